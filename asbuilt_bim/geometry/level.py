"""The levelled view: upright planes become lines, level planes become rows.

The rectified rays are turned so that the vertical is exactly the image's y. There an upright plane's disparity depends
on x only, d = alpha x + gamma, so a building is a plan drawing in (x, d); a level plane's depends on y only.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.geometry.disparity_plane import fit_q
from asbuilt_bim.geometry.transform import unit

HEIGHT_BIN_M = 0.025
"""A raked slab or rolled gravel is level to this; blinding and slab differ by more."""
LEAST_SHARE = 0.006
"""A floor covers at least this share of the photo."""
MOST_FLOORS = 6
SAMPLES = 20_000
"""Enough that a plane is known to thousandths of a pixel."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelView:
    """The turn `level_from_rectified` (3, 3): x right, y straight down, z level and forward; `f_px` of both views."""

    level_from_rectified: FloatArray
    f_px: float

    def turn(self, rays: ArrayLike) -> FloatArray:
        """Turn rectified rays (..., 3) into the level frame."""
        turned: FloatArray = np.asarray(rays, dtype=np.float64) @ self.level_from_rectified.T
        return turned

    def coordinates(self, rays: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return level x and y in pixels from the principal point, and the factor that divides disparities."""
        turned = self.turn(rays)
        forward = np.maximum(turned[..., 2], 1e-3)
        return self.f_px * turned[..., 0] / forward, self.f_px * turned[..., 1] / forward, forward

    def q_upright(self, slope: float, offset_px: float) -> FloatArray:
        """Return q (3,) of the upright plane d = slope x + offset of the level view."""
        right, _, forward = self.level_from_rectified
        q: FloatArray = slope * self.f_px * right + offset_px * forward
        return q

    @property
    def down(self) -> FloatArray:
        """Return the plumb direction (3,) in the rectified frame."""
        return np.asarray(self.level_from_rectified[1], dtype=np.float64)


def level_view(up: ArrayLike, f_px: float) -> LevelView:
    """Build the levelled view from `up` (3,) in the rectified frame, which must not lie along the camera's axis."""
    down = -unit(up)
    forward = unit(np.array([0.0, 0.0, 1.0]) - down[2] * down)
    return LevelView(level_from_rectified=np.stack([np.cross(down, forward), down, forward]), f_px=f_px)


def pixel_rays(width_px: int, height_px: int, f_px: float, cx_px: float, cy_px: float) -> FloatArray:
    """Return the rectified rays (H, W, 3), z = 1, of every pixel."""
    rays = np.ones((height_px, width_px, 3))
    rays[..., 0] = (np.arange(width_px) - cx_px)[None, :] / f_px
    rays[..., 1] = (np.arange(height_px) - cy_px)[:, None] / f_px
    return rays


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelledMap:
    """A disparity map with its levelled coordinates, all (H, W): `rays` (H, W, 3) rectified, level `x`, `y` and `d`.

    `d_level = disparity / forward`; NaN where nothing was measured.
    """

    view: LevelView
    rays: FloatArray
    x_px: FloatArray
    y_px: FloatArray
    forward: FloatArray
    disparity_px: FloatArray
    d_px: FloatArray
    sigma_px: FloatArray
    measured: BoolArray
    baseline_m: float


def levelled_map(
    disparity_px: ArrayLike, sigma_px: ArrayLike, view: LevelView, rays: FloatArray, baseline_m: float
) -> LevelledMap:
    """Level a disparity map (H, W), NaN where not measured."""
    disparity = np.asarray(disparity_px, dtype=np.float64)
    x, y, forward = view.coordinates(rays)
    return LevelledMap(
        view=view,
        rays=rays,
        x_px=x,
        y_px=y,
        forward=forward,
        disparity_px=disparity,
        d_px=disparity / forward,
        sigma_px=np.asarray(sigma_px, dtype=np.float64),
        measured=np.isfinite(disparity) & (disparity > 0.0),
        baseline_m=baseline_m,
    )


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
