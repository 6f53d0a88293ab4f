"""How likely what a station shows is where concrete stands, against where it doesn't: one regression's answer.

A station sees a sample's place built, or open, or it sees neither: something stands before it, or isn't concrete. What
it doesn't see says nothing, however likely "built" is elsewhere: its odds are even, so what nobody sees stays unknown.
The weights are fitted on rendered sites whose every sample is known (benchmarks/site/fit_evidence.py writes
evidence.json, with their covariance and what each feature buys).
Reference: Cox 1958, the regression of binary sequences; here of three outcomes.
"""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.progress.states.features import FEATURES, Shown, features_of

DATA = Path(__file__).with_name("evidence.json")
MOST_NATS = 8.0
"""The most that stations say of one sample: one in 3,000 wrong, of which a fit on a thousand elements knows nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Weights (K + 1, 2) of built and open, the base last; how often (3,) neither, built, open; the odds to decide.

    `features` (K,) names what the weights are of: a feature that was not fitted yet weighs nothing.
    """

    weights: FloatArray
    often: FloatArray
    limit: float
    features: tuple[str, ...] = tuple(FEATURES)


@lru_cache(maxsize=1)
def model() -> Model:
    """Read the fitted model that lies in the package."""
    held = json.loads(DATA.read_text(encoding="utf-8"))
    features = tuple(held["features"])
    if not set(features) <= set(FEATURES):
        raise ValueError(f"{DATA.name} was fitted on features that are gone: run benchmarks/site/fit_evidence.py again")
    return Model(
        weights=frozen(held["weights"]), often=frozen(held["often"]), limit=float(held["limit"]), features=features
    )


def log_odds(seen: Shown) -> FloatArray:
    """Return log p(what is shown | built) / p(the same | open) of every sample (N,); 0 where nothing is shown."""
    odds = np.zeros(len(seen.faced))
    odds[seen.faced] = odds_of(features_of(seen, model().features)[seen.faced], model())
    return odds


def odds_of(features: FloatArray, fitted: Model) -> FloatArray:
    """Return the log-odds (N,) of features (N, K).

    Nothing speaks for built where no surface is seen, and nothing for open where none is seen past.
    """
    chance = chances(features, fitted.weights) / fitted.often
    hidden = fitted.often[0]
    built, opened = (hidden * chance[:, 0] + (1.0 - hidden) * chance[:, kind] for kind in (1, 2))
    near, past = (features[:, fitted.features.index(name)] > 0.0 for name in ("near", "behind"))
    odds: FloatArray = np.clip(np.log(built / opened), np.where(past, -np.inf, 0.0), np.where(near, np.inf, 0.0))
    return odds


def chances(features: FloatArray, weights: FloatArray) -> FloatArray:
    """Return how likely each sample (N, K) is seen as neither, built, open: (N, 3)."""
    score = np.column_stack([np.zeros(len(features)), features @ weights[:-1] + weights[-1]])
    power = np.exp(score - score.max(axis=1, keepdims=True))
    found: FloatArray = power / power.sum(axis=1, keepdims=True)
    return found


def no_surer_than_learned(odds: FloatArray) -> FloatArray:
    """Return log-odds (N,) of all stations together, held to what so many known elements can tell."""
    return np.clip(odds, -MOST_NATS, MOST_NATS)


def least_nats() -> float:
    """Return the log-odds from which on a sample is decided."""
    return model().limit


def decided(odds: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Say which samples are built, and which are open, by log-odds (N,) of all stations together."""
    limit = model().limit
    return odds > limit, odds < -limit
