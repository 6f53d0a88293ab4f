"""When a task is planned, and why its dates don't count where they don't."""

from dataclasses import dataclass
from datetime import date, datetime, time
from typing import Any

import ifcopenshell.util.date

from asbuilt_bim.bim.schedule import at_time
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.ifc.read.work_calendar import worked_out_finish


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedDates:
    """A task's planned dates; `fault` says what is wrong with them; the finish may be `worked_out`."""

    start: datetime | None = None
    finish: datetime | None = None
    fault: Note | None = None
    worked_out: bool = False


def planned_dates(task: Any) -> PlannedDates:
    """Return when a task is planned."""
    all_times = task_times(task)
    if len({(moment(times.ScheduleStart), moment(times.ScheduleFinish)) for times in all_times}) > 1:
        return PlannedDates(fault=_fault(Reason.PLANS_DIFFER, task, {"schedules": len(all_times)}))
    if not all_times:
        return PlannedDates()
    times = all_times[0]
    written = times.ScheduleStart, times.ScheduleFinish
    start, finish = (moment(one) for one in written)
    for name, one, found in (("start", written[0], start), ("finish", written[1], finish)):
        if one is not None and found is None:
            values: Values = {"end": name, "written": str(one)[:40]}
            return PlannedDates(fault=_fault(Reason.DATE_UNREADABLE, task, values))
    if finish is not None and finish.time() == time.min:  # a date alone, as most programs write it
        finish = at_time(finish.date(), end=True)
    if start and finish and finish < start:
        days = {"start": start.date().isoformat(), "finish": finish.date().isoformat()}
        return PlannedDates(fault=_fault(Reason.FINISH_BEFORE_START, task, days))
    if start and written[1] is None and getattr(times, "ScheduleDuration", None):
        return _by_duration(task, times, start)
    return PlannedDates(start=start, finish=finish)


def task_times(task: Any) -> tuple[Any, ...]:
    """Return what holds a task's dates: its IfcTaskTime, or in IFC2X3 the IfcScheduleTimeControl of its schedules."""
    if hasattr(task, "TaskTime"):
        return (task.TaskTime,) if task.TaskTime is not None else ()
    controls = (getattr(relation, "TimeForTask", None) for relation in task.HasAssignments or ())
    return tuple({control.id(): control for control in controls if control is not None}.values())


def moment(value: Any) -> datetime | None:
    """Return an IFC date, date and time, or text as a datetime; None where it is none."""
    if value is None:
        return None
    try:
        if getattr(value, "TimeComponent", None) is not None:
            return _date_and_time(value.DateComponent, value.TimeComponent)
        moment = ifcopenshell.util.date.ifc2datetime(value)
    except (ValueError, TypeError, AttributeError):
        return None
    if isinstance(moment, datetime):
        return moment.replace(tzinfo=None)
    return datetime(moment.year, moment.month, moment.day) if isinstance(moment, date) else None


def _by_duration(task: Any, times: Any, start: datetime) -> PlannedDates:
    finish = worked_out_finish(task, times, start)
    if finish is not None:
        return PlannedDates(start=start, finish=finish, worked_out=True)
    lasts = {"duration": str(times.ScheduleDuration)[:40]}
    return PlannedDates(start=start, fault=_fault(Reason.FINISH_UNKNOWN, task, lasts))


def _fault(code: Reason, task: Any, values: Values) -> Note:
    subject = about(SubjectKind.TASK, str(task.GlobalId))
    return noted(code, subject, task=str(task.Name or task.GlobalId), **values)


def _date_and_time(day: Any, clock: Any) -> datetime:
    """Return an IFC2X3 date and time; minute and second may be left out there, and the library fails on that."""
    minute, second = clock.MinuteComponent or 0, int(clock.SecondComponent or 0)
    return datetime(day.YearComponent, day.MonthComponent, day.DayComponent, clock.HourComponent, minute, second)
