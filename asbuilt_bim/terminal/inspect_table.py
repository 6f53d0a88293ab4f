"""What the program understands of an IFC file, as tables."""

from __future__ import annotations

from collections import Counter

from rich.table import Table
from rich.text import Text

from asbuilt_bim.bim.model import BimElement, BimModel

MAX_NOTES = 40


def design_tables(design: BimModel) -> list[Table]:
    """Return the tables: storeys with their elements, the schedule and costs, what can't be used."""
    tables = [_storeys(design), _money(design)]
    return [*tables, _notes(design)] if design.notes else tables


def _storeys(design: BimModel) -> Table:
    table = Table(title=f"{design.file_name} ({design.schema}): {design.project_name}", title_justify="left")
    table.add_column("Storey")
    for name in ("Elevation", "Walls", "Columns", "Concrete", "Faces", "round", "Exposed area", "Volume"):
        table.add_column(name, justify="right")
    names = {storey.global_id: (storey.name, f"{storey.elevation_m:.2f} m") for storey in design.storeys}
    keys = [*names, *({e.storey for e in design.elements} - names.keys())]
    for key in keys:
        name, elevation = names.get(key, ("(no storey)", ""))
        table.add_row(*map(Text, [name, elevation, *_counts([e for e in design.elements if e.storey == key])]))
    table.add_section()
    table.add_row(*map(Text, ["whole", "", *_counts(list(design.elements))]), style="bold")
    return table


def _counts(elements: list[BimElement]) -> list[str]:
    kinds = Counter(element.kind for element in elements)
    said = Counter(element.is_concrete for element in elements)
    concrete = f"{said[True]} yes" + (f", {said[False]} no" if said[False] else "")
    concrete += f", {said[None]} not said" if said[None] else ""
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


def _money(design: BimModel) -> Table:
    table = Table(title="Schedule and costs", title_justify="left")
    table.add_column("Line")
    table.add_column("Elements", justify="right")
    table.add_column("Planned", justify="right")
    for task in design.tasks:
        days = [d.date().isoformat() if d else "?" for d in (task.schedule_start, task.schedule_finish)]
        table.add_row(Text(f"task {task.name}"), str(len(task.elements)), f"{days[0]} to {days[1]}")
    for line in design.cost_lines:
        rate = f"{line.planned_quantity:.2f} {line.unit} x {line.rate:.2f} {line.currency}"
        table.add_row(Text(f"cost {line.name}"), str(len(line.elements)), Text(rate.strip()))
    if not design.tasks and not design.cost_lines:
        table.add_row("none in the file", "", "")
    return table


def _notes(design: BimModel) -> Table:
    table = Table(title="What can't be used", title_justify="left", show_header=False)
    table.add_column()
    for note in design.notes[:MAX_NOTES]:
        table.add_row(Text(note))
    if len(design.notes) > MAX_NOTES:
        table.add_row(f"... and {len(design.notes) - MAX_NOTES} more")
    return table
