"""CSV as people and spreadsheets write it: the one place where its rows are read, each no wider than the headings."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.storage.regular_file import as_text

MAX_ROWS = 200_000
MAX_CELL = 200_000
"""Letters of a cell: a row may list some thousand GlobalIds."""
_ONE_OF_TWO = {
    ",": "a comma within a number or a text makes two cells of one: write 310.75, put quotation marks round a text "
    "with a comma, or semicolons between cells",
    ";": "a semicolon within a cell makes two of one: put quotation marks round it",
    "\t": "a tab within a cell makes two of one: put quotation marks round it",
}
_ONE_CELL = "in Excel part the first column with Data > Text to Columns, and save the table as CSV UTF-8 again"
CsvRow = tuple[int, list[str]]
"""Its line in the file, and its cells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvTable:
    """The headings of a table and the rows under them, without blank ones; `sign` stands between cells."""

    header: tuple[str, ...]
    rows: tuple[CsvRow, ...]
    sign: str


def csv_table(data: bytes, name: str, refusal: type[AsBuiltError], *, comments: bool = False) -> CsvTable:
    """Read a table in UTF-8 or UTF-16 with commas, semicolons or tabs; with `comments`, rows that begin with # aren't.

    Raises:
        AsBuiltError: of the sort `refusal`: it is no such text, too long, or a row has a cell without a heading.
    """
    utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    text = as_text(data, refusal, name, "utf-16" if utf_16 else "utf-8-sig").replace("\0", "")
    lines = (line.strip() for line in io.StringIO(text, newline=None))  # lines may end as they do on any system
    first = next((line for line in lines if line and not (comments and line.startswith("#"))), "")
    sign = "\t" if first == "sep=" else max(",;\t", key=first.count)  # a tab behind it is a blank
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=sign, strict=True)
    found: list[CsvRow] = []
    try:
        for row in reader:
            cells = [_unquoted(cell) for cell in row]
            says_sign = not found and cells[:1] == ["sep="]  # a first line for Excel: `sep=;`
            if not any(cells) or says_sign or (comments and cells[0].startswith("#")):
                continue
            if any(len(cell) > MAX_CELL for cell in cells):
                raise refusal(f"{name}, line {reader.line_num}: a cell of over {MAX_CELL:,} characters")
            found.append((reader.line_num, cells))
            if len(found) > MAX_ROWS:
                raise refusal(f"{name}: more than {MAX_ROWS:,} rows; is it the right file?")
    except csv.Error as problem:
        cause = "a quotation mark (\") isn't closed" if "end of data" in str(problem) else problem
        raise refusal(f"{name}, line {reader.line_num}: no CSV ({cause}); save it as CSV again") from problem
    if not found:
        raise refusal(f"{name}: the table is empty; copy or save it again, whole")
    (at, header), *rows = found
    header = header[: _width(header)]
    if len(header) == 1 and any(mark in header[0] for mark in _ONE_OF_TWO):
        raise refusal(f"{name}, line {at}: all headings stand in one cell; {_ONE_CELL}")
    wide = [(line, _width(cells)) for line, cells in rows if _width(cells) > len(header)]
    if wide:
        more = f" (and {len(wide) - 1} more lines)" if len(wide) > 1 else ""
        raise refusal(
            f"{name}, line {wide[0][0]}: {wide[0][1]} cells under the {len(header)} headings of line {at}{more}; "
            f"{_ONE_OF_TWO[sign]}. A further column needs a heading, and nothing may stand above the headings"
        )
    return CsvTable(header=tuple(header), rows=tuple(rows), sign=sign)


def _width(cells: Sequence[str]) -> int:
    """Return how many cells a row has up to its last filled one."""
    return max((at for at, cell in enumerate(cells, 1) if cell), default=0)


def _unquoted(cell: str) -> str:
    """Return a cell without the apostrophe that a table of ours puts before what a spreadsheet would run."""
    text = cell.strip()
    return text[1:] if text[:1] == "'" and text[1:].lstrip()[:1] in ("=", "+", "-", "@") else text
