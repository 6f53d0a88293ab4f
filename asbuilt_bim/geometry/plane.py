"""Planes in metres: n . x = d, with a frame (u, v) for drawing on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, cross, rotate, unit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """The points x with `normal . x = offset_m`; the normal is a unit vector that points out of the concrete."""

    normal: FloatArray  # (3,)
    offset_m: float

    def distance_m(self, points_m: ArrayLike) -> FloatArray:
        """Return the signed distance of points (..., 3), positive on the normal's side."""
        distance: FloatArray = np.asarray(points_m, dtype=np.float64) @ self.normal - self.offset_m
        return distance

    def foot_m(self, point_m: ArrayLike) -> FloatArray:
        """Return the point (3,) of the plane nearest to a point (3,)."""
        point = np.asarray(point_m, dtype=np.float64)
        foot: FloatArray = point - self.distance_m(point) * self.normal
        return foot

    def intersect(self, origin_m: ArrayLike, directions: ArrayLike) -> FloatArray:
        """Return where rays (origin (3,), directions (..., 3)) meet the plane; NaN where they run along it."""
        origin = np.asarray(origin_m, dtype=np.float64)
        rays = np.asarray(directions, dtype=np.float64)
        along = rays @ self.normal
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(np.abs(along) > 1e-12, (self.offset_m - origin @ self.normal) / along, np.nan)
        met: FloatArray = origin + rays * scale[..., None]
        return met

    def moved(self, b_from_a: FloatArray) -> Plane:
        """Return this plane of frame a in frame b."""
        normal = rotate(b_from_a, self.normal)
        return Plane(normal=frozen(normal), offset_m=float(self.offset_m + normal @ b_from_a[:3, 3]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneFrame:
    """An origin and two unit axes on a plane; u x v is the outward normal, v points up where there is an up."""

    origin_m: FloatArray  # (3,)
    u: FloatArray  # (3,)
    v: FloatArray  # (3,)

    @property
    def normal(self) -> FloatArray:
        """Return u x v (3,), written out: np.cross takes twenty times as long for two vectors."""
        (a, b, c), (d, e, f) = self.u.tolist(), self.v.tolist()
        return np.array([b * f - c * e, c * d - a * f, a * e - b * d])

    @property
    def plane(self) -> Plane:
        """Return the plane that the frame lies in."""
        return Plane(normal=frozen(self.normal), offset_m=float(self.normal @ self.origin_m))

    def to_uv(self, points_m: ArrayLike) -> FloatArray:
        """Return the coordinates (..., 2) in metres of points (..., 3) projected on the plane."""
        relative = np.asarray(points_m, dtype=np.float64) - self.origin_m
        return np.stack([relative @ self.u, relative @ self.v], axis=-1)

    def from_uv(self, uv_m: ArrayLike, height_m: float = 0.0) -> FloatArray:
        """Return the points (..., 3) of coordinates (..., 2), lifted off the plane by `height_m`."""
        uv = np.asarray(uv_m, dtype=np.float64)
        points: FloatArray = self.origin_m + uv[..., :1] * self.u + uv[..., 1:2] * self.v + height_m * self.normal
        return points

    def moved(self, b_from_a: FloatArray) -> PlaneFrame:
        """Return this frame of a in b."""
        return PlaneFrame(
            origin_m=frozen(apply(b_from_a, self.origin_m)),
            u=frozen(rotate(b_from_a, self.u)),
            v=frozen(rotate(b_from_a, self.v)),
        )


def frame_on_plane(plane: Plane, origin_m: ArrayLike, up: ArrayLike) -> PlaneFrame:
    """Lay a frame on `plane` at the foot of `origin_m` (3,), its v as near to `up` (3,) as it can be.

    Where the plane is level (normal within 1e-6 of up) the axis least along the normal takes the place of up.
    """
    normal = plane.normal
    rising = np.asarray(up, dtype=np.float64)
    v = rising - (rising @ normal) * normal
    if np.linalg.norm(v) < 1e-6:
        axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
        v = axis - (axis @ normal) * normal
    v = unit(v)
    return PlaneFrame(origin_m=frozen(plane.foot_m(origin_m)), u=frozen(cross(v, normal)), v=frozen(v))
