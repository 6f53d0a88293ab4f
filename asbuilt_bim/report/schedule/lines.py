"""The lines of an exported schedule, worked out once: MS Project and P6 only write them in their own words."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, time

from asbuilt_bim.bim.schedule import SCHEDULE_KEY, WorkCalendar
from asbuilt_bim.progress.completion.planned import TaskVerdict, calendar_of, verdict
from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.wording.values import plain

MORNING, EVENING = time(8), time(17)
"""A visit's day as a schedule writes it: what was seen begun or complete on it, and the status date."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleTimes:
    """A task's dates and working hours as they are now; None is not written."""

    start: datetime | None  # the actual one, once begun
    finish: datetime | None  # start and duration, once begun; the actual one, once finished
    duration_h: float | None
    actual_start: datetime | None
    actual_finish: datetime | None
    done_h: float | None  # share of the duration
    remaining_h: float | None
    elapsed_h: float | None = None  # from the actual start to the actual finish or the status date
    forecast: datetime | None = None  # the actual finish, or the status date and what remains


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


def planned_hours(task: TaskProgress, calendar: WorkCalendar) -> float | None:
    """Return the planned working hours; all hours where the plan lies in time that isn't worked."""
    start, finish = task.schedule_start, task.schedule_finish
    if start is None or finish is None or finish < start:
        return None
    return _hours(calendar, start, finish)


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


def status_moment(report: ProgressReport) -> datetime:
    """Return the status date: the evening of the visit's day."""
    return datetime.combine(report.visit_date, EVENING)


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
    calendar, known = calendar_of(report), verdict(task)
    planned = planned_hours(task, calendar)
    return ScheduleLine(
        number=number,
        name=task.progress.name or task.progress.key,
        task=task,
        verdict=known,
        times=_times(task, known, planned, calendar, status_moment(report)),
        planned_h=planned,
    )


def _times(
    task: TaskProgress, known: TaskVerdict, planned_h: float | None, calendar: WorkCalendar, status: datetime
) -> ScheduleTimes:
    """Return the dates as they are now. A task that has begun starts when it was first seen, and keeps its duration."""
    share = known.share
    if share is None or (share <= 0.0 and task.actual_start is None):  # nothing is known, or nothing is there
        left_h = planned_h if share is not None else None
        return ScheduleTimes(
            start=task.schedule_start,
            finish=task.schedule_finish,
            duration_h=planned_h,
            actual_start=None,
            actual_finish=None,
            done_h=None if left_h is None else 0.0,
            remaining_h=left_h,
            forecast=task.schedule_finish,
        )
    begun = datetime.combine(task.actual_start or status.date(), MORNING)
    ended = datetime.combine(task.actual_finish, EVENING) if known.finished and task.actual_finish else None
    elapsed = _hours(calendar, begun, ended or status)
    duration = elapsed if ended else planned_h
    remaining = None if duration is None else (1.0 - share) * duration
    return ScheduleTimes(
        start=begun,
        finish=ended or (None if duration is None else _after(calendar, begun, duration)),
        duration_h=duration,
        actual_start=begun,
        actual_finish=ended,
        done_h=None if duration is None else share * duration,
        remaining_h=remaining,
        elapsed_h=elapsed,
        forecast=ended or (None if remaining is None else _after(calendar, status, remaining)),
    )


def _hours(calendar: WorkCalendar, start: datetime, finish: datetime) -> float:
    """Return the working hours between two moments; all hours where none of them is worked."""
    return calendar.hours(start, finish) or (finish - start).total_seconds() / 3600.0


def _after(calendar: WorkCalendar, start: datetime, hours: float) -> datetime | None:
    try:
        return calendar.after(start, hours)
    except ValueError:  # a calendar that ends: no finish is known
        return None
