"""The trend over the visits: what is certain, what is possible, and what the plan wants, as one drawing."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta

from asbuilt_bim.progress.completion.planned import calendar_of, planned_share
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.wording.completion import best_shown

WIDTH, HEIGHT = 720.0, 260.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 52.0, 16.0, 16.0, 34.0
_STEPS = 60
"""Points of the planned curve."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A visit on the drawing; `best` is None where not enough was seen."""

    day: date
    x: float
    lower: float
    upper: float
    best: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """Paths in the drawing's units: the band from at least to possibly, both bounds, the plan; and the visits."""

    band: str
    lower: str
    upper: str
    plan: str
    marks: tuple[Mark, ...]
    first: date
    last: date
    elements: int
    of: int
    planned_now: float | None  # share that the plan wants by the visit's day


def trend_of(report: ProgressReport, earlier: Sequence[ProgressReport]) -> Trend | None:
    """Draw the visits in the order of days; None where there is one visit and no plan.

    With a plan the drawing is of the elements that have one, so that its curves can be compared.
    """
    plan = _Plan(report)
    if not earlier and not plan.elements:
        return None
    visits = [*sorted(earlier, key=lambda one: one.visit_date), report]
    days = [one.visit_date for one in visits]
    first, last = min([*days, *plan.days]), max([*days, *plan.days])
    span = max((last - first).days, 1)

    def x(day: date) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * (day - first).days / span

    marks = tuple(_mark(one, plan, x(one.visit_date)) for one in visits)
    low, high = ([(m.x, _y(getattr(m, what))) for m in marks] for what in ("lower", "upper"))
    steps = [first + timedelta(days=round(span * step / _STEPS)) for step in range(_STEPS + 1)]
    return Trend(
        band=_line([*low, *reversed(high)]) + "Z",
        lower=_line(low),
        upper=_line(high),
        plan=_line([(x(day), _y(plan.share(day))) for day in dict.fromkeys(steps)]) if plan.elements else "",
        marks=marks,
        first=first,
        last=last,
        elements=len(plan.elements) or len(report.elements),
        of=len(report.elements),
        planned_now=plan.share(report.visit_date) if plan.elements else None,
    )


class _Plan:
    """What the plan wants of the elements that have one, by their exposed design area."""

    def __init__(self, report: ProgressReport) -> None:
        dated = [task for task in report.tasks if task.schedule_start and task.schedule_finish]
        self._calendar = calendar_of(report)
        self._spans: dict[str, list[tuple[datetime, datetime]]] = {}
        for task in dated:
            assert task.schedule_start is not None
            assert task.schedule_finish is not None
            for key in task.progress.elements:
                self._spans.setdefault(key, []).append((task.schedule_start, task.schedule_finish))
        self.elements = {e.global_id: e.design_area_m2 for e in report.elements if e.global_id in self._spans}
        self.days = [moment.date() for spans in self._spans.values() for span in spans for moment in span]

    def share(self, day: date) -> float:
        """Return the share (0..1) that the plan wants by the end of a day."""
        total = wanted = 0.0
        for key, area in self.elements.items():
            shares = [planned_share(start, finish, day, self._calendar) for start, finish in self._spans[key]]
            known = [share for share in shares if share is not None]
            total += area
            wanted += area * sum(known) / max(len(known), 1)
        return wanted / total if total > 0.0 else 0.0


def _mark(report: ProgressReport, plan: _Plan, x: float) -> Mark:
    """Return a visit's bounds: the whole's, or those of the elements that have a plan."""
    done = report.whole.completion
    if not plan.elements or len(plan.elements) == len(report.elements):
        best = best_shown(done)
        return Mark(
            day=report.visit_date, x=x, lower=done.lower, upper=done.upper, best=None if best is None else _y(best)
        )
    own = [element for element in report.elements if element.global_id in plan.elements]
    weights = [plan.elements[element.global_id] for element in own]
    total = max(sum(weights), 1e-9)
    lower, upper = (
        sum(w * getattr(e.completion, what) for e, w in zip(own, weights, strict=True)) / total
        for what in ("lower", "upper")
    )
    return Mark(day=report.visit_date, x=x, lower=lower, upper=upper, best=None)


def _y(share: float) -> float:
    return _TOP + (HEIGHT - _TOP - _BOTTOM) * (1.0 - share)


def _line(points: Sequence[tuple[float, float]]) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
