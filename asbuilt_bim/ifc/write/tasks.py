"""Measured progress of tasks: IfcTaskTime, or in IFC2X3 IfcScheduleTimeControl."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from typing import Any

from asbuilt_bim.ifc.names import Value
from asbuilt_bim.ifc.read.planned_dates import task_times
from asbuilt_bim.ifc.write.entities import Marker
from asbuilt_bim.progress.completion.planned import TaskVerdict, percent_down, verdict
from asbuilt_bim.progress.report import TaskProgress

FIELDS = ("DataOrigin", "StatusTime", "ActualStart", "ActualFinish", "Completion")
"""The attributes of a task's time that are overwritten; each old value is kept in our set."""
_ORIGINAL = "Original"
_NO_TIME = f"{_ORIGINAL}TaskTime"


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskSaid:
    """What our set has to say of a task: values, and the IFC2X3 dates that were overwritten, by reference."""

    values: dict[str, Value | None]
    dates: dict[str, Any] = field(default_factory=dict)


def write_task(marker: Marker, task: Any, progress: TaskProgress, visit: date) -> TaskSaid:
    """Write what was measured into a task's time; return what our set has to say about it.

    Completion is what every schedule is told: the lower bound, of a finished task 1. Where that is 0 it stays empty,
    because an IfcPositiveRatioMeasure can't be 0, with origin and status time. Unknown: nothing on the task.
    """
    told = verdict(progress)
    if told.share is None:
        return TaskSaid(values={"Basis": "too little was seen to say: the task's own time is as it was"})
    holder, why = _holder(task)
    if why:
        return TaskSaid(values={"Basis": why})
    said = TaskSaid(values={})
    if holder is None:
        holder = task.TaskTime = marker.file.create_entity("IfcTaskTime")
        said.values[_NO_TIME] = "NONE"
    for name in FIELDS:
        _keep(said, name, getattr(holder, name, None))
    if hasattr(holder, "DataOrigin"):
        holder.DataOrigin = "MEASURED"
    holder.StatusTime = marker.moment(visit)
    holder.ActualStart = marker.moment(progress.actual_start)
    holder.ActualFinish = marker.moment(progress.actual_finish)
    holder.Completion = told.share if told.share > 0.0 else None
    said.values["Basis"] = _basis(told, told.share, progress)
    return said


def put_back(task: Any, said: Any) -> None:
    """Give a task's time the values it had before, as our property set tells them.

    What was never overwritten stays, and so does a time that somebody has exchanged since.
    """
    kept = {
        one.Name: one.PropertyReference if one.is_a("IfcPropertyReferenceValue") else one.NominalValue.wrappedValue
        for one in said.HasProperties or ()
    }
    if not str(kept.get("Basis", "")).startswith("Completion"):
        return
    times = task_times(task)
    if kept.get(_NO_TIME) == "NONE":
        task.TaskTime = None
        _remove_unused(task.file, times)
    elif len(times) == 1:
        for name in FIELDS:
            if hasattr(times[0], name):
                ours = getattr(times[0], name)
                old = kept.get(f"{_ORIGINAL}{name}")
                setattr(times[0], name, float(old) if name == "Completion" and old is not None else old)
                _remove_unused(task.file, [ours])


def _holder(task: Any) -> tuple[Any, str]:
    """Return what holds a task's time (None: it has to be made), or why nothing can."""
    times = task_times(task)
    if not times and task.file.schema == "IFC2X3":
        return None, "the task has no schedule time control that could hold its completion"
    if len(times) > 1:
        return None, f"the task stands in {len(times)} schedules with a time each: none was chosen"
    if times and task.file.get_total_inverses(times[0]) > 1 and _shared(times[0]):
        return None, "the task shares its time with another one: it was left as it was"
    return (times[0] if times else None), ""


def _shared(time: Any) -> bool:
    users = {
        task.id()
        for user in time.file.get_inverse(time)
        for task in ([user] if user.is_a("IfcTask") else getattr(user, "RelatedObjects", None) or ())
        if task.is_a("IfcTask")
    }
    return len(users) > 1


def _keep(said: TaskSaid, name: str, value: Any) -> None:
    if hasattr(value, "is_a"):
        said.dates[f"{_ORIGINAL}{name}"] = value
    elif value is not None:
        said.values[f"{_ORIGINAL}{name}"] = repr(float(value)) if name == "Completion" else value


def _basis(told: TaskVerdict, share: float, progress: TaskProgress) -> str:
    group, best = progress.progress, progress.progress.completion.best
    if told.finished:
        return f"Completion is 1: seen complete; at least {percent_down(group.completion.lower)} % is certain"
    why = [f"{group.unknown} of its elements are unknown"] if group.unknown else []
    why += [f"{progress.others} more not measured here"] if progress.others else []
    why += [f"the best estimate is {best * 100:.1f} %"] if best is not None else []
    empty = "" if share > 0.0 else "; it is 0, which the schedule can't hold and leaves empty"
    return f"Completion is the lower bound{': ' if why else ''}{', '.join(why)}{empty}"


def _remove_unused(file: Any, things: Any) -> None:
    """Remove entities of ours, and their parts, once nothing refers to them; plain values are nothing to remove."""
    for thing in things:
        if hasattr(thing, "is_a") and file.get_total_inverses(thing) == 0:
            parts = list(thing)
            file.remove(thing)
            _remove_unused(file, parts)
