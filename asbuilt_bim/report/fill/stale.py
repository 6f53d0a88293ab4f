"""Which formulas depend on cells that are filled: their last values are no longer true, and are taken away.

Whatever a formula names that isn't a plain reference (a name, a table's column, INDIRECT, OFFSET) counts as dependent:
a value too many is calculated again, and none that is wrong stays.
"""

import re
from bisect import bisect_left, insort
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from asbuilt_bim.report.fill.references import MAX_COLUMN, MAX_ROW, Area, area_of, column_number
from asbuilt_bim.report.fill.sheet import Cell, Sheet

MAX_ROUNDS = 60
"""Formulas that depend on each other from below upwards need a round each; after so many all count as dependent."""
_QUOTED = re.compile(r"""'(?:[^']|'')*'|"(?:[^"]|"")*\"""")
_SHEET = r"(?:'((?:[^']|'')*)'!|([^\W\d][\w.]*(?::[^\W\d][\w.]*)?)!)?"
_REFERENCE = re.compile(
    _SHEET + r"(?<![\w.])(?:(\$?[A-Z]{1,3})(\$?[0-9]{1,7})(?::(\$?[A-Z]{1,3})(\$?[0-9]{1,7}))?"
    r"|(\$?[A-Z]{1,3}):(\$?[A-Z]{1,3})|(\$?[0-9]{1,7}):(\$?[0-9]{1,7}))(?![\w.(!])",
    re.IGNORECASE,
)
_FUNCTION = re.compile(r"[^\W\d][\w.]*\(")
_ANYWHERE = re.compile(r"\b(?:INDIRECT|OFFSET|CELL|SUMIF|AVERAGEIF)\(", re.IGNORECASE)
"""Functions that read cells which they don't name; the last two stretch what they sum up."""
_CONSTANT = re.compile(r"\b(?:TRUE|FALSE)\b|#[A-Z0-9/!?]+|\b[0-9.]+(?:E[+-]?[0-9]+)?\b", re.IGNORECASE)
_NAME = re.compile(r"[^\W\d]|\[", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Formula:
    """A formula: the cells that hold its values, and what it reads; None: nobody knows."""

    sheet: str
    cells: Area
    reads: tuple[tuple[str, Area], ...] | None


def stale_cells(sheets: Mapping[str, Sheet], filled: Mapping[str, Iterable[tuple[int, int]]]) -> dict[str, list[Cell]]:
    """Return by sheet the cells whose values depend on the filled ones, by way of any number of formulas."""
    formulas = [one for sheet in sheets.values() for one in _formulas(sheet)]
    known: dict[str, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
    for name, places in filled.items():
        for row, column in places:
            insort(known[name.casefold()][column], row)
    waiting, stale = formulas, list[Formula]()
    for number in range(MAX_ROUNDS + 1):
        rest = []
        for one in waiting:
            if number < MAX_ROUNDS and not _depends(one, known):
                rest.append(one)
                continue
            stale.append(one)
            for row, column in _places(one, sheets):
                insort(known[one.sheet.casefold()][column], row)
        if len(rest) == len(waiting):
            break
        waiting = rest
    return _cells(sheets, stale)


def _cells(sheets: Mapping[str, Sheet], stale: Sequence[Formula]) -> dict[str, list[Cell]]:
    found: dict[str, dict[tuple[int, int], Cell]] = defaultdict(dict)
    for one in stale:
        cells = sheets[one.sheet].cells
        found[one.sheet] |= {at: cells[at] for at in _places(one, sheets) if cells[at].value is not None}
    return {name: list(of_sheet.values()) for name, of_sheet in found.items()}


def _places(one: Formula, sheets: Mapping[str, Sheet]) -> Iterable[tuple[int, int]]:
    """Return the cells that a formula fills, as far as they are there."""
    area, cells = one.cells, sheets[one.sheet].cells
    if area.top == area.bottom and area.left == area.right:
        return ((area.top, area.left),)
    return tuple(at for at in cells if area.holds(*at))


def _depends(one: Formula, known: Mapping[str, Mapping[int, list[int]]]) -> bool:
    if one.reads is None:
        return True
    for name, area in one.reads:
        for column, rows in known.get(name.casefold(), {}).items():
            if area.left <= column <= area.right:
                at = bisect_left(rows, area.top)
                if at < len(rows) and rows[at] <= area.bottom:
                    return True
    return False


def _formulas(sheet: Sheet) -> Iterable[Formula]:
    """Yield a sheet's formulas; a shared one stands in one cell as text, and in the others by its number."""
    masters: dict[str, tuple[int, int, str]] = {}
    for (row, column), cell in sheet.cells.items():
        if cell.formula is None:
            continue
        kind, text = cell.formula.attributes.get("t", "normal"), cell.formula.text
        shift = (0, 0)
        if kind == "shared":
            key = cell.formula.attributes.get("si", "")
            if text:
                masters[key] = (row, column, text)
            elif key in masters:
                top, left, text = masters[key]
                shift = (row - top, column - left)
        cells = Area(row, column, row, column)
        if kind in ("array", "dataTable") and "ref" in cell.formula.attributes:
            cells = area_of(cell.formula.attributes["ref"])
        reads = reads_of(text, sheet.name, shift) if text and kind != "dataTable" else None
        yield Formula(sheet=sheet.name, cells=cells, reads=reads)


def reads_of(formula: str, sheet: str, shift: tuple[int, int] = (0, 0)) -> tuple[tuple[str, Area], ...] | None:
    """Return the areas that a formula names, moved as a shared formula's are; None where it isn't sure which."""
    text = _QUOTED.sub(lambda found: found[0] if found[0].startswith("'") else "0", formula)
    if _ANYWHERE.search(text):
        return None
    areas: list[tuple[str, Area]] = []
    for match in _REFERENCE.finditer(text):
        name = (match[1] or "").replace("''", "'") or match[2] or sheet
        if "[" in name:  # of another workbook
            continue
        if ":" in name:  # of several sheets at once
            return None
        try:
            areas.append((name, _area(match, shift)))
        except ValueError:
            return None
    rest = _CONSTANT.sub("0", _FUNCTION.sub("(", _REFERENCE.sub("0", text)))
    return None if _NAME.search(rest) or ":" in rest else tuple(areas)  # what is left over is a name, or a range of two


def _area(match: re.Match[str], shift: tuple[int, int]) -> Area:
    if match[7]:
        left, right = _column(match[7], shift[1]), _column(match[8], shift[1])
        return Area(1, min(left, right), MAX_ROW, max(left, right))
    if match[9]:
        top, bottom = _row(match[9], shift[0]), _row(match[10], shift[0])
        return Area(min(top, bottom), 1, max(top, bottom), MAX_COLUMN)
    left, top = _column(match[3], shift[1]), _row(match[4], shift[0])
    right, bottom = (_column(match[5], shift[1]), _row(match[6], shift[0])) if match[5] else (left, top)
    return Area(min(top, bottom), min(left, right), max(top, bottom), max(left, right))


def _column(text: str, shift: int) -> int:
    return column_number(text.lstrip("$")) + (0 if text.startswith("$") else shift)


def _row(text: str, shift: int) -> int:
    return int(text.lstrip("$")) + (0 if text.startswith("$") else shift)
