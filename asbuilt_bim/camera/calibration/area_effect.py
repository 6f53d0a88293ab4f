"""What a calibration's uncertainty does to an area: the sigma of a square face at 5 m, and where it comes from."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.polygon import ring_area
from asbuilt_bim.geometry.transform import apply, rotation_from_vector

DISTANCE_M, SIDE_M = 5.0, 1.0
"""Where areas are judged: the middle of the 3 to 8 m from which faces are photographed."""
_PARTS = {
    "focal lengths": (0, 1, 4, 5),
    "directions of the cameras": (2, 3, 6, 7, 8, 9, 10),  # principal points and rotation: one makes up for the other
    "baseline": (11, 12, 13),
}
_STEPS = np.array([0.1] * 8 + [1e-5] * 3 + [1e-5] * 3)  # px, rad, m: small against what they do, large against digits


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaEffect:
    """Sigma of the area of a face 1 m square, 5 m off, seen from the front in the middle, as a share of it.

    `parts` holds what each group of parameters would do by itself; they are correlated, and don't add up.
    """

    sigma: float
    parts: tuple[tuple[str, float], ...]


def area_effect(rig: StereoRig) -> AreaEffect | None:
    """Return what the rig's covariance does to an area at 5 m; None where the covariance isn't known."""
    if not rig.covariance.any():
        return None
    centre = -0.5 * rig.right_from_left[:3, :3].T @ rig.right_from_left[:3, 3]
    half = 0.5 * SIDE_M
    corners = np.array([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])
    corners = corners + centre + [0.0, 0.0, DISTANCE_M]
    left_px, right_px = rig.left.project(corners), rig.right.project(apply(rig.right_from_left, corners))

    def area(moved: StereoRig) -> float:
        points = triangulate(moved.left, moved.right, moved.right_from_left, left_px, right_px)
        sides = points[1] - points[0], points[3] - points[0]
        u = sides[0] / np.linalg.norm(sides[0])
        v = sides[1] - (sides[1] @ u) * u
        v /= np.linalg.norm(v)
        return abs(ring_area(np.stack([(points - points[0]) @ u, (points - points[0]) @ v], axis=-1)))

    true = area(rig)
    slopes = np.array([(area(_moved(rig, index, step)) - true) / step for index, step in enumerate(_STEPS)]) / true
    parts = [(name, _sigma(slopes, rig.covariance, rows)) for name, rows in _PARTS.items()]
    return AreaEffect(sigma=_sigma(slopes, rig.covariance, tuple(range(len(slopes)))), parts=tuple(parts))


def _sigma(slopes: FloatArray, covariance: FloatArray, rows: tuple[int, ...]) -> float:
    at = list(rows)
    return float(np.sqrt(max(float(slopes[at] @ covariance[np.ix_(at, at)] @ slopes[at]), 0.0)))


def _moved(rig: StereoRig, index: int, step: float) -> StereoRig:
    """Return the rig with one of `rig.PARAMETERS` moved by `step`."""
    if index < 8:
        moved = _camera_moved(rig.left if index < 4 else rig.right, index % 4, step)
        return replace(rig, left=moved) if index < 4 else replace(rig, right=moved)
    pose = np.array(rig.right_from_left)
    if index < 11:
        # a rotation vector's derivative differs from a turn on top by a rotation of the axes: to first order the same
        # for the small angles between two parallel cameras
        turn = np.zeros(3)
        turn[index - 8] = step
        pose[:3, :3] = rotation_from_vector(turn) @ pose[:3, :3]
    else:
        pose[index - 11, 3] += step
    return replace(rig, right_from_left=frozen(pose))


def _camera_moved(camera: Intrinsics, index: int, step: float) -> Intrinsics:
    K = np.array(camera.K)
    K[(0, 1, 0, 1)[index], (0, 1, 2, 2)[index]] += step
    return replace(camera, K=frozen(K))
