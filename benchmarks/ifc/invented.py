"""A report with invented results on every wall and column of an IFC file: what the writer needs, without a photo."""

from __future__ import annotations

from collections import defaultdict
from datetime import date, timedelta
from typing import Any

import numpy as np

from asbuilt_bim.bim.model import CostLine, Task
from asbuilt_bim.ifc.read.cost import read_cost_lines
from asbuilt_bim.ifc.read.schedule import read_tasks
from asbuilt_bim.ifc.read.structure import storey_of
from asbuilt_bim.ifc.units import read_units
from asbuilt_bim.progress.completion.earned_value import earned
from asbuilt_bim.progress.report import (
    Completion,
    CostProgress,
    ElementProgress,
    GroupProgress,
    ProgressReport,
    State,
    StationRecord,
    TaskProgress,
)

VISITS = (date(2026, 3, 2), date(2026, 3, 16))
OUTCOMES: tuple[tuple[float | None, ...], ...] = ((0.5, 1.0), (0.0, 0.5), (None, 0.0), (None, None))
"""Completion after each visit; the walls and columns of a file take turns."""
DECIDED = 0.9
AREA_M2 = 12.5
STATIONS = ("N1", "N2")


def invented_reports(file: Any) -> tuple[ProgressReport, ...]:
    """Return one report a visit; the last one is what the writer writes, the earlier ones are its history."""
    things = {one.GlobalId: one for kind in ("IfcWall", "IfcColumn") for one in file.by_type(kind)}
    ids = frozenset(things)
    storeys = {key: storey_of(thing) for key, thing in things.items()}
    tasks, _ = read_tasks(file, ids)
    lines, _ = read_cost_lines(file, ids, read_units(file))
    reports = []
    for number, day in enumerate(VISITS):
        elements = [
            _element(thing, OUTCOMES[i % len(OUTCOMES)][number], storeys[key], day)
            for i, (key, thing) in enumerate(things.items())
        ]
        by_id = {element.global_id: element for element in elements}
        reports.append(
            ProgressReport(
                project_name="invented",
                visit_date=day,
                earlier_visits=VISITS[:number],
                elements=tuple(elements),
                storeys=_storeys(file, elements),
                whole=_group("", "Whole", elements),
                tasks=tuple(_task(task, by_id, day) for task in tasks),
                cost_lines=tuple(_cost(line, by_id) for line in lines),
                faces=(),
                stations=tuple(_station(name, day) for name in STATIONS),
                rejections=(),
                unmatched=(),
                unobserved=(),
                notes=(),
            )
        )
    return tuple(reports)


def _completion(best: float | None) -> Completion:
    if best is None:
        return Completion(best=None, lower=0.0, upper=1.0, coverage=0.0)
    built = best * DECIDED
    return Completion(best=best, lower=built, upper=built + 1.0 - DECIDED, coverage=DECIDED)


def _element(thing: Any, best: float | None, storey: str, day: date) -> ElementProgress:
    state: State = "unknown" if best is None else "complete" if best == 1.0 else "part" if best else "not started"
    measured = bool(best)
    return ElementProgress(
        global_id=thing.GlobalId,
        ifc_class=thing.is_a(),
        kind="wall" if thing.is_a("IfcWall") else "column",
        name=thing.Name or "",
        storey=storey,
        state=state,
        completion=_completion(best),
        cells_built=10.0 * (best or 0.0),
        cells_open=0.0 if best is None else 10.0 * (1.0 - best),
        cells_unknown=10.0 if best is None else 0.0,
        cells_conflict=0.0,
        surface_coverage=0.0 if best is None else DECIDED,
        design_area_m2=AREA_M2,
        design_volume_m3=2.0,
        built_area_m2=AREA_M2 * (best or 0.0),
        as_built_area_m2=AREA_M2 * best if best else None,
        as_built_sigma_m2=0.125 if measured else None,
        offset_m=0.012 if measured else None,
        offset_sigma_m=0.004 if measured else None,
        tilt_rad=0.002 if measured else None,
        stations=() if best is None else STATIONS,
        last_seen=None if best is None else day,
        notes=(),
    )


def _group(key: str, name: str, members: list[ElementProgress]) -> GroupProgress:
    states = [member.state for member in members]
    count = max(len(members), 1)
    lower = sum(member.completion.lower for member in members) / count
    upper = sum(member.completion.upper for member in members) / count
    coverage = lower + 1.0 - upper
    best = lower / coverage if coverage >= 0.1 else None
    return GroupProgress(
        key=key,
        name=name,
        elements=tuple(member.global_id for member in members),
        completion=Completion(best=best, lower=lower, upper=upper, coverage=coverage),
        complete=states.count("complete"),
        part=states.count("part"),
        not_started=states.count("not started"),
        unknown=states.count("unknown"),
        design_area_m2=sum(member.design_area_m2 for member in members),
        as_built_area_m2=sum(member.as_built_area_m2 or 0.0 for member in members),
        as_built_sigma_m2=0.1,
    )


def _storeys(file: Any, elements: list[ElementProgress]) -> tuple[GroupProgress, ...]:
    members: defaultdict[str, list[ElementProgress]] = defaultdict(list)
    for element in elements:
        members[element.storey].append(element)
    names = {storey.GlobalId: storey.Name or "" for storey in file.by_type("IfcBuildingStorey")}
    return tuple(_group(key, names.get(key, "(no storey)"), inside) for key, inside in members.items())


def _task(task: Task, elements: dict[str, ElementProgress], day: date) -> TaskProgress:
    group = _group(task.global_id, task.name, [elements[key] for key in task.elements])
    return TaskProgress(
        progress=group,
        schedule_start=task.schedule_start,
        schedule_finish=task.schedule_finish,
        actual_start=day - timedelta(days=14) if group.complete + group.part else None,
        actual_finish=day if group.complete == len(task.elements) else None,
        late=None,
    )


def _cost(line: CostLine, elements: dict[str, ElementProgress]) -> CostProgress:
    shares = dict.fromkeys(line.elements, 1.0 / max(len(line.elements), 1))
    own = {key: elements[key] for key in line.elements}
    return earned(line, _group("", "", list(own.values())).completion, shares, own)


def _station(name: str, day: date) -> StationRecord:
    folder = f"photos/{day.isoformat()}"
    return StationRecord(
        name=name, day=day, left_photo=f"{folder}/{name}_left.jpg", right_photo=f"{folder}/{name}_right.jpg",
        left_digest="", right_digest="", f_px=3000.0, cx_px=2000.0, cy_px=1500.0, baseline_m=0.2, width_px=4000,
        height_px=3000, rectified_from_left=np.eye(3), world_from_left=np.eye(4), pose_covariance=None,
        pose_residual_px=0.2, pose_method="markers", markers_used=(1, 2), target_left_px=None, target_right_px=None,
        target_radius_px=None, target_depth_m=None, target_depth_sigma_m=None, target_range_m=None,
        target_diameter_m=None, faces=(), picture=f"pictures/{day.isoformat()}/{name}.jpg", seconds={},
    )  # fmt: skip
