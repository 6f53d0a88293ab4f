"""Cells of a workbook that a person saved: each a number, a text or a day, or a message of what to do."""

import math
from collections.abc import Mapping
from datetime import date
from pathlib import Path

from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.report.workbook.layout import VARIATIONS
from asbuilt_bim.storage.table_file import written_day
from asbuilt_bim.storage.xlsx_file import XlsxCell, XlsxFile, XlsxSheet

MAX_TEXT = 500
AGAIN = "open it, let it calculate (Ctrl+Shift+F9) and save it"
LOST_INPUT = "what was written into it would be lost"
Row = Mapping[str, XlsxCell]


def rows_of(book: XlsxFile, name: str, needed: str, path: Path) -> list[Row]:
    """Return the rows of a sheet's table by heading, up to the first without any number or text in its first cells."""
    sheet = book.sheets.get(name, XlsxSheet(rows=(), formulas=False))
    for index, cells in enumerate(sheet.rows[:20]):
        if "No." in cells and needed in cells:
            heads = [str(cell) if cell is not None else "" for cell in cells]
            if len({head for head in heads if head}) != sum(1 for head in heads if head):
                raise WorkbookError(f"{path}: sheet '{name}' has two columns of one heading; take one out")
            rows = [dict(zip(heads, row, strict=False)) for row in sheet.rows[index + 1 :]]
            return [row for row in rows if isinstance(row.get("No."), int | float) or name == VARIATIONS]
    raise WorkbookError(f"{path}: sheet '{name}' lacks its headings, so {LOST_INPUT}; take an earlier copy of it")


def day_of(cell: XlsxCell) -> date | None:
    """Return a cell as a day; None where it is none."""
    return cell if isinstance(cell, date) else written_day(str(cell).strip())


def number_of(row: Row, key: str, path: Path, what: str, remedy: str = AGAIN) -> float:
    """Return a number that has to be there.

    Raises:
        WorkbookError: it isn't: it is text, or the workbook was changed, or saved by what calculates nothing.
    """
    cell = row.get(key)
    value = plain_of(cell)
    if isinstance(cell, str) and cell.strip():
        raise WorkbookError(
            f"{path}: {what}: '{key}' is the text '{cell.strip()[:40]}' and no number. Give the cell a number format, "
            "type it with your spreadsheet's own decimal sign and without a unit, such as 310.50 or 310,50, and save"
        )
    if value is None:
        raise WorkbookError(f"{path}: {what}: '{key}' has no value, and none is guessed; {remedy}")
    return value


def plain_of(cell: XlsxCell) -> float | None:
    """Return a cell as a number; None where it is none."""
    if isinstance(cell, bool) or not isinstance(cell, int | float) or not math.isfinite(cell):
        return None
    return float(cell)


def text_of(row: Row, key: str) -> str:
    """Return a row's cell as text, "" where it is empty."""
    cell = row.get(key)
    if cell is None:
        return ""
    text = f"{cell:g}" if isinstance(cell, float) else str(cell)
    return text.strip()[:MAX_TEXT]
