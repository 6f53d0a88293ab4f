"""Ties a schedule's tasks to the design: to the IFC's tasks, or by GlobalIds straight to elements.

In this order, and only where it is one to one: a GlobalId in a custom field or column; identification and name;
identification alone, unless it is a mere outline number; name alone.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

from asbuilt_bim.bim.model import BimModel, Task
from asbuilt_bim.bim.schedule import SCHEDULE_KEY
from asbuilt_bim.schedule.rows import ScheduleFile, ScheduleRow

_OUTLINE_NUMBER = re.compile(r"[\d.\s-]*")
MAX_NAMED = 8


@dataclass(slots=True)
class _Ties:
    """What is tied so far: the row's uid -> the task that it gives dates to."""

    tied: dict[str, Task] = field(default_factory=dict)
    ambiguous: dict[str, str] = field(default_factory=dict)  # the row's uid -> its name


def with_schedule(design: BimModel, schedule: ScheduleFile) -> BimModel:
    """Return the design with the schedule's dates, outline and links on its tasks, and notes on what could not be tied.

    A task of the IFC that no row is tied to keeps its own dates; a row with elements' GlobalIds becomes a task.
    """
    ties = _by_global_id(design, schedule.rows)
    for keys in (_both, _identification, _name):
        _tie(design.tasks, schedule.rows, ties, keys)
    tied_tasks = {task.global_id: uid for uid, task in ties.tied.items()}
    key_of = {uid: task.global_id for uid, task in ties.tied.items()}
    rows = {row.uid: row for row in schedule.rows}
    old = {task.global_id for task in design.tasks}
    kept = [
        _dated(t, rows[tied_tasks[t.global_id]], key_of, schedule) if t.global_id in tied_tasks else t
        for t in design.tasks
    ]
    made = [_dated(t, rows[uid], key_of, schedule) for uid, t in ties.tied.items() if t.global_id not in old]
    notes = _notes(schedule, ties, [task for task in design.tasks if task.global_id not in tied_tasks])
    return replace(design, tasks=(*kept, *made), notes=(*design.notes, *notes), schedule=schedule.source)


def _dated(task: Task, row: ScheduleRow, key_of: dict[str, str], schedule: ScheduleFile) -> Task:
    links = tuple(
        replace(link, predecessor=key_of[link.predecessor]) for link in row.links if link.predecessor in key_of
    )
    start, finish, _ = _dates(task, row)
    return replace(
        task,
        schedule_start=start,
        schedule_finish=finish,
        identification=row.identification or task.identification,
        outline=row.outline or task.outline,
        links=links or task.links,
        schedule_uid=row.uid,
        calendar=schedule.calendars.get(row.calendar),
    )


def _dates(task: Task, row: ScheduleRow) -> tuple[datetime | None, datetime | None, str]:
    """Return the dates that count, the IFC's where the row has none that can be used, and what is to be said of it."""
    old = task.schedule_start, task.schedule_finish
    if row.fault or (row.start is None and row.finish is None):
        return (*old, row.fault and f"{row.fault}; {_stands(old)}")
    start, finish = row.start or old[0], row.finish or old[1]
    if row.start and row.finish:
        return start, finish, ""
    given, missing = ("start", "finish") if row.start else ("finish", "start")
    if start and finish and finish < start:
        return (*old, f"it has a {given} alone, which the IFC's {missing} contradicts; {_stands(old)}")
    there = f"the IFC's {missing} stands" if start and finish else f"nor has the IFC: give the {missing}"
    return start, finish, f"it has no {missing}, {there}"


def _stands(old: tuple[datetime | None, datetime | None]) -> str:
    return "the IFC's dates stand" if any(old) else "the IFC has no dates either: correct the schedule"


def _by_global_id(design: BimModel, rows: Sequence[ScheduleRow]) -> _Ties:
    """Tie what names a task's or elements' GlobalIds; a task of the IFC goes before elements."""
    ties = _Ties()
    tasks = {task.global_id: task for task in design.tasks}
    elements = {element.global_id for element in design.elements}
    wanted = Counter(key for row in rows for key in row.global_ids if key in tasks)
    for row in rows:
        named = [key for key in row.global_ids if key in tasks]
        makes = tuple(key for key in row.global_ids if key in elements)
        if len(named) > 1 or any(wanted[key] > 1 for key in named):
            ties.ambiguous[row.uid] = row.name
        elif named:
            ties.tied[row.uid] = tasks[named[0]]
        elif makes:
            ties.tied[row.uid] = Task(
                global_id=f"{SCHEDULE_KEY}{row.uid}",
                name=row.name,
                identification=row.identification,
                elements=makes,
                schedule_start=None,
                schedule_finish=None,
            )
    return ties


def _tie(
    tasks: Sequence[Task],
    rows: Sequence[ScheduleRow],
    ties: _Ties,
    key_of: Callable[[str, str], tuple[str, ...] | None],
) -> None:
    """Tie rows and tasks that share a key, where one row and one task have it; otherwise name the row."""
    taken = {task.global_id for task in ties.tied.values()}
    by_key: dict[tuple[str, ...], list[Task]] = {}
    for task in tasks:
        key = key_of(task.identification, task.name)
        if key is not None and task.global_id not in taken:
            by_key.setdefault(key, []).append(task)
    free = [row for row in rows if row.uid not in ties.tied and row.uid not in ties.ambiguous]
    count = Counter(key_of(row.identification, row.name) for row in free)
    for row in free:
        key = key_of(row.identification, row.name)
        found = by_key.get(key, []) if key is not None else []
        if len(found) == 1 and count[key] == 1:
            ties.tied[row.uid] = found[0]
        elif found and key_of is _name:
            ties.ambiguous[row.uid] = row.name


def _both(identification: str, name: str) -> tuple[str, ...] | None:
    one, other = _plain(identification), _plain(name)
    return (one, other) if one and other else None


def _identification(identification: str, name: str) -> tuple[str, ...] | None:
    plain = _plain(identification)
    return None if _OUTLINE_NUMBER.fullmatch(plain) else (plain,)


def _name(identification: str, name: str) -> tuple[str, ...] | None:
    plain = _plain(name)
    return (plain,) if plain else None


def _plain(text: str) -> str:
    return " ".join(text.split()).casefold()


def _notes(schedule: ScheduleFile, ties: _Ties, left: Sequence[Task]) -> list[str]:
    start, rows = f"Schedule {schedule.source.name}", schedule.rows
    notes = [f"{start}: {note}." for note in schedule.notes]
    said = [(row.name, _dates(ties.tied[row.uid], row)[2]) for row in rows if row.uid in ties.tied]
    if faults := [f"'{name[:60]}': {fault}" for name, fault in said if fault]:
        more = f" and {len(faults) - MAX_NAMED} more" if len(faults) > MAX_NAMED else ""
        notes.append(f"{start}: dates that can't be taken as they are: {'; '.join(faults[:MAX_NAMED])}{more}.")
    if ties.ambiguous:
        notes.append(
            f"{start}: not tied, because more than one task of the file or of the IFC fits: "
            f"{_some([*dict.fromkeys(ties.ambiguous.values())])}. Give them GlobalIds or identifications of their own."
        )
    untied = [row.name for row in rows if row.uid not in ties.tied and row.uid not in ties.ambiguous]
    if untied:
        notes.append(
            f"{start}: {len(ties.tied)} of its {len(rows)} tasks are tied to walls or columns; no task of the IFC that "
            f"makes any has the GlobalId, identification or name of {_some(untied)}."
        )
    if left:
        names = _some([task.name for task in left])
        notes.append(f"{start} has no task for these of the IFC, which keep their own dates: {names}.")
    return notes


def _some(names: Sequence[str]) -> str:
    quoted = [f"'{name[:60]}'" for name in names[:MAX_NAMED]]
    more = len(names) - len(quoted)
    return ", ".join(quoted) + (f" and {more} more" if more else "")
