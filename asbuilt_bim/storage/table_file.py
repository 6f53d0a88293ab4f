"""A table that somebody typed, as CSV or `.xlsx`: rows by column, numbers and days that can be meant one way only."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.storage.regular_file import read_bytes
from asbuilt_bim.storage.xlsx_file import XlsxCell, read_xlsx

MAX_BYTES = 60_000_000
MAX_NAMED = 8
Columns = Mapping[str, Sequence[str]]
"""What a column is known by here -> what it may be called; capitals, spaces, dashes and underscores don't count."""
Cells = Mapping[str, str | float | date]
"""A row's cells by column; "" where there is none."""
_Line = tuple[int, Sequence[str | float | date]]
_DAY = re.compile(r"(\d{4})-(\d{1,2})-(\d{1,2})")
_DOTTED_DAY = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")
_PLAIN = re.compile(r"[+-]?\d+(\.\d+)?([eE][+-]?\d{1,3})?")
_COMMA = re.compile(r"[+-]?(\d+|\d{1,3}([.\u00a0\u202f'’ ]\d{3})+),\d+")
_POINT_GROUPS = re.compile(r"[+-]?\d{1,3}([,\u00a0\u202f'’ ]\d{3})+\.\d+")
_BRACKETS = re.compile(r"[\[(].*?[\])]")
_UNITS = {
    "m": ("metres", "[mcdk]m|(milli|centi|kilo)met(er|re)[sn]?|ft|foot|feet|inch(es)?|yd|yards?|zoll|fu(ss|ß)|px"),
    "deg": ("degrees", "m?gon|gra?d?|grads|gradians?|neugrad|m?rad|radians?|mils?|hours?|dms"),
    "px": ("pixels", "[mcd]?m|met(er|re)s?|%"),
}
"""What a column is read in, by what its name ends in, and what says of another unit in a heading's brackets."""
_GROUP = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}((\.\d{3}){2,}|(,\d{3}){2,})")


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """One row: its number in the file, and its cells."""

    number: int
    cells: Cells

    def text(self, column: str) -> str:
        """Return a cell as text; a whole number without its `.0`."""
        cell = self.cells.get(column, "")
        if isinstance(cell, float):
            return f"{cell:.0f}" if cell == math.floor(cell) and abs(cell) < 1e15 else f"{cell:.15g}"
        return cell.isoformat() if isinstance(cell, date) else cell


@dataclass(frozen=True, slots=True, kw_only=True)
class TableFile:
    """A table that was read; `formulas` says whether some of its values are those that formulas last had."""

    name: str
    rows: tuple[TableRow, ...]
    formulas: bool
    commas: bool  # its numbers are written with a decimal comma
    points: frozenset[str] = frozenset()  # columns in which a point parts no thousands


def read_table(
    path: Path,
    columns: Columns,
    needed: Iterable[str],
    refusal: type[AsBuiltError],
    parted: Callable[[Cells], Cells] = lambda cells: cells,
) -> TableFile:
    """Read a table by its ending; blank rows are left out, and columns that nobody asked for.

    `parted` takes from a row's cells what stands beside their numbers, before their decimal signs are looked at. Where
    it finds anything somebody typed the column, and commas between cells don't say that its points are decimal ones.

    Raises:
        AsBuiltError: of the sort `refusal`: no such table, too large, or a needed column is missing or there twice.
    """
    between, formulas = "", False
    lines: list[_Line]
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        book = read_xlsx(path, refusal)
        sheet = next(iter(book.sheets.values()), None)
        lines = [(number, [*map(_plain, row)]) for number, row in enumerate(sheet.rows if sheet else (), 1)]
        formulas = sheet is not None and sheet.formulas
    else:
        read = csv_table(read_bytes(path, MAX_BYTES, refusal), str(path), refusal)
        lines, between = [(1, read.header), *read.rows], read.sign
    filled = [(number, cells) for number, cells in lines if any(cell != "" for cell in cells)]
    if not filled:
        raise refusal(f"{path}: the table is empty; `asbuilt-bim template PROJECT.yaml` writes one to fill in")
    places = _places([str(cell) for cell in filled[0][1]], columns, needed, path, refusal)
    given = [{key: cells[at] for key, at in places.items() if at < len(cells)} for _, cells in filled[1:]]
    rows = tuple(
        TableRow(number=number, cells=parted(cells)) for (number, _), cells in zip(filled[1:], given, strict=True)
    )
    texts = [(key, cell.strip(" %")) for row in rows for key, cell in row.cells.items() if isinstance(cell, str)]
    commas = any(_is_decimal_comma(text) for _, text in texts)
    points = frozenset(key for key, text in texts if _is_decimal_point(text))
    if between == ",":
        typed = {key for row, cells in zip(rows, given, strict=True) for key in cells if row.cells[key] != cells[key]}
        points |= places.keys() - typed
    return TableFile(name=path.name, rows=rows, formulas=formulas, commas=commas, points=points)


def number_in(row: TableRow, column: str, table: TableFile) -> float | None:
    """Return a number, None where the cell is empty.

    `1.234` and `1,234` are thousands for one person and not for another: what could be meant two ways is refused,
    unless the table's commas, or the column's points, are seen to be decimal ones.

    Raises:
        ValueError: it is no number, or could be meant two ways; says what to write.
    """
    cell = row.cells.get(column, "")
    if not isinstance(cell, str):
        if isinstance(cell, date):
            raise ValueError(f"'{cell}' is a day, and a number is wanted")
        return float(cell)
    text = cell.strip()
    if not text:
        return None
    if table.commas and _COMMA.fullmatch(text):
        return float(re.sub(r"[^-+\d,]", "", text).replace(",", "."))
    sign, digits = "," if table.commas else ".", re.sub(r"[^-+\d]", "", text)
    if _GROUPS.fullmatch(text) and not (table.commas and "," in text):
        return float(digits)
    if _GROUP.fullmatch(text) and not (column in table.points and not table.commas and "," not in text):
        smaller = f"{digits[:-3]}{sign}{digits[-3:]}0"
        raise ValueError(f"'{text[:40]}' could be meant two ways; write {digits}, or {smaller}")
    bare = re.sub(r"[^-+\d.]", "", text) if _POINT_GROUPS.fullmatch(text) else text
    if not _PLAIN.fullmatch(bare) or not math.isfinite(float(bare)):
        raise ValueError(f"'{text[:40]}' is no number; write 1234{sign}5, without a unit or a currency")
    if table.commas and "." in bare:
        raise ValueError(f"'{text[:40]}' has a point, and others here a decimal comma; write {bare.replace('.', ',')}")
    return float(bare)


def _is_decimal_comma(text: str) -> bool:
    """Say whether a number's comma can't part thousands: `0,5`, `1.234,500`, and not `1,234`."""
    return _COMMA.fullmatch(text) is not None and _GROUP.fullmatch(text) is None


def _is_decimal_point(text: str) -> bool:
    """Say whether a number's point can't part thousands: `12.5`, `1,234.500`, and not `1.234`."""
    return "." in text and bool(_PLAIN.fullmatch(text) or _POINT_GROUPS.fullmatch(text)) and not _GROUP.fullmatch(text)


def share_in(row: TableRow, column: str, table: TableFile) -> float | None:
    """Return a percentage as a share in 0..1, None where the cell is empty.

    Raises:
        ValueError: it is no number, not within 0 to 100, or may be a share: above 0, at most 1, and without a sign.
    """
    cell = row.cells.get(column, "")
    signed = isinstance(cell, str) and cell.strip().endswith("%")
    if isinstance(cell, str) and signed:
        row = TableRow(number=row.number, cells={**row.cells, column: cell.strip()[:-1].strip()})
    value = number_in(row, column, table)
    if value is not None and 0.0 < value <= 1.0 and not signed:
        what, percent = f"'{row.text(column).strip()}' may be a share or a percentage", f"{100.0 * value:g} %"
        if isinstance(cell, float):  # a cell of a workbook that shows 50 % holds 0.5
            raise ValueError(f"{what}; write it as text, such as {percent}")
        raise ValueError(f"{what}; write {percent} or {value:g} %")
    if value is not None and not 0.0 <= value <= 100.0:
        raise ValueError(f"{value:g} is no percentage from 0 to 100")
    return None if value is None else value / 100.0


def words_in(row: TableRow, column: str) -> str:
    """Return the text of a cell that can hold no number alone.

    Raises:
        ValueError: it does, as where a comma within a number before it moved the cells.
    """
    text = row.text(column).strip()
    if _PLAIN.fullmatch(text):
        raise ValueError(f"'{text[:40]}' is a number; does a comma within a number before it make two cells of one?")
    return text


def day_in(row: TableRow, column: str) -> date | None:
    """Return a day (2026-03-16, or 16.03.2026), None where the cell is empty.

    Raises:
        ValueError: it is none; 03/02 is another day in another country.
    """
    cell = row.cells.get(column, "")
    if isinstance(cell, date):
        return cell
    text = str(cell).strip()
    if text and (day := written_day(text)) is None:
        raise ValueError(f"'{text[:40]}' is no day; write 2026-03-16{in_excel(text)}")
    return day if text else None


def in_excel(text: str) -> str:
    """Return how Excel leaves a day as it was typed, "" where it isn't 3/16/2026, as an English one writes it anew."""
    return " (in Excel: Format Cells, Custom, yyyy-mm-dd)" if text.count("/") == 2 else ""


def written_day(text: str) -> date | None:
    """Return the day that a text is (2026-03-16, or 16.03.2026), None where it is none."""
    for pattern, order in ((_DAY, (1, 2, 3)), (_DOTTED_DAY, (3, 2, 1))):
        if found := pattern.fullmatch(text):
            try:
                return date(*(int(found[part]) for part in order))
            except ValueError:
                break
    return None


def refused_rows(path: Path, faults: Sequence[str], refusal: type[AsBuiltError]) -> None:
    """Refuse a table with all that is wrong with its rows, the first ones in words.

    Raises:
        AsBuiltError: of the sort `refusal`, where there are any.
    """
    if faults:
        more = f"\n  and {len(faults) - MAX_NAMED} more" if len(faults) > MAX_NAMED else ""
        raise refusal(f"{path}: can't be used:\n  " + "\n  ".join(faults[:MAX_NAMED]) + more)


def _plain(cell: XlsxCell) -> str | float | date:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    return float(cell) if isinstance(cell, int) else cell.strip() if isinstance(cell, str) else cell


def _places(
    header: Sequence[str], columns: Columns, needed: Iterable[str], path: Path, refusal: type[AsBuiltError]
) -> dict[str, int]:
    names = [_bare(cell) for cell in header]
    places: dict[str, int] = {}
    for key, known in columns.items():
        found = [at for at, name in enumerate(names) if name in map(_bare, (key, *known))]
        if len(found) > 1:
            twice = ", ".join(header[at] for at in found)
            raise refusal(f"{path}: the first row names more than one column for {key} ({twice:.80}); keep one")
        if found:
            places[key] = found[0]
            _check_unit(header[found[0]], key, path, refusal)
    missing = [key for key in needed if key not in places]
    if missing:
        raise refusal(
            f"{path}: the first row names no column {', '.join(missing)}, but {', '.join(filter(None, header)):.120}; "
            f"known are {', '.join(columns)}. Nothing may stand above the headings. "
            "`asbuilt-bim template PROJECT.yaml` writes a table to fill in"
        )
    return places


def _check_unit(heading: str, key: str, path: Path, refusal: type[AsBuiltError]) -> None:
    """Refuse another unit in a heading's brackets than its column is read in, such as `bearing [gon]`.

    Raises:
        AsBuiltError: of the sort `refusal`.
    """
    unit, others = _UNITS.get(key.rpartition("_")[2], ("", "(?!)"))
    other = re.compile(rf"(?<!\w)({others})(?!\w)|^.\s*in\s*.$", re.IGNORECASE)  # `in` alone: it may be a word
    if unit and any(other.search(given[0]) for given in _BRACKETS.finditer(heading)):
        raise refusal(f"{path}: the column '{heading[:60]}' is read in {unit}; bring it into {unit}, as {key}")


def _bare(text: str) -> str:
    """Return a heading as it is compared, without a unit in brackets."""
    return re.sub(r"[\s_.:/-]", "", _BRACKETS.sub("", text)).casefold()
