"""Planned against actual: what the plan wanted by the status date, how late a task is, which elements are late."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Literal

from asbuilt_bim.bim.model import Task
from asbuilt_bim.bim.schedule import EVERY_DAY, SCHEDULE_KEY, WorkCalendar
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.progress.completion.element import is_unfinished
from asbuilt_bim.progress.completion.moments import days_past, status_moment
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport, TaskProgress

Knowledge = Literal["measured", "part measured", "measured 0", "unknown"]
"""What is known of a task: all its elements, some of them, that nothing of it stands, or nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskVerdict:
    """What a schedule gets for a task: `share` is None where it gets nothing."""

    knowledge: Knowledge
    share: float | None  # 0..1
    finished: bool  # all its elements are complete, and as much of each is certain
    note: Note


@dataclass(frozen=True, slots=True, kw_only=True)
class LateElement:
    """An element that should stand, by every task that makes it, and was seen not to, or seen too little to say."""

    element: ElementProgress
    task: str  # the one with the latest planned finish
    due: date
    late_days: int  # since it was due


def verdict(task: TaskProgress) -> TaskVerdict:
    """Return what a schedule gets for a task: the lower bound, for every task; the IFC copy gets the same.

    A best estimate beside a lower bound in one column would be read as the same thing. A finished task is whole.
    An unknown task gets nothing: what the schedule holds of it stays as it is.
    """
    progress, done = task.progress, task.progress.completion
    if done.best is None and not (task.others and done.coverage > 0.0):
        begun = {"begun": task.actual_start.isoformat() if task.actual_start else ""}
        note = _note(Reason.TASK_UNKNOWN, task, begun)
        return TaskVerdict(knowledge="unknown", share=None, finished=False, note=note)
    if task.actual_finish is not None and done.best is not None:
        seen = {"elements": len(progress.elements), "best": done.best, "lower": done.lower}
        note = _note(Reason.TASK_COMPLETE, task, seen)
        return TaskVerdict(knowledge="measured", share=1.0, finished=True, note=note)
    if done.best is not None and done.best <= 0.0 and not progress.unknown:
        note = _note(Reason.TASK_NOTHING_BUILT, task, {})
        return TaskVerdict(knowledge="measured 0", share=0.0, finished=False, note=note)
    bounds = {"lower": done.lower, "upper": done.upper}
    if done.best is not None and not progress.unknown:
        estimate: Values = {"best": done.best} if done.enough_seen else {}
        note = _note(Reason.TASK_MEASURED, task, {**bounds, **estimate})
        return TaskVerdict(knowledge="measured", share=done.lower, finished=False, note=note)
    counts = {"unknown": progress.unknown, "others": task.others, "of": len(progress.elements) + task.others}
    note = _note(Reason.TASK_PART_MEASURED, task, {**bounds, **counts})
    return TaskVerdict(knowledge="part measured", share=done.lower, finished=False, note=note)


def _note(code: Reason, task: TaskProgress, values: Values) -> Note:
    return noted(code, about(SubjectKind.TASK, task.progress.key), **values)


def planned_share(
    start: datetime | None, finish: datetime | None, day: date, calendar: WorkCalendar = EVERY_DAY
) -> float | None:
    """Return the share (0..1) that the plan wants done by the end of a day: working time gone by of all working time.

    None where the plan has no start or no finish, or they are the wrong way round.
    """
    if start is None or finish is None or finish < start:
        return None
    status = status_moment(day)
    if status >= finish:
        return 1.0
    if status <= start:
        return 0.0
    whole = calendar.hours(start, finish)
    return min(1.0, calendar.hours(start, status) / whole) if whole > 0.0 else 0.0


def days_behind(
    task: TaskProgress,
    completion: Completion,
    day: date,
    calendar: WorkCalendar = EVERY_DAY,
    unfinished_on: date | None = None,
) -> tuple[int | None, int | None, int | None]:
    """Return how many whole days a task is behind its plan: by the best estimate, at least and at most.

    A task in progress is as late as the day is after the moment at which the plan wanted what is there now. At least:
    all that wasn't seen is built. At most: none of it is. It finished by the day that saw it so, and not before the
    last day that saw something of it unfinished (`unfinished_on`). Negative is ahead. The first is None where the
    completion is unknown, or the finish has passed and nothing was seen unfinished; all are where there is no plan.
    """
    start, finish = task.schedule_start, task.schedule_finish
    if finish is None or (start is not None and finish < start):
        return None, None, None
    seen = max(0, (unfinished_on - finish.date()).days if unfinished_on else 0)
    if task.actual_finish is not None:
        late = (task.actual_finish - finish.date()).days
        return late, min(seen, late), late
    passed = days_past(finish, day)
    most = passed if start is None else _behind(start, finish, completion.lower, day, calendar)
    if task.late is None and passed:
        return None, seen, most
    if start is None:  # only whether the finish has passed is known
        return (None if completion.best is None else passed), (passed if completion.upper < 1.0 else seen), most
    best = None if completion.best is None else _behind(start, finish, completion.best, day, calendar)
    least = _behind(start, finish, completion.upper, day, calendar)
    least = min(least, 0) if completion.upper >= 1.0 else least  # it may have been finished in time
    return best, max(seen, least) if seen else least, most


def late_elements(report: ProgressReport) -> tuple[LateElement, ...]:
    """Return the elements sure not to be complete after the latest planned finish of their tasks, longest due first."""
    return tuple(one for one in _overdue(report) if _is_late(one.element, report))


def due_but_unknown(report: ProgressReport) -> tuple[LateElement, ...]:
    """Return the elements that should stand and were seen too little to say whether they do.

    They are unknown, complete as far as seen, or in part with bounds that reach up to complete.
    """
    unclear = ("unknown", "complete as far as seen", "part", "not started")
    found = (one for one in _overdue(report) if not _is_late(one.element, report))
    return tuple(one for one in found if one.element.shown_state in unclear)


def late_alone(report: ProgressReport) -> tuple[TaskProgress, ...]:
    """Return the late tasks none of whose elements is late: those that are unfinished have until a later task."""
    unfinished = {element.global_id for element in report.elements if _is_late(element, report)}
    over = {one.element.global_id for one in _overdue(report)}
    open_of = ((task, unfinished & set(task.progress.elements)) for task in report.tasks if task.late)
    return tuple(task for task, keys in open_of if keys and not keys & over)


def _is_late(element: ElementProgress, report: ProgressReport) -> bool:
    return is_unfinished(element.state, element.completion, report.complete_from)


def _overdue(report: ProgressReport) -> Sequence[LateElement]:
    """Return every element whose tasks should be finished, whatever its state, the longest due first."""
    found = []
    due, known = _due(report.tasks), {element.global_id: element for element in report.elements}
    for key in due.keys() & known.keys():
        finish, task = due[key]
        if days := days_past(finish, report.visit_date):
            found.append(LateElement(element=known[key], task=task, due=finish.date(), late_days=days))
    return sorted(found, key=lambda one: (-one.late_days, one.element.name, one.element.global_id))


def calendar_of(report: ProgressReport) -> WorkCalendar:
    """Return the working time that planned shares are counted in."""
    return report.schedule.calendar if report.schedule else EVERY_DAY


def due_by(tasks: Iterable[Task], day: date) -> set[str]:
    """Return the elements that should stand by a day: every task that makes them should be finished."""
    return {key for key, (finish, _) in _due(tasks).items() if days_past(finish, day)}


def _due(tasks: Iterable[Task | TaskProgress]) -> Mapping[str, tuple[datetime, str]]:
    """Return element -> (latest planned finish, its task); an element with a task without a finish is left out.

    A row of the schedule file without any date, that is no task of the IFC, says nothing of when an element is due.
    IFC tasks that no row matches say nothing of what such a row dates; the rest is due by their finish in the IFC.
    """
    due: dict[str, tuple[datetime, str]] = {}
    open_ended: set[str] = set()
    made = [(t, t.global_id, t) if isinstance(t, Task) else (t, t.progress.key, t.progress) for t in tasks]
    rows = [(task, own.elements) for task, key, own in made if key.startswith(SCHEDULE_KEY)]
    dated = {key for task, elements in rows if task.schedule_finish is not None for key in elements}
    for task, own_key, own in made:
        is_row = own_key.startswith(SCHEDULE_KEY)
        for key in own.elements:
            if not is_row and not task.schedule_uid and key in dated:
                continue
            finish = task.ifc_finish or task.schedule_finish
            if finish is None:
                if not is_row or task.schedule_start is not None:
                    open_ended.add(key)
            elif key not in due or finish.date() > due[key][0].date():
                due[key] = (finish, own.name)
    return {key: value for key, value in due.items() if key not in open_ended}


def _behind(start: datetime, finish: datetime, share: float, day: date, calendar: WorkCalendar) -> int:
    """Return the whole days from when the plan wanted `share` to the end of `day`; 0 before the plan begins."""
    status = status_moment(day)
    if share <= 0.0 and status <= start:
        return 0
    whole = calendar.hours(start, finish)
    wanted = finish if share >= 1.0 or whole <= 0.0 else min(finish, calendar.after(start, share * whole))
    days = (status - wanted) / timedelta(days=1)
    return math.floor(days) if days >= 0.0 else math.ceil(days)
