"""The trend over the visits: what is certain, what is possible, and what the plan wants, as one drawing."""

from collections.abc import Sequence
from dataclasses import dataclass

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.drawings.chart import Bounds, Chart, chart_of
from asbuilt_bim.report.drawings.planned_shares import PlannedElements, planned_elements
from asbuilt_bim.report.drawings.timeline import axis_over

_LEVELS = tuple((share / 100.0, f"{share} %") for share in (0, 25, 50, 75, 100))


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """The drawing, and what the visits knew, as shares of what it is of."""

    chart: Chart
    visits: tuple[Bounds, ...]
    elements: int
    of: int
    planned_now: float | None  # share that the plan wants by the visit's day


def trend_of(report: ProgressReport, earlier: Sequence[ProgressReport]) -> Trend | None:
    """Draw the visits in the order of days; None where there is one visit and no plan.

    With a plan the drawing is of the elements that have one, so that its curves can be compared.
    """
    plan = planned_elements(report)
    if not earlier and not plan.spans:
        return None
    visits = tuple(_bounds(one, plan, report) for one in (*sorted(earlier, key=lambda one: one.visit_date), report))
    axis = axis_over([*(one.day for one in visits), *plan.days])
    wanted = plan.wanted({e.global_id: e.design_area_m2 for e in report.elements})
    total = max(wanted.total, 1e-9)
    return Trend(
        chart=chart_of(axis, visits, (lambda day: wanted.by(day) / total) if plan.spans else None, _LEVELS),
        visits=visits,
        elements=len(plan.spans) or len(report.elements),
        of=len(report.elements),
        planned_now=wanted.by(report.visit_date) / total if plan.spans else None,
    )


def _bounds(visit: ProgressReport, plan: PlannedElements, report: ProgressReport) -> Bounds:
    """Return a visit's bounds: the whole's, or those of the elements that have a plan."""
    done = visit.whole.completion
    if not plan.spans or len(plan.spans) == len(report.elements):
        return Bounds(day=visit.visit_date, lower=done.lower, upper=done.upper, best=done.best_shown)
    weights = {e.global_id: e.design_area_m2 for e in report.elements if e.global_id in plan.spans}
    own = [element for element in visit.elements if element.global_id in weights]
    total = max(sum(weights[element.global_id] for element in own), 1e-9)
    lower, upper = (
        sum(weights[e.global_id] * getattr(e.completion, what) for e in own) / total for what in ("lower", "upper")
    )
    return Bounds(day=visit.visit_date, lower=lower, upper=upper)
