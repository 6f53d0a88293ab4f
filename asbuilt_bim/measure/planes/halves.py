"""How far a face's own pixels agree on its plane: it is refined on each half of them alone, split twice.

A covariance by residuals takes blocks of them for independent, and all for one even surface. Where some show another
surface, or matching errs alike over a wide part, halves differ by more than that. Then the plane is so much less sure.

The two numbers are fitted on rendered planes whose truth is known (benchmarks/faces/fit_planes.py writes halves.json).
Reference: a variance known to a scaled inverse chi-square, Gelman et al. 2013, Bayesian Data Analysis, 2.6 and 3.2.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.masks import box_of
from asbuilt_bim.measure.planes.refine import Pictures, PlaneFit, refine_plane

DATA = Path(__file__).with_suffix(".json")
NUMBERS = 3
"""Of a plane: what two halves may differ in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HalvesModel:
    """What a plane's variance is before its halves were compared: `variance` times its own, known to `freedom`."""

    freedom: float
    variance: float

    def times(self, splits: Sequence[float]) -> float:
        """Return by what a plane's covariance is wider, of the chi-squares by which its halves differ."""
        known = self.freedom + NUMBERS * len(splits)
        return (self.freedom * self.variance + float(np.sum(splits))) / known


@lru_cache(maxsize=1)
def model() -> HalvesModel:
    """Read the fitted model that lies in the package."""
    held = json.loads(DATA.read_text(encoding="utf-8"))
    return HalvesModel(freedom=held["freedom"], variance=held["variance"])


def as_halves_agree(both: Pictures, rays: FloatArray, fit: PlaneFit, core: BoolArray) -> PlaneFit:
    """Return a plane that was refined on the pixels `core` (H, W), as sure as their halves agree on it."""
    splits = splits_of(both, rays, fit.q_px, core)
    doubt = excess_share(float(np.sum(splits)), NUMBERS * len(splits)) if splits else 1.0
    return replace(fit, covariance=fit.covariance * model().times(splits), doubt=doubt)


def excess_share(chi2: float, freedom: int) -> float:
    """Return the share 0..1 of a squared difference that isn't by chance, of its chi-square (James and Stein 1961)."""
    return max(0.0, 1.0 - freedom / max(chi2, 1e-9))


def splits_of(both: Pictures, rays: FloatArray, q_px: FloatArray, core: BoolArray) -> list[float]:
    """Return the chi-squares by which left and right, upper and lower half differ; of those that hold a plane."""
    found: list[float] = []
    box = box_of(core)
    for place in np.ogrid[box]:
        middle = np.median(np.broadcast_to(place, core[box].shape)[core[box]])
        fits: list[PlaneFit] = []
        for side in (place <= middle, place > middle):
            half = np.zeros_like(core)
            half[box] = core[box] & side
            fit = refine_plane(both, rays, half, q_px, again=True)
            fits += [fit] if fit is not None else []
        if len(fits) == 2:
            apart = fits[0].q_px - fits[1].q_px
            found.append(float(apart @ np.linalg.solve(fits[0].covariance + fits[1].covariance, apart)))
    return found
