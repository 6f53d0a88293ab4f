"""Links a schedule's tasks to the design: to the IFC's tasks, or by GlobalIds straight to elements.

Links are one to one. They go by a GlobalId in a custom field or column, else by identification and name. Else they
go by identification alone (unless it is a mere outline number), and last by name alone.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

from asbuilt_bim.bim.model import BimModel, Task
from asbuilt_bim.bim.schedule import EVERY_DAY, SCHEDULE_KEY, ScheduleSource
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.schedule.rows import ScheduleFile, ScheduleRow

_KeyOf = Callable[[str, str], tuple[str, ...] | None]
"""What a task or row of an identification and a name is matched by; None where it has no such key."""
_OUTLINE_NUMBER = re.compile(r"[\d.\s-]*")
MAX_NAMED = 8


@dataclass(slots=True)
class _Matched:
    """What is matched so far: the row's uid -> the task that it gives dates to."""

    task_of: dict[str, Task] = field(default_factory=dict)
    ambiguous: dict[str, str] = field(default_factory=dict)  # the row's uid -> its name


def with_schedule(design: BimModel, schedule: ScheduleFile) -> BimModel:
    """Return the design with the schedule's dates, outline and links on its tasks, and notes on what has no match.

    A row with elements' GlobalIds becomes a task. A task of the IFC that no row matches keeps its own dates, but for
    elements that such a row dates: of one element only one of both counts.
    """
    matched = _by_global_id(design, schedule.rows)
    for keys in (_both, _identification, _name):
        _match(design.tasks, schedule.rows, matched, keys)
    row_of = {task.global_id: uid for uid, task in matched.task_of.items()}
    key_of = {uid: task.global_id for uid, task in matched.task_of.items()}
    rows = {row.uid: row for row in schedule.rows}
    old = {task.global_id for task in design.tasks}
    kept = [
        _dated(t, rows[row_of[t.global_id]], key_of, schedule) if t.global_id in row_of else t for t in design.tasks
    ]
    made = [_dated(t, rows[uid], key_of, schedule) for uid, t in matched.task_of.items() if t.global_id not in old]
    kept, taken = _by_elements(kept, row_of, [task for task in made if task.schedule_finish is not None])
    ours = {*row_of, *(task.global_id for task in taken)}
    kept = [task if task.global_id in ours else replace(task, calendar=EVERY_DAY) for task in kept]
    notes = [*_notes(schedule, matched), *_unlinked(design.tasks, schedule, matched), *_unknown_ids(design, schedule)]
    subject = about(SubjectKind.SCHEDULE, schedule.source.name)
    if left := [task.name for task in design.tasks if task.global_id not in ours]:
        notes.append(noted(Reason.SCHEDULE_LACKS_TASKS, subject, **_some(left)))
    if taken:
        named = {key for task in made if task.schedule_finish is not None for key in task.elements}
        elements = len(named & {key for task in taken for key in task.elements})
        values: Values = {**_some([task.name for task in taken]), "elements": elements}
        notes.append(noted(Reason.SCHEDULE_DATES_TAKEN, subject, **values))
    source = _with_ids_of_others(schedule, matched, kept)
    return replace(design, tasks=(*kept, *made), notes=(*design.notes, *notes), schedule=source)


def _with_ids_of_others(schedule: ScheduleFile, matched: _Matched, kept: Sequence[Task]) -> ScheduleSource:
    """Return the schedule's source with the ids of activities that are linked to no task, and that a task has, too.

    An export may not give them to that task: an import would take one for the other.
    """
    ours = {_plain(task.identification) for task in kept if task.identification}
    foreign = (row.identification for row in schedule.rows if row.uid not in matched.task_of)
    others = dict.fromkeys(one for one in foreign if _plain(one) in ours)
    return replace(schedule.source, other_ids=tuple(others))


def _by_elements(
    kept: Sequence[Task], row_of: Mapping[str, str], made: Sequence[Task]
) -> tuple[list[Task], list[Task]]:
    """Date the IFC's tasks that no row matches by what the file says of their elements; return all, and those.

    Elements that the file doesn't date keep such a task's own dates in it, and so does what isn't measured here.
    """
    of: dict[str, list[Task]] = {}
    for task in made:
        for key in task.elements:
            of.setdefault(key, []).append(task)
    taken = [task for task in kept if task.global_id not in row_of and any(key in of for key in task.elements)]
    dated = {task.global_id: _spanned(task, of) for task in taken}
    return [dated.get(task.global_id, task) for task in kept], taken


def _spanned(task: Task, of: Mapping[str, Sequence[Task]]) -> Task:
    """Return a task from the first start to the last finish of its elements; none of either where one is missing."""
    plans = [plan for key in task.elements for plan in of.get(key, ())]
    if task.others or any(key not in of for key in task.elements):
        plans.append(task)
    starts = [plan.schedule_start for plan in plans if plan.schedule_start is not None]
    start = min(starts) if len(starts) == len(plans) else None
    last = max(plans, key=lambda plan: plan.schedule_finish or datetime.max)
    return replace(
        task,
        schedule_start=start,
        schedule_finish=last.schedule_finish,
        finish_from=last.finish_from,
        ifc_finish=task.schedule_finish,
    )


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
        finish_from=schedule.source.name if finish is not None and finish == row.finish else "",
    )


def _dates(task: Task, row: ScheduleRow) -> tuple[datetime | None, datetime | None, Note | None]:
    """Return the dates that count, the IFC's where the row has none that can be used, and a note on it."""
    old = task.schedule_start, task.schedule_finish
    if row.fault is not None:
        return (*old, replace(row.fault, values={**row.fault.values, "ifc_dates": any(old)}))
    if row.start is None and row.finish is None:
        return (*old, None)
    start, finish = row.start or old[0], row.finish or old[1]
    if row.start and row.finish:
        return start, finish, None
    given, missing = ("start", "finish") if row.start else ("finish", "start")
    subject = about(SubjectKind.TASK, row.name)
    if start and finish and finish < start:
        values: Values = {"given": given, "missing": missing, "ifc_dates": any(old)}
        return (*old, noted(Reason.SCHEDULE_DATE_CONTRADICTED, subject, **values))
    values = {"missing": missing, "ifc_dates": bool(start and finish)}
    return start, finish, noted(Reason.SCHEDULE_DATE_MISSING, subject, **values)


def _by_global_id(design: BimModel, rows: Sequence[ScheduleRow]) -> _Matched:
    """Match what names a task's or elements' GlobalIds; a task of the IFC goes before elements."""
    matched = _Matched()
    tasks = {task.global_id: task for task in design.tasks}
    elements = {element.global_id for element in design.elements}
    wanted = Counter(key for row in rows for key in row.global_ids if key in tasks)
    for row in rows:
        named = [key for key in row.global_ids if key in tasks]
        makes = tuple(dict.fromkeys(key for key in map(design.today, row.global_ids) if key in elements))
        if len(named) > 1 or any(wanted[key] > 1 for key in named):
            matched.ambiguous[row.uid] = row.name
        elif named:
            matched.task_of[row.uid] = tasks[named[0]]
        elif makes:
            matched.task_of[row.uid] = Task(
                global_id=f"{SCHEDULE_KEY}{row.uid}",
                name=row.name,
                identification=row.identification,
                elements=makes,
                schedule_start=None,
                schedule_finish=None,
            )
    return matched


def _match(
    tasks: Sequence[Task],
    rows: Sequence[ScheduleRow],
    matched: _Matched,
    key_of: _KeyOf,
) -> None:
    """Match rows and tasks that share a key, where one row and one task have it; otherwise name the row."""
    taken = {task.global_id for task in matched.task_of.values()}
    by_key: dict[tuple[str, ...], list[Task]] = {}
    for task in tasks:
        key = key_of(task.identification, task.name)
        if key is not None and task.global_id not in taken:
            by_key.setdefault(key, []).append(task)
    free = [row for row in rows if row.uid not in matched.task_of and row.uid not in matched.ambiguous]
    count = Counter(key_of(row.identification, row.name) for row in free)
    for row in free:
        key = key_of(row.identification, row.name)
        found = by_key.get(key, []) if key is not None else []
        if len(found) == 1 and count[key] == 1:
            matched.task_of[row.uid] = found[0]
        elif found and key_of is _name:
            matched.ambiguous[row.uid] = row.name


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


def _notes(schedule: ScheduleFile, matched: _Matched) -> list[Note]:
    subject, rows = about(SubjectKind.SCHEDULE, schedule.source.name), schedule.rows
    linked = ((matched.task_of[row.uid], row) for row in rows if row.uid in matched.task_of)
    faults = [fault for fault in (_dates(task, row)[2] for task, row in linked) if fault is not None]
    notes = [*schedule.notes, *faults[:MAX_NAMED]]
    if len(faults) > MAX_NAMED:
        notes.append(noted(Reason.SCHEDULE_DATES_MORE, subject, count=len(faults) - MAX_NAMED))
    undated = [row for row in rows if row.uid in matched.task_of and not (row.start or row.finish or row.fault)]
    if undated:
        dated = sum(matched.task_of[row.uid].schedule_finish is not None for row in undated)
        values: Values = {**_some([row.name for row in undated]), "dated": dated}
        notes.append(noted(Reason.SCHEDULE_ROWS_UNDATED, subject, **values))
    return notes


def _unlinked(tasks: Sequence[Task], schedule: ScheduleFile, matched: _Matched) -> Iterator[Note]:
    """Say why rows are tied to nothing: they fit more than once, their task has another row, or none has their name."""
    linked = {task.global_id for task in matched.task_of.values()}
    free = [task for task in tasks if task.global_id not in linked]
    taken = [task for task in tasks if task.global_id in linked]
    numbers = {_plain(task.identification) for task in free} - {""}
    free_ids, taken_ids, taken_names = _keys(free, _identification), _keys(taken, _identification), _keys(taken, _name)
    found: dict[Reason, list[str]] = {}
    for row in schedule.rows:
        key, name = _identification(row.identification, row.name), row.name
        if row.uid in matched.task_of:
            continue
        if row.uid in matched.ambiguous or key in free_ids:
            code = Reason.SCHEDULE_AMBIGUOUS
        elif key in taken_ids or _name("", row.name) in taken_names:
            code = Reason.SCHEDULE_TASK_TAKEN
        elif _plain(row.identification) in numbers:
            code, name = Reason.SCHEDULE_NUMBER_ALONE, row.identification
        else:
            code = Reason.SCHEDULE_NOT_LINKED
        found.setdefault(code, []).append(name)
    sums: Values = {"linked": len(matched.task_of), "of": len(schedule.rows)}
    for code, names in found.items():
        values = {**_some([*dict.fromkeys(names)]), **(sums if code is Reason.SCHEDULE_NOT_LINKED else {})}
        yield noted(code, about(SubjectKind.SCHEDULE, schedule.source.name), **values)


def _unknown_ids(design: BimModel, schedule: ScheduleFile) -> Iterator[Note]:
    """Name what stands in the file's lists of GlobalIds and is none of the design's."""
    known = {task.global_id for task in design.tasks} | {element.global_id for element in design.elements}
    known |= {obstacle.global_id for obstacle in design.obstacles}
    listed = dict.fromkeys(key for row in schedule.rows for key in row.listed)
    if unknown := [key for key in listed if design.today(key) not in known]:
        values: Values = {"elements": tuple(unknown[:MAX_NAMED]), "count": len(unknown)}
        yield noted(Reason.SCHEDULE_IDS_UNKNOWN, about(SubjectKind.SCHEDULE, schedule.source.name), **values)


def _keys(tasks: Sequence[Task], key_of: _KeyOf) -> set[tuple[str, ...]]:
    return {key for task in tasks if (key := key_of(task.identification, task.name)) is not None}


def _some(names: Sequence[str]) -> Values:
    return {"tasks": tuple(name[:60] for name in names[:MAX_NAMED]), "count": len(names)}
