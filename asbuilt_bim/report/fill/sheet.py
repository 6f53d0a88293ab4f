"""One sheet of a workbook: its cells with their values and places, what is merged, and cells exchanged in it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from asbuilt_bim.report.fill.references import Area, area_of, cell_name, cell_of
from asbuilt_bim.report.fill.xml_places import Edit, Place, attributes_text, edited, xml_text

Value = str | float | int | None
_ROW, _CELL = "worksheet/sheetData/row", "worksheet/sheetData/row/c"


@dataclass(slots=True, kw_only=True)
class Cell:
    """A cell as it stands: its tags, its formula and its value as they are written."""

    place: Place
    formula: Place | None = None
    value: Place | None = None  # <v>
    inline: str | None = None  # text that stands in the cell itself


@dataclass(slots=True, kw_only=True)
class Sheet:
    """A worksheet's cells by row and column, and what can't be filled in it."""

    name: str
    part: str
    data: bytes
    cells: dict[tuple[int, int], Cell] = field(default_factory=dict)
    rows: dict[int, Place] = field(default_factory=dict)
    merged: dict[int, list[Area]] = field(default_factory=lambda: defaultdict(list))  # by each row that they touch
    arrays: list[Area] = field(default_factory=list)  # of array formulas and data tables: one formula, many cells
    column_styles: list[tuple[int, int, str]] = field(default_factory=list)
    protected: bool = False

    def written(self, row: int, column: int) -> Area | None:
        """Return the merged area that hides a cell: one whose first cell is another; None where there is none."""
        found = next((area for area in self.merged.get(row, ()) if area.holds(row, column)), None)
        return None if found is None or (found.top, found.left) == (row, column) else found


def read_sheet(name: str, part: str, data: bytes, found: Sequence[Place]) -> Sheet:
    """Return a sheet from the elements of its part.

    Raises:
        ValueError: a place in it is called as no cell can be.
    """
    sheet = Sheet(name=name, part=part, data=data)
    row = column = 0
    for one in found:
        if one.path == _ROW:
            row, column = int(one.attributes.get("r", row + 1)), 0
            sheet.rows[row] = one
        elif one.path == _CELL:
            place = one.attributes.get("r")
            row, column = cell_of(place) if place else (row, column + 1)
            cell = sheet.cells[row, column] = Cell(place=one)
        elif one.path.startswith(_CELL):
            _into_cell(cell, one, sheet)
        elif one.path == "worksheet/cols/col" and "style" in one.attributes:
            first, last = int(one.attributes["min"]), int(one.attributes["max"])
            sheet.column_styles.append((first, last, one.attributes["style"]))
        elif one.path == "worksheet/mergeCells/mergeCell":
            _merge(sheet, area_of(one.attributes.get("ref", "")))
        elif one.path == "worksheet/sheetProtection":
            sheet.protected = one.attributes.get("sheet") in ("1", "true")
    return sheet


def _merge(sheet: Sheet, area: Area) -> None:
    tall = area.bottom - area.top >= len(sheet.rows)  # rows come before what is merged
    for row in sheet.rows if tall else range(area.top, area.bottom + 1):
        if area.top <= row <= area.bottom:
            sheet.merged[row].append(area)


def _into_cell(cell: Cell, one: Place, sheet: Sheet) -> None:
    inside = one.path.removeprefix(_CELL)
    if inside == "/f":
        cell.formula = one
        if one.attributes.get("t") in ("array", "dataTable") and "ref" in one.attributes:
            sheet.arrays.append(area_of(one.attributes["ref"]))
    elif inside == "/v":
        cell.value = one
    elif inside in ("/is/t", "/is/r/t"):
        cell.inline = (cell.inline or "") + one.text


def cell_value(cell: Cell | None, shared: Sequence[str]) -> Value:
    """Return what a cell shows: text or a number; None where it is empty, or shows an error.

    Raises:
        ValueError: it is damaged.
    """
    if cell is None:
        return None
    kind = cell.place.attributes.get("t", "n")
    if kind == "inlineStr":
        return cell.inline
    text = cell.value.text if cell.value is not None else ""
    if kind == "s" and text.strip():
        number = int(text)
        if not 0 <= number < len(shared):
            raise ValueError(f"text number {number} isn't among the workbook's texts")
        return shared[number]
    if kind in ("str", "d"):
        return text
    if kind == "e" or not text.strip():
        return None
    return ("FALSE", "TRUE")[int(text)] if kind == "b" else float(text)


def without_value(cell: Cell) -> bool:
    """Say whether a cell holds a formula that no program has calculated yet; a text that came out empty is a value."""
    written = cell.value is not None and (cell.value.text.strip() or cell.place.attributes.get("t") == "str")
    return cell.formula is not None and not written


def with_values(sheet: Sheet, values: Mapping[tuple[int, int], Value], stale: Sequence[Cell]) -> bytes:
    """Return a sheet's part with values in some of its cells, and without the values of formulas that are stale."""
    edits = [edit for cell in stale for edit in _without_value(cell, sheet.data)]
    missing: dict[int, dict[int, Value]] = {}
    for (row, column), value in values.items():
        cell = sheet.cells.get((row, column))
        if cell is None:
            missing.setdefault(row, {})[column] = value
        else:
            edits.append(Edit(cell.place.start, cell.place.end, _cell_xml(cell.place, row, column, value)))
    for row, new in missing.items():
        edits += _new_cells(sheet, row, new)
    return edited(sheet.data, edits)


def _cell_xml(place: Place, row: int, column: int, value: Value) -> bytes:
    """Return a cell as it is to be: its own name and style, the new value, and nothing else of what it held."""
    kept = {key: text for key, text in place.attributes.items() if key in ("r", "s", "ph")}
    return _xml(place.prefix, kept, value)


def _xml(prefix: str, attributes: Mapping[str, str], value: Value) -> bytes:
    head = attributes_text(attributes)
    if value is None:
        return f"<{prefix}c{head}/>".encode()
    if isinstance(value, str):
        text = f'<{prefix}is><{prefix}t xml:space="preserve">{xml_text(value)}</{prefix}t></{prefix}is>'
        return f'<{prefix}c{head} t="inlineStr">{text}</{prefix}c>'.encode()
    return f"<{prefix}c{head}><{prefix}v>{value!r}</{prefix}v></{prefix}c>".encode()


def _new_cells(sheet: Sheet, row: int, new: Mapping[int, Value]) -> list[Edit]:
    """Return the edits that put cells into a row which has none there, in the order of the columns."""
    place = sheet.rows[row]
    there = sorted(column for at, column in sheet.cells if at == row)
    inserted: dict[int, bytes] = {}
    for column in sorted(new):
        after = next((other for other in there if other > column), None)
        at = sheet.cells[row, after].place.start if after else place.close
        style = _style(sheet, place, column)
        attributes = {"r": cell_name(row, column)} | ({"s": style} if style else {})
        inserted[at] = inserted.get(at, b"") + _xml(place.prefix, attributes, new[column])
    if not place.empty:
        return [Edit(at, at, data) for at, data in inserted.items()]
    tag = sheet.data[place.start : place.inside].rstrip()[:-2].rstrip()
    whole = tag + b">" + b"".join(inserted.values()) + f"</{place.prefix}row>".encode()
    return [Edit(place.start, place.end, whole)]


def _style(sheet: Sheet, row: Place, column: int) -> str:
    """Return the style that an empty cell shows: its row's, else its column's."""
    if row.attributes.get("customFormat") in ("1", "true"):
        return row.attributes.get("s", "")
    return next((style for first, last, style in sheet.column_styles if first <= column <= last), "")


def _without_value(cell: Cell, data: bytes) -> list[Edit]:
    """Return the edits that take a formula's last value away, with the kind that it had."""
    edits = [Edit(cell.value.start, cell.value.end, b"")] if cell.value is not None else []
    if edits and cell.place.attributes.get("t"):
        tag = data[cell.place.start : cell.place.inside]
        for quote in (b'"', b"'"):
            kind = b" t=" + quote + cell.place.attributes["t"].encode() + quote
            if (found := tag.find(kind)) >= 0:
                at = cell.place.start + found
                edits.append(Edit(at, at + len(kind), b""))
    return edits
