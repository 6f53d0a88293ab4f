"""`quantities.csv`: elements by storey, for any program that reads tables."""

import csv
import io
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Literal, TypeVar

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.tables import ElementRow, element_rows
from asbuilt_bim.report.wording.values import plain, share_bounds
from asbuilt_bim.storage.atomic_write import writing

Row = TypeVar("Row")
CsvForm = Literal["comma", "semicolon"]
"""Commas and decimal points, or semicolons and decimal commas: what spreadsheets set to these open."""
_FORMULA = re.compile("(^[ \u00a0]*(?=[\t\r\n])|(?:^[ \u00a0]*|[,;\t\r\n])(?=[=+\\-@＝＋－＠]))")
"""Where a formula would begin: also past a separator or a line's end, where a spreadsheet set to another separator
divides the cell. The wide signs, too: spreadsheets set to Japanese or Chinese take them for the narrow ones."""


def write_csv(report: ProgressReport, path: Path) -> None:
    """Write the elements by storey; unknown is an empty cell, never 0.

    Raises:
        OutputError: the file can't be written.
    """
    with writing(path):
        path.write_bytes(csv_text(report).encode("utf-8-sig"))  # with the mark that makes Excel read UTF-8


def csv_text(report: ProgressReport) -> str:
    """Return the table as text with CRLF line ends (RFC 4180)."""
    return table_text(COLUMNS, element_rows(report), report.csv)


def table_text(columns: Mapping[str, Callable[[Row], str]], rows: Iterable[Row], form: CsvForm) -> str:
    """Return a table as text with CRLF line ends: what each column is called, and its cell of a row."""
    between, point = (";", ",") if form == "semicolon" else (",", ".")
    out = io.StringIO(newline="")
    writer = csv.writer(out, delimiter=between, lineterminator="\r\n")
    writer.writerow(columns)
    for row in rows:
        cells = [cell(row) for cell in columns.values()]
        writer.writerow([one.replace(".", point) if isinstance(one, Number) else one for one in cells])
    return out.getvalue()


class Number(str):
    """A cell that is a number, with a decimal point: the one that a table's form may turn into a comma."""

    __slots__ = ()


def safe_cell(text: str) -> str:
    """Return text that no spreadsheet runs as a formula: where one would begin stands an apostrophe."""
    return _FORMULA.sub(r"\1'", plain(text))


def number(value: float | None, decimals: int = 4) -> Number:
    """Write a number with a point; None is empty."""
    return Number("" if value is None else f"{value + 0.0:.{decimals}f}")


COLUMNS: dict[str, Callable[[ElementRow], str]] = {
    "Storey": lambda row: safe_cell(row.storey),
    "GlobalId": lambda row: safe_cell(row.global_id),
    "Class": lambda row: safe_cell(row.ifc_class),
    "Name": lambda row: safe_cell(row.name),
    "State": lambda row: row.state,
    "DesignArea_m2": lambda row: number(row.design_area_m2),
    "PhotographedDesignArea_m2": lambda row: number(row.photographed_m2),
    "AsBuiltArea_m2": lambda row: number(row.as_built_area_m2),
    "Sigma_m2": lambda row: number(row.sigma_m2),
    "CompletionBest": lambda row: number(row.best),
    "CompletionLower": lambda row: Number(share_bounds(row.lower, row.upper)[0]),
    "CompletionUpper": lambda row: Number(share_bounds(row.lower, row.upper)[1]),
    "Coverage": lambda row: number(row.coverage),
    "Offset_mm": lambda row: number(row.offset_mm, 1),
    "OffsetSigma_mm": lambda row: number(row.offset_sigma_mm, 1),
    "Visit": lambda row: row.visit.isoformat(),
    "LastSeen": lambda row: row.last_seen.isoformat() if row.last_seen else "",
    "Stations": lambda row: safe_cell(row.stations),
    "Notes": lambda row: safe_cell(row.notes),
}
