"""Was a face seen whole? Each side's probability to be the face's end, by one regression on what lies about it.

The weights are fitted on rendered scenes whose every border is known (benchmarks/faces/fit_ends.py writes ends.json,
with their covariance and what each feature buys).
Reference: Cox 1958, the regression of binary sequences.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.outline.border import FEATURES, OUTWARD_PX, BorderSide, Surface, shown_by
from asbuilt_bim.measure.workbench import Workbench

DATA = Path(__file__).with_suffix(".json")
LEAST = 1e-6
"""No side is surer than that, either way."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Weights (K + 1,) of the features and the base; a face's two; what a face must reach to count as whole."""

    weights: FloatArray
    face: FloatArray  # (2,): what the odds of its sides' mean count, and the base
    limit: float
    least_side_px: float  # a shorter side ends where its neighbours do


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """How likely a side is its face's end, and how far past it nothing else is seen: nearby, and at all."""

    probability: float
    open_px: float
    far_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """How likely a face was seen whole, and what speaks against it most: the frame, a near thing, or neither."""

    probability: float
    by_edge: Mapping[int, End]  # of each straight side, by the number of its edge
    cut_by_frame: bool
    occluded: bool
    open_edge: bool

    def of_edge(self, number: int) -> End:
        """Return what is known of an edge; one that no place lies on is as likely an end as all together."""
        far = OUTWARD_PX[-1]
        return self.by_edge.get(number, End(probability=self.probability, open_px=far, far_px=far))


@lru_cache(maxsize=1)
def model() -> Model:
    """Read the fitted model that lies in the package."""
    held = json.loads(DATA.read_text(encoding="utf-8"))
    if tuple(held["features"]) != FEATURES:
        raise ValueError(f"{DATA.name} was fitted on other features: run benchmarks/faces/fit_ends.py again")
    return Model(
        weights=frozen(held["weights"]), face=frozen(held["face"]), limit=held["limit"],
        least_side_px=held["least_side_px"],
    )  # fmt: skip


def judge_ends(bench: Workbench, sides: Sequence[BorderSide], own: Surface) -> Ends:
    """Say how likely the face within these sides was seen whole."""
    fitted = model()
    seen = [shown_by(bench, side, own) for side in sides]
    shown = np.array([one.features for one in seen])
    each = side_probabilities(shown, fitted.weights)
    lengths = np.array([side.length_px for side in sides])
    counts = lengths >= min(fitted.least_side_px, float(lengths.max()))
    probability = face_probability(each[counts], fitted.face)
    ends = [End(probability=float(p), open_px=s.open_px, far_px=s.far_px) for p, s in zip(each, seen, strict=True)]
    by_edge = dict(zip((side.number for side in sides), ends, strict=True))
    weakest = dict(zip(FEATURES, shown[counts][int(np.argmin(each[counts]))], strict=True))
    cut, hidden = weakest["past the frame"], weakest["before"]
    reason = int(np.argmax([cut, hidden, 1.0 - cut - hidden])) if probability < fitted.limit else None
    return Ends(
        probability=probability, by_edge=by_edge, cut_by_frame=reason == 0, occluded=reason == 1, open_edge=reason == 2
    )  # fmt: skip


def side_probabilities(features: FloatArray, weights: FloatArray) -> FloatArray:
    """Return how likely each side (N,) is the end of its face, of features (N, K)."""
    odds: FloatArray = features @ weights[:-1] + weights[-1]
    return _logistic(odds)


def odds_of_mean(sides: FloatArray) -> float:
    """Return the logarithm of the odds of the sides' geometric mean: one that is surely no end pulls it down."""
    against = max(-float(np.mean(np.log(np.maximum(sides, LEAST)))), LEAST)
    return -float(np.log(np.expm1(against)))


def face_probability(sides: FloatArray, face: FloatArray) -> float:
    """Return how likely a face is whole whose sides have these probabilities: they err together, not one by one."""
    return float(_logistic(face[0] * odds_of_mean(sides) + face[1]))


def _logistic(odds: FloatArray) -> FloatArray:
    probability: FloatArray = 1.0 / (1.0 + np.exp(-np.clip(odds, -30.0, 30.0)))
    return probability
