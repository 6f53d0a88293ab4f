"""What a rig sees of squares from a place: in both photos' frames, near enough, not slant, nothing before it."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import apply, inverse
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """From how near to how far, and how slant, a face counts as seen."""

    near_m: float = NEAR_M
    far_m: float = FAR_M
    slant_rad: float = MOST_SLANT_RAD


PLANNED = Reach()
TAKEN = Reach(near_m=0.5 * NEAR_M, far_m=1.5 * FAR_M, slant_rad=float(np.radians(75.0)))


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
        seen[some] = around.near(eye_m, reach.far_m).free(eye_m, ends)
    return seen


def in_both_frames(
    rig: StereoRig, world_from_left: FloatArray, points_m: FloatArray, margin: float = FRAME_MARGIN
) -> BoolArray:
    """Say of points (P, 3) of the world whether both photos of a pose (4, 4) show them, off their border."""
    left = apply(inverse(world_from_left), points_m)
    found = np.ones(len(points_m), dtype=np.bool_)
    for camera, own in ((rig.left, left), (rig.right, apply(rig.right_from_left, left))):
        off = margin * camera.width_px
        ahead = own[:, 2] > 0.1
        pixels = camera.project(np.where(ahead[:, None], own, [0.0, 0.0, 1.0]))
        size = np.array([camera.width_px, camera.height_px])
        found &= ahead & np.all((pixels >= off) & (pixels <= size - 1.0 - off), axis=1)
    return found


def upright_pose(eye_m: FloatArray, bearing_rad: float) -> FloatArray:
    """Return `world_from_left` (4, 4) of a rig held upright; the bearing is counted from x towards y."""
    ahead = np.array([np.cos(bearing_rad), np.sin(bearing_rad), 0.0])
    right = np.array([ahead[1], -ahead[0], 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, [0.0, 0.0, -1.0], ahead])
    pose[:3, 3] = eye_m
    return pose
