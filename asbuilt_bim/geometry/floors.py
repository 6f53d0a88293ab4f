"""Level surfaces (ground, slabs, soffits) found in a disparity map by the height that their pixels share."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.geometry.disparity_plane import fit_q
from asbuilt_bim.geometry.level import LevelledMap

HEIGHT_BIN_M = 0.025
"""A raked slab or rolled gravel is level to this; blinding and slab differ by more."""
LEAST_SHARE = 0.006
"""A floor covers at least this share of the photo."""
MOST_FLOORS = 6
SAMPLES = 20_000
"""Enough that a plane is known to thousandths of a pixel."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Floor:
    """A level surface: q (3,) in the rectified frame, and its height below the camera in metres (negative: above)."""

    q_px: FloatArray
    below_m: float


def floor_pixels(level: LevelledMap, slope: Float32Array) -> BoolArray:
    """Say which pixels' disparity changes along the plumb line as a level surface's does, d / y."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = slope * level.y_px / level.d_px
    flat: BoolArray = level.measured & (np.abs(ratio - 1.0) < 0.4) & (np.abs(level.y_px) > 8.0) & (level.d_px > 3.0)
    return flat


def grow_floors(level: LevelledMap, slope: Float32Array) -> list[Floor]:
    """Find level surfaces, the largest first; `slope` (H, W) is the disparity's change along the plumb line."""
    spots = np.flatnonzero(floor_pixels(level, slope))
    below = level.y_px.ravel()[spots] * level.baseline_m / level.d_px.ravel()[spots]
    least = LEAST_SHARE * level.d_px.size
    free = np.ones(len(spots), dtype=bool)
    floors: list[Floor] = []
    while len(floors) < MOST_FLOORS and np.count_nonzero(free) > least:
        counts, edges = np.histogram(below[free], bins=np.arange(-12.0, 12.0, HEIGHT_BIN_M))
        pairs = counts[:-1] + counts[1:]
        best = int(np.argmax(pairs))
        if pairs[best] < least:
            break
        height = float(edges[best + 1])
        near = np.abs(below - height) < 2.5 * HEIGHT_BIN_M
        picked = spots[near & free]
        picked = picked[:: max(1, len(picked) // SAMPLES)]
        rays = level.rays.reshape(-1, 3)[picked]
        q, _ = fit_q(rays, level.disparity_px.ravel()[picked], 0.3)
        floors.append(Floor(q_px=q, below_m=height))
        free &= ~near
    return floors
