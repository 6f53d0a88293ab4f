"""Reading `.xlsx`: values only, within bounds. No formula is run, no link is followed, no entity grows.

A cell that holds a formula gives the value that it had when the file was last saved.
"""

import io
import re
import zipfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import openpyxl

from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.storage.regular_file import read_bytes

MAX_BYTES = 60_000_000
"""A workbook of 20,000 elements and 3,000 cost lines has 4 MB."""
MAX_UNPACKED = 600_000_000
MAX_PARTS = 5_000
MAX_ROWS, MAX_COLUMNS = 300_000, 80
_XML = (".xml", ".rels", ".vml")
_OPEN = "open it in a spreadsheet program and save it as .xlsx"

XlsxCell = str | float | int | bool | date | None


@dataclass(frozen=True, slots=True, kw_only=True)
class XlsxSheet:
    """The rows of a sheet from its first; `formulas` says whether any cell of it is one."""

    rows: tuple[tuple[XlsxCell, ...], ...]
    formulas: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class XlsxFile:
    """The sheets that were asked for, and where defined names of one cell point: (sheet, row, column), from 0."""

    sheets: Mapping[str, XlsxSheet]
    names: Mapping[str, tuple[str, int, int]]
    all_sheets: tuple[str, ...]

    def at(self, name: str) -> XlsxCell:
        """Return the value of a named cell, None where there is none."""
        sheet, row, column = self.names.get(name, ("", 0, 0))
        rows = self.sheets[sheet].rows if sheet in self.sheets else ()
        return rows[row][column] if row < len(rows) and column < len(rows[row]) else None


def read_xlsx(
    path: Path, refusal: type[AsBuiltError], wanted: Collection[str] | None = None, advice: str = ""
) -> XlsxFile:
    """Read the visible values of a workbook's sheets: those of the names `wanted`, else the first one.

    `advice` says what to do about one that is damaged, or is no workbook.

    Raises:
        AsBuiltError: of the sort `refusal`: no workbook, damaged, with a password, too large, or with document types.
    """
    data = read_bytes(path, MAX_BYTES, refusal, str(path))
    _inspect(data, path, refusal, advice)
    try:
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True, keep_links=False)
        names = [name for name in book.sheetnames if hasattr(book[name], "iter_rows")]
        chosen = [name for name in names if name in wanted] if wanted is not None else names[:1]
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            sheets = {name: _sheet(book[name], archive, path, refusal) for name in chosen}
        found = XlsxFile(sheets=sheets, names=_names(book), all_sheets=tuple(names))
        book.close()
    except AsBuiltError:
        raise
    except Exception as problem:  # openpyxl raises whatever a damaged part leads it into
        reason = " ".join(f"{type(problem).__name__}: {problem}".split())[:160]
        raise refusal(f"{path}: the workbook is damaged ({reason}); {advice or _OPEN}") from problem
    return found


def _inspect(data: bytes, path: Path, refusal: type[AsBuiltError], advice: str) -> None:
    """Look through the archive before anything is built from it."""
    if data.startswith(b"\xd0\xcf\x11\xe0"):
        raise refusal(f"{path}: is an old .xls, or has a password; save it as .xlsx without one")
    if not data.startswith(b"PK\x03\x04"):
        raise refusal(f"{path}: is no .xlsx; {advice or 'save it as one, or as CSV (UTF-8) with the ending .csv'}")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = archive.infolist()
            size = sum(part.file_size for part in parts)
            if len(parts) > MAX_PARTS or size > MAX_UNPACKED:
                most = f"{MAX_UNPACKED / 1e6:.0f} MB or {MAX_PARTS:,} parts"
                raise refusal(f"{path}: unpacks to {size / 1e6:,.0f} MB in {len(parts):,} parts, limit {most}")
            for part in parts:
                if part.filename.lower().endswith(_XML):
                    text = archive.read(part)  # never more than its size says
                    if b"<!DOCTYPE" in text or b"<!ENTITY" in text or b"\0" in text[:64]:
                        raise refusal(
                            f"{path}: {part.filename} holds a document type, which no workbook needs; {_OPEN}"
                        )
    except (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, EOFError, OSError) as problem:
        raise refusal(f"{path}: the workbook is damaged ({problem!s:.120}); {advice or _OPEN}") from problem
    except Exception as problem:
        if isinstance(problem, AsBuiltError):
            raise
        raise refusal(f"{path}: the workbook is damaged ({problem!s:.120}); {advice or _OPEN}") from problem


def _sheet(sheet: Any, archive: zipfile.ZipFile, path: Path, refusal: type[AsBuiltError]) -> XlsxSheet:
    rows: list[tuple[XlsxCell, ...]] = []
    for cells in sheet.iter_rows(max_col=MAX_COLUMNS, values_only=True):
        rows.append(_trimmed([_value(cell) for cell in cells]))
        if len(rows) > MAX_ROWS:
            raise refusal(f"{path}: sheet '{sheet.title}' has more than {MAX_ROWS:,} rows; delete what isn't needed")
    while rows and not rows[-1]:
        rows.pop()
    part = str(getattr(sheet, "_worksheet_path", "")).lstrip("/")
    formulas = part in archive.namelist() and re.search(rb"<f[ >/]", archive.read(part)) is not None
    return XlsxSheet(rows=tuple(rows), formulas=formulas)


def _trimmed(cells: list[XlsxCell]) -> tuple[XlsxCell, ...]:
    while cells and cells[-1] is None:
        cells.pop()
    return tuple(cells)


def _value(cell: Any) -> XlsxCell:
    """Return a cell's value as plain data; what is no number, text or day is None."""
    if isinstance(cell, datetime):
        return cell.date()
    if isinstance(cell, str):
        return None if cell.startswith("#") and cell.rstrip("!?").isupper() and " " not in cell else cell
    if isinstance(cell, bool | int | float | date) and not isinstance(cell, time | timedelta):
        return cell
    return None


def _names(book: Any) -> dict[str, tuple[str, int, int]]:
    """Return where the defined names of one cell point."""
    found = {}
    for name, defined in book.defined_names.items():
        place = re.fullmatch(r"'?([^'!]{1,31})'?!\$?([A-Z]{1,3})\$?([0-9]{1,7})", str(defined.attr_text or ""))
        if place:
            column = 0
            for letter in place[2]:
                column = column * 26 + ord(letter) - 64
            found[str(name)] = (place[1], int(place[3]) - 1, column - 1)
    return found
