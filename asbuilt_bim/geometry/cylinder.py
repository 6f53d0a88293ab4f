"""Round columns: a cylinder with an axis, and the coordinates (arc length, height) of its lateral surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, cross, rotate


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylinderFrame:
    """A cylinder: `origin_m` on its axis, `axis` up, `zero` the direction in which u is 0.

    Lateral coordinates (u, v), in metres: u = radius x angle from `zero`, in (-pi r, pi r], counter-clockwise seen from
    above (from the tip of `axis`). v = height along the axis.
    """

    origin_m: FloatArray  # (3,)
    axis: FloatArray  # (3,) unit
    zero: FloatArray  # (3,) unit, at right angles to axis
    radius_m: float

    def to_uv(self, points_m: ArrayLike) -> FloatArray:
        """Return lateral coordinates (..., 2) in metres of points (..., 3), projected radially."""
        relative = np.asarray(points_m, dtype=np.float64) - self.origin_m
        side = cross(self.axis, self.zero)
        angle = np.arctan2(relative @ side, relative @ self.zero)
        return np.stack([self.radius_m * angle, relative @ self.axis], axis=-1)

    def from_uv(self, uv_m: ArrayLike, height_m: float = 0.0) -> FloatArray:
        """Return points (..., 3) of lateral coordinates (..., 2), `height_m` off the surface."""
        uv = np.asarray(uv_m, dtype=np.float64)
        out = self.outward(uv)
        points: FloatArray = self.origin_m + uv[..., 1:2] * self.axis + (self.radius_m + height_m) * out
        return points

    def outward(self, uv_m: ArrayLike) -> FloatArray:
        """Return the outward unit normals (..., 3) at lateral coordinates (..., 2)."""
        angle = np.asarray(uv_m, dtype=np.float64)[..., 0] / self.radius_m
        side = cross(self.axis, self.zero)
        normals: FloatArray = np.cos(angle)[..., None] * self.zero + np.sin(angle)[..., None] * side
        return normals

    def distance_m(self, points_m: ArrayLike) -> FloatArray:
        """Return the distance of points (..., 3) from the lateral surface, positive outside."""
        relative = np.asarray(points_m, dtype=np.float64) - self.origin_m
        across = relative - (relative @ self.axis)[..., None] * self.axis
        distance: FloatArray = np.linalg.norm(across, axis=-1) - self.radius_m
        return distance

    def intersect(self, origin_m: ArrayLike, directions: ArrayLike) -> FloatArray:
        """Return the first points (..., 3) where rays meet the lateral surface from outside; NaN where they miss."""
        start = np.asarray(origin_m, dtype=np.float64) - self.origin_m
        rays = np.asarray(directions, dtype=np.float64)
        start_across = start - (start @ self.axis) * self.axis
        rays_across = rays - (rays @ self.axis)[..., None] * self.axis
        a = np.sum(rays_across**2, axis=-1)
        b = rays_across @ start_across
        c = start_across @ start_across - self.radius_m**2
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = (-b - np.sqrt(b * b - a * c)) / a
        points: FloatArray = (
            np.asarray(origin_m, dtype=np.float64) + rays * np.where(scale > 0.0, scale, np.nan)[..., None]
        )
        return points

    def moved(self, b_from_a: FloatArray) -> CylinderFrame:
        """Return this cylinder of frame a in frame b."""
        return CylinderFrame(
            origin_m=frozen(apply(b_from_a, self.origin_m)),
            axis=frozen(rotate(b_from_a, self.axis)),
            zero=frozen(rotate(b_from_a, self.zero)),
            radius_m=self.radius_m,
        )
