"""A band over the visits with the plan's curve, in percent of a drawing that takes any width."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, timedelta

from asbuilt_bim.report.drawings.timeline import Tick, TimeAxis

_STEPS = 60
"""Points of the planned curve."""
Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What was known at a visit, as shares of the drawing's height; `best` is None where not enough was seen."""

    day: date
    lower: float
    upper: float
    best: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartMark:
    """A visit on the drawing: percent from the left, and from the top."""

    day: date
    x: float
    lower: float
    upper: float
    best: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """A drawing: paths are SVG's in a square of 1,000, all else is in percent of it."""

    band: str  # corners of the band, as CSS' polygon takes them; "" of a single visit
    lower: str
    upper: str
    plan: str
    marks: tuple[ChartMark, ...]
    levels: tuple[Tick, ...]  # from the top
    ticks: tuple[Tick, ...]
    now: float


def chart_of(
    axis: TimeAxis,
    visits: Sequence[Bounds],
    planned: Callable[[date], float] | None,
    levels: Sequence[tuple[float, str]],
) -> Chart:
    """Draw the visits in the order of days; `planned` is the share by the end of a day, `levels` are shares named."""
    marks = tuple(
        ChartMark(
            day=one.day,
            x=axis.at(one.day),
            lower=_down(one.lower),
            upper=_down(one.upper),
            best=None if one.best is None else _down(one.best),
        )
        for one in visits
    )
    low, high = [(m.x, m.lower) for m in marks], [(m.x, m.upper) for m in marks]
    span = (axis.last - axis.first).days
    days = dict.fromkeys(axis.first + timedelta(days=round(span * step / _STEPS)) for step in range(_STEPS + 1))
    curve = [(axis.at(day), _down(planned(day))) for day in days] if planned else []
    several = len(marks) > 1
    return Chart(
        band=", ".join(f"{x:.2f}% {y:.2f}%" for x, y in [*low, *reversed(high)]) if several else "",
        lower=_line(low) if several else "",
        upper=_line(high) if several else "",
        plan=_line(curve),
        marks=marks,
        levels=tuple(Tick(at=_down(share), words=words) for share, words in levels),
        ticks=axis.ticks,
        now=axis.at(visits[-1].day),
    )


def _down(share: float) -> float:
    """Return how far (percent) below the top a share lies."""
    return min(100.0, max(0.0, 100.0 * (1.0 - share)))


def _line(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{10.0 * x:.1f} {10.0 * y:.1f}" for x, y in points) if points else ""
