"""What stands about a camera on site by the plan: which points it has a free sight to."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.model import BimElement, BimModel, Obstacle
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen

_CHUNK = 400_000  # sights times triangles at once: some 60 MB
_END = 1.0 - 1e-4  # of a sight: what it ends at does not stand in it
_LEVEL = 1e-9
_ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """Triangles of all that is taken to stand: a corner (N, 3), two sides (N, 3), and the box round each."""

    corner_m: FloatArray
    first_m: FloatArray
    second_m: FloatArray
    low_m: FloatArray
    high_m: FloatArray

    def between(self, eye_m: FloatArray, ends_m: FloatArray) -> "Surroundings":
        """Return what may stand in the way of sights from an eye (3,) to points (P, 3): what meets the box round them.

        A level triangle at the border of the box meets none of them.
        """
        points = np.vstack([eye_m, ends_m])
        low, high = points.min(axis=0), points.max(axis=0)
        inside = np.all((self.low_m < high) & (self.high_m > low), axis=1)
        names = ("corner_m", "first_m", "second_m", "low_m", "high_m")
        return Surroundings(**{name: getattr(self, name)[inside] for name in names})

    def free(self, eye_m: FloatArray, points_m: FloatArray) -> BoolArray:
        """Say of each point (P, 3) whether nothing stands between it and an eye (3,).

        A sight along a triangle's own plane doesn't meet it. Reference: Moeller & Trumbore 1997.
        """
        seen = np.ones(len(points_m), dtype=np.bool_)
        if not len(self.corner_m):
            return seen
        from_corner = (eye_m - self.corner_m).astype(np.float32)  # from the eye, single precision is a micrometre
        first, second = self.first_m.astype(np.float32), self.second_m.astype(np.float32)
        turned, beside, normal = np.cross(from_corner, first), np.cross(from_corner, second), np.cross(first, second)
        height = np.einsum("ni,ni->n", second, turned)
        step = max(1, _CHUNK // len(first))
        for start in range(0, len(points_m), step):
            way = (points_m[start : start + step] - eye_m).astype(np.float32)
            along = -(way @ normal.T)
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.where(np.abs(along) > _LEVEL, np.float32(1.0) / along, np.float32(np.inf))
                u = -(way @ beside.T) * share
                v = (way @ turned.T) * share
                t = height * share
                met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0) & (t < _END)
            seen[start : start + step] = ~met.any(axis=1)
        return seen


def surroundings(design: BimModel, standing: Collection[str], floors: Sequence[Obstacle] = ()) -> Surroundings:
    """Return what stands by the plan: elements by GlobalId, everything else of the design, and its floors."""
    known = {one.global_id for one in design.obstacles}
    bodies: list[BimElement | Obstacle] = [one for one in design.elements if one.global_id in standing]
    bodies += [*design.obstacles, *(one for one in floors if one.global_id not in known)]
    corners = [one.vertices_m[one.triangles] for one in bodies if len(one.triangles)]
    all_m = np.concatenate(corners) if corners else np.zeros((0, 3, 3))
    return Surroundings(
        corner_m=frozen(all_m[:, 0]),
        first_m=frozen(all_m[:, 1] - all_m[:, 0]),
        second_m=frozen(all_m[:, 2] - all_m[:, 0]),
        low_m=frozen(all_m.min(axis=1) - _ROUNDING_M),
        high_m=frozen(all_m.max(axis=1) + _ROUNDING_M),
    )
