"""As-built quantities in cost schedules of their own, which mirror the planned ones."""

import math
from collections.abc import Sequence
from datetime import date
from typing import Any

from asbuilt_bim.bim.model import COSTS_KEY
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.ifc.names import AS_BUILT
from asbuilt_bim.ifc.write.entities import LABEL_LENGTH, Marker
from asbuilt_bim.progress.report import CostProgress

_QUANTITIES = {
    "volume": ("IfcQuantityVolume", "VolumeValue"),
    "area": ("IfcQuantityArea", "AreaValue"),
    "length": ("IfcQuantityLength", "LengthValue"),
    "count": ("IfcQuantityCount", "CountValue"),
}


def write_costs(marker: Marker, lines: tuple[CostProgress, ...], visit: date) -> None:
    """Add an IfcCostSchedule (USERDEFINED, object type ASBUILT) beside each planned one, with one item a line.

    A tender beside a budget isn't added to it here either: programs add up a schedule's items. The item's quantity is
    what can be certified, the LOWER bound, of an item that takes money off the UPPER one; the best estimate stands in
    our set. IFC2X3 can't hold one.
    """
    if marker.schema == "IFC2X3":
        return
    lines = tuple(line for line in lines if not line.global_id.startswith(COSTS_KEY))  # a table's are not the IFC's
    planned = list(dict.fromkeys(line.schedule for line in lines))
    made = [_schedule(marker, name, [line for line in lines if line.schedule == name], visit) for name in planned]
    projects = marker.file.by_type("IfcProject")
    if projects and made:
        marker.rooted(
            "IfcRelDeclares", f"cost/{AS_BUILT}/declares", RelatingContext=projects[0], RelatedDefinitions=made
        )


def _schedule(marker: Marker, planned: str, lines: Sequence[CostProgress], visit: date) -> Any:
    key = f"cost/{AS_BUILT}/{planned}"
    schedule = marker.rooted(
        "IfcCostSchedule",
        key,
        Name=f"As-built quantities: {planned}"[:LABEL_LENGTH] if planned else "As-built quantities",
        ObjectType=AS_BUILT,
        PredefinedType="USERDEFINED",
        UpdateDate=f"{visit.isoformat()}T00:00:00",
    )
    items = [_item(marker, line) for line in lines]
    marker.rooted("IfcRelAssignsToControl", f"{key}/rel", RelatedObjects=items, RelatingControl=schedule)
    return schedule


def _item(marker: Marker, line: CostProgress) -> Any:
    file, key = marker.file, f"cost/{line.global_id}"
    ifc_class, attribute = _QUANTITIES[line.measure]
    unit = _unit_of(marker.find(line.global_id))
    count: float | int = line.as_built_lower
    if line.measure == "count" and marker.schema == "IFC4X3":
        count = math.ceil(count - 1e-9) if line.takes_off else math.floor(count + 1e-9)  # whole pieces only there
    quantity = file.create_entity(ifc_class, Name="AsBuiltLower", Unit=unit, **{attribute: count})
    rate = file.create_entity(
        "IfcCostValue", Name="Rate", AppliedValue=file.create_entity("IfcMonetaryMeasure", line.rate)
    )
    item = marker.rooted(
        "IfcCostItem",
        key,
        Name=line.name or None,
        Identification=line.identification or None,
        ObjectType=AS_BUILT,
        PredefinedType="USERDEFINED",
        CostValues=[rate],
        CostQuantities=[quantity],
    )
    products = [product for name in line.elements if (product := marker.find(name)) is not None]
    if products:
        marker.rooted("IfcRelAssignsToControl", f"{key}/rel", RelatedObjects=products, RelatingControl=item)
    marker.properties(
        item,
        {
            "CompletionBest": line.completion.best_shown,
            "CompletionLower": line.completion.lower,
            "CompletionUpper": line.completion.upper,
            "Coverage": line.completion.coverage,
            "Basis": _basis(line, rounded=count != line.as_built_lower),
        },
    )
    return item


def _basis(line: CostProgress, *, rounded: bool) -> Note:
    """Say which bound of the as-built quantity an item holds."""
    shown = line.best_quantity_shown
    best: Values = {} if shown is None else {"best": shown}
    return noted(
        Reason.BASIS_COST,
        about(SubjectKind.COST_LINE, line.global_id),
        **best,
        takes_off=line.takes_off,
        certain=line.as_built_lower,
        rounded=rounded,
        planned=line.planned_quantity,
        unit=line.unit,
    )


def _unit_of(planned: Any) -> Any:
    """Return the unit that a planned item's quantities are in, None where that is the project's."""
    quantities = getattr(planned, "CostQuantities", None) or ()
    return next((one.Unit for one in quantities if one.is_a("IfcPhysicalSimpleQuantity")), None)
