"""How far a face's own pixels agree on its plane: each half of them alone is asked for its own, split twice.

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

from asbuilt_bim.measure.planes.refine import LEAST_PIXELS, PlaneFit, sandwich

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


def as_halves_agree(fit: PlaneFit) -> PlaneFit:
    """Return a refined plane as sure as halves of its pixels agree on it."""
    splits = splits_of(fit)
    doubt = excess_share(float(np.sum(splits)), NUMBERS * len(splits)) if splits else 1.0
    return replace(fit, covariance=fit.covariance * model().times(splits), doubt=doubt)


def excess_share(chi2: float, freedom: int) -> float:
    """Return the share 0..1 of a squared difference that isn't by chance, of its chi-square (James and Stein 1961)."""
    return max(0.0, 1.0 - freedom / max(chi2, 1e-9))


def splits_of(fit: PlaneFit) -> list[float]:
    """Return the chi-squares by which left and right, upper and lower half differ; of those that hold a plane.

    A half's plane is one step from the whole's, on its own pixels: they are compared there already.
    """
    found: list[float] = []
    for places in (fit.compared.rows, fit.compared.columns):
        middle = np.median(places)
        halves = [fit.compared.of(np.flatnonzero(side)) for side in (places <= middle, places > middle)]
        if min(len(half.rows) for half in halves) < LEAST_PIXELS:
            continue
        steps = [(half, *step) for half in halves if (step := half.step()) is not None]
        if len(steps) == 2:
            apart = steps[0][1] - steps[1][1]
            both = sum(sandwich(half.after(change), hessian) for half, change, hessian in steps)
            found.append(float(apart @ np.linalg.solve(both, apart)))
    return found
