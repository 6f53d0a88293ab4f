"""How high a station stood over the design: by feet and heads of the faces that it is placed by."""

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.register.by_design.fitting import BUILT_M, ENDS_M, Fitted
from asbuilt_bim.register.by_design.planes import Seen, Upright

CAMERA_M, CAMERA_SIGMA_M = 1.5, 0.4
"""A rig on a tripod or in the hands, over the floor."""
HIDDEN = 0.5
"""How likely an end is hidden, or not built up to the design's: nobody knows."""
SPREAD_M = 3.0
"""Over how much the ends of hidden and unfinished faces spread: a storey."""
STEP_M, NEAR_M = 0.005, 0.06


def camera_height(seen: Seen, design: Upright, fit: Fitted, floor_m: float) -> tuple[float, float, float]:
    """Return the camera's height in the world, its sigma, and how likely it lies anywhere else.

    Feet stand on one slab, which is off its design itself: that stays, however many feet there are.
    """
    use = np.flatnonzero(fit.on >= 0)
    asked = (design.heights_m[fit.on[use]] - seen.faces.heights_m[use]).ravel()
    grid = floor_m + CAMERA_M + np.arange(-5.0 * CAMERA_SIGMA_M, 5.0 * CAMERA_SIGMA_M, STEP_M)
    log = -0.5 * np.square((grid - floor_m - CAMERA_M) / CAMERA_SIGMA_M)
    sigma = np.hypot(ENDS_M, BUILT_M)
    faces = np.repeat(fit.on[use], 2) * 2 + np.tile([0, 1], len(use))
    for end in np.unique(faces):  # pieces of one face say one thing once
        log += _end(grid, asked[faces == end], sigma)
    share = np.exp(log - log.max())
    share /= share.sum()
    best = float(grid[int(np.argmax(share))])
    near = np.abs(grid - best) <= NEAR_M
    mean = float((share[near] @ grid[near]) / share[near].sum())
    own = float(np.sqrt(share[near] @ np.square(grid[near] - mean) / share[near].sum()))
    return mean, float(np.hypot(own, BUILT_M)), float(1.0 - share[near].sum())


def _end(grid: FloatArray, asked: FloatArray, sigma: float) -> FloatArray:
    there = np.exp(-0.5 * np.square((grid[:, None] - asked) / sigma)).max(axis=1) / (np.sqrt(2.0 * np.pi) * sigma)
    log: FloatArray = np.log(HIDDEN / SPREAD_M + (1.0 - HIDDEN) * there)
    return log
