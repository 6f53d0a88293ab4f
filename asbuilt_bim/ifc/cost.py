"""Cost schedules: what each line pays for, how much of it, and at what rate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.ifc.marks import AS_BUILT
from asbuilt_bim.ifc.units import Measure, Units, quantity_measure, unit_scale, unit_symbol

_MAX_DEPTH = 32


def read_cost_lines(file: Any, elements: frozenset[str], units: Units) -> tuple[tuple[CostLine, ...], tuple[str, ...]]:
    """Return the cost lines that pay for elements of the design, and notes on the items that can't be used."""
    if file.schema == "IFC2X3":
        note = "IFC2X3 cost items hold neither quantities nor rates: cost comes from the workbook only"
        return (), (note,) if file.by_type("IfcCostItem") else ()
    lines: list[CostLine] = []
    notes: list[str] = []
    for item in planned_items(file):
        made = tuple(dict.fromkeys(e for e in _products(item) if e in elements))
        if not made:
            continue
        line = _line(file, item, made, units)
        if isinstance(line, str):
            notes.append(f"cost item {item.Name or item.GlobalId}: {line}; it is left out")
        else:
            lines.append(line)
    return tuple(lines), tuple(notes)


def planned_items(file: Any) -> Iterator[Any]:
    """Yield the cost items of the planned schedules; what lies in a schedule of ours is left out."""
    ours = {
        item.id()
        for schedule in file.by_type("IfcCostSchedule")
        if schedule.ObjectType == AS_BUILT
        for item in _items_of(schedule)
    }
    yield from (item for item in file.by_type("IfcCostItem") if item.id() not in ours)


def _items_of(schedule: Any) -> Iterator[Any]:
    for relation in schedule.Controls or ():
        for item in relation.RelatedObjects:
            if item.is_a("IfcCostItem"):
                yield from _tree(item)


def _tree(item: Any, depth: int = 0) -> Iterator[Any]:
    yield item
    for relation in (item.IsNestedBy or ()) if depth < _MAX_DEPTH else ():
        for inner in relation.RelatedObjects:
            yield from _tree(inner, depth + 1)


def _products(item: Any) -> Iterator[str]:
    for relation in item.Controls or ():
        yield from (product.GlobalId for product in relation.RelatedObjects if not product.is_a("IfcCostItem"))


def _line(file: Any, item: Any, elements: tuple[str, ...], units: Units) -> CostLine | str:
    """Return a cost item as a line, or why it can't be one."""
    quantities = [q for q in item.CostQuantities or () if q.is_a("IfcPhysicalSimpleQuantity")]
    if not quantities:
        return "it has no quantity"
    measure = quantity_measure(quantities[0])
    if measure is None or any(quantity_measure(q) != measure for q in quantities):
        return "its quantities are not all volumes, all areas, all lengths or all counts"
    own = quantities[0].Unit
    scale = unit_scale(own) if own is not None else units.scale(measure)
    planned = sum(units.quantity(q)[1] for q in quantities) / scale
    rates = [_rate(value, measure, units, scale) for value in item.CostValues or ()]
    if not rates or any(rate is None for rate in rates):
        return "it has no rate, or one that is no plain sum"
    return CostLine(
        global_id=item.GlobalId,
        name=item.Name or "",
        identification=str(item.Identification or ""),
        elements=elements,
        unit=unit_symbol(file, measure, own),
        measure=measure,
        planned_quantity=planned,
        rate=float(sum(rate for rate in rates if rate is not None)),
        currency=units.currency,
    )


def _rate(value: Any, measure: Measure, units: Units, scale: float, depth: int = 0) -> float | None:
    """Return a cost value per one of the line's unit: components added, the unit basis divided out."""
    if value.Components and depth < _MAX_DEPTH:
        inner = [_rate(part, measure, units, scale, depth + 1) for part in value.Components]
        if value.ArithmeticOperator not in (None, "ADD") or any(part is None for part in inner):
            return None
        amount = float(sum(part for part in inner if part is not None))
    elif value.AppliedValue is not None and hasattr(value.AppliedValue, "wrappedValue"):
        amount = float(value.AppliedValue.wrappedValue)
    else:
        return None
    if value.UnitBasis is None:
        return amount
    basis = float(value.UnitBasis.ValueComponent.wrappedValue)
    if measure != "count":
        basis *= unit_scale(value.UnitBasis.UnitComponent) / scale
    return amount / basis if basis > 0.0 else None
