"""The door of this room: the tasks as a table and as schedules that planning programs import."""

from collections.abc import Callable
from datetime import date, datetime
from pathlib import Path

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.csv import Number, number, safe_cell, table_text
from asbuilt_bim.report.schedule.msp import write_msp
from asbuilt_bim.report.schedule.p6 import write_p6
from asbuilt_bim.report.task_rows import TaskRow, task_rows
from asbuilt_bim.report.wording.values import share_bounds
from asbuilt_bim.storage.atomic_write import writing


def write_schedules(report: ProgressReport, folder: Path) -> tuple[Path, ...]:
    """Write `tasks.csv`, `schedule.msp.xml` and `schedule.p6.xml` into a folder; a design without tasks gets none.

    Raises:
        OutputError: a file can't be written.
    """
    if not report.tasks:
        return ()
    table, msp, p6 = folder / "tasks.csv", folder / "schedule.msp.xml", folder / "schedule.p6.xml"
    write_tasks_csv(report, table)
    write_msp(report, msp)
    write_p6(report, p6)
    return table, msp, p6


def write_tasks_csv(report: ProgressReport, path: Path) -> None:
    """Write the tasks; unknown is an empty cell, never 0, and `Known` says which of both it is.

    Raises:
        OutputError: the file can't be written.
    """
    with writing(path):  # with the mark that makes Excel read UTF-8
        path.write_bytes(table_text(COLUMNS, task_rows(report), report.csv).encode("utf-8-sig"))


def _moment(when: date | datetime | None) -> str:
    return "" if when is None else when.isoformat()


def _days(value: int | None) -> str:
    return "" if value is None else str(value)


COLUMNS: dict[str, Callable[[TaskRow], str]] = {
    "Identification": lambda row: safe_cell(row.identification),
    "Name": lambda row: safe_cell(row.name),
    "Outline": lambda row: safe_cell(row.outline),
    "GlobalId": lambda row: safe_cell(row.global_id),
    "PlannedStart": lambda row: _moment(row.planned_start),
    "PlannedFinish": lambda row: _moment(row.planned_finish),
    "SeenBegun": lambda row: _moment(row.seen_begun),
    "SeenComplete": lambda row: _moment(row.seen_complete),
    "Known": lambda row: row.knowledge,
    "CompletionBest": lambda row: number(row.completion.best_shown),
    "CompletionLower": lambda row: Number(share_bounds(row.completion.lower, row.completion.upper)[0]),
    "CompletionUpper": lambda row: Number(share_bounds(row.completion.lower, row.completion.upper)[1]),
    "Coverage": lambda row: number(row.completion.coverage),
    "CompletionTold": lambda row: "" if row.certain is None else Number(share_bounds(row.certain, row.certain)[0]),
    "PlannedShare": lambda row: number(row.planned),
    "Behind_days": lambda row: _days(row.behind_days),
    "BehindAtLeast_days": lambda row: _days(row.behind_least_days),
    "BehindAtMost_days": lambda row: _days(row.behind_most_days),
    "Late": lambda row: {None: "", True: "late", False: "no"}[row.late],
    "Late_days": lambda row: _days(row.late_days),
    "ForecastFinish": lambda row: _moment(row.forecast_finish),
    "Elements": lambda row: str(row.elements),
    "Complete": lambda row: str(row.complete),
    "Part": lambda row: str(row.part),
    "NotStarted": lambda row: str(row.not_started),
    "Displaced": lambda row: str(row.displaced),
    "Unknown": lambda row: str(row.unknown),
    "Note": lambda row: safe_cell(row.note),
    "CompleteAsFarAsSeen": lambda row: str(row.as_far_as_seen),
    "ForecastEarliest": lambda row: _moment(row.forecast_earliest),
}
