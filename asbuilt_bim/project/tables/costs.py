"""The costs table: a line each, with what it pays for; becomes the design's cost lines."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from difflib import get_close_matches
from pathlib import Path

from asbuilt_bim.bim.cost_notes import cost_notes
from asbuilt_bim.bim.cost_units import currency_there, meant_unit, measure_of, sign_of
from asbuilt_bim.bim.covers import Cover, Covered, CoveredRows
from asbuilt_bim.bim.model import COSTS_KEY, BimModel, CostLine
from asbuilt_bim.codes import Note, Reason, SubjectKind, Value, about, noted
from asbuilt_bim.errors import CostError
from asbuilt_bim.project.tables.rates import currencies_in, parted_rate
from asbuilt_bim.storage.table_file import TableFile, TableRow, number_in, read_table, refused_rows, words_in

COLUMNS = {
    "item": ("id", "identification", "no", "number", "pos", "position", "oz", "itemno", "code"),
    "text": ("name", "description", "shorttext", "kurztext", "title", "bezeichnung", "beschreibung"),
    "unit": ("einheit", "uom", "me"),
    "quantity": ("qty", "menge", "plannedquantity", "contractquantity"),
    "rate": ("price", "unitprice", "unitrate", "ep", "einheitspreis"),
    "currency": ("waehrung", "währung"),
    "globalids": ("globalid", "elements", "ifcglobalid", "ifcglobalids"),
    "selector": ("query",),
    "class": ("ifcclass",),
    "storey": ("level", "geschoss", "floor"),
    "type": ("typename", "ifctype"),
}
"""What a column may be called."""
NEEDED = ("item", "unit", "quantity", "rate")
MAX_LINES = 50_000
_MOST_NAMED = 8
MAX_NUMBER = 1e12
MAX_TEXT, MAX_SELECTOR = 500, 2_000
_ID = re.compile(r"[^\s,;|]+")
_MONTH = "(jan|feb|mär|mrz|mar|apr|mai|may|jun|jul|aug|sep|okt|oct|nov|dez|dec)"
_MADE_A_DAY = re.compile(rf"\d{{1,2}}[. -]+{_MONTH}|{_MONTH}[. -]+\d{{2}}", re.IGNORECASE)
"""What spreadsheets show where somebody typed the item 1.1 or 1.26: `01. Jan`, `Jan 26`; `DEC-01` is somebody's own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CostsTable:
    """A costs table as it was read: its lines without their elements, and what each is said to cover."""

    name: str
    lines: tuple[CostLine, ...]
    covers: tuple[Cover, ...]
    formulas: bool


def read_costs(path: Path) -> CostsTable:
    """Read a costs table, CSV or `.xlsx`.

    Raises:
        CostError: it can't be read; or a row has no item, an item stands twice, or a number could be meant two ways.
            Every such row is named, up to eight.
    """
    table = read_table(path, COLUMNS, NEEDED, CostError, parted_rate)
    if len(table.rows) > MAX_LINES:
        raise CostError(f"{path}: holds {len(table.rows):,} lines, limit {MAX_LINES:,}; is it the right file?")
    faults: list[str] = []
    lines: list[CostLine] = []
    covers: list[Cover] = []
    seen: dict[str, int] = {}
    more: list[tuple[TableRow, Cover]] = []
    currencies = currencies_in(table.rows, faults)
    for row in table.rows:
        if not row.text("quantity") and not row.text("rate") and not row.text("unit"):
            more.append((row, _cover(row, faults)))
            continue
        line = _line(row, table, currencies[row.number], faults)
        first = seen.setdefault(line.identification, row.number)
        if first != row.number:
            faults.append(f"row {row.number}: the item {line.identification!r} stands in row {first}, too")
        lines.append(line)
        covers.append(_cover(row, faults))
    covers = _with_more(covers, lines, more, faults)
    refused_rows(path, faults, CostError)
    if not lines:
        raise CostError(f"{path}: holds no line with a unit, a quantity and a rate; fill them in")
    return CostsTable(name=path.name, lines=tuple(lines), covers=tuple(covers), formulas=table.formulas)


def _with_more(
    covers: Sequence[Cover], lines: Sequence[CostLine], more: Sequence[tuple[TableRow, Cover]], faults: list[str]
) -> list[Cover]:
    """Return the covers with what rows without a price add to the line of their item.

    A row without an item, or without anything that it covers, is a heading, or nobody filled it in.
    """
    place = {line.identification: index for index, line in enumerate(lines)}
    found = list(covers)
    for row, cover in more:
        item = row.text("item").strip()
        if not item or cover.empty:
            continue
        if item not in place:
            faults.append(f"row {row.number}: the item {item!r} has no unit, quantity and rate in any row")
        elif cover.selector or cover.by_rule:
            faults.append(
                f"row {row.number}: a row without a price adds GlobalIds to its item, no selector and no class"
            )
        else:
            ids = (*found[place[item]].global_ids, *cover.global_ids)
            found[place[item]] = replace(found[place[item]], global_ids=tuple(dict.fromkeys(ids)))
    return found


def _line(row: TableRow, table: TableFile, currency: str, faults: list[str]) -> CostLine:
    item, unit = row.text("item").strip()[:MAX_TEXT], row.text("unit").strip()[:20]
    numbers = {}
    for column in ("quantity", "rate"):
        try:
            value = number_in(row, column, table)
            if value is None:
                raise ValueError("is empty; write a number, 0 where there is none")
            if not abs(value) <= MAX_NUMBER:
                raise ValueError(f"{value:.3g} is beyond {MAX_NUMBER:.0e}, which nothing on a site is")
            numbers[column] = value
        except ValueError as problem:
            faults.append(f"row {row.number}, {column}: {problem}")
    for column in ("currency", "globalids", "class"):
        try:
            words_in(row, column)
        except ValueError as problem:
            faults.append(f"row {row.number}, {column}: {problem}")
    if not item:
        faults.append(f"row {row.number}: has no item; give each line its own")
    if isinstance(row.cells.get("item"), date) or (_MADE_A_DAY.fullmatch(item) and not item.isupper()):
        advice = "a spreadsheet makes one of 1.1. Make the column text, and type the items again"
        faults.append(f"row {row.number}: the item '{item}' is a day; {advice}")
    measure, scale = measure_of(unit)
    return CostLine(
        global_id=f"{COSTS_KEY}{item}",
        name=row.text("text").strip()[:MAX_TEXT],
        identification=item,
        elements=(),
        unit=sign_of(unit),
        measure=measure,
        planned_quantity=numbers.get("quantity", 0.0),
        rate=numbers.get("rate", 0.0),
        currency=currency[:10],
        unit_scale=scale,
    )


def _cover(row: TableRow, faults: list[str]) -> Cover:
    selector = row.text("selector").strip()
    if len(selector) > MAX_SELECTOR:
        faults.append(f"row {row.number}: its selector has {len(selector):,} letters, limit {MAX_SELECTOR:,}")
    return Cover(
        global_ids=tuple(dict.fromkeys(_ID.findall(row.text("globalids")))),
        selector=selector[:MAX_SELECTOR],
        ifc_class=row.text("class").strip(),
        storey=row.text("storey").strip(),
        type_name=row.text("type").strip(),
    )


def with_costs(design: BimModel, table: CostsTable, covered: CoveredRows) -> BimModel:
    """Return a design with the table's lines in the place of the IFC's cost items, and notes on what can't be used.

    Raises:
        CostError: a selector can't be read; names its row.
    """
    where = about(SubjectKind.FILE, table.name)
    faults = [
        f"item {line.identification}: its selector can't be read ({found.fault}); write it like "
        '`IfcWall, location="Level 1"`'
        for line, found in zip(table.lines, covered.rows, strict=True)
        if found.fault
    ]
    refused_rows(Path(table.name), faults, CostError)
    lines: list[CostLine] = []
    notes: list[Note] = []
    for line, cover, found in zip(table.lines, table.covers, covered.rows, strict=True):
        made = replace(
            line,
            elements=found.elements,
            others=found.others,
            currency=currency_there(line.currency, covered.currency),
            schedule=table.name,
        )
        lines.append(made)
        notes += _cover_notes(made, cover, found, design)
    notes += cost_notes(lines)
    if without := len({e.global_id for e in design.elements}.difference(*(line.elements for line in lines))):
        values = {"count": without, "of": len(design.elements)}
        notes.append(noted(Reason.NOT_IN_COST_LINES, about(SubjectKind.DESIGN), **values))
    if table.formulas:
        notes.append(noted(Reason.COSTS_FORMULAS, where))
    if design.cost_lines:
        notes.append(noted(Reason.COSTS_INSTEAD, where, count=len(design.cost_lines)))
    kept = [note for note in design.notes if note.code not in _OF_IFC_COSTS and not _of_cost(note)]
    return replace(design, cost_lines=tuple(lines), notes=(*kept, *notes))


_OF_IFC_COSTS = frozenset(
    {Reason.NOT_IN_COST_LINES, Reason.COST_OF_OTHER_WORK, Reason.COST_SCHEDULES_SEVERAL, Reason.COST_NOT_IN_IFC2X3}
)
"""Notes on the IFC's own cost items, which don't count where there is a table."""


def _of_cost(note: Note) -> bool:
    return note.subject.kind is SubjectKind.COST_LINE


def _cover_notes(line: CostLine, cover: Cover, found: Covered, design: BimModel) -> list[Note]:
    subject, item = about(SubjectKind.COST_LINE, line.global_id), _label(line)
    notes: list[Note] = []
    if found.unknown:
        unknown: Sequence[str] = found.unknown[:5]
        notes.append(
            noted(Reason.COST_COVER_UNKNOWN, subject, item=item, elements=tuple(unknown), count=len(found.unknown))
        )
    if not found.elements and not found.others:
        wrong = _unfit(cover, design) if cover.by_rule and not (cover.global_ids or cover.selector) else {}
        notes.append(noted(Reason.COST_COVERS_NOTHING, subject, item=item, said=not cover.empty, **wrong))
    elif line.measure == "other":
        meant = meant_unit(line.unit)
        notes.append(
            noted(Reason.COST_UNIT_UNKNOWN, subject, item=item, unit=line.unit, others=line.others, meant=meant)
        )
    return notes


def _unfit(cover: Cover, design: BimModel) -> dict[str, Value]:
    """Return which cell of a rule names what the design has nothing of, and what there is, as values of a note."""
    classes = {element.ifc_class for element in design.elements} | {"IfcWall", "IfcColumn"}
    there = (
        ("storey", cover.storey, [storey.name for storey in design.storeys]),
        ("class", cover.ifc_class, sorted(classes)),
        ("type", cover.type_name, sorted({element.type_name for element in design.elements} - {""})),
    )
    for column, written, names in there:
        bare = {" ".join(name.split()).casefold(): name for name in names}
        wanted = " ".join(written.split()).casefold()
        if written and wanted not in bare:
            alike = get_close_matches(wanted, bare, n=1)
            meant = bare[alike[0]] if alike else ""
            known: tuple[str, ...] = tuple(names[:_MOST_NAMED])
            return {"column": column, "written": written, "meant": meant, "known": known, "count": len(names)}
    return {}


def _label(line: CostLine) -> str:
    return f"{line.identification} {line.name}".strip()
