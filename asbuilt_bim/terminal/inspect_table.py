"""What the program understands of an IFC file, as tables."""

import math
from collections import Counter
from collections.abc import Callable

from rich.table import Table
from rich.text import Text

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.ifc.read.facts import FileFacts
from asbuilt_bim.ifc.read.georeference import Georeference
from asbuilt_bim.report.wording.notes import note_words

MAX_ROWS = 40
_YES_NO = {True: "yes", False: "no", None: "not said"}
_GEOMETRY: dict[str, tuple[str, Callable[[BimElement], float]]] = {
    "Length": ("m", lambda e: e.length_m if e.kind == "wall" else e.height_m),
    "Width": ("m", lambda e: e.thickness_m),
    "Height": ("m", lambda e: e.height_m),
    "NetSideArea": ("m²", lambda e: sum(f.area_m2 for f in e.faces if f.role == "side") / 2.0),
    "OuterSurfaceArea": ("m²", lambda e: sum(f.area_m2 for f in e.faces)),
    "NetVolume": ("m³", lambda e: e.volume_m3),
}
"""The file's own quantities that the geometry has a counterpart of."""


def fact_tables(name: str, facts: FileFacts) -> list[Table]:
    """Return the tables of what a file holds, usable or not."""
    table = _table(f"{name} ({facts.schema})", "", "")
    _row(table, "written by", facts.exporter or "not said")
    _row(table, "units", f"{', '.join(facts.units)}; money: {facts.currency or 'not said'}")
    _row(table, "place on the map", _place(facts.georeference))
    zones = [f"{zone} ({count} spaces)" for zone, count in facts.zones[:8]]
    more = f" and {len(facts.zones) - 8} more" if len(facts.zones) > 8 else ""
    _row(table, "zones", (", ".join(zones) + more) or "none")
    _row(
        table,
        "tasks",
        f"{facts.tasks_assigned} of {facts.tasks} with walls or columns" if facts.tasks else "none",
    )
    costs = f"{facts.cost_items} items in {facts.cost_schedules} schedules" if facts.cost_items else "none"
    if not facts.cost_has_values:
        costs += "; IFC2X3 holds neither quantities nor rates: no cost line is read, and nothing is priced"
    _row(table, "costs", costs)
    kinds = _table("Walls and columns in the file", "Class", "Type", "Material", "Concrete", "Lies in", "Number")
    for kind, count in facts.kinds[:MAX_ROWS]:
        answer = _YES_NO[kind.concrete]
        _row(kinds, kind.ifc_class, kind.type_name, kind.materials, answer, kind.placed_in, str(count))
    _more(kinds, len(facts.kinds))
    return [table, kinds]


def design_tables(design: BimModel) -> list[Table]:
    """Return the tables: storeys with their elements, own quantities, the schedule and costs, what can't be used."""
    tables = [_storeys(design), _quantities(design), _money(design), _notes(design)]
    return [table for table in tables if table.row_count]


def _place(place: Georeference | None) -> str:
    if place is None:
        return "no map conversion: the survey is in the file's own coordinates"
    turn = math.degrees(place.turn_rad)
    return (
        f"{place.crs}: E {place.eastings_m:.3f} m, N {place.northings_m:.3f} m, height {place.height_m:.3f} m, "
        f"turned {turn:.4f}°, scale {place.scale:.7g}; the survey stays in the file's own coordinates"
    )


def _storeys(design: BimModel) -> Table:
    table = _table(f"What is used of {design.file_name}: {design.project_name}", "Storey")
    for name in ("Elevation", "Walls", "Columns", "Concrete", "Faces", "round", "Exposed area", "Volume"):
        table.add_column(name, justify="right")
    names = {storey.global_id: (storey.name, f"{storey.elevation_m:.2f} m") for storey in design.storeys}
    keys = [*names, *({e.storey for e in design.elements} - names.keys())]
    for key in keys:
        name, elevation = names.get(key, ("(no storey)", ""))
        _row(table, name, elevation, *_counts([e for e in design.elements if e.storey == key]))
    table.add_section()
    table.add_row(*map(Text, ["whole", "", *_counts(list(design.elements))]), style="bold")
    return table


def _counts(elements: list[BimElement]) -> list[str]:
    kinds = Counter(element.kind for element in elements)
    answer = Counter(element.is_concrete for element in elements)
    concrete = f"{answer[True]} yes" + (f", {answer[False]} no" if answer[False] else "")
    concrete += f", {answer[None]} not said" if answer[None] else ""
    faces = [face for element in elements for face in element.faces]
    round_faces = sum(1 for face in faces if hasattr(face.frame, "radius_m"))
    return [
        str(kinds["wall"]),
        str(kinds["column"]),
        concrete,
        str(len(faces)),
        str(round_faces),
        f"{sum(element.exposed_area_m2 for element in elements):.1f} m²",
        f"{sum(element.volume_m3 for element in elements):.2f} m³",
    ]


def _quantities(design: BimModel) -> Table:
    """Return the file's own quantities, added up, beside what the geometry gives for the same elements."""
    table = _table("The file's own quantities beside its geometry (which is what counts)", "Quantity")
    for name in ("Elements", "File", "Geometry", "Apart by over 2 %"):
        table.add_column(name, justify="right")
    for name, (unit, of_geometry) in _GEOMETRY.items():
        pairs = [(e.qto[name], of_geometry(e)) for e in design.elements if name in e.qto]
        if pairs:
            apart = sum(abs(own - measured) > 0.02 * max(abs(measured), 1e-9) for own, measured in pairs)
            own, measured = (sum(column) for column in zip(*pairs, strict=True))
            _row(table, name, str(len(pairs)), f"{own:.2f} {unit}", f"{measured:.2f} {unit}", str(apart))
    return table


def _money(design: BimModel) -> Table:
    table = _table("Schedule and costs", "Line")
    table.add_column("Elements", justify="right")
    table.add_column("Planned", justify="right")
    for task in design.tasks[:MAX_ROWS]:
        days = [d.date().isoformat() if d else "?" for d in (task.schedule_start, task.schedule_finish)]
        _row(table, f"task {task.name}", str(len(task.elements)), f"{days[0]} to {days[1]}")
    _more(table, len(design.tasks))
    for line in design.cost_lines[:MAX_ROWS]:
        rate = f"{line.planned_quantity:.2f} {line.unit} x {line.rate:.2f} {line.currency}"
        _row(table, f"cost {line.name}", str(len(line.elements)), rate.strip())
    _more(table, len(design.cost_lines))
    if not design.tasks and not design.cost_lines:
        table.add_row("none in the file", "", "")
    return table


def _notes(design: BimModel) -> Table:
    table = _table("What can't be used", "")
    table.show_header = False
    for note in design.notes[:MAX_ROWS]:
        _row(table, note_words(note))
    _more(table, len(design.notes))
    return table


def _table(title: str, *columns: str) -> Table:
    table = Table(title=Text(_shown(title)), title_justify="left", show_header=any(columns))
    for column in columns:
        table.add_column(column, justify="right" if column == "Number" else "left")
    return table


def _row(table: Table, *cells: str) -> None:
    table.add_row(*(Text(_shown(cell)) for cell in cells))


def _more(table: Table, count: int) -> None:
    if count > MAX_ROWS:
        table.add_row(f"... and {count - MAX_ROWS} more", *[""] * (len(table.columns) - 1))


def _shown(text: str) -> str:
    """Return a text from the file without what would steer the terminal."""
    return "".join(c if c.isprintable() else " " for c in text)
