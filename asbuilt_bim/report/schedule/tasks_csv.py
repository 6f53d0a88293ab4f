"""`tasks.csv`: the tasks, planned against actual, for any program that reads tables."""

from __future__ import annotations

import csv
import io
from datetime import date, datetime
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.csv import safe_cell
from asbuilt_bim.report.schedule.task_rows import TaskRow, task_rows
from asbuilt_bim.report.wording.values import share_bounds

HEADER = (
    "Identification",
    "Name",
    "Outline",
    "GlobalId",
    "PlannedStart",
    "PlannedFinish",
    "SeenBegun",
    "SeenComplete",
    "Known",
    "CompletionBest",
    "CompletionLower",
    "CompletionUpper",
    "Coverage",
    "CompletionTold",
    "PlannedShare",
    "DaysLate",
    "DaysLateAtLeast",
    "DaysLateAtMost",
    "Late",
    "Elements",
    "Complete",
    "Part",
    "NotStarted",
    "Unknown",
    "Note",
)


def write_tasks_csv(report: ProgressReport, path: Path) -> None:
    """Write the tasks; unknown is an empty cell, never 0, and `Known` says which of both it is.

    Raises:
        OutputError: the file can't be written.
    """
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(HEADER)
    writer.writerows(_cells(row) for row in task_rows(report))
    try:
        path.write_bytes(out.getvalue().encode("utf-8-sig"))  # with the mark that makes Excel read UTF-8
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}; close it elsewhere") from error


def _cells(row: TaskRow) -> tuple[str, ...]:
    done = row.completion
    days = (row.days_late, row.days_late_least, row.days_late_most)
    return (
        *(safe_cell(text) for text in (row.identification, row.name, row.outline, row.global_id)),
        *(_moment(when) for when in (row.planned_start, row.planned_finish, row.seen_begun, row.seen_complete)),
        row.knowledge,
        _share(done.best),
        *share_bounds(done.lower, done.upper),
        _share(done.coverage),
        "" if row.certain is None else share_bounds(row.certain, row.certain)[0],
        _share(row.planned),
        *("" if value is None else str(value) for value in days),
        {None: "", True: "late", False: "no"}[row.late],
        *(str(count) for count in (row.elements, row.complete, row.part, row.not_started, row.unknown)),
        safe_cell(row.note),
    )


def _moment(when: date | datetime | None) -> str:
    return "" if when is None else when.isoformat()


def _share(value: float | None) -> str:
    return "" if value is None else f"{value + 0.0:.4f}"
