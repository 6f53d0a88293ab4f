"""A task with a start and a duration: its finish is worked out where the file leaves no doubt, and only there."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder

START = "2026-03-05T08:00:00"  # a Thursday


def calendar(
    builder: ModelBuilder, hours: tuple[tuple[str, str], ...] = (), off: tuple[str, str] | None = None, **more: Any
) -> Any:
    """A week from Monday to Friday, with the hours of a day, and days off."""
    periods = [builder.make("IfcTimePeriod", StartTime=a, EndTime=b) for a, b in hours]
    pattern = builder.make(
        "IfcRecurrencePattern", RecurrenceType="WEEKLY", WeekdayComponent=[1, 2, 3, 4, 5], TimePeriods=periods or None,
        **more,
    )  # fmt: skip
    work = builder.make("IfcWorkTime", RecurrencePattern=pattern)
    free = [builder.make("IfcWorkTime", None, None, None, None, *off)] if off else None
    return builder.rooted("IfcWorkCalendar", Name="Site", WorkingTimes=[work], ExceptionTimes=free)


def task(builder: ModelBuilder, duration: str, kind: str = "WORKTIME") -> Any:
    made = builder.task("pour", [builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))])
    made.TaskTime = builder.make(
        "IfcTaskTime", ScheduleStart=START, ScheduleDuration=duration, DurationType=kind or None
    )  # fmt: skip
    return made


def controlled(builder: ModelBuilder, thing: Any, by: Any) -> None:
    builder.rooted("IfcRelAssignsToControl", RelatedObjects=[thing], RelatingControl=by)


def read(builder: ModelBuilder, tmp_path: Path) -> tuple[BimModel, datetime | None, list[str]]:
    design = read_design(builder.write(tmp_path / "plan.ifc"))
    (made,) = design.tasks
    assert made.schedule_start == datetime(2026, 3, 5, 8)
    return (
        design,
        made.schedule_finish,
        [note for note in design.notes if note.code in (Reason.FINISH_WORKED_OUT, Reason.FINISH_UNKNOWN)],
    )


@pytest.mark.parametrize("schema", ["IFC4", "IFC4X3"])
@pytest.mark.parametrize(
    ("duration", "hours", "off", "finish"),
    [
        ("P4D", (), None, datetime(2026, 3, 11, 8)),  # Thursday, Friday, Monday, Tuesday: over when Wednesday is as old
        ("P4D", (), ("2026-03-06", "2026-03-09"), datetime(2026, 3, 13, 8)),
        ("PT16H", (("08:00:00", "12:00:00"), ("13:00:00", "17:00:00")), None, datetime(2026, 3, 6, 17)),
        ("P0Y0M0DT24H0M0S", (("08:00:00", "16:00:00"),), ("2026-03-06", "2026-03-06"), datetime(2026, 3, 10, 16)),
        ("P0D", (), None, datetime(2026, 3, 5, 8)),
    ],
)
def test_working_time_is_counted_by_the_tasks_calendar_and_said(
    schema: str, duration: str, hours: Any, off: Any, finish: datetime, tmp_path: Path
) -> None:
    builder = ModelBuilder(schema=schema)
    controlled(builder, task(builder, duration), calendar(builder, hours, off))
    _, found, notes = read(builder, tmp_path)
    assert found == finish
    (note,) = notes
    assert note.code == Reason.FINISH_WORKED_OUT
    assert note.values == {"count": 1, "tasks": (f"pour {finish:%Y-%m-%d %H:%M}",)}


def test_elapsed_time_needs_no_calendar(tmp_path: Path) -> None:
    builder = ModelBuilder()
    task(builder, "P1DT12H", kind="ELAPSEDTIME")
    assert read(builder, tmp_path)[1] == datetime(2026, 3, 6, 20)


def test_the_calendar_of_the_work_schedule_counts_for_its_tasks(tmp_path: Path) -> None:
    builder = ModelBuilder()
    summary = builder.rooted("IfcTask", Name="all", IsMilestone=False)
    builder.rooted("IfcRelNests", RelatingObject=summary, RelatedObjects=[task(builder, "P2D")])
    plan = builder.rooted("IfcWorkSchedule", Name="plan", CreationDate=START, StartTime=START)
    controlled(builder, summary, plan)
    controlled(builder, plan, calendar(builder))
    assert read(builder, tmp_path)[1] == datetime(2026, 3, 9, 8)


@pytest.mark.parametrize(
    ("duration", "kind", "hours", "more"),
    [
        ("P5D", "WORKTIME", (("08:00:00", "16:00:00"),), {}),  # five shifts, or 120 hours of work
        ("P1DT16H", "WORKTIME", (("08:00:00", "16:00:00"),), {}),
        ("PT40H", "WORKTIME", (), {}),
        ("P5D", "WORKTIME", (), {"Interval": 2}),
        ("P2M", "WORKTIME", (), {}),
        ("soon", "ELAPSEDTIME", (), {}),
        ("P5D", "WORKTIME", (), {"Occurrences": 3}),
        ("P1W", "WORKTIME", (), {}),
        ("P5D", "", (), {}),
        ("P99999D", "ELAPSEDTIME", (), {}),
        ("PT8H", "WORKTIME", (("16:00:00", "08:00:00"),), {}),
    ],
)
def test_a_duration_that_may_mean_two_things_gives_no_finish_and_is_named(
    duration: str, kind: str, hours: Any, more: dict[str, Any], tmp_path: Path
) -> None:
    builder = ModelBuilder()
    controlled(builder, task(builder, duration, kind), calendar(builder, hours, **more))
    _, found, notes = read(builder, tmp_path)
    assert found is None
    assert [note.code for note in notes] == [Reason.FINISH_UNKNOWN]
    assert notes[0].values == {"task": "pour", "duration": duration}


def test_two_calendars_or_none_give_no_finish(tmp_path: Path) -> None:
    for count in (0, 2):
        builder = ModelBuilder()
        made = task(builder, "P5D")
        for _ in range(count):
            controlled(builder, made, calendar(builder))
        assert read(builder, tmp_path)[1] is None


def test_a_finish_at_midnight_is_a_date_alone_and_means_the_end_of_its_working_day(tmp_path: Path):
    builder = ModelBuilder("IFC4")
    made = builder.task("pour", [builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))])
    made.TaskTime = builder.make("IfcTaskTime", ScheduleStart=START, ScheduleFinish="2026-03-05T00:00:00")
    design, finish, _ = read(builder, tmp_path)
    assert finish == datetime(2026, 3, 5, 17)
    assert not [note for note in design.notes if note.code == Reason.FINISH_BEFORE_START]
