"""The door of this room: the tasks as a table and as schedules that planning programs import."""

from __future__ import annotations

from pathlib import Path

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.schedule.msp import write_msp
from asbuilt_bim.report.schedule.p6 import write_p6
from asbuilt_bim.report.schedule.tasks_csv import write_tasks_csv


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
