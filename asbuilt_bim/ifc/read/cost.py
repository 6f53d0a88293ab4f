"""Cost schedules: what each line pays for, how much of it, and at what rate."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from asbuilt_bim.bim.cost_notes import cost_notes
from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.ifc.identity import with_ids
from asbuilt_bim.ifc.names import AS_BUILT
from asbuilt_bim.ifc.read.assignments import Assigned, assigned_elements
from asbuilt_bim.ifc.units import Measure, Units, quantity_measure, unit_scale, unit_symbol

_MAX_DEPTH = 32
MAX_NUMBER = 1e15
"""No building's quantity, rate or unit; sums of what is beyond it lose cents, then overflow."""


def read_cost_lines(file: Any, elements: frozenset[str], units: Units) -> tuple[tuple[CostLine, ...], tuple[Note, ...]]:
    """Return the cost lines that pay for elements of the design, and notes on the items that can't be used."""
    if file.schema == "IFC2X3":
        note = noted(Reason.COST_NOT_IN_IFC2X3, about(SubjectKind.DESIGN))
        return (), (note,) if file.by_type("IfcCostItem") else ()
    lines: dict[int, CostLine] = {}
    notes: list[Note] = []
    elsewhere = 0
    paying: dict[Any, tuple[Assigned, str]] = {}
    for item, schedule in planned_items(file):
        pays_for = assigned_elements(_products(item), elements)
        if pays_for.elements:
            paying[item] = pays_for, schedule
        else:
            elsewhere += bool(item.CostQuantities and item.CostValues)
    known, strangers = with_ids(paying, SubjectKind.COST_LINE, each_once=True)
    notes += strangers
    for item in known:
        pays_for, schedule = paying[item]
        line = _line(file, item, schedule, pays_for, units)
        if isinstance(line, Note):
            notes.append(line)
        else:
            lines[item.id()] = line
    whole = [number for number in lines if _has_part_among(file.by_id(number), lines)]
    for line in [lines.pop(number) for number in whole]:
        subject = about(SubjectKind.COST_LINE, line.global_id)
        notes.append(noted(Reason.COST_NESTED, subject, item=line.name or line.global_id))
    notes += cost_notes(list(lines.values()))
    if elsewhere:
        notes.append(noted(Reason.COST_OF_OTHER_WORK, about(SubjectKind.DESIGN), count=elsewhere))
    return tuple(lines.values()), tuple(notes)


def planned_items(file: Any) -> Iterator[tuple[Any, str]]:
    """Yield the cost items and the names of their schedules; schedules that this program wrote are left out."""
    schedules = file.by_type("IfcCostSchedule")
    of_name = Counter(schedule.Name for schedule in schedules)
    home = {
        item.id(): None if schedule.ObjectType == AS_BUILT else _label(schedule, of_name)
        for schedule in schedules
        for relation in schedule.Controls or ()
        for top in relation.RelatedObjects
        if top.is_a("IfcCostItem")
        for item in _tree(top)
    }
    for item in file.by_type("IfcCostItem"):
        schedule = home.get(item.id(), "")
        if schedule is not None:
            yield item, schedule


def _label(schedule: Any, of_name: Mapping[str | None, int]) -> str:
    """Return a cost schedule's name, with its GlobalId where another has the same."""
    if not schedule.Name:
        return str(schedule.GlobalId)
    return f"{schedule.Name} ({schedule.GlobalId})" if of_name[schedule.Name] > 1 else str(schedule.Name)


def _tree(item: Any) -> Iterator[Any]:
    """Yield a cost item and all that are nested in it, each once."""
    met: set[int] = set()
    open_ones = [item]
    while open_ones:
        one = open_ones.pop()
        if one.id() not in met:
            met.add(one.id())
            yield one
            open_ones += [inner for relation in one.IsNestedBy or () for inner in relation.RelatedObjects]


def _products(item: Any) -> Iterator[Any]:
    for relation in item.Controls or ():
        yield from relation.RelatedObjects


def _has_part_among(item: Any, lines: Mapping[int, CostLine]) -> bool:
    """Say whether a part of a cost item is a line itself: both would pay for one thing."""
    return any(inner.id() in lines for inner in _tree(item) if inner.id() != item.id())


def _line(file: Any, item: Any, schedule: str, pays_for: Assigned, units: Units) -> CostLine | Note:
    """Return a cost item as a line, or a note that says why it can't be one."""
    quantities = [q for q in item.CostQuantities or () if q.is_a("IfcPhysicalSimpleQuantity")]
    if not quantities:
        return _note(Reason.COST_NO_QUANTITY, item, {})
    measure = quantity_measure(quantities[0])
    if measure is None or any(quantity_measure(q) != measure for q in quantities):
        return _note(Reason.COST_MIXED_QUANTITIES, item, {})
    own = quantities[0].Unit
    scale = unit_scale(own) if own is not None else units.scale(measure)
    if not 1.0 / MAX_NUMBER <= scale <= MAX_NUMBER:
        return _note(Reason.COST_UNIT_IMPOSSIBLE, item, {"unit_scale": scale})
    planned = sum(units.quantity(q)[1] for q in quantities) / scale
    rate = _sum_of_rates(item.CostValues or (), measure, units, scale)
    if isinstance(rate, Reason):
        return _note(rate, item, {})
    for code, value in ((Reason.COST_QUANTITY_IMPOSSIBLE, planned), (Reason.COST_RATE_IMPOSSIBLE, rate)):
        if not abs(value) <= MAX_NUMBER:
            return _note(code, item, {"written": f"{value:.3g}", "limit": MAX_NUMBER})
    return CostLine(
        global_id=item.GlobalId,
        name=item.Name or "",
        identification=str(item.Identification or ""),
        elements=pays_for.elements,
        unit=unit_symbol(file, measure, own),
        measure=measure,
        planned_quantity=planned,
        rate=rate,
        currency=units.currency,
        schedule=schedule,
        unit_scale=scale,
        others=pays_for.others,
    )


def _note(code: Reason, item: Any, values: Values) -> Note:
    subject = about(SubjectKind.COST_LINE, item.GlobalId)
    return noted(code, subject, item=item.Name or item.GlobalId, **values)


def _sum_of_rates(values: Sequence[Any], measure: Measure, units: Units, scale: float) -> float | Reason:
    """Return the sum of an item's cost values per one of the line's unit, or why they have none."""
    if len(values) > 1 and any(one.ApplicableDate or one.FixedUntilDate or one.Condition for one in values):
        return Reason.COST_RATES_SEVERAL
    rates = [_rate(value, measure, units, scale) for value in values]
    if not rates or any(rate is None for rate in rates):
        return Reason.COST_NO_RATE
    return float(sum(rate for rate in rates if rate is not None))


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
