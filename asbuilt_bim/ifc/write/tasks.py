"""Measured progress of tasks: IfcTaskTime, or in IFC2X3 IfcScheduleTimeControl."""

from dataclasses import dataclass, field
from datetime import date
from typing import Any

from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, Values, about, noted
from asbuilt_bim.ifc.names import Value
from asbuilt_bim.ifc.read.planned_dates import task_times
from asbuilt_bim.ifc.write.entities import DESCRIPTION, Marker
from asbuilt_bim.progress.completion.moments import begun_at, finished_at, status_written
from asbuilt_bim.progress.completion.planned import TaskVerdict, verdict
from asbuilt_bim.progress.report import TaskProgress

FIELDS = ("DataOrigin", "StatusTime", "ActualStart", "ActualFinish", "Completion")
"""The attributes of a task's time that are overwritten; each old value is kept in our set."""
_ORIGINAL = "Original"
_NO_TIME = f"{_ORIGINAL}TaskTime"
_OVERWRITTEN = (Reason.BASIS_COMPLETE, Reason.BASIS_LOWER)
"""What our set says of a task whose own time was overwritten."""
_BEFORE_CODES = "Completion"
"""The name of that property in copies that were written before there were codes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskValues:
    """What our set holds of a task: values, and the IFC2X3 dates that were overwritten, by reference."""

    values: dict[str, Value | None]
    dates: dict[str, Any] = field(default_factory=dict)


def write_task(marker: Marker, task: Any, progress: TaskProgress, visit: date) -> TaskValues:
    """Write what was measured into a task's time; return what our set holds of it.

    Completion is what every schedule gets: the lower bound, of a finished task 1. Where that is 0 it stays empty,
    because an IfcPositiveRatioMeasure can't be 0, with origin and status time. Unknown: nothing on the task.
    """
    known, subject = verdict(progress), about(SubjectKind.TASK, progress.progress.key)
    if known.share is None:
        return TaskValues(values={"Basis": noted(Reason.BASIS_UNKNOWN, subject)})
    holder, why = _holder(task, subject)
    if why is not None:
        return TaskValues(values={"Basis": why})
    kept = TaskValues(values={})
    if holder is None:
        holder = task.TaskTime = marker.file.create_entity("IfcTaskTime")
        kept.values[_NO_TIME] = "NONE"
    for name in FIELDS:
        _keep(kept, name, getattr(holder, name, None))
    if hasattr(holder, "DataOrigin"):
        holder.DataOrigin = "MEASURED"
    begun, complete = progress.actual_start, progress.actual_finish
    holder.StatusTime = marker.moment(status_written(visit))
    holder.ActualStart = marker.moment(begun_at(begun) if begun else None)
    holder.ActualFinish = marker.moment(finished_at(complete) if complete else None)
    holder.Completion = known.share if known.share > 0.0 else None
    kept.values["Basis"] = _basis(known, known.share, progress, subject)
    return kept


def put_back(task: Any, our_set: Any) -> None:
    """Give a task's time the values it had before, as our property set holds them.

    What was never overwritten stays, and so does a time that somebody has exchanged since.
    """
    kept = {
        one.Name: one.PropertyReference if one.is_a("IfcPropertyReferenceValue") else one.NominalValue.wrappedValue
        for one in our_set.HasProperties or ()
    }
    if not any(_says_overwritten(one) for one in our_set.HasProperties or () if one.Name == "Basis"):
        return
    times = task_times(task)
    if kept.get(_NO_TIME) == "NONE":
        task.TaskTime = None
        _remove_unused(task.file, times)
    elif len(times) == 1:
        for name in FIELDS:
            if hasattr(times[0], name):
                written = getattr(times[0], name)
                old = kept.get(f"{_ORIGINAL}{name}")
                setattr(times[0], name, float(old) if name == "Completion" and old is not None else old)
                _remove_unused(task.file, [written])


def _says_overwritten(basis: Any) -> bool:
    code = basis[DESCRIPTION]
    if code:
        return code in _OVERWRITTEN
    return str(basis.NominalValue.wrappedValue).startswith(_BEFORE_CODES)


def _holder(task: Any, subject: Subject) -> tuple[Any, Note | None]:
    """Return what holds a task's time (None: it has to be made), or why nothing can."""
    times = task_times(task)
    if not times and task.file.schema == "IFC2X3":
        return None, noted(Reason.BASIS_NO_TIME, subject)
    if len(times) > 1:
        return None, noted(Reason.BASIS_SEVERAL_TIMES, subject, count=len(times))
    if times and task.file.get_total_inverses(times[0]) > 1 and _shared(times[0]):
        return None, noted(Reason.BASIS_SHARED_TIME, subject)
    return (times[0] if times else None), None


def _shared(time: Any) -> bool:
    users = {
        task.id()
        for user in time.file.get_inverse(time)
        for task in ([user] if user.is_a("IfcTask") else getattr(user, "RelatedObjects", None) or ())
        if task.is_a("IfcTask")
    }
    return len(users) > 1


def _keep(kept: TaskValues, name: str, value: Any) -> None:
    if hasattr(value, "is_a"):
        kept.dates[f"{_ORIGINAL}{name}"] = value
    elif value is not None:
        kept.values[f"{_ORIGINAL}{name}"] = repr(float(value)) if name == "Completion" else value


def _basis(known: TaskVerdict, share: float, progress: TaskProgress, subject: Subject) -> Note:
    """Say which number is the task's completion."""
    group, best = progress.progress, progress.progress.completion.best_shown
    if known.finished:
        return noted(Reason.BASIS_COMPLETE, subject, lower=group.completion.lower)
    estimate: Values = {} if best is None else {"best": best}
    values: Values = {**estimate, "unknown": group.unknown, "others": progress.others, "left_empty": share <= 0.0}
    return noted(Reason.BASIS_LOWER, subject, **values)


def _remove_unused(file: Any, things: Any) -> None:
    """Remove our entities, and their parts, once nothing refers to them; plain values are nothing to remove."""
    for thing in things:
        if hasattr(thing, "is_a") and file.get_total_inverses(thing) == 0:
            parts = list(thing)
            file.remove(thing)
            _remove_unused(file, parts)
