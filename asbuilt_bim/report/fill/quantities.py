"""What can be filled in of an element, of a cost line, and of all elements of one class, storey and type."""

from collections.abc import Callable, Mapping, Sequence

from asbuilt_bim.progress.completion.rollup import weighted
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import CostProgress, ElementProgress, ShownState
from asbuilt_bim.progress.valuation.bill import BillLine

Quantity = str | float | int | None
"""None is unknown, and never written as 0."""


def _best(element: ElementProgress, amount: float) -> float | None:
    best = element.completion.best_shown
    return None if best is None else best * amount


def _last_seen(element: ElementProgress) -> str | None:
    return element.last_seen.isoformat() if element.last_seen else None


OF_ELEMENTS: Mapping[str, Callable[[ElementProgress], Quantity]] = {
    "state": lambda e: e.shown_state,
    "completion_best": lambda e: e.completion.best_shown,
    "completion_lower": lambda e: e.completion.lower,
    "completion_upper": lambda e: e.completion.upper,
    "coverage": lambda e: e.completion.coverage,
    "design_area_m2": lambda e: e.design_area_m2,
    "as_built_area_m2": lambda e: e.as_built_area_m2,
    "as_built_sigma_m2": lambda e: e.as_built_sigma_m2,
    "built_area_best_m2": lambda e: _best(e, e.design_area_m2),
    "built_area_lower_m2": lambda e: e.completion.lower * e.design_area_m2,
    "built_area_upper_m2": lambda e: e.completion.upper * e.design_area_m2,
    "design_volume_m3": lambda e: e.design_volume_m3,
    "built_volume_best_m3": lambda e: _best(e, e.design_volume_m3),
    "built_volume_lower_m3": lambda e: e.completion.lower * e.design_volume_m3,
    "built_volume_upper_m3": lambda e: e.completion.upper * e.design_volume_m3,
    "last_seen": _last_seen,
}
OF_COST_LINES: Mapping[str, Callable[[CostProgress], Quantity]] = {
    "completion_best": lambda c: c.completion.best_shown,
    "completion_certain": lambda c: c.certain,
    "coverage": lambda c: c.completion.coverage,
    "planned_quantity": lambda c: c.planned_quantity,
    "as_built_best": lambda c: c.best_quantity_shown,
    "as_built_lower": lambda c: c.as_built_lower,
    "earned_best": lambda c: c.earned_best_shown,
    "earned_lower": lambda c: c.earned_lower,
}
OF_BILL_LINES: Mapping[str, Callable[[BillLine], Quantity]] = {
    "certified_quantity": lambda b: b.quantity,
    "certified_amount": lambda b: b.amount,
    "previous_quantity": lambda b: b.previous_quantity,
    "previous_amount": lambda b: b.previous,
    "period_amount": lambda b: b.period,
}
"""As the valuation has it: overrides, changed rates and, where they count, observations included."""
_SUMS = (
    *("design_area_m2", "built_area_lower_m2", "built_area_upper_m2"),
    *("design_volume_m3", "built_volume_lower_m3", "built_volume_upper_m3"),
)
_BESTS = {"built_area_best_m2": "design_area_m2", "built_volume_best_m3": "design_volume_m3"}
"""The best estimates of a group, by what weighs its elements."""
_COUNTS: Mapping[str, ShownState] = {
    "elements_complete": "complete",
    "elements_part": "part",
    "elements_not_started": "not started",
    "elements_displaced": "displaced",
    "elements_unknown": "unknown",
    "elements_as_far_as_seen": "complete as far as seen",
}


def _count(state: ShownState) -> Callable[[Sequence[ElementProgress]], Quantity]:
    return lambda members: sum(one.shown_state == state for one in members)


def _sum(name: str) -> Callable[[Sequence[ElementProgress]], Quantity]:
    return lambda members: sum(_amounts(name, members))


def _best_of(weight: str) -> Callable[[Sequence[ElementProgress]], Quantity]:
    """Return the best estimate of a group, as storeys and cost lines have it; unknown where under half was seen."""

    def of(members: Sequence[ElementProgress]) -> Quantity:
        amounts = _amounts(weight, members)
        best = weighted(members, amounts, ProgressOptions()).best_shown
        return None if best is None else best * sum(amounts)

    return of


def _amounts(name: str, members: Sequence[ElementProgress]) -> list[float]:
    return [float(value) for one in members if (value := OF_ELEMENTS[name](one)) is not None]


def _measured(members: Sequence[ElementProgress]) -> Quantity:
    """Return the area that was measured; unknown where none was."""
    areas = [one.as_built_area_m2 for one in members if one.as_built_area_m2 is not None]
    return sum(areas) if areas else None


OF_GROUPS: Mapping[str, Callable[[Sequence[ElementProgress]], Quantity]] = {
    "elements": len,
    **{name: _count(state) for name, state in _COUNTS.items()},
    "as_built_area_m2": _measured,
    **{name: _sum(name) for name in _SUMS},
    **{name: _best_of(weight) for name, weight in _BESTS.items()},
}
