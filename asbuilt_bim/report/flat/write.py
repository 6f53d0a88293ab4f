"""The door of this room: the flat tables as CSV or Parquet, with the description that reporting programs read."""

import csv
import io
import json
from collections.abc import Sequence
from datetime import date, datetime
from pathlib import Path
from typing import Any, Literal

from asbuilt_bim.errors import OutputError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.csv import safe_cell
from asbuilt_bim.report.flat.columns import KEYS, TABLES, Column, Table
from asbuilt_bim.report.flat.exchange import csv2ifc_text, ifccsv_text
from asbuilt_bim.report.flat.parquet import parquet_bytes
from asbuilt_bim.report.flat.rows import Cell, flat_tables
from asbuilt_bim.storage.atomic_write import replace_all

Form = Literal["csv", "parquet"]
DESCRIPTION = "datapackage.json"
IFCCSV, CSV2IFC = "ifccsv.csv", "csv2ifc.csv"


def file_names(form: Form) -> tuple[str, ...]:
    """Return the names of all files that `write_tables` may write."""
    return (DESCRIPTION, *(f"{name}.{form}" for name in TABLES), IFCCSV, CSV2IFC)


def write_tables(reports: Sequence[ProgressReport], folder: Path, form: Form = "csv") -> tuple[Path, ...]:
    """Write the tables of some visits' results into a folder, and beside them what other programs take as CSV.

    Raises:
        OutputError: they can't be written.
        MissingExtraError: Parquet is wanted, and pyarrow isn't installed.
    """
    rows = flat_tables(reports)
    files: dict[Path, bytes] = {}
    for name, columns in TABLES.items():
        make = parquet_bytes if form == "parquet" else csv_bytes
        files[folder / f"{name}.{form}"] = make(columns, rows[name])
    newest = max(reports, key=lambda report: report.visit_date)
    files[folder / IFCCSV] = ifccsv_text(newest).encode("utf-8", "replace")
    if newest.cost_lines:
        files[folder / CSV2IFC] = csv2ifc_text(newest).encode("utf-8", "replace")
    text = json.dumps(description(form), indent=2, ensure_ascii=False)
    files[folder / DESCRIPTION] = f"{text}\n".encode()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        replace_all(files)
    except OSError as problem:
        reason = problem.strerror or problem
        raise OutputError(
            f"{folder}: tables can't be written ({reason}); name another folder, or free space"
        ) from problem
    return tuple(files)


def csv_bytes(columns: Sequence[Column], rows: Sequence[Sequence[Cell]]) -> bytes:
    """Return a table as CSV: UTF-8 with its mark, commas, decimal points, empty where there is no value."""
    out = io.StringIO(newline="")
    table = csv.writer(out, lineterminator="\r\n")
    table.writerow(column.name for column in columns)
    table.writerows([_text(cell) for cell in row] for row in rows)
    return out.getvalue().encode("utf-8-sig", "replace")


def description(form: Form = "csv") -> dict[str, Any]:
    """Return what the tables hold, as a data package (https://specs.frictionlessdata.io) describes it."""
    return {
        "$schema": "https://specs.frictionlessdata.io/schemas/tabular-data-package.json",
        "$id": "https://asbuilt-bim.org/schemas/tables-1.json",
        "profile": "tabular-data-package",
        "name": "asbuilt-bim-tables",
        "version": "1",
        "description": "As-built progress by asbuilt-bim, one row of each thing and visit. Names end in their unit.",
        "resources": [_resource(name, columns, form) for name, columns in TABLES.items()],
    }


def _resource(name: Table, columns: Sequence[Column], form: Form) -> dict[str, Any]:
    fields = [
        {"name": one.name, "type": one.kind, "description": one.meaning}
        | ({"format": "%Y-%m-%dT%H:%M:%S"} if one.kind == "datetime" else {})
        | ({"constraints": {"required": True}} if one.always else {})
        for one in columns
    ]
    return {
        "name": name.replace("_", "-"),
        "path": f"{name}.{form}",
        "profile": "tabular-data-resource",
        "encoding": "utf-8",
        "schema": {"fields": fields, "primaryKey": list(KEYS[name]), "missingValues": [""]},
    }


def _text(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    if isinstance(cell, datetime):
        return cell.replace(microsecond=0, tzinfo=None).isoformat()
    if isinstance(cell, date):
        return cell.isoformat()
    return safe_cell(cell) if isinstance(cell, str) else repr(cell)
