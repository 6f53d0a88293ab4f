"""Points in space from where both ORIGINAL photos show them."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply, rigid


def triangulate(
    left: Intrinsics, right: Intrinsics, right_from_left: FloatArray, left_px: ArrayLike, right_px: ArrayLike
) -> FloatArray:
    """Return the points (N, 3) in the left frame half-way between the rays of pixels (N, 2), (N, 2).

    NaN where a lens shows nothing there, or the rays run side by side.
    """
    return midpoints(left.rays(left_px), right.rays(right_px), right_from_left)


def midpoints(left_rays: FloatArray, right_rays: FloatArray, right_from_left: FloatArray) -> FloatArray:
    """Return the points (N, 3) in the left frame half-way between rays (N, 3) of either camera, in its own frame.

    NaN where a ray is, or where the two run side by side.
    """
    from_left, from_right = left_rays, right_rays @ right_from_left[:3, :3]
    centre = -right_from_left[:3, :3].T @ right_from_left[:3, 3]
    # Shortest distance of two lines: normal equations of a from_left - b from_right = centre.
    aa, bb = np.sum(from_left * from_left, axis=1), np.sum(from_right * from_right, axis=1)
    ab = np.sum(from_left * from_right, axis=1)
    ac, bc = from_left @ centre, from_right @ centre
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = aa * bb - ab * ab
        determinant = np.where(determinant > 1e-12, determinant, np.nan)
        along_left = (bb * ac - ab * bc) / determinant
        along_right = (ab * ac - aa * bc) / determinant
    points: FloatArray = 0.5 * (from_left * along_left[:, None] + centre + from_right * along_right[:, None])
    return points


def square_poses(points_m: FloatArray, rays: FloatArray) -> list[FloatArray]:
    """Return camera_from_square (4, 4) by one photo, up to two: a small square looks alike tilted to either side.

    Its corners (4, 3) are seen along rays (4, 3); there is none where one of them is NaN.

    Reference: Collins & Bartoli 2014, Infinitesimal plane-based pose estimation.
    """
    if not np.all(np.isfinite(rays)):
        return []
    seen = np.ascontiguousarray(rays[:, :2] / rays[:, 2:])
    try:
        found, turns, shifts, _ = cv2.solvePnPGeneric(
            np.ascontiguousarray(points_m), seen, np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return []
    poses = [rigid(np.ravel(turn), shift) for turn, shift in zip(turns[:found], shifts[:found], strict=True)]
    return [pose for pose in poses if np.all(np.isfinite(pose)) and pose[2, 3] > 0.0]


def meeting_gap_px(
    left: Intrinsics, right: Intrinsics, right_from_left: FloatArray, points_m: FloatArray, left_px: ArrayLike,
    right_px: ArrayLike,
) -> FloatArray:  # fmt: skip
    """Return how far (N,) the points lie from where they were seen, in pixels: the worse of both photos."""
    gaps = [
        np.linalg.norm(left.project(points_m) - np.asarray(left_px), axis=1),
        np.linalg.norm(right.project(apply(right_from_left, points_m)) - np.asarray(right_px), axis=1),
    ]
    worse: FloatArray = np.maximum(gaps[0], gaps[1])
    return worse
