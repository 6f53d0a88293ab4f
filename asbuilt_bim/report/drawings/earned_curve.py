"""Planned against earned: what the cost lines should have earned by a day, and what each visit shows of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from asbuilt_bim.progress.completion.earned_value import certain_share
from asbuilt_bim.progress.report import CostProgress, ElementProgress, ProgressReport
from asbuilt_bim.report.cost_rows import CostGroup, cost_groups, possible_share
from asbuilt_bim.report.drawings.chart import Bounds, Chart, chart_of
from asbuilt_bim.report.drawings.planned_shares import PlannedElements, planned_elements
from asbuilt_bim.report.drawings.timeline import axis_over
from asbuilt_bim.report.wording.of_page.gantt_words import money_level

MOST_CURVES = 4
_LEVELS = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class EarnedAt:
    """What stood at a visit, in money: certain, possible, and what the plan wanted by then."""

    day: date
    certain: float
    possible: float
    planned: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EarnedCurve:
    """Planned against earned of one cost schedule and currency."""

    name: str
    currency: str
    chart: Chart
    visits: tuple[EarnedAt, ...]
    total: float  # of what has planned dates
    contract: float  # of all lines


def earned_curves(report: ProgressReport, earlier: Sequence[ProgressReport]) -> tuple[EarnedCurve, ...]:
    """Return a curve for each cost schedule and currency; none without planned dates.

    A curve holds what the lines pay for elements with planned dates. Earlier visits count at today's lines and rates.
    """
    plan = planned_elements(report)
    visits = (*sorted(earlier, key=lambda one: one.visit_date), report)
    made = (_curve(group, visits, plan) for group in cost_groups(report)) if plan.spans else ()
    return tuple(curve for curve in made if curve is not None)[:MOST_CURVES]


def _curve(group: CostGroup, visits: Sequence[ProgressReport], plan: PlannedElements) -> EarnedCurve | None:
    worth: dict[str, float] = {}
    for _, key, amount in _parts(group, plan):
        worth[key] = worth.get(key, 0.0) + amount
    wanted = plan.wanted(worth)
    if wanted.total <= 0.0:
        return None
    known = tuple(_earned_at(visit, group, plan, wanted.by(visit.visit_date)) for visit in visits)
    most = max(wanted.total, *(one.possible for one in known))
    bounds = [Bounds(day=one.day, lower=one.certain / most, upper=one.possible / most) for one in known]
    axis = axis_over([*(one.day for one in known), *plan.days])
    levels = [(share, money_level(share * most, most)) for share in _LEVELS]
    return EarnedCurve(
        name=group.name,
        currency=group.currency,
        chart=chart_of(axis, bounds, lambda day: wanted.by(day) / most, levels),
        visits=known,
        total=wanted.total,
        contract=group.planned,
    )


def _parts(group: CostGroup, plan: PlannedElements) -> Iterator[tuple[CostProgress, str, float]]:
    """Yield what a line pays for an element with planned dates when it is finished."""
    for line in group.lines:
        for key, part in line.parts.items():
            if key in plan.spans:
                yield line, key, part * line.planned_value


def _earned_at(visit: ProgressReport, group: CostGroup, plan: PlannedElements, planned: float) -> EarnedAt:
    elements: Mapping[str, ElementProgress] = {element.global_id: element for element in visit.elements}
    certain = possible = 0.0
    for line, key, amount in _parts(group, plan):
        pieces, element = line.measure == "count", elements.get(key)
        if element is None:  # that visit's design didn't have it
            certain, possible = certain + min(amount, 0.0), possible + max(amount, 0.0)
            continue
        certain += amount * certain_share(element, pieces=pieces, takes_off=line.takes_off)
        possible += amount * possible_share(element, visit.complete_from, pieces=pieces, takes_off=line.takes_off)
    return EarnedAt(day=visit.visit_date, certain=certain, possible=possible, planned=planned)
