"""The lines of an exported schedule, worked out once: MS Project and P6 only write them in their own words."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from asbuilt_bim.bim.schedule import SCHEDULE_KEY, WorkCalendar
from asbuilt_bim.progress.completion.forecast import forecast_of, planned_hours, working_hours
from asbuilt_bim.progress.completion.moments import status_moment
from asbuilt_bim.progress.completion.planned import TaskVerdict, calendar_of, verdict
from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.wording.values import plain


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleTimes:
    """A task's dates and working hours as they are now; None is not written."""

    start: datetime | None  # the actual one, once begun; of an unknown task the planned one
    finish: datetime | None  # the forecast; of an unknown task the planned one
    duration_h: float | None  # from start to finish
    actual_start: datetime | None
    actual_finish: datetime | None
    done_h: float | None  # share of the duration
    remaining_h: float | None  # from the status date to the finish
    elapsed_h: float | None = None  # from the actual start to the actual finish or the status date


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleLine:
    """A task, or a summary above tasks; `number` is its outline number, such as 1.2.1."""

    number: str
    name: str
    task: TaskProgress | None  # None: a summary
    verdict: TaskVerdict | None
    times: ScheduleTimes
    planned_h: float | None

    @property
    def level(self) -> int:
        """Return how deep it is indented, from 1."""
        return self.number.count(".") + 1


def schedule_lines(report: ProgressReport) -> tuple[ScheduleLine, ...]:
    """Return summaries and tasks as an outline, in the order in which the schedule has them."""
    return tuple(_lines(list(report.tasks), (), "", report))


def one_line(text: str, limit: int) -> str:
    """Return a name as schedules hold it: one line, no control characters, cut where it is longer than they allow."""
    flat = " ".join(plain(text).split())
    return flat if len(flat) <= limit else flat[: limit - 1] + "…"


def ifc_ids(task: TaskProgress, limit: int) -> str:
    """Return the GlobalId of a task in the IFC; of a schedule's own task those of its elements, all or none.

    Given back with the file they tie the task again, and some of an element's tasks would tie it wrongly.
    """
    if not task.progress.key.startswith(SCHEDULE_KEY):
        return one_line(task.progress.key, limit)
    elements = " ".join(task.progress.elements)
    return elements if len(elements) <= limit else ""


def _lines(
    tasks: list[TaskProgress], above: tuple[str, ...], number: str, report: ProgressReport
) -> Iterator[ScheduleLine]:
    """Yield what is under one summary: its own tasks and further summaries, as they come."""
    depth, position, done = len(above), 0, set[str]()
    for task in tasks:
        name = task.outline[depth] if len(task.outline) > depth else None
        if name is not None and name in done:
            continue
        position += 1
        here = f"{number}.{position}" if number else str(position)
        if name is None:
            yield _task_line(task, here, report)
            continue
        done.add(name)
        below = [one for one in tasks if len(one.outline) > depth and one.outline[depth] == name]
        lines = list(_lines(below, (*above, name), here, report))
        yield _summary_line(name, here, lines)
        yield from lines


def _summary_line(name: str, number: str, lines: list[ScheduleLine]) -> ScheduleLine:
    starts = [line.times.start for line in lines if line.times.start is not None]
    finishes = [line.times.finish for line in lines if line.times.finish is not None]
    times = ScheduleTimes(
        start=min(starts, default=None),
        finish=max(finishes, default=None),
        duration_h=None,
        actual_start=None,
        actual_finish=None,
        done_h=None,
        remaining_h=None,
    )
    return ScheduleLine(number=number, name=name, task=None, verdict=None, times=times, planned_h=None)


def _task_line(task: TaskProgress, number: str, report: ProgressReport) -> ScheduleLine:
    known = verdict(task)
    return ScheduleLine(
        number=number,
        name=task.progress.name or task.progress.key,
        task=task,
        verdict=known,
        times=_times(task, known, report),
        planned_h=planned_hours(task, calendar_of(report)),
    )


def _times(task: TaskProgress, known: TaskVerdict, report: ProgressReport) -> ScheduleTimes:
    """Return the dates as they are now, those of the forecast; durations follow from them, in the project's time."""
    calendar, found, status = calendar_of(report), forecast_of(task, report), status_moment(report.visit_date)
    begun = known.share is not None and (known.share > 0.0 or task.actual_start is not None)
    planned_h = planned_hours(task, calendar)
    if known.share is None or not begun:
        left_h = planned_h if known.share is not None else None
        return ScheduleTimes(
            start=found.start or task.schedule_start,
            finish=found.finish or task.schedule_finish,
            duration_h=planned_h,
            actual_start=None,
            actual_finish=None,
            done_h=None if left_h is None else 0.0,
            remaining_h=left_h,
        )
    ended = found.finish if known.finished else None
    duration = None if found.finish is None or found.start is None else _hours(calendar, found.start, found.finish)
    return ScheduleTimes(
        start=found.start,
        finish=found.finish,
        duration_h=duration,
        actual_start=found.start,
        actual_finish=ended,
        done_h=None if duration is None else known.share * duration,
        remaining_h=0.0 if ended else _left(calendar, status, found.finish),
        elapsed_h=None if found.start is None else _hours(calendar, found.start, ended or status),
    )


def _hours(calendar: WorkCalendar, start: datetime, finish: datetime) -> float:
    return working_hours(calendar, start, finish) if finish > start else 0.0


def _left(calendar: WorkCalendar, status: datetime, finish: datetime | None) -> float | None:
    return None if finish is None else max(0.0, calendar.hours(status, finish))
