"""The working time of a schedule file: the calendar of its project, and those that tasks have of their own."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from datetime import date, time
from pathlib import Path

from asbuilt_bim.bim.schedule import DAY_MIN, EVERY_DAY, WorkCalendar, WorkDay, WorkSpan
from asbuilt_bim.errors import ScheduleError
from asbuilt_bim.schedule.rows import moment
from asbuilt_bim.schedule.safe_xml import child, children, text

MAX_EXCEPTIONS = 20_000
"""Fifty years of days, all exceptions of a calendar together; more are a damaged file."""
_DAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
_OFFICE = (WorkSpan(from_min=480, to_min=720), WorkSpan(from_min=780, to_min=1020))  # MS Project's own default


def msp_calendar(root: ET.Element, path: Path, uid: str = "") -> WorkCalendar:
    """Return a calendar of an MS Project document, the project's or that of a UID, with what it is based on.

    Raises:
        ScheduleError: its exceptions cover more days than `MAX_EXCEPTIONS`; `path` is for the message.
    """
    by_uid = {text(one, "UID"): one for one in children(child(root, "Calendars"), "Calendar")}
    own = by_uid.get(uid or text(root, "CalendarUID"))
    if own is None:
        return EVERY_DAY
    week: dict[int, tuple[WorkSpan, ...]] = {n: _OFFICE if n < 5 else () for n in range(7)}
    exceptions: dict[date, tuple[WorkSpan, ...]] = {}
    base = by_uid.get(text(own, "BaseCalendarUID"))
    left = MAX_EXCEPTIONS

    def except_for(element: ET.Element) -> None:
        nonlocal left
        days = _period(element)
        left -= len(days)
        if left < 0:
            raise _too_many(path, own)
        exceptions.update((date.fromordinal(day), tuple(_msp_spans(element))) for day in days)

    for calendar in (base, own) if base is not None and base is not own else (own,):
        for day in children(child(calendar, "WeekDays"), "WeekDay"):
            kind = text(day, "DayType")
            if kind in {"1", "2", "3", "4", "5", "6", "7"}:
                week[(int(kind) + 5) % 7] = tuple(_msp_spans(day))  # 1 is Sunday
            else:
                except_for(day)
        for other in children(child(calendar, "Exceptions"), "Exception"):
            if not _recurs(other):
                except_for(other)
    return _made(text(own, "Name"), week, exceptions)


def msp_recurring(root: ET.Element) -> int:
    """Return how many exceptions of a document's calendars recur: their period isn't all of it, so they don't count."""
    calendars = children(child(root, "Calendars"), "Calendar")
    return sum(_recurs(one) for calendar in calendars for one in children(child(calendar, "Exceptions"), "Exception"))


def own_calendars(root: ET.Element, path: Path) -> tuple[dict[str, WorkCalendar], int, int]:
    """Return the calendars of their own that tasks of an MS Project or P6 document have, by number.

    With them: how many tasks have one, and how many name a calendar that the document lacks.

    Raises:
        ScheduleError: one has more exceptions than `MAX_EXCEPTIONS`; `path` is for the message.
    """
    project = child(root, "Project")
    tasks = [*children(child(root, "Tasks"), "Task"), *children(root, "Activity"), *children(project, "Activity")]
    usual = {"", "-1", text(root, "CalendarUID"), text(project, "ActivityDefaultCalendarObjectId")}
    named = [text(one, "CalendarUID") or text(one, "CalendarObjectId") for one in tasks]
    msp = {text(one, "UID") for one in children(child(root, "Calendars"), "Calendar")}
    p6 = {text(one, "ObjectId") for one in [*children(root, "Calendar"), *children(project, "Calendar")]}
    found = {key: msp_calendar(root, path, key) for key in msp.intersection(named) - usual}
    found |= {key: p6_calendar(root, path, key) for key in p6.intersection(named) - usual}
    return found, sum(key in found for key in named), sum(key not in usual | found.keys() for key in named)


def _recurs(exception: ET.Element) -> bool:
    return text(exception, "Type") not in ("", "0", "1") or text(exception, "Period") not in ("", "0", "1")


def p6_calendar(root: ET.Element, path: Path, object_id: str = "") -> WorkCalendar:
    """Return a calendar of a P6 document: the default one of its first project, or that of an object id.

    Raises:
        ScheduleError: it has more exceptions than `MAX_EXCEPTIONS`; `path` is for the message.
    """
    project = child(root, "Project")
    wanted = object_id or text(project, "ActivityDefaultCalendarObjectId")
    calendars = [*children(root, "Calendar"), *children(project, "Calendar")]
    own = next((one for one in calendars if text(one, "ObjectId") == wanted), None)
    if own is None:
        return EVERY_DAY
    week: dict[int, tuple[WorkSpan, ...]] = dict.fromkeys(range(7), ())
    for day in children(child(own, "StandardWorkWeek"), "StandardWorkHours"):
        if text(day, "DayOfWeek") in _DAYS:
            week[_DAYS.index(text(day, "DayOfWeek"))] = tuple(_p6_spans(day))
    exceptions: dict[date, tuple[WorkSpan, ...]] = {}
    for other in children(child(own, "HolidayOrExceptions"), "HolidayOrException"):
        when = moment(text(other, "Date"), end=False)
        if when is not None:
            exceptions[when.date()] = tuple(_p6_spans(other))
    if len(exceptions) > MAX_EXCEPTIONS:
        raise _too_many(path, own)
    return _made(text(own, "Name"), week, exceptions)


def _too_many(path: Path, calendar: ET.Element) -> ScheduleError:
    return ScheduleError(
        f"{path}: the exceptions of its calendar '{text(calendar, 'Name')[:60]}' cover more than {MAX_EXCEPTIONS:,} "
        "days; take out those that no longer matter, and export it again"
    )


def _made(name: str, week: dict[int, tuple[WorkSpan, ...]], others: dict[date, tuple[WorkSpan, ...]]) -> WorkCalendar:
    """Put a calendar together; one without any working time is of no use, and time passes evenly.

    Of a span over midnight the rest is worked on the day after, so an exception's also on a day that is none itself.
    """
    if not any(week.values()):
        return EVERY_DAY
    week = {n: _within(week[n], week[(n - 1) % 7]) for n in range(7)}
    nights = {day: spans for day, spans in others.items() if _rest(spans) and day < date.max}
    after = {date.fromordinal(day.toordinal() + 1): spans for day, spans in nights.items()}
    others = {
        day: _within(others.get(day, week[day.weekday()]), after.get(day, ())) for day in others.keys() | after.keys()
    }
    return WorkCalendar(
        name=name or "Calendar",
        week=tuple(WorkDay(weekday=n, day=None, spans=week[n]) for n in range(7)),
        exceptions=tuple(WorkDay(weekday=None, day=day, spans=others[day]) for day in sorted(others)),
    )


def _rest(spans: tuple[WorkSpan, ...]) -> tuple[WorkSpan, ...]:
    """Return what of a day's spans lies after midnight, as spans of the day after."""
    return tuple(WorkSpan(from_min=0, to_min=span.to_min - DAY_MIN) for span in spans if span.to_min > DAY_MIN)


def _within(spans: tuple[WorkSpan, ...], before: tuple[WorkSpan, ...]) -> tuple[WorkSpan, ...]:
    """Return a day's spans, cut at midnight, with the rest of the day before; what overlaps is worked once."""
    rest = _rest(before)
    cut = tuple(WorkSpan(from_min=span.from_min, to_min=min(span.to_min, DAY_MIN)) for span in spans)
    joined: list[WorkSpan] = []
    for span in sorted((*rest, *cut), key=lambda one: one.from_min):
        last = joined.pop() if joined and span.from_min < joined[-1].to_min else span
        joined.append(WorkSpan(from_min=last.from_min, to_min=max(span.to_min, last.to_min)))
    return tuple(joined)


def _msp_spans(day: ET.Element) -> Iterator[WorkSpan]:
    if text(day, "DayWorking") != "1":
        return
    for span in children(child(day, "WorkingTimes"), "WorkingTime"):
        yield from _span(text(span, "FromTime"), text(span, "ToTime"), step_min=60)


def _p6_spans(day: ET.Element) -> Iterator[WorkSpan]:
    for span in children(day, "WorkTime"):
        yield from _span(text(span, "Start"), text(span, "Finish"), step_min=30)


def _span(begin: str, end: str, *, step_min: int) -> Iterator[WorkSpan]:
    """Yield a span; one that ends before it begins ends on the day after, beyond `DAY_MIN`.

    P6 names the last minute worked (11:59, 16:29): what ends a minute short of a step (an hour, half of one) ends with
    it. Midnight is the end of the day as well.
    """
    try:
        first, last = time.fromisoformat(begin), time.fromisoformat(end)
    except ValueError:
        return
    from_min, to_min = first.hour * 60 + first.minute, last.hour * 60 + last.minute
    to_min = to_min + 1 if to_min % step_min == step_min - 1 else to_min or DAY_MIN
    if from_min != to_min:
        yield WorkSpan(from_min=from_min, to_min=to_min + (DAY_MIN if to_min < from_min else 0))


def _period(element: ET.Element) -> range:
    """Return the days of an exception as ordinals."""
    period = child(element, "TimePeriod")
    first, last = moment(text(period, "FromDate"), end=False), moment(text(period, "ToDate"), end=True)
    return range(first.toordinal(), last.toordinal() + 1) if first and last else range(0)
