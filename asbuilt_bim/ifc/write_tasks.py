"""Measured progress of tasks: IfcTaskTime, or in IFC2X3 IfcScheduleTimeControl."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, datetime
from typing import Any

from asbuilt_bim.ifc.marks import Marker, Value
from asbuilt_bim.ifc.schedule import moment, task_times
from asbuilt_bim.progress.report import TaskProgress

FIELDS = ("DataOrigin", "StatusTime", "ActualStart", "ActualFinish", "Completion")
"""The attributes of a task's time that are overwritten; each old value is kept in our set."""


def write_task(marker: Marker, task: Any, progress: TaskProgress, visit: date) -> dict[str, Value | None]:
    """Write what was measured into a task's time; return what our set has to say about it.

    Three cases are told apart. Measured above 0: Completion, at most 1. Measured 0: origin and status time, Completion
    empty, because IfcPositiveRatioMeasure can't be 0. Unknown: nothing on the task.
    """
    completion = progress.progress.completion
    if completion.best is None:
        return {"Basis": "too little was seen to say: the task's own time is as it was"}
    holders = task_times(task)
    kept: dict[str, Value | None] = {}
    if not holders and task.file.schema != "IFC2X3":
        task.TaskTime = marker.file.create_entity("IfcTaskTime")
        kept["OriginalTaskTime"] = "NONE"
        holders = (task.TaskTime,)
    if not holders:
        return {"Basis": "the task has no schedule time control that could hold its completion"}
    decided = progress.progress.unknown == 0
    share = min(completion.best if decided else completion.lower, 1.0)
    kept |= {f"Original{name}": _text(getattr(holders[0], name, None)) for name in FIELDS}
    for holder in holders:
        if hasattr(holder, "DataOrigin"):
            holder.DataOrigin = "MEASURED"
        holder.StatusTime = _moment_entity(marker.file, visit)
        holder.ActualStart = _moment_entity(marker.file, progress.actual_start)
        holder.ActualFinish = _moment_entity(marker.file, progress.actual_finish)
        holder.Completion = share if share > 0.0 else None
    return {"Basis": _basis(decided, share, progress), **kept}


def put_back(file: Any, task: Any, said: Mapping[str, str]) -> None:
    """Give a task's time the values it had before, as our set tells them; what was never overwritten stays."""
    if not any(name.startswith("Original") for name in said) and not said.get("Basis", "").startswith("Completion"):
        return
    if said.get("OriginalTaskTime") == "NONE":
        ours, task.TaskTime = task.TaskTime, None
        if ours is not None and file.get_total_inverses(ours) == 0:
            file.remove(ours)
        return
    for holder in task_times(task):
        for name in FIELDS:
            if hasattr(holder, name):
                ours = getattr(holder, name)
                setattr(holder, name, _from_text(file, name, said.get(f"Original{name}")))
                _remove_moment(file, ours)


def _basis(decided: bool, share: float, progress: TaskProgress) -> str:
    bound = (
        "is the best estimate"
        if decided
        else f"is the lower bound: {progress.progress.unknown} of its elements are unknown"
    )
    return f"Completion {bound}" + ("" if share > 0.0 else "; it is 0, which the schedule can't hold and leaves empty")


def _text(value: Any) -> str | None:
    """Return a time attribute as text that `_from_text` reads back."""
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, float | int):
        return repr(float(value))
    when = moment(value)
    if when is None:
        return None
    return when.date().isoformat() if value.is_a("IfcCalendarDate") else when.isoformat()


def _from_text(file: Any, name: str, text: str | None) -> Any:
    if text is None:
        return None
    if name == "Completion":
        return float(text)
    if name == "DataOrigin" or file.schema != "IFC2X3":
        return text
    moments = file.by_type("IfcDateAndTime" if "T" in text else "IfcCalendarDate")
    same = [one for one in moments if _text(one) == text]
    if same:  # what was overwritten is still there, most often unused
        return min(same, key=file.get_total_inverses)
    return _moment_entity(file, datetime.fromisoformat(text) if "T" in text else date.fromisoformat(text))


def _remove_moment(file: Any, moment_entity: Any) -> None:
    """Remove an IFC2X3 moment of ours, and its parts, once nothing refers to it."""
    if not hasattr(moment_entity, "is_a") or file.get_total_inverses(moment_entity) > 0:
        return
    parts = [part for part in moment_entity if hasattr(part, "is_a")]
    file.remove(moment_entity)
    for part in parts:
        _remove_moment(file, part)


def _moment_entity(file: Any, when: date | None) -> Any:
    """Return a moment as the schema wants it: text, or in IFC2X3 an IfcCalendarDate or IfcDateAndTime."""
    if when is None:
        return None
    if file.schema != "IFC2X3":
        return when.isoformat() if isinstance(when, datetime) else f"{when.isoformat()}T00:00:00"
    day = file.create_entity(
        "IfcCalendarDate", DayComponent=when.day, MonthComponent=when.month, YearComponent=when.year
    )
    if not isinstance(when, datetime):
        return day
    time = file.create_entity(
        "IfcLocalTime", HourComponent=when.hour, MinuteComponent=when.minute, SecondComponent=float(when.second)
    )
    return file.create_entity("IfcDateAndTime", DateComponent=day, TimeComponent=time)
