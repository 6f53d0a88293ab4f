"""When a task will be finished: one forecast, which every file holds."""

from dataclasses import dataclass
from datetime import date, datetime, timedelta

from asbuilt_bim.bim.schedule import WorkCalendar
from asbuilt_bim.progress.completion.moments import begun_at, finished_at, status_moment
from asbuilt_bim.progress.completion.planned import calendar_of, verdict
from asbuilt_bim.progress.report import ProgressReport, TaskProgress


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """A task's start and finish as they are now; None: nothing says when."""

    start: datetime | None
    finish: datetime | None


NOTHING = Forecast(start=None, finish=None)
"""Of a task of which nothing is known."""


def forecast(task: TaskProgress, day: date, calendar: WorkCalendar) -> Forecast:
    """Return when a task has begun or will begin, and when it was or will be finished.

    What isn't certain yet of it takes its share of the planned working time, from the status date on. What hasn't begun
    begins as planned, or now where that has passed. A finished one was finished on the day that saw it so. Links to
    other tasks aren't followed: a planning program does that.
    """
    known = verdict(task)
    if known.share is None:
        return NOTHING
    if known.finished and task.actual_finish is not None:
        return Forecast(start=begun_at(task.actual_start or task.actual_finish), finish=finished_at(task.actual_finish))
    status, planned_h = status_moment(day), planned_hours(task, calendar)
    if known.share > 0.0 or task.actual_start is not None:
        left_h = None if planned_h is None else (1.0 - known.share) * planned_h
        finish = None if left_h is None else _after(calendar, status, left_h)
        return Forecast(start=begun_at(task.actual_start or day), finish=finish)
    if task.schedule_start is None or planned_h is None or task.schedule_start >= status:
        return Forecast(start=task.schedule_start, finish=task.schedule_finish)
    return Forecast(start=_next_minute(calendar, status), finish=_after(calendar, status, planned_h))


def forecast_of(task: TaskProgress, report: ProgressReport) -> Forecast:
    """Return the forecast that a result holds; of a result from before there was one, by the project's calendar."""
    found = forecast(task, report.visit_date, calendar_of(report))
    return Forecast(start=found.start, finish=task.forecast_finish) if task.forecast_finish is not None else found


def planned_hours(task: TaskProgress, calendar: WorkCalendar) -> float | None:
    """Return the planned working hours; all hours where the plan lies in time that isn't worked."""
    start, finish = task.schedule_start, task.schedule_finish
    if start is None or finish is None or finish < start:
        return None
    return working_hours(calendar, start, finish)


def working_hours(calendar: WorkCalendar, start: datetime, finish: datetime) -> float:
    """Return the working hours between two moments; all hours where none of them is worked."""
    return calendar.hours(start, finish) or (finish - start).total_seconds() / 3600.0


def _after(calendar: WorkCalendar, start: datetime, hours: float) -> datetime | None:
    try:
        return calendar.after(start, hours)
    except ValueError:  # a calendar that ends: no finish is known
        return None


def _next_minute(calendar: WorkCalendar, moment: datetime) -> datetime | None:
    """Return the first working minute from a moment on."""
    found = _after(calendar, moment, 1.0 / 60.0)
    return None if found is None else found - timedelta(minutes=1)
