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

    start: datetime | None = None
    finish: datetime | None = None  # by what is certain
    earliest: datetime | None = None  # if all that may be built is built


def forecast(task: TaskProgress, day: date, calendar: WorkCalendar) -> Forecast:
    """Return when a task has begun or will begin, and when it was or will be finished.

    What isn't certain yet of it takes its share of the planned working time, from the status date on. What hasn't begun
    begins as planned, or now where that has passed. A finished one was finished on the day that saw it so. At the
    earliest all that may be built is. Links to other tasks aren't followed: a planning program does that.
    """
    known = verdict(task)
    if known.share is None:
        return Forecast()
    if known.finished and task.actual_finish is not None:
        ended = finished_at(task.actual_finish)
        return Forecast(start=begun_at(task.actual_start or task.actual_finish), finish=ended, earliest=ended)
    status, planned_h, upper = status_moment(day), planned_hours(task, calendar), task.progress.completion.upper
    begun = known.share > 0.0 or task.actual_start is not None
    if not begun and (task.schedule_start is None or planned_h is None or task.schedule_start >= status):
        start, finish = task.schedule_start, task.schedule_finish
    elif begun:
        start, finish = begun_at(task.actual_start or day), _after(calendar, status, planned_h, 1.0 - known.share)
    else:
        start, finish = _next_minute(calendar, status), _after(calendar, status, planned_h)
    left_h = planned_h if upper > 0.0 else None
    soonest = finished_at(day) if upper >= 1.0 else _after(calendar, status, left_h, 1.0 - upper)
    return Forecast(start=start, finish=finish, earliest=min(filter(None, (finish, soonest)), default=None))


def forecast_of(task: TaskProgress, report: ProgressReport) -> Forecast:
    """Return the forecast that a result holds; of a result from before there was one, by the project's calendar."""
    found = forecast(task, report.visit_date, calendar_of(report))
    finish, earliest = task.forecast_finish or found.finish, task.forecast_earliest or found.earliest
    return Forecast(start=found.start, finish=finish, earliest=earliest)


def planned_hours(task: TaskProgress, calendar: WorkCalendar) -> float | None:
    """Return the planned working hours; all hours where the plan lies in time that isn't worked."""
    start, finish = task.schedule_start, task.schedule_finish
    return None if start is None or finish is None or finish < start else working_hours(calendar, start, finish)


def working_hours(calendar: WorkCalendar, start: datetime, finish: datetime) -> float:
    """Return the working hours between two moments; all hours where none of them is worked."""
    return calendar.hours(start, finish) or (finish - start).total_seconds() / 3600.0


def _after(calendar: WorkCalendar, start: datetime, hours: float | None, share: float = 1.0) -> datetime | None:
    try:
        return None if hours is None else calendar.after(start, share * hours)
    except ValueError:  # a calendar that ends: no finish is known
        return None


def _next_minute(calendar: WorkCalendar, moment: datetime) -> datetime | None:
    """Return the first working minute from a moment on."""
    found = _after(calendar, moment, 1.0 / 60.0)
    return None if found is None else found - timedelta(minutes=1)
