"""`schedule.p6.xml`: the tasks with what was measured, as Primavera P6 imports them (APIBusinessObjects).

What is measured is physical percent complete, 0..1 in the file; durations are hours. An unknown activity carries no
percent, no status and no remaining duration (all are optional): an import that updates a project leaves its own as
they are. Elements are in alphabetical order, as P6's own schema (p6apibo.xsd) has them.
"""

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Sequence, Set
from datetime import datetime
from pathlib import Path

from asbuilt_bim.bim.schedule import WorkCalendar, WorkDay
from asbuilt_bim.progress.completion.moments import status_written
from asbuilt_bim.progress.completion.planned import TaskVerdict, calendar_of
from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.schedule.lines import (
    ScheduleLine,
    ScheduleTimes,
    ifc_ids,
    one_line,
    schedule_lines,
)
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.xml_file import XSI, add, add_all, add_nil, write_xml

NAMESPACE = "http://xmlns.oracle.com/Primavera/P6/V18.8/API/BusinessObjects"
"""Later versions of P6 read earlier ones' files, not the other way round."""
FIELDS = ((1, "AsBuilt"), (2, "AsBuilt note"), (3, "IFC GlobalId"))
_LINKS = {"FF": "Finish to Finish", "FS": "Finish to Start", "SF": "Start to Finish", "SS": "Start to Start"}
_DAYS = ("Sunday", "Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday")
_ID, _NAME, _UDF = 40, 120, 255


def write_p6(report: ProgressReport, path: Path) -> None:
    """Write the tasks as Primavera P6 XML.

    Raises:
        OutputError: the file can't be written.
    """
    lines = schedule_lines(report)
    root = ET.Element("APIBusinessObjects", {"xmlns": NAMESPACE, **XSI})
    for key, title in FIELDS:
        add_all(ET.SubElement(root, "UDFType"), DataType="Text", ObjectId=key, SubjectArea="Activity", Title=title)
    _write_calendar(root, calendar_of(report))
    project = ET.SubElement(root, "Project")
    starts = [line.times.start for line in lines if line.times.start]
    add_all(
        project,
        ActivityDefaultCalendarObjectId=1,
        ActivityDefaultPercentCompleteType="Physical",
        DataDate=_moment(status_written(report.visit_date)),
        Id=one_line(report.project_name, _ID) or "PROJECT",
        Name=one_line(report.project_name, 100),
        ObjectId=1,
        PlannedStartDate=_moment(min(starts, default=status_written(report.visit_date))),
        Status="Active",
    )
    objects = {line.number: index for index, line in enumerate(lines, 1)}
    for line in lines:
        if line.task is None:
            _write_wbs(project, line, objects)
    ids = _activity_ids(lines, set(report.schedule.other_ids) if report.schedule else set())
    for line in lines:
        if line.task is not None:
            _write_activity(project, line, line.task, ids[line.number], objects)
    _write_links(project, lines, objects)
    write_xml(root, path)


def _write_wbs(project: ET.Element, line: ScheduleLine, objects: dict[str, int]) -> None:
    element = ET.SubElement(project, "WBS")
    code, key = line.number.rpartition(".")[2], objects[line.number]
    add_all(element, Code=code, Name=one_line(line.name, 100) or line.number, ObjectId=key)
    _add_above(element, "ParentObjectId", line, objects)
    add_all(element, ProjectObjectId=1, SequenceNumber=key, Status="Active")


def _add_above(element: ET.Element, name: str, line: ScheduleLine, objects: dict[str, int]) -> None:
    """Name the summary above a line; where there is none P6 says so, and doesn't leave it out."""
    above = objects.get(line.number.rpartition(".")[0])
    if above is None:
        add_nil(element, name)
    else:
        add(element, name, above)


def _write_activity(
    project: ET.Element, line: ScheduleLine, task: TaskProgress, key: str, objects: dict[str, int]
) -> None:
    known, times = line.verdict, line.times
    if known is None:
        return
    share = None if known.share is None else min(known.share, 1.0 if known.finished else 0.9999)
    percent = None if share is None else f"{int(share * 10_000 + 1e-6) / 10_000:g}"
    element = ET.SubElement(project, "Activity")
    add_all(
        element,
        ActualDuration=_hours(times.elapsed_h),
        ActualFinishDate=_moment(times.actual_finish),
        ActualStartDate=_moment(times.actual_start),
        AtCompletionDuration=_hours(_at_completion(times)),
        CalendarObjectId=1,
        DurationType="Fixed Duration and Units",
        FinishDate=_moment(times.finish),
        Id=key,
        Name=one_line(line.name, _NAME),
        ObjectId=objects[line.number],
        PercentComplete=percent,
        PercentCompleteType="Physical",
        PhysicalPercentComplete=percent,
        PlannedDuration=_hours(line.planned_h),
        PlannedFinishDate=_moment(task.schedule_finish),
        PlannedStartDate=_moment(task.schedule_start),
        ProjectObjectId=1,
        RemainingDuration=_hours(times.remaining_h),
        StartDate=_moment(times.start),
        Status=_status(known, times),
        Type="Task Dependent",
    )
    _add_above(element, "WBSObjectId", line, objects)
    for (field, _), value in zip(FIELDS, (known.knowledge, note_words(known.note), ifc_ids(task, _UDF)), strict=True):
        if value:
            add_all(ET.SubElement(element, "UDF"), TypeObjectId=field, TextValue=one_line(value, _UDF))


def _at_completion(times: ScheduleTimes) -> float | None:
    """Return the hours that have gone by and those that remain; a physical percent says nothing of the first."""
    if times.actual_start is None:
        return times.duration_h
    return None if times.elapsed_h is None or times.remaining_h is None else times.elapsed_h + times.remaining_h


def _status(known: TaskVerdict, times: ScheduleTimes) -> str | None:
    """Return how far an activity is: begun where something was seen built, though none of it may be certain yet."""
    if known.share is None:
        return None
    return "Completed" if known.finished else "In Progress" if times.actual_start is not None else "Not Started"


def _write_links(project: ET.Element, lines: Sequence[ScheduleLine], objects: dict[str, int]) -> None:
    by_key = {line.task.progress.key: objects[line.number] for line in lines if line.task}
    pairs = [(line, link) for line in lines if line.task for link in line.task.links if link.predecessor in by_key]
    for index, (line, link) in enumerate(pairs, 1):
        add_all(
            ET.SubElement(project, "Relationship"),
            Lag=_hours(link.lag_h),
            ObjectId=index,
            PredecessorActivityObjectId=by_key[link.predecessor],
            PredecessorProjectObjectId=1,
            SuccessorActivityObjectId=objects[line.number],
            SuccessorProjectObjectId=1,
            Type=_LINKS[link.kind],
        )


def _activity_ids(lines: Sequence[ScheduleLine], others: Set[str]) -> dict[str, str]:
    """Return outline number -> activity id: the schedule's own where it is one, so that P6 finds its activity again.

    The ids of its `others` are left to these.
    """
    own = {line.number: _own_id(line.task, others) for line in lines if line.task}
    count = Counter(own.values())
    taken = {key for key in own.values() if key and count[key] == 1 and len(key) <= _ID}
    ids, free = {}, 1000
    for number, key in own.items():
        if key not in taken:
            while (key := f"AB{free}") in taken:
                free += 10
            free += 10
        ids[number] = key
    return ids


def _own_id(task: TaskProgress, others: Set[str]) -> str:
    return "" if task.identification in others and not task.schedule_uid else one_line(task.identification, 1000)


def _write_calendar(root: ET.Element, calendar: WorkCalendar) -> None:
    element = ET.SubElement(root, "Calendar")
    day, week = max(day.minutes for day in calendar.week) / 60.0, sum(day.minutes for day in calendar.week) / 60.0
    add_all(
        element,
        HoursPerDay=f"{day:g}",
        HoursPerMonth=f"{week * 4:g}",
        HoursPerWeek=f"{week:g}",
        HoursPerYear=f"{week * 52:g}",
        IsDefault=0,
        IsPersonal=0,
        Name=one_line(calendar.name, 60),
        ObjectId=1,
        Type="Global",
    )
    standard = ET.SubElement(element, "StandardWorkWeek")
    for index, name in enumerate(_DAYS):
        hours = ET.SubElement(standard, "StandardWorkHours")
        add(hours, "DayOfWeek", name)
        _write_times(hours, calendar.week[(index + 6) % 7])
    exceptions = ET.SubElement(element, "HolidayOrExceptions")
    for other in calendar.exceptions:
        exception = ET.SubElement(exceptions, "HolidayOrException")
        add(exception, "Date", f"{other.day}T00:00:00")
        _write_times(exception, other)


def _write_times(parent: ET.Element, day: WorkDay) -> None:
    """Write a day's working times, none on a free day; P6 names the last minute worked."""
    for span in day.spans:
        add_all(ET.SubElement(parent, "WorkTime"), Start=_clock(span.from_min), Finish=_clock(span.to_min - 1))


def _moment(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="seconds")


def _hours(hours: float | None) -> str | None:
    return None if hours is None else f"{round(hours, 2):g}"


def _clock(minute: int) -> str:
    return f"{minute // 60:02}:{minute % 60:02}:00"
