"""The work schedule's tasks: their elements' completion, and the dates that the visits can vouch for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date

from asbuilt_bim.bim.model import Task
from asbuilt_bim.bim.schedule import EVERY_DAY, WorkCalendar
from asbuilt_bim.progress.completion.planned import days_late, planned_share
from asbuilt_bim.progress.completion.rollup import group, with_unmeasured
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, TaskProgress
from asbuilt_bim.progress.surface import SurfaceState


def task_progress(
    task: Task,
    elements: Mapping[str, ElementProgress],
    surfaces: Mapping[str, Sequence[SurfaceState]],
    visit_date: date,
    options: ProgressOptions,
    calendar: WorkCalendar = EVERY_DAY,
) -> TaskProgress:
    """Return a task's progress. Its start is the first visit that saw something of it built; its finish the first one
    that found all of its elements complete. A task with elements that aren't measured here is never finished here.
    """
    members = [elements[key] for key in task.elements if key in elements]
    others = task.others + len(task.elements) - len(members)
    complete = bool(members) and not others and all(element.state == "complete" for element in members)
    measured = group(task.global_id, task.name, members, surfaces, options)
    share = len(members) / max(len(members) + others, 1)
    made = TaskProgress(
        progress=replace(measured, completion=with_unmeasured(measured.completion, share)),
        schedule_start=task.schedule_start,
        schedule_finish=task.schedule_finish,
        actual_start=_first(element.first_built for element in members),
        actual_finish=_last(element.complete_on for element in members) if complete else None,
        late=_late(task, members, complete, visit_date),
        identification=task.identification,
        outline=task.outline,
        links=task.links,
        schedule_uid=task.schedule_uid,
        planned=planned_share(task.schedule_start, task.schedule_finish, visit_date, calendar),
        others=others,
    )
    unfinished_on = _last(element.unfinished_on for element in members)
    best, least, most = days_late(made, made.progress.completion, visit_date, calendar, unfinished_on)
    return replace(made, days_late=best, days_late_least=least, days_late_most=most)


def _first(days: Iterable[date | None]) -> date | None:
    return min((day for day in days if day is not None), default=None)


def _last(days: Iterable[date | None]) -> date | None:
    return max((day for day in days if day is not None), default=None)


def _late(task: Task, members: Sequence[ElementProgress], complete: bool, visit_date: date) -> bool | None:
    if task.schedule_finish is None or not members:
        return None
    if complete or task.schedule_finish.date() >= visit_date:
        return False
    return True if any(element.state in ("part", "not started") for element in members) else None
