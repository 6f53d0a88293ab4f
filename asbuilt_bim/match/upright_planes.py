"""Upright planes as lines in plan: those that were measured, those that are designed, and which lie on which."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.score import in_world
from asbuilt_bim.register.by_design.fitting import turned
from asbuilt_bim.register.by_design.planes import UPRIGHT, Upright, row_of, upright
from asbuilt_bim.register.pose import PlacedStation

Indices = NDArray[np.intp]
PARALLEL_COS = float(np.cos(np.radians(5.0)))
NEARLY_M = 0.1  # a face lies on its element's mesh to millimetres


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placing:
    """How what was measured is off: moved level and upwards, then turned about the shared origin."""

    turn_rad: float = 0.0  # counter-clockwise, seen from above
    move_m: FloatArray = field(default_factory=lambda: np.zeros(2))
    rise_m: float = 0.0

    @property
    def turn(self) -> FloatArray:
        """Return the turn as a matrix (2, 2)."""
        return turned(self.turn_rad)

    def back(self, seen: Upright) -> Upright:
        """Return measured planes turned and moved back to where they are designed."""
        return replace(
            seen,
            normals=seen.normals @ self.turn,
            middles_m=seen.middles_m @ self.turn - self.move_m,
            heights_m=seen.heights_m - self.rise_m,
        )


def measured_planes(stations: Sequence[PlacedStation]) -> tuple[Upright, FloatArray]:
    """Return the stations' upright planes, and the origin (2,) in the world that their places are from."""
    planes = []
    for placed in stations:
        for face in placed.measurement.faces:
            seen = in_world(face, placed.pose)
            if isinstance(seen.frame, PlaneFrame) and abs(seen.frame.normal[2]) <= UPRIGHT and seen.outline:
                planes.append((seen.frame, np.concatenate(face.outline_uv_m)))
    middles = [frame.from_uv(uv_m).mean(axis=0)[:2] for frame, uv_m in planes]
    origin = np.mean(middles, axis=0) if middles else np.zeros(2)
    rows = [row_of(frame, uv_m, origin, 0) for frame, uv_m in planes]
    return upright([row for row in rows if row is not None]), origin


def design_planes(design: BimModel, origin: FloatArray, reach_m: float) -> Upright:
    """Return the design's upright planes up to `reach_m` from an origin (2,) in the world, and from that origin."""
    rows = []
    for number, element in enumerate(design.elements):
        plan = element.vertices_m[:, :2] - origin
        if np.hypot(*np.clip(0.0, plan.min(axis=0), plan.max(axis=0))) >= reach_m + NEARLY_M:
            continue  # far off with all of its faces: most of a large design
        for face in element.faces:
            if isinstance(face.frame, PlaneFrame) and abs(float(face.frame.normal[2])) < UPRIGHT:
                uv_m = np.concatenate([ring for region in face.rings_uv_m for ring in region])
                plan = face.frame.from_uv(uv_m)[:, :2] - origin
                if np.linalg.norm(np.clip(0.0, plan.min(axis=0), plan.max(axis=0))) < reach_m:
                    rows.append(row_of(face.frame, uv_m, origin, number))
    return upright([row for row in rows if row is not None])


def lying(seen: Upright, design: Upright, band_m: float) -> tuple[BoolArray, Indices]:
    """Return which measured planes lie on a design's (N,), and on which (N,): within `band_m`, in plan and height."""
    one, other, off_m = level_pairs(seen, design, band_m)
    stands = at_height(seen, design, one, other)
    nearest_last = np.argsort(-off_m[stands], kind="stable")
    lies, on = np.zeros(len(seen.halves_m), dtype=bool), np.zeros(len(seen.halves_m), dtype=np.intp)
    lies[one[stands]] = True
    on[one[stands][nearest_last]] = other[stands][nearest_last]
    return lies, on


def level_pairs(seen: Upright, design: Upright, band_m: float) -> tuple[Indices, Indices, FloatArray]:
    """Return which measured planes (K,) lie in plan on which of the design's (K,), and how far off (K,), at any height.

    Directions and distances of all pairs are two products of matrices; the rest is asked of those few that pass.
    """
    foot = np.einsum("mk,mk->m", design.middles_m, design.normals)
    off = np.abs(seen.middles_m @ design.normals.T - foot)
    one, other = np.nonzero((seen.normals @ design.normals.T > PARALLEL_COS) & (off < band_m))
    beside = side_by_side(seen, design, one, other)
    return one[beside], other[beside], off[one, other][beside]


def side_by_side(seen: Upright, design: Upright, one: Indices, other: Indices) -> BoolArray:
    """Say of which pairs (K,) half of the measured plane's length is beside the designed one."""
    aside = np.einsum("kd,kd->k", seen.middles_m[one] - design.middles_m[other], design.along[other])
    half, length = seen.halves_m[one], design.halves_m[other]
    return np.asarray(np.minimum(aside + half, length) - np.maximum(aside - half, -length) >= half)


def at_height(seen: Upright, design: Upright, one: Indices, other: Indices, rise_m: float = 0.0) -> BoolArray:
    """Say of which pairs (K,) half of the measured plane's height is beside the designed one, lowered by `rise_m`."""
    (low, high), (foot, head) = (seen.heights_m[one] - rise_m).T, design.heights_m[other].T
    return np.asarray(np.minimum(high, head) - np.maximum(low, foot) >= 0.5 * (high - low))
