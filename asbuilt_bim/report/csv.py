"""`quantities.csv`: elements by storey, for any program that reads tables."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.tables import ElementRow, element_rows
from asbuilt_bim.report.wording.values import plain, share_bounds
from asbuilt_bim.storage.atomic_write import writing

HEADER = (
    "Storey",
    "GlobalId",
    "Class",
    "Name",
    "State",
    "DesignArea_m2",
    "AsBuiltArea_m2",
    "Sigma_m2",
    "CompletionBest",
    "CompletionLower",
    "CompletionUpper",
    "Coverage",
    "Offset_mm",
    "Visit",
    "LastSeen",
    "Stations",
    "Notes",
)
_RUNS_AS_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def write_csv(report: ProgressReport, path: Path) -> None:
    """Write the elements by storey; unknown is an empty cell, never 0.

    Raises:
        OutputError: the file can't be written.
    """
    with writing(path):
        path.write_bytes(csv_text(report).encode("utf-8-sig"))  # with the mark that makes Excel read UTF-8


def csv_text(report: ProgressReport) -> str:
    """Return the table as text with CRLF line ends (RFC 4180)."""
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(HEADER)
    writer.writerows(_cells(row) for row in element_rows(report))
    return out.getvalue()


def safe_cell(text: str) -> str:
    """Return text that no spreadsheet runs as a formula: what begins like one gets an apostrophe."""
    cleaned = plain(text)
    return f"'{cleaned}" if cleaned.lstrip(" \u00a0").startswith(_RUNS_AS_FORMULA) else cleaned


def _cells(row: ElementRow) -> tuple[str, ...]:
    """Write one row's cells."""
    return (
        safe_cell(row.storey),
        safe_cell(row.global_id),
        safe_cell(row.ifc_class),
        safe_cell(row.name),
        row.state,
        _number(row.design_area_m2, 4),
        _number(row.as_built_area_m2, 4),
        _number(row.sigma_m2, 4),
        _number(row.best, 4),
        *share_bounds(row.lower, row.upper),
        _number(row.coverage, 4),
        _number(row.offset_mm, 1),
        row.visit.isoformat(),
        row.last_seen.isoformat() if row.last_seen else "",
        safe_cell(row.stations),
        safe_cell(row.notes),
    )


def _number(value: float | None, decimals: int) -> str:
    """Write a number with a point; None is empty."""
    return "" if value is None else f"{value + 0.0:.{decimals}f}"
