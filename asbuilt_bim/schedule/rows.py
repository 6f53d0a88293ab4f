"""What a schedule file holds, whatever its format: its tasks in order, and its working time."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime

from asbuilt_bim.bim.schedule import ScheduleSource, TaskLink, WorkCalendar, at_time
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted

MAX_ROWS = 200_000
"""The largest schedules of building projects have some ten thousand tasks."""
FIRST_YEAR, LAST_YEAR = 1950, 2200
_GLOBAL_ID = re.compile(r"(?<![0-9A-Za-z_$])[0-3][0-9A-Za-z_$]{21}(?![0-9A-Za-z_$])")

_WORD = re.compile(r"[^\s,;|]+")
_NEARLY = re.compile(r"[0-9A-Za-z_$]{21,23}")  # a sign wrong, too many or missing


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleRow:
    """One task as the file has it: no summary, no blank line."""

    uid: str  # unique in the file; links name it
    name: str
    identification: str
    outline: tuple[str, ...]
    start: datetime | None
    finish: datetime | None
    links: tuple[TaskLink, ...]
    global_ids: tuple[str, ...]  # of IFC tasks or of elements, out of its custom fields
    listed: tuple[str, ...] = ()  # what stands as a GlobalId in fields that list them, mistyped or not
    fault: Note | None = None  # why its dates don't count, where they don't
    calendar: str = ""  # the number of its own calendar


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleFile:
    """A schedule that was read."""

    source: ScheduleSource
    rows: tuple[ScheduleRow, ...]
    notes: tuple[Note, ...]  # what could not be taken over
    calendars: Mapping[str, WorkCalendar] = field(default_factory=dict)  # those of tasks' own, by number


def global_ids(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the IFC GlobalIds that stand in some texts, each once, in their order."""
    return tuple(dict.fromkeys(found for text in texts for found in _GLOBAL_ID.findall(text)))


def listed(texts: Iterable[str]) -> tuple[str, ...]:
    """Return what stands as a GlobalId, mistyped or not, in those texts that list GlobalIds: several, or nothing else.

    Any other text may stand in a custom field.
    """
    found: dict[str, None] = {}
    for text in texts:
        words, sound = _WORD.findall(text), len(_GLOBAL_ID.findall(text))
        like = [word for word in words if _NEARLY.fullmatch(word)]
        if sound > 1 or (sound and len(like) == len(words)):
            found.update(dict.fromkeys(like))
    return tuple(found)


def moment(text: str, *, end: bool) -> datetime | None:
    """Return an ISO date or date and time without zone; a date alone is the beginning or the end of the working day.

    None where there is none, or it lies outside any building project's years.
    """
    try:
        value = datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    value = value.replace(tzinfo=None)
    if not FIRST_YEAR <= value.year <= LAST_YEAR:
        return None
    return at_time(value.date(), end=end) if len(text.strip()) <= len("2026-03-02") else value


def dates(start: str, finish: str, task: str) -> tuple[datetime | None, datetime | None, Note | None]:
    """Return a task's start and finish as they are written, and what is wrong with them; then both are None."""
    subject = about(SubjectKind.TASK, task)
    begin, end = moment(start, end=False), moment(finish, end=True)
    for name, written, found in (("start", start, begin), ("finish", finish, end)):
        if written and found is None:
            values: Values = {"end": name, "written": written[:30], "years": (FIRST_YEAR, LAST_YEAR)}
            return None, None, noted(Reason.SCHEDULE_DATE_UNREADABLE, subject, **values)
    if begin and end and end < begin:
        values = {"start": f"{begin:%Y-%m-%d %H:%M}", "finish": f"{end:%Y-%m-%d %H:%M}"}
        return None, None, noted(Reason.SCHEDULE_FINISH_BEFORE_START, subject, **values)
    return begin, end, None
