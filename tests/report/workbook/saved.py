"""A workbook as a spreadsheet program saves it: values typed into its cells, what formulas gave kept as it was."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from xml.sax.saxutils import escape

import openpyxl

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.result.document import write_result
from asbuilt_bim.report.workbook.write import write_workbook

Value = str | float | date | None


def typed(path: Path, values: Mapping[tuple[str, str], Value]) -> Path:
    """Type values into cells, by sheet and place or by the name of a cell ("", name); nothing is calculated anew."""
    book = openpyxl.load_workbook(path)
    parts = {name: f"xl/worksheets/sheet{index}.xml" for index, name in enumerate(book.sheetnames, 1)}
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    for (sheet, place), value in values.items():
        if not sheet:
            sheet, place = (text.strip("'").replace("$", "") for text in book.defined_names[place].attr_text.split("!"))
        files[parts[sheet]] = _with(files[parts[sheet]].decode(), place, value).encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def _with(xml: str, place: str, value: Value) -> str:
    cell = re.search(rf'<c r="{place}"( s="\d+")?[^>]*?(/>|>.*?</c>)', xml)
    assert cell, place
    style = cell[1] or ""
    if value is None:
        made = f'<c r="{place}"{style}/>'
    elif isinstance(value, str):
        made = f'<c r="{place}"{style} t="inlineStr"><is><t>{escape(value)}</t></is></c>'
    else:
        number = (value - date(1899, 12, 30)).days if isinstance(value, date) else value
        made = f'<c r="{place}"{style}><v>{number!r}</v></c>'
    return xml[: cell.start()] + made + xml[cell.end() :]


def at(path: Path, sheet: str, heading: str, row: int) -> tuple[str, str]:
    """Return the place of a cell by its heading and its row below the headings, from 0."""
    cells = openpyxl.load_workbook(path)[sheet][4]
    return sheet, next(cell.column_letter for cell in cells if cell.value == heading) + str(5 + row)


def run_folder(path: Path, report: ProgressReport) -> Path:
    """Make an output folder whose current run is of a report, with the copy of its workbook; return that copy."""
    run = path / "runs" / "20260317T120000Z-00000000"
    run.mkdir(parents=True)
    write_result(report, run / "result.json")
    write_workbook(report, run / "quantities.xlsx")
    pointer = {"format": "asbuilt-bim/current", "version": 1, "run": f"runs/{run.name}", "ifc": "x.ifc"}
    (path / "current.json").write_text(json.dumps(pointer))
    (path / "quantities.xlsx").write_bytes((run / "quantities.xlsx").read_bytes())
    return path / "quantities.xlsx"
