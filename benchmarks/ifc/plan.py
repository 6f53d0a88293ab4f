"""Gives an open IFC file a work schedule and a budget on its own walls and columns: few real files have them."""

from __future__ import annotations

import uuid
from typing import Any

import ifcopenshell.guid

TASKS = ("built", "half", "measured 0", "unknown", "mixed")
"""Task i makes the walls and columns that have the i-th of the invented outcomes; the last one some of each."""


def add_plan(file: Any, completion: float | None = 0.25) -> None:
    """Add five tasks (IFC2X3: with time controls) and, where the schema holds them, five cost lines.

    `completion` is what the tasks say before anything was measured.
    """
    things = [one for kind in ("IfcWall", "IfcColumn") for one in file.by_type(kind)]
    things = list({one.GlobalId: one for one in things}.values())
    if not things:
        return
    count = len(TASKS) - 1
    groups = [things[i::count][:20] for i in range(count)] + [things[:count]]
    add = _add_old if file.schema == "IFC2X3" else _add
    add(file, completion, [(name, group) for name, group in zip(TASKS, groups, strict=True) if group])


def _rooted(file: Any, ifc_class: str, key: str, **attributes: Any) -> Any:
    owners = file.by_type("IfcOwnerHistory")
    guid = ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_OID, f"plan/{ifc_class}/{key}").hex)
    owner = owners[0] if owners else None
    return file.create_entity(ifc_class, GlobalId=guid, OwnerHistory=owner, **attributes)


def _tie(file: Any, task: Any, things: list[Any]) -> None:
    for thing in things:
        key = f"{task.Name}/{thing.GlobalId}"
        _rooted(file, "IfcRelAssignsToProduct", key, RelatedObjects=[task], RelatingProduct=thing)


def _add(file: Any, completion: float | None, groups: list[tuple[str, list[Any]]]) -> None:
    budget = _rooted(file, "IfcCostSchedule", "budget", Name="budget", PredefinedType="BUDGET")
    items = []
    for name, things in groups:
        time = file.create_entity("IfcTaskTime", ScheduleStart="2026-02-01T08:00:00", Completion=completion)
        task = _rooted(file, "IfcTask", name, Name=name, Identification=name, IsMilestone=False, TaskTime=time)
        _tie(file, task, things)
        rate = file.create_entity("IfcCostValue", AppliedValue=file.create_entity("IfcMonetaryMeasure", 210.0))
        volume = file.create_entity("IfcQuantityVolume", Name="planned", VolumeValue=10.0 * len(things))
        item = _rooted(file, "IfcCostItem", name, Name=name, CostQuantities=[volume], CostValues=[rate])
        _rooted(file, "IfcRelAssignsToControl", name, RelatedObjects=things, RelatingControl=item)
        items.append(item)
    _rooted(file, "IfcRelAssignsToControl", "budget", RelatedObjects=items, RelatingControl=budget)


def _add_old(file: Any, completion: float | None, groups: list[tuple[str, list[Any]]]) -> None:
    day = file.create_entity("IfcCalendarDate", 1, 2, 2026)
    schedule = _rooted(file, "IfcWorkSchedule", "plan", Name="plan", Identifier="1", CreationDate=day, StartTime=day)
    for name, things in groups:
        control = _rooted(
            file, "IfcScheduleTimeControl", name, Name=name, ScheduleStart=day, StatusTime=day, Completion=completion
        )
        task = _rooted(file, "IfcTask", name, Name=name, TaskId=name, IsMilestone=False)
        _rooted(file, "IfcRelAssignsTasks", name, RelatedObjects=[task], RelatingControl=schedule, TimeForTask=control)
        _tie(file, task, things)
