"""In tolerance or not: offset and lean of an element's measured faces against limits, each with its sigma.

Built is one thing, in tolerance another: neither decides the other. An element is in only where all that was measured
of it lies inside by two sigma, out only where something lies outside by as much (the rule of ISO 14253-1, with a
coverage factor of 2, that is 95 %). All else is undecided.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from asbuilt_bim.progress.surface import SurfaceState

COVERAGE = 2.0
"""Sigmas that a deviation has to lie inside or outside of its limit."""
Verdict = Literal["in", "out", "undecided"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlumbLimit:
    """How far an element may lean from foot to top: `least_m`, or a share of its height where that is more."""

    least_m: float
    height_share: float = 0.0
    up_to_m: float | None = None  # for elements up to this height; None for all

    def limit_m(self, height_m: float) -> float:
        """Return the limit for an element of a height."""
        return max(self.least_m, self.height_share * height_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """Limits that a project asks for; `plumb` rows from the lowest elements on, none where lean isn't judged."""

    name: str
    offset_m: float | None  # of a face from its design, either way; None where that isn't judged
    plumb: tuple[PlumbLimit, ...] = ()

    def plumb_limit_m(self, height_m: float) -> float | None:
        """Return the limit for an element of a height, None where the rows say nothing of it."""
        rows = (row for row in self.plumb if row.up_to_m is None or height_m <= row.up_to_m)
        row = next(rows, None)
        return row.limit_m(height_m) if row is not None else None


@dataclass(frozen=True, slots=True, kw_only=True)
class ToleranceCheck:
    """What was found of an element; `lean_m` is how far its top stands off its foot."""

    verdict: Verdict
    offset: Verdict | None  # None where it isn't judged
    plumb: Verdict | None
    offset_limit_m: float | None
    plumb_limit_m: float | None
    lean_m: float | None
    lean_sigma_m: float | None


EN_13670_1 = Tolerance(
    name="EN 13670, class 1",
    offset_m=0.025,
    plumb=(
        PlumbLimit(least_m=0.015, height_share=1.0 / 400.0, up_to_m=10.0),
        PlumbLimit(least_m=0.025, height_share=1.0 / 600.0),
    ),
)
"""Columns and walls: place in plan against secondary lines (annex G), inclination (figure 2)."""


def checked(
    tolerance: Tolerance, surfaces: Iterable[SurfaceState], height_m: float, moved_m: float | None = None
) -> ToleranceCheck:
    """Judge an element by its measured faces; `moved_m` is how far it stands beside its design, where it does.

    What is judged where it stands instead has its offsets from there: then the move alone says whether it is in place,
    and what is known to have moved is never in.
    """
    measured = list(surfaces)
    offsets = [(s.offset_m, s.offset_sigma_m) for s in measured if s.offset_m is not None]
    leans = [(height_m * np.tan(s.tilt_rad), _lean_sigma(s, height_m)) for s in measured if s.tilt_rad is not None]
    plumb_limit = tolerance.plumb_limit_m(height_m)
    offset: Verdict | None = None if tolerance.offset_m is None else _verdict(offsets, tolerance.offset_m)
    if moved_m is not None and tolerance.offset_m is not None:
        offset = "out" if moved_m > tolerance.offset_m else "undecided"
    plumb: Verdict | None = None
    if tolerance.plumb:
        plumb = "undecided" if plumb_limit is None else _verdict(leans, plumb_limit)
    verdicts = [one for one in (offset, plumb) if one is not None]
    lean, sigma = max(leans, key=lambda one: abs(one[0]), default=(None, None))
    return ToleranceCheck(
        verdict="out" if "out" in verdicts else "undecided" if "undecided" in verdicts else "in",
        offset=offset,
        plumb=plumb,
        offset_limit_m=tolerance.offset_m,
        plumb_limit_m=plumb_limit,
        lean_m=None if lean is None else float(lean),
        lean_sigma_m=sigma,
    )


def _lean_sigma(surface: SurfaceState, height_m: float) -> float | None:
    return None if surface.tilt_sigma_rad is None else height_m * surface.tilt_sigma_rad


def _verdict(found: Iterable[tuple[float | None, float | None]], limit_m: float) -> Verdict:
    """Judge deviations (m) with their sigmas (m); one without a sigma decides nothing, and keeps all from being in."""
    known = [(abs(value), sigma) for value, sigma in found if value is not None]
    if any(sigma is not None and value - COVERAGE * sigma > limit_m for value, sigma in known):
        return "out"
    if known and all(sigma is not None and value + COVERAGE * sigma <= limit_m for value, sigma in known):
        return "in"
    return "undecided"
