"""LibreOffice without a window: it recalculates a workbook, and what comes out is compared with what we wrote."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import openpyxl
from openpyxl.worksheet.worksheet import Worksheet

SOFFICE = shutil.which("soffice")


@dataclass(frozen=True, slots=True, kw_only=True)
class Recalculated:
    """How the formulas of a workbook came out: how many, which are errors, and which differ from what we wrote."""

    formulas: int
    errors: tuple[str, ...]
    differ: tuple[str, ...]


def converted(path: Path, form: str, folder: Path) -> Path:
    """Have LibreOffice convert a file; returns where the result lies."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as profile:
        command = [str(SOFFICE), f"-env:UserInstallation=file://{profile}", "--headless", "--convert-to", form]
        subprocess.run([*command, "--outdir", str(folder), str(path)], check=True, capture_output=True, timeout=1800)
    return folder / f"{path.stem}.{form}"


def recalculated(path: Path, folder: Path, edits: Mapping[tuple[str, str, int], object] | None = None) -> Path:
    """Save a workbook with edits, without any value that a formula gave, and have LibreOffice work them all out.

    `edits`: (sheet, heading, row below the headings from 0) -> value; a name stands for its cell with the row -1.
    """
    book = openpyxl.load_workbook(path)
    for (sheet, heading, row), value in (edits or {}).items():
        if row < 0:
            where, cell = str(book.defined_names[heading].attr_text).split("!")
            book[where.strip("'")][cell.replace("$", "")].value = value
        else:
            columns = {cell.value: cell.column for cell in book[sheet][4]}
            book[sheet].cell(5 + row, columns[heading]).value = value  # type: ignore[index]
    folder.mkdir(parents=True, exist_ok=True)
    bare = folder / f"{path.stem}.xlsx"
    book.save(bare)
    return converted(bare, "xlsx", folder / "calculated")


def compared(path: Path, calculated: Path) -> Recalculated:
    """Compare what formulas give in LibreOffice with the values that we wrote beside them."""
    formulas, ours = openpyxl.load_workbook(path), openpyxl.load_workbook(path, data_only=True)
    theirs = openpyxl.load_workbook(calculated, data_only=True)
    count, errors, differ = 0, [], []
    for name in formulas.sheetnames:
        sheet: Worksheet = formulas[name]
        for row in sheet.iter_rows():
            for cell in row:
                if cell.data_type != "f":
                    continue
                count += 1
                place = f"{name}!{cell.coordinate}"
                own, other = ours[name][cell.coordinate].value, theirs[name][cell.coordinate].value
                if isinstance(other, str) and other.startswith("#"):
                    errors.append(f"{place}: {other}")
                elif not _same(own, other):
                    differ.append(f"{place}: {own!r}, LibreOffice {other!r}")
    return Recalculated(formulas=count, errors=tuple(errors), differ=tuple(differ))


def _same(own: object, other: object) -> bool:
    if isinstance(own, int | float) and isinstance(other, int | float):
        return abs(own - other) <= 1e-9 * max(1.0, abs(own))
    return (own or "") == (other or "")
