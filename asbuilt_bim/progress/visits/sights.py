"""What a rig sees of squares from a place: in both photos' frames, near enough, not slant, nothing before it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import rigid
from asbuilt_bim.progress.visits.squares import Squares
from asbuilt_bim.progress.visits.surroundings import Surroundings

NEAR_M, FAR_M = 3.0, 8.0
"""From what is measured: nearer shows little of it, further measures it badly. What a placed station saw counts from
half of the one to half as much again as the other."""
MOST_SLANT_RAD = float(np.radians(65.0))
"""Off a face's normal: from there on a pixel covers more than twice its width of the surface."""
LIFT_M = 0.02
"""A sight ends so far before a face: what touches it hides none of it."""
FRAME_MARGIN = 0.03
"""Of the frame's width: nobody stands to the centimetre, or points a rig to the degree."""
_TABLE, _WIDEST = 512, 2.0  # cells of under half a degree, to 63 degrees off the axis
_FOLDED = 1e-3  # of a tangent: a pixel that leads back to another ray than it came from


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """From how near to how far, and how slant, a face counts as seen."""

    near_m: float = NEAR_M
    far_m: float = FAR_M
    slant_rad: float = MOST_SLANT_RAD


PLANNED = Reach()
EITHER = Reach(near_m=0.0, far_m=2.0 * FAR_M, slant_rad=float(np.radians(80.0)))
"""Of the right eye, where the left one judges distance and slant."""
TAKEN = Reach(near_m=0.5 * NEAR_M, far_m=1.5 * FAR_M, slant_rad=float(np.radians(75.0)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigFrames:
    """What both cameras of a rig show, looked up: tables (N, N) over x / z and y / z up to `_WIDEST` each way."""

    left: BoolArray
    right: BoolArray
    right_from_left: FloatArray

    def show(self, world_from_left: FloatArray, points_m: FloatArray) -> BoolArray:
        """Say of points (..., 3) of the world whether both photos of a pose (4, 4) show them."""
        return self._show((points_m - world_from_left[:3, 3]) @ world_from_left[:3, :3])

    def right_eye(self, world_from_left: FloatArray) -> FloatArray:
        """Return where the right camera's centre (3,) is at a pose (4, 4) of the left one."""
        in_left = -self.right_from_left[:3, :3].T @ self.right_from_left[:3, 3]
        eye: FloatArray = world_from_left[:3, :3] @ in_left + world_from_left[:3, 3]
        return eye

    def show_upright(self, eye_m: FloatArray, bearings_rad: FloatArray, points_m: FloatArray) -> BoolArray:
        """Say (B, ...) of points (..., 3) whether an upright rig at an eye (3,) shows them, by its bearings (B,)."""
        way = points_m - eye_m
        at = bearings_rad.reshape(-1, *[1] * (way.ndim - 1))
        sine, cosine = np.sin(at), np.cos(at)
        right, ahead = way[..., 0] * sine - way[..., 1] * cosine, way[..., 0] * cosine + way[..., 1] * sine
        return self._show(np.stack([right, np.broadcast_to(-way[..., 2], right.shape), ahead], axis=-1))

    def _show(self, own: FloatArray) -> BoolArray:
        found = _looked_up(self.left, own)
        found &= _looked_up(self.right, own @ self.right_from_left[:3, :3].T + self.right_from_left[:3, 3])
        return found


@lru_cache(maxsize=4)
def rig_frames(rig: StereoRig, margin: float = FRAME_MARGIN) -> RigFrames:
    """Return what a rig's cameras show, off the border by a share of the frame's width."""
    at = (np.arange(_TABLE) + 0.5) / _TABLE * 2.0 * _WIDEST - _WIDEST
    x, y = np.meshgrid(at, at)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    tables = []
    for camera in (rig.left, rig.right):
        off = margin * camera.width_px
        pixels = camera.project(rays)
        size = np.array([camera.width_px, camera.height_px])
        inside = np.all((pixels >= off) & (pixels <= size - 1.0 - off), axis=-1)
        ways = camera.rays(pixels[inside])  # a lens's polynomial folds back far outside
        inside[inside] = np.abs(ways[:, :2] - rays[inside][:, :2]).max(axis=-1) < _FOLDED
        tables.append(inside)
    return RigFrames(left=tables[0], right=tables[1], right_from_left=rig.right_from_left)


def _looked_up(table: BoolArray, own_m: FloatArray) -> BoolArray:
    ahead = own_m[..., 2] > 0.1
    depth = np.where(ahead, own_m[..., 2], 1.0)[..., None]
    place = np.floor((own_m[..., :2] / depth + _WIDEST) * (0.5 * _TABLE / _WIDEST)).astype(np.intp)
    ahead &= np.all((place >= 0) & (place < _TABLE), axis=-1)
    column, row = np.moveaxis(np.clip(place, 0, _TABLE - 1), -1, 0)
    found: BoolArray = ahead & table[row, column]
    return found


def facing(eye_m: FloatArray, points_m: FloatArray, normals: FloatArray, reach: Reach) -> BoolArray:
    """Say of points (P, 3) whether they lie within reach of an eye (3,) and are turned towards it."""
    way = eye_m - points_m
    away = np.linalg.norm(way, axis=1)
    cosine = np.einsum("pi,pi->p", way, normals) / np.maximum(away, 1e-9)
    found: BoolArray = (away >= reach.near_m) & (away <= reach.far_m) & (cosine >= np.cos(reach.slant_rad))
    return found


def sighted_points(
    around: Surroundings, eye_m: FloatArray, points_m: FloatArray, normals: FloatArray, reach: Reach = PLANNED
) -> BoolArray:
    """Say of points (P, 3) whether an eye (3,) sees them, wherever it looks."""
    seen = facing(eye_m, points_m, normals, reach)
    some = np.flatnonzero(seen)
    if len(some):
        ends = points_m[some] + LIFT_M * normals[some]
        seen[some] = around.between(eye_m, ends).free(eye_m, ends)
    return seen


def sighted_patches(around: Surroundings, eye_m: FloatArray, squares: Squares, reach: Reach = PLANNED) -> BoolArray:
    """Say of the patches (P,) of squares whether an eye (3,) sees them: the middle, and most of the way to corners."""
    seen = sighted_points(around, eye_m, squares.points_m, squares.normals, reach)
    some = np.flatnonzero(seen)
    if len(some):
        ends = (squares.corners_m[some] + LIFT_M * squares.normals[some, None]).reshape(-1, 3)
        free = around.between(eye_m, ends).free(eye_m, ends)
        seen[some] = free.reshape(-1, 4).all(axis=1)
    return seen


def framed_patches(frames: RigFrames, world_from_left: FloatArray, squares: Squares) -> BoolArray:
    """Say of the patches (P,) of squares whether both photos of a pose (4, 4) show them to their corners."""
    seen = frames.show(world_from_left, squares.points_m)
    some = np.flatnonzero(seen)
    seen[some] = frames.show(world_from_left, squares.corners_m[some]).all(axis=1)
    return seen


def upright_pose(eye_m: FloatArray, bearing_rad: float) -> FloatArray:
    """Return `world_from_left` (4, 4) of a rig held upright; the bearing is counted from x towards y."""
    ahead = np.array([np.cos(bearing_rad), np.sin(bearing_rad), 0.0])
    right = np.array([ahead[1], -ahead[0], 0.0])
    return rigid(np.column_stack([right, [0.0, 0.0, -1.0], ahead]), eye_m)
