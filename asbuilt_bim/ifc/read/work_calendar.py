"""Planned finishes that a file leaves to be worked out: a start, a duration, and the calendar that it is worked by."""

import re
from collections.abc import Iterable
from datetime import date, datetime, timedelta
from typing import Any

import ifcopenshell.util.date

from asbuilt_bim.bim.schedule import DAY_MIN, WorkCalendar, WorkDay, WorkSpan

MAX_OFF_DAYS = 20_000
"""Fifty years of days, all exceptions of a calendar together; more are a damaged file."""
MOST_DAYS = 36_525
"""A hundred years: no task lasts longer."""
_MAX_ABOVE = 50
_DURATION = re.compile(
    r"P(?:0+Y)?(?:0+M)?(?:(?P<W>\d{1,5})W)?(?:(?P<D>\d{1,5})D)?"
    r"(?:T(?:(?P<H>\d{1,6})H)?(?:(?P<M>\d{1,6})M)?(?:(?P<S>\d{1,6})(?:\.\d+)?S)?)?"
)


def worked_out_finish(task: Any, times: Any, start: datetime) -> datetime | None:
    """Return when a task of a start and a duration is finished; None where the file doesn't say so beyond doubt.

    Elapsed time is added as it is. Working time is, where the task's calendar is a plain week with days off: hours
    where it says which hours are worked, days where it doesn't. A day beside such hours may be 24 of them, or a shift,
    and a week of work seven days, or five.
    """
    written = _DURATION.fullmatch(str(getattr(times, "ScheduleDuration", None) or ""))
    if written is None or not hasattr(times, "DurationType"):  # IFC2X3: seconds of either
        return None
    amounts = {unit: int(number or 0) for unit, number in written.groupdict().items()}
    days = 7 * amounts["W"] + amounts["D"]
    if days > MOST_DAYS:
        return None
    rest = timedelta(hours=amounts["H"], minutes=amounts["M"], seconds=amounts["S"])
    if not days and not rest:  # a milestone
        return start
    try:
        if times.DurationType == "ELAPSEDTIME":
            return start + timedelta(days=days) + rest
        calendar = _calendar_of(task) if times.DurationType == "WORKTIME" else None
        if calendar is None or amounts["W"] or bool(days) == bool(rest):
            return None
        by_the_hour = any(0 < day.minutes < DAY_MIN for day in calendar.week)
        if by_the_hour != bool(rest):
            return None
        return calendar.after(start, 24.0 * days + rest / timedelta(hours=1))
    except (ValueError, OverflowError):  # a calendar without work, a year beyond 9999
        return None


def _calendar_of(task: Any) -> WorkCalendar | None:
    """Return a task's own calendar, else its work schedule's, else that of a summary above it; None where unclear."""
    for _ in range(_MAX_ABOVE):
        own = list(_controls(task, "IfcWorkCalendar"))
        of_schedule = [one for plan in _controls(task, "IfcWorkSchedule") for one in _controls(plan, "IfcWorkCalendar")]
        for found in (own, of_schedule):
            if found:
                return _week(found[0]) if len({one.id() for one in found}) == 1 else None
        above = next((relation.RelatingObject for relation in task.Nests or () if relation.is_a("IfcRelNests")), None)
        if above is None or not above.is_a("IfcTask"):
            return None
        task = above
    return None


def _controls(thing: Any, ifc_class: str) -> Iterable[Any]:
    for relation in thing.HasAssignments or ():
        control = getattr(relation, "RelatingControl", None)
        if control is not None and control.is_a(ifc_class):
            yield control


def _week(calendar: Any) -> WorkCalendar | None:
    """Return a calendar that is a plain week with days off; None for any other."""
    worked: dict[int, list[WorkSpan]] = {}
    for time in calendar.WorkingTimes or ():
        pattern = time.RecurrencePattern
        bounded = time[4] is not None or time[5] is not None
        if pattern is None or bounded or pattern.RecurrenceType != "WEEKLY" or not pattern.WeekdayComponent:
            return None
        if (pattern.Interval or 1) != 1 or pattern.Occurrences:
            return None
        spans = [_span(period) for period in pattern.TimePeriods or ()] or [WorkSpan(from_min=0, to_min=DAY_MIN)]
        for number in pattern.WeekdayComponent:
            if not 1 <= number <= 7 or number - 1 in worked or None in spans:
                return None
            worked[number - 1] = [span for span in spans if span is not None]
    off = _days_off(calendar.ExceptionTimes or ())
    if not worked or off is None:
        return None
    week = tuple(WorkDay(weekday=n, day=None, spans=tuple(worked.get(n, ()))) for n in range(7))
    return WorkCalendar(
        name=calendar.Name or "",
        week=week,
        exceptions=tuple(WorkDay(weekday=None, day=d, spans=()) for d in sorted(off)),
    )


def _span(period: Any) -> WorkSpan | None:
    """Return a piece of a day; None where it isn't one."""
    try:
        start, end = (ifcopenshell.util.date.ifc2datetime(text) for text in (period.StartTime, period.EndTime))
        first, last = (60 * one.hour + one.minute for one in (start, end))
    except (ValueError, TypeError, AttributeError):
        return None
    return WorkSpan(from_min=first, to_min=last) if first < last else None


def _days_off(times: Iterable[Any]) -> set[date] | None:
    """Return the days that exceptions take off; None where one recurs or has no dates, or they are too many."""
    off: set[date] = set()
    for time in times:
        try:
            first, last = (date.fromisoformat(str(text)[:10]) for text in (time[4], time[5]))
        except ValueError:
            return None
        if time.RecurrencePattern is not None or (last - first).days + len(off) > MAX_OFF_DAYS:
            return None
        off |= {first + timedelta(days=n) for n in range((last - first).days + 1)}
    return off
