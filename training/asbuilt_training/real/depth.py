"""Relative depth against a laser's or a stereo pair's, after the best scale and shift; plain guesses beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthErrors:
    """Mean of |Z - truth| / truth, the share within a factor of 1.25, and of how many pixels."""

    abs_rel: float
    within: float
    pixels: int


def depth_errors(relative: Map, true_depth_m: Map) -> DepthErrors:
    """Hold a relative inverse depth (h, w) against metres (h, w), NaN where unknown.

    Scale and shift are least squares in inverse depth over the known pixels; what they send behind the farthest truth
    is set to twice its distance, since inverse depth may end at zero or below.

    Reference: Ranftl et al. 2022, "Towards Robust Monocular Depth Estimation", section 5.
    """
    known = np.isfinite(true_depth_m) & np.isfinite(relative)
    truth, guess = true_depth_m[known], relative[known]
    guess = (guess - guess.mean()) / max(float(guess.std()), 1e-30)  # a network's own scale may be tiny
    design = np.column_stack([guess, np.ones_like(guess)])
    fitted = design @ np.linalg.lstsq(design, 1.0 / truth, rcond=None)[0]
    depth = 1.0 / np.maximum(fitted, 0.5 / truth.max())
    ratio = np.maximum(depth / truth, truth / depth)
    return DepthErrors(
        abs_rel=float(np.mean(np.abs(depth - truth) / truth)), within=float(np.mean(ratio < 1.25)), pixels=truth.size
    )


def flat(shape: tuple[int, int]) -> Map:
    """Return the guess that all is equally far."""
    return np.zeros(shape)


def ramp(shape: tuple[int, int]) -> Map:
    """Return the guess that what is lower in the picture is nearer, evenly from top to bottom."""
    return np.repeat(np.arange(shape[0], dtype=np.float64)[:, None], shape[1], axis=1)
