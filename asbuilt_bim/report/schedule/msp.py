"""`schedule.msp.xml`: the tasks with what was measured, as MS Project reads them.

What is measured is physical: it is written as PhysicalPercentComplete, with that as the earned value method. It is
PercentComplete too, the column that people look at; actual and remaining duration follow from it. Unknown
tasks get none of these elements. Reference: Microsoft, Project XML Data Interchange Schema (mspdi_pj12.xsd), whose
elements are a sequence: their order counts.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from datetime import datetime, timedelta
from pathlib import Path

from asbuilt_bim.bim.schedule import DAY_MIN, WorkCalendar, WorkDay
from asbuilt_bim.progress.completion.moments import status_written
from asbuilt_bim.progress.completion.planned import calendar_of
from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.schedule.lines import ScheduleLine, ScheduleTimes, ifc_ids, one_line, schedule_lines
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.xml_file import add, add_all, write_xml

NAMESPACE = "http://schemas.microsoft.com/project"
KNOWLEDGE = ("188744015", "Text29", "AsBuilt")
GLOBAL_ID = ("188744016", "Text30", "IFC GlobalId")
"""Custom fields (id, name, alias): the last two of thirty, which plans seldom use."""
_LINKS = {"FF": 0, "FS": 1, "SF": 2, "SS": 3}
_NAME, _PHYSICAL, _NOT_BEFORE, _DAYS, _HOURS = 255, 1, 4, 7, 5


def write_msp(report: ProgressReport, path: Path) -> None:
    """Write the tasks as MS Project XML.

    Raises:
        OutputError: the file can't be written.
    """
    lines = schedule_lines(report)
    uids = _uids(lines, report.schedule.last_uid if report.schedule else 0)
    by_key = {line.task.progress.key: uids[line.number] for line in lines if line.task}
    root = _project(report, lines)
    tasks = ET.SubElement(root, "Tasks")
    for row, line in enumerate(lines, 1):
        element = ET.SubElement(tasks, "Task")
        add_all(element, UID=uids[line.number], ID=row, Name=one_line(line.name, _NAME), Active=1, Manual=0, Type=1)
        add_all(element, IsNull=0, WBS=_wbs(line), OutlineNumber=line.number, OutlineLevel=line.level)
        if line.task is None:
            add_all(element, Start=_moment(line.times.start), Finish=_moment(line.times.finish), Summary=1)
        else:
            _write_task(element, line, line.task, by_key)
    ET.SubElement(root, "Resources")
    ET.SubElement(root, "Assignments")
    write_xml(root, path)


def _write_task(element: ET.Element, line: ScheduleLine, task: TaskProgress, by_key: dict[str, int]) -> None:
    """Write a task's own elements, in the schema's order."""
    times, known = line.times, line.verdict
    if known is None:
        return
    percent = None if known.share is None else whole_percent(known.share)
    not_before = _moment(times.start) if times.actual_start is None else None
    add_all(
        element,
        Start=_moment(times.start),
        Finish=_moment(times.finish),
        Duration=_duration(times.duration_h),
        DurationFormat=_DAYS if times.duration_h is not None else None,
        Estimated=0,
        Milestone=int(line.planned_h == 0.0),
        Summary=0,
        PercentComplete=percent,
        ActualStart=_moment(times.actual_start),
        ActualFinish=_moment(times.actual_finish),
        ActualDuration=_duration(times.done_h),
        RemainingDuration=_duration(_rest(times)),
        ConstraintType=_NOT_BEFORE if not_before else None,  # else it would move to the project's beginning
        CalendarUID=-1,
        ConstraintDate=not_before,
        Notes=f"{note_words(known.note)} ({known.knowledge}; asbuilt-bim)",
        PhysicalPercentComplete=percent,
        EarnedValueMethod=_PHYSICAL,
    )
    for link in task.links:
        if link.predecessor in by_key:
            other = ET.SubElement(element, "PredecessorLink")
            tenths = round(link.lag_h * 600)
            add_all(other, PredecessorUID=by_key[link.predecessor], Type=_LINKS[link.kind], CrossProject=0)
            add_all(other, LinkLag=tenths, LagFormat=_HOURS)
    for (field, _, _), value in ((KNOWLEDGE, known.knowledge), (GLOBAL_ID, ifc_ids(task, _NAME))):
        if value:
            add_all(ET.SubElement(element, "ExtendedAttribute"), FieldID=field, Value=value)
    if task.schedule_start and task.schedule_finish:
        plan = ET.SubElement(element, "Baseline")
        add_all(plan, Number=0, Start=_moment(task.schedule_start), Finish=_moment(task.schedule_finish))
        add_all(plan, Duration=_duration(line.planned_h), DurationFormat=_DAYS)


def _rest(times: ScheduleTimes) -> float | None:
    """Return what isn't done of the duration: MS Project's remaining duration, whatever time has gone by."""
    return None if times.duration_h is None or times.done_h is None else times.duration_h - times.done_h


def whole_percent(share: float) -> int:
    """Return whole percents, rounded down: only what is complete is 100, and nothing is paid for that isn't there."""
    return math.floor(share * 100.0 + 1e-6)


def _project(report: ProgressReport, lines: Iterable[ScheduleLine]) -> ET.Element:
    """Return the document with all that stands before its tasks."""
    calendar = calendar_of(report)
    starts = [line.times.start for line in lines if line.times.start]
    finishes = [line.times.finish for line in lines if line.times.finish]
    name = one_line(report.project_name, _NAME)
    per_day = max(day.minutes for day in calendar.week)
    root = ET.Element("Project", {"xmlns": NAMESPACE})
    add_all(
        root,
        SaveVersion=14,
        Name=name,
        Title=name,
        ScheduleFromStart=1,
        StartDate=_moment(min(starts, default=status_written(report.visit_date))),
        FinishDate=_moment(max(finishes, default=None)) if finishes else None,
        CalendarUID=1,
        DefaultStartTime="08:00:00",
        DefaultFinishTime="17:00:00",
        MinutesPerDay=per_day,
        MinutesPerWeek=sum(day.minutes for day in calendar.week),
        DaysPerMonth=20 if per_day < DAY_MIN else 30,
        DurationFormat=_DAYS,
        StatusDate=_moment(status_written(report.visit_date)),
        NewTasksAreManual=0,
        DefaultTaskEVMethod=_PHYSICAL,
    )
    attributes = ET.SubElement(root, "ExtendedAttributes")
    for field, field_name, alias in (KNOWLEDGE, GLOBAL_ID):
        add_all(ET.SubElement(attributes, "ExtendedAttribute"), FieldID=field, FieldName=field_name, Alias=alias)
    _write_calendar(ET.SubElement(root, "Calendars"), calendar)
    return root


def _write_calendar(parent: ET.Element, calendar: WorkCalendar) -> None:
    element = ET.SubElement(parent, "Calendar")
    add_all(element, UID=1, Name=one_line(calendar.name, 51), IsBaseCalendar=1, BaseCalendarUID=-1)
    week = ET.SubElement(element, "WeekDays")
    for day_type in range(1, 8):  # 1 is Sunday
        day = ET.SubElement(week, "WeekDay")
        add(day, "DayType", day_type)
        _write_times(day, calendar.week[(day_type + 5) % 7])
    if calendar.exceptions:
        exceptions = ET.SubElement(element, "Exceptions")
        for other in calendar.exceptions:
            exception = ET.SubElement(exceptions, "Exception")
            add(exception, "EnteredByOccurrences", 0)
            period = ET.SubElement(exception, "TimePeriod")
            add_all(period, FromDate=f"{other.day}T00:00:00", ToDate=f"{other.day}T23:59:00")
            add_all(exception, Occurrences=1, Type=1)
            _write_times(exception, other)


def _write_times(parent: ET.Element, day: WorkDay) -> None:
    add(parent, "DayWorking", int(bool(day.spans)))
    if day.spans:
        times = ET.SubElement(parent, "WorkingTimes")
        for span in day.spans:
            one = ET.SubElement(times, "WorkingTime")
            add_all(one, FromTime=_clock(span.from_min), ToTime=_clock(span.to_min % DAY_MIN))


def _uids(lines: Iterable[ScheduleLine], last: int) -> dict[str, int]:
    """Return outline number -> UID: those of the MS Project file that the plan came from, free ones for the others.

    Free are those over the file's `last` one: an import would give what stands here to that task.
    """
    lines = list(lines)
    known = {ln.number: int(ln.task.schedule_uid) for ln in lines if ln.task and ln.task.schedule_uid.isdecimal()}
    free = max(last, *known.values()) if known else last
    if len(set(known.values())) < len(known) or free > 2**31 - len(lines) - 1:
        known, free = {}, 0
    for line in lines:
        if line.number not in known:
            free += 1
            known[line.number] = free
    return known


def _wbs(line: ScheduleLine) -> str:
    own = line.task.identification if line.task else ""
    return one_line(own, _NAME) or line.number


def _moment(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="seconds")


def _duration(hours: float | None) -> str | None:
    if hours is None:
        return None
    minutes = round(timedelta(hours=hours).total_seconds() / 60.0)
    return f"PT{minutes // 60}H{minutes % 60}M0S"


def _clock(minute: int) -> str:
    return f"{minute // 60:02}:{minute % 60:02}:00"
