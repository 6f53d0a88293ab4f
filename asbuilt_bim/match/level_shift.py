"""Do feet and heads of what was measured lie above those of the design, all alike?"""

from __future__ import annotations

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.upright_lines import Indices, Upright, level_pairs

REACH_M = 2.0
"""More than half a storey: whole ones are told by what stands on them."""
BAND_M = 0.02  # as in `beside`
LEAST_MORE, LEAST_MORE_SHARE = 3, 0.25
"""So many feet, and so many heads, and so large a share of all ends more are suited by the rise."""
_STEP_M = 0.01


def find_rise(seen: Upright, design: Upright) -> tuple[float, int]:
    """Return the upward move in metres, 0 where none is clearly better, and how many feet and heads more it suits.

    Feet are hidden and walls are poured in part: only where both ends of faces say the same is it a move.
    """
    if not len(seen.halves_m) or not len(design.halves_m):
        return 0.0, 0
    one, other, _ = level_pairs(seen, design, BAND_M)
    ends = seen.heights_m[one] - design.heights_m[other]  # (K, 2) feet and heads
    steps = np.arange(-REACH_M, REACH_M + 0.5 * _STEP_M, _STEP_M)
    suited = np.stack([_suited(one, ends[:, column], steps) for column in (0, 1)], axis=-1)  # (steps, 2)
    best = np.lexsort((np.abs(steps), -suited.sum(axis=1)))[0]
    more = suited[best] - suited[np.argmin(np.abs(steps))]
    if more.min() < LEAST_MORE or more.sum() < LEAST_MORE_SHARE * 2 * len(np.unique(one)):
        return 0.0, 0
    return float(np.mean(ends[np.abs(ends - steps[best]) < BAND_M])), int(more.sum())


def _suited(planes: Indices, ends_m: FloatArray, steps_m: FloatArray) -> Indices:
    """Return of how many planes an end lies within the band of each step (S,)."""
    near = np.rint((ends_m - steps_m[0]) / _STEP_M).astype(np.intp)[:, None] + np.arange(-2, 3)
    suits = (near >= 0) & (near < len(steps_m))
    suits &= np.abs(ends_m[:, None] - steps_m[np.clip(near, 0, len(steps_m) - 1)]) < BAND_M
    plane_at = (planes[:, None] * len(steps_m) + near)[suits]
    return np.bincount(np.unique(plane_at) % len(steps_m), minlength=len(steps_m))
