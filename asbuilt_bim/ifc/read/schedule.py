"""The work schedule: tasks, their dates, and the elements that they make."""

from collections.abc import Iterable
from typing import Any

import ifcopenshell.util.date

from asbuilt_bim.bim.model import Task
from asbuilt_bim.bim.schedule import LinkKind, TaskLink
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.ifc.identity import has_id, with_ids
from asbuilt_bim.ifc.read.assignments import assigned_elements
from asbuilt_bim.ifc.read.planned_dates import planned_dates

_LINKS: dict[str, LinkKind] = {
    "FINISH_START": "FS",
    "START_START": "SS",
    "FINISH_FINISH": "FF",
    "START_FINISH": "SF",
}
MAX_OUTLINE = 50
"""No schedule is indented deeper; a task that is its own summary ends here."""
MAX_NAMED = 5


def read_tasks(file: Any, elements: frozenset[str]) -> tuple[tuple[Task, ...], tuple[Note, ...]]:
    """Return the tasks that have elements of the design, in the file's order, and notes on the rest.

    Assignments are read both ways: IfcRelAssignsToProduct (the element is what the task makes), and
    IfcRelAssignsToProcess (the task works on it). What else a task makes is counted: it isn't measured, so the task is
    not seen finished.
    """
    tasks, faults, worked_out = [], list[Note](), list[str]()
    making = ((task, assigned_elements(_products(task), elements)) for task in file.by_type("IfcTask"))
    found = {task: made for task, made in making if made.elements}
    known, strangers = with_ids(found, SubjectKind.TASK, each_once=True)
    for task in known:
        made = found[task]
        planned = planned_dates(task)
        if planned.fault is not None:
            faults.append(planned.fault)
        if planned.worked_out and planned.finish:
            worked_out.append(f"{task.Name or task.GlobalId} {planned.finish:%Y-%m-%d %H:%M}")
        tasks.append(
            Task(
                global_id=task.GlobalId,
                name=task.Name or "",
                identification=str(getattr(task, "Identification", None) or getattr(task, "TaskId", None) or ""),
                elements=made.elements,
                others=made.others,
                schedule_start=planned.start,
                schedule_finish=planned.finish,
                outline=_outline(task),
                links=tuple(_links(task)),
            )
        )
    notes = (*_several_schedules(found), *_worked_out(worked_out), *faults[:MAX_NAMED])
    left = len(faults) - MAX_NAMED
    more = noted(Reason.TASK_DATES_MORE, about(SubjectKind.DESIGN), count=left)
    return tuple(tasks), (*strangers, *notes, *((more,) if left > 0 else ()))


def _worked_out(tasks: list[str]) -> list[Note]:
    """Say which planned finishes the file doesn't hold."""
    if not tasks:
        return []
    values: Values = {"count": len(tasks), "tasks": tuple(tasks[:MAX_NAMED])}
    return [noted(Reason.FINISH_WORKED_OUT, about(SubjectKind.DESIGN), **values)]


def _several_schedules(tasks: Iterable[Any]) -> list[Note]:
    """Say which work schedules the tasks stand in where that are several: a baseline beside a plan counts like it."""
    schedules = {one.id(): one for task in tasks for one in _schedules_of(task)}
    if len(schedules) < 2:
        return []
    kinds = [(one.Name or one.GlobalId, getattr(one, "PredefinedType", None)) for one in schedules.values()]
    names = tuple(f"{name} ({kind})" if kind else str(name) for name, kind in kinds[:MAX_NAMED])
    return [noted(Reason.WORK_SCHEDULES_SEVERAL, about(SubjectKind.DESIGN), count=len(schedules), schedules=names)]


def _schedules_of(task: Any) -> Iterable[Any]:
    """Yield the work schedules that a task, or a summary above it, is assigned to."""
    for _ in range(MAX_OUTLINE):
        for relation in task.HasAssignments or ():
            control = getattr(relation, "RelatingControl", None)
            if control is not None and control.is_a("IfcWorkSchedule"):
                yield control
        task = _above(task)
        if task is None:
            return


def _outline(task: Any) -> tuple[str, ...]:
    """Return the names of the summary tasks above a task, the outermost first."""
    names: list[str] = []
    while len(names) < MAX_OUTLINE:
        task = _above(task)
        if task is None:
            break
        names.append(task.Name or "")
    return tuple(reversed(names))


def _above(task: Any) -> Any:
    """Return the summary task above a task; None where there is none."""
    nests = getattr(task, "Nests", None) or getattr(task, "Decomposes", None) or ()
    above = next((r.RelatingObject for r in nests if r.is_a("IfcRelNests")), None)
    return above if above is not None and above.is_a("IfcTask") else None


def _links(task: Any) -> Iterable[TaskLink]:
    """Yield a task's predecessors; a lag that is a share of a duration counts as none."""
    for relation in task.IsSuccessorFrom or ():
        other = relation.RelatingProcess
        if other is None or not other.is_a("IfcTask") or not has_id(other):
            continue
        kind = _LINKS.get(relation.SequenceType or "", "FS")
        yield TaskLink(predecessor=other.GlobalId, kind=kind, lag_h=_lag_h(relation.TimeLag))


def _lag_h(lag: Any) -> float:
    """Return a time lag in hours: IFC2X3 holds seconds, later schemas an IfcLagTime with a duration."""
    if lag is None or isinstance(lag, int | float):
        return float(lag or 0.0) / 3600.0
    try:
        duration = ifcopenshell.util.date.ifc2datetime(lag.LagValue.wrappedValue)
        return float(duration.total_seconds()) / 3600.0
    except (ValueError, TypeError, AttributeError):
        return 0.0


def _products(task: Any) -> Iterable[Any]:
    for relation in task.HasAssignments or ():
        if relation.is_a("IfcRelAssignsToProduct"):
            yield relation.RelatingProduct
    for relation in task.OperatesOn or ():
        yield from relation.RelatedObjects
