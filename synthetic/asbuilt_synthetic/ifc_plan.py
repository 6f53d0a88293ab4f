"""Adds the work schedule (tasks assigned to elements) and the cost schedule (rates per m3, m2 and piece) to an IFC."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Any

from asbuilt_synthetic.building import STOREYS, Element
from asbuilt_synthetic.ifc_writer import IfcWriter
from asbuilt_synthetic.progress import DAYS_BETWEEN_VISITS, FIRST_DAY
from asbuilt_synthetic.solids import side_area_m2, sides, volume_m3

_RATE_EUR = {"concrete": 245.0, "formwork": 62.5, "column": 180.0}


def add_work_schedule(w: IfcWriter) -> None:
    """Add a schedule: per storey and pour one task for the columns, one for the walls, one for each slab."""
    plan = w.rooted(
        "IfcWorkPlan",
        "plan",
        Name="Shell works",
        CreationDate="2026-02-02T08:00:00",
        StartTime="2026-02-16T08:00:00",
        PredefinedType="PLANNED",
    )
    schedule = w.rooted(
        "IfcWorkSchedule",
        "schedule",
        Name="Baseline",
        CreationDate="2026-02-02T08:00:00",
        StartTime="2026-02-16T08:00:00",
        PredefinedType="PLANNED",
    )
    w.rooted("IfcRelAggregates", "plan", RelatingObject=plan, RelatedObjects=[schedule])
    w.rooted("IfcRelDeclares", "plan", RelatingContext=w.project, RelatedDefinitions=[plan])
    tops = []
    for storey, title in enumerate(STOREYS):
        leaves = [t for zone in (0, 1) for t in _tasks_of(w, storey, zone)]
        top = w.rooted(
            "IfcTask",
            title,
            Name=title,
            Identification=f"{storey + 1}",
            IsMilestone=False,
            PredefinedType="CONSTRUCTION",
        )
        w.rooted("IfcRelNests", title, RelatingObject=top, RelatedObjects=leaves)
        tops.append(top)
    w.rooted("IfcRelAssignsToControl", "schedule", RelatingControl=schedule, RelatedObjects=tops)


def _tasks_of(w: IfcWriter, storey: int, zone: int) -> list[Any]:
    out = []
    part = ("west", "east")[zone]
    for k, (title, kind, start_day, days) in enumerate(
        (("Columns", "IfcColumn", -10, 18), ("Walls", "IfcWall", -7, 20), ("Slab", "IfcSlab", -14, 8))
    ):
        elements = [e for e in w.building.elements if (e.storey, e.zone, e.ifc_class) == (storey, zone, kind)]
        if not elements:
            continue
        begin = FIRST_DAY + timedelta(days=start_day + DAYS_BETWEEN_VISITS * (storey + zone * (storey + 1) // 2))
        name = f"{title} {STOREYS[storey].lower()}, {part}"
        time = w.new(
            "IfcTaskTime",
            Name=name,
            DataOrigin="PREDICTED",
            DurationType="WORKTIME",
            ScheduleDuration=f"P{days}D",
            ScheduleStart=f"{begin.isoformat()}T08:00:00",
            ScheduleFinish=f"{(begin + timedelta(days=days)).isoformat()}T17:00:00",
        )
        task = w.rooted(
            "IfcTask",
            name,
            Name=name,
            Identification=f"{storey + 1}.{zone + 1}.{k + 1}",
            IsMilestone=False,
            TaskTime=time,
            PredefinedType="CONSTRUCTION",
        )
        for e in elements:
            w.rooted(
                "IfcRelAssignsToProduct",
                f"{name}/{e.global_id}",
                RelatedObjects=[task],
                RelatingProduct=w.products[e.global_id],
            )
        out.append(task)
    return out


def add_cost_schedule(w: IfcWriter) -> None:
    """Add a budget: per storey concrete in m3 and formwork in m2 of the walls and columns, columns by the piece."""
    schedule = w.rooted(
        "IfcCostSchedule",
        "budget",
        Name="Bill of quantities",
        PredefinedType="BUDGET",
        Status="PLANNED",
        SubmittedOn="2026-02-02T08:00:00",
    )
    w.rooted("IfcRelDeclares", "budget", RelatingContext=w.project, RelatedDefinitions=[schedule])
    tops = []
    for storey, title in enumerate(STOREYS):
        upright = [e for e in w.building.vertical if e.storey == storey]
        columns = [e for e in upright if e.ifc_class == "IfcColumn"]
        leaves = [
            _item(
                w,
                f"{storey + 1}.1",
                f"Concrete C30/37 in walls and columns, {title.lower()}",
                upright,
                "IfcQuantityVolume",
                "VolumeValue",
                volume_m3,
                _RATE_EUR["concrete"],
                "IfcVolumeMeasure",
            ),
            _item(
                w,
                f"{storey + 1}.2",
                f"Formwork of walls and columns, {title.lower()}",
                upright,
                "IfcQuantityArea",
                "AreaValue",
                formwork_m2,
                _RATE_EUR["formwork"],
                "IfcAreaMeasure",
            ),
            _item(
                w,
                f"{storey + 1}.3",
                f"Reinforced columns, {title.lower()}",
                columns,
                "IfcQuantityCount",
                "CountValue",
                lambda e: 1,
                _RATE_EUR["column"],
                "IfcCountMeasure",
            ),
        ]
        top = w.rooted("IfcCostItem", title, Name=title, Identification=f"{storey + 1}")
        w.rooted("IfcRelNests", f"cost {title}", RelatingObject=top, RelatedObjects=leaves)
        tops.append(top)
    w.rooted("IfcRelAssignsToControl", "budget", RelatingControl=schedule, RelatedObjects=tops)


def formwork_m2(e: Element) -> float:
    """Return the formed surface of an element: its lateral faces, openings off."""
    return sum(side_area_m2(e, s) for s in sides(e))


def _item(
    w: IfcWriter,
    number: str,
    name: str,
    elements: list[Element],
    kind: str,
    field: str,
    measure: Callable[[Element], float],
    rate: float,
    unit_measure: str,
) -> Any:
    quantities = [w.new(kind, Name=e.name, **{field: round(measure(e), 4)}) for e in elements]
    per_unit = {"IfcVolumeMeasure": "VOLUMEUNIT", "IfcAreaMeasure": "AREAUNIT"}.get(unit_measure)
    unit = next(u for u in w.file.by_type("IfcSIUnit") if u.UnitType == per_unit) if per_unit else _pieces(w)
    value = w.new(
        "IfcCostValue",
        Name="Rate",
        AppliedValue=w.new("IfcMonetaryMeasure", rate),
        UnitBasis=w.new("IfcMeasureWithUnit", w.new(unit_measure, 1.0 if per_unit else 1), unit),
    )
    item = w.rooted(
        "IfcCostItem", number, Name=name, Identification=number, CostValues=[value], CostQuantities=quantities
    )
    w.rooted(
        "IfcRelAssignsToControl",
        number,
        RelatingControl=item,
        RelatedObjects=[w.products[e.global_id] for e in elements],
    )
    return item


def _pieces(w: IfcWriter) -> Any:
    known = [u for u in w.file.by_type("IfcContextDependentUnit") if u.Name == "piece"]
    if known:
        return known[0]
    none = w.new("IfcDimensionalExponents", 0, 0, 0, 0, 0, 0, 0)
    return w.new("IfcContextDependentUnit", Dimensions=none, UnitType="USERDEFINED", Name="piece")
