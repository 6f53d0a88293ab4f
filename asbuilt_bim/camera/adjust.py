"""All boards, both cameras and the rig in one least-squares adjustment, and the covariance that it gives."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, vector_from_rotation

CAMERA_PARAMETERS = 9  # fx fy cx cy k1 k2 p1 p2 k3
SHARED_PARAMETERS = 2 * CAMERA_PARAMETERS + 6
_ROUNDS = 40
_ENOUGH = 1e-10  # relative gain of a step
_LENS_PRIOR = np.array([1.0, 0.5, 0.02, 0.02, 0.25])
"""Sigma of k1 k2 p1 p2 k3 before any photo is seen: what lenses that are no fisheyes have. It keeps the higher terms
from running wild in the parts of the frame that no board covered, and weighs nothing where boards do."""
_CORNER_SIGMA_PX = 0.1  # what a corner is usually good for, to weigh the prior against corners
_PRIOR_WEIGHT = np.concatenate([*[np.r_[np.zeros(4), (_CORNER_SIGMA_PX / _LENS_PRIOR) ** 2]] * 2, np.zeros(6)])
RIG_ROWS = np.array([0, 1, 2, 3, 9, 10, 11, 12, 18, 19, 20, 21, 22, 23])
"""Where `rig.PARAMETERS` stand among the shared parameters."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardView:
    """One pair of photos of the board: the corners (N, 3), (M, 3) in metres on it, and their pixels in each photo."""

    name: str
    left_points_m: FloatArray
    left_px: FloatArray
    right_points_m: FloatArray
    right_px: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjustment:
    """The adjusted rig: `shared` (24,) parameters (both cameras, then rotation vector and translation), `poses` (V, 6).

    `covariance` (24, 24) of the shared parameters with the boards' poses marginalised; `residuals` one (2 (N + M),) a
    view, in pixels, left first.
    """

    shared: FloatArray
    poses: FloatArray
    covariance: FloatArray
    residuals: tuple[FloatArray, ...]

    @property
    def rms_px(self) -> float:
        """Return the root mean square of the distance between seen and computed corners."""
        return rms_px(np.concatenate(self.residuals))


def rms_px(residual: FloatArray) -> float:
    """Return the root mean square distance of residuals (2 N,) that are x, y, x, y ..."""
    return float(np.sqrt(2.0 * np.mean(residual * residual))) if len(residual) else 0.0


def pack(left: Intrinsics, right: Intrinsics, right_from_left: FloatArray) -> FloatArray:
    """Write two cameras and their relative pose as the shared parameters (24,)."""
    cameras = [np.r_[c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], c.distortion[:5]] for c in (left, right)]
    turn = vector_from_rotation(right_from_left[:3, :3])
    packed: FloatArray = np.concatenate([*cameras, turn, right_from_left[:3, 3]])
    return packed


def camera_of(shared: FloatArray, side: int, size: tuple[int, int]) -> Intrinsics:
    """Read the left (0) or right (1) camera out of the shared parameters."""
    fx, fy, cx, cy, *distortion = shared[side * CAMERA_PARAMETERS : (side + 1) * CAMERA_PARAMETERS]
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(distortion), width_px=size[0], height_px=size[1])


def right_from_left_of(shared: FloatArray) -> FloatArray:
    """Read the relative pose (4, 4) out of the shared parameters."""
    return frozen(rigid(shared[18:21], shared[21:24]))


def view_residual(shared: FloatArray, pose: FloatArray, view: BoardView) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a view's residual (R,), and its Jacobians against the shared parameters (R, 24) and its pose (R, 6).

    `pose` is left_from_board as rotation vector and translation. Analytic: the chain rule over OpenCV's projection.
    """
    left_px, left_pose, left_camera = _project(view.left_points_m, pose[:3], pose[3:], shared[:9])
    turn, shift, *parts = cv2.composeRT(
        pose[:3, None].copy(), pose[3:, None].copy(), shared[18:21, None].copy(), shared[21:24, None].copy()
    )
    by_r1, by_t1, by_r2, by_t2, tby_r1, tby_t1, tby_r2, tby_t2 = (np.asarray(part) for part in parts)
    right_px, right_pose, right_camera = _project(view.right_points_m, _flat(turn), _flat(shift), shared[9:18])
    by_board = right_pose @ np.block([[by_r1, by_t1], [tby_r1, tby_t1]])
    by_rig = right_pose @ np.block([[by_r2, by_t2], [tby_r2, tby_t2]])
    n, m = len(left_px), len(right_px)
    by_shared = np.zeros((n + m, SHARED_PARAMETERS))
    by_shared[:n, :9], by_shared[n:, 9:18], by_shared[n:, 18:] = left_camera, right_camera, by_rig
    residual = np.r_[left_px - view.left_px.ravel(), right_px - view.right_px.ravel()]
    return residual, by_shared, np.concatenate([left_pose, by_board])


def _flat(vector: object) -> FloatArray:
    return np.array(vector, dtype=np.float64).ravel()


def _project(
    points: FloatArray, turn: FloatArray, shift: FloatArray, camera: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    K = np.array([[camera[0], 0.0, camera[2]], [0.0, camera[1], camera[3]], [0.0, 0.0, 1.0]])
    pixels, jacobian = cv2.projectPoints(points.reshape(-1, 1, 3).copy(), turn, shift, K, camera[4:].copy())
    by = np.asarray(jacobian, dtype=np.float64)
    return np.asarray(pixels, dtype=np.float64).ravel(), by[:, :6], by[:, 6:15]


def adjust(shared: FloatArray, poses: FloatArray, views: list[BoardView], *, free_rig: bool = True) -> Adjustment:
    """Adjust the shared parameters (24,) and the boards' poses (V, 6) to all corners (Levenberg-Marquardt).

    The poses are eliminated view by view (Schur complement), so that the work grows with the number of views only.
    With `free_rig` off the shared parameters stay and each board finds its pose.
    """
    damping, gained = 1e-4, 1.0
    parts = [view_residual(shared, pose, view) for pose, view in zip(poses, views, strict=True)]
    cost = _cost(shared, parts)
    for _ in range(_ROUNDS):
        step, pose_steps = _step(shared, parts, damping, free_rig)
        tried, tried_poses = shared + step, poses + pose_steps
        after = [view_residual(tried, pose, view) for pose, view in zip(tried_poses, views, strict=True)]
        new_cost = _cost(tried, after)
        if np.isfinite(new_cost) and new_cost <= cost:
            gained = (cost - new_cost) / max(cost, 1e-30)
            shared, poses, parts, cost, damping = tried, tried_poses, after, new_cost, damping * 0.1
            if gained < _ENOUGH:
                break
        else:
            damping *= 10.0
            if damping > 1e12:
                break
    covariance = _covariance(parts) if free_rig else np.zeros((SHARED_PARAMETERS, SHARED_PARAMETERS))
    return Adjustment(
        shared=frozen(shared),
        poses=frozen(poses),
        covariance=frozen(covariance),
        residuals=tuple(frozen(r) for r, _, _ in parts),
    )


Parts = list[tuple[FloatArray, FloatArray, FloatArray]]


def _cost(shared: FloatArray, parts: Parts) -> float:
    return sum(float(residual @ residual) for residual, _, _ in parts) + float(_PRIOR_WEIGHT @ shared**2)


def _step(shared: FloatArray, parts: Parts, damping: float, free_rig: bool) -> tuple[FloatArray, FloatArray]:
    """Return the step of the shared parameters (24,) and of the poses (V, 6)."""
    reduced, right_side = np.diag(_PRIOR_WEIGHT), _PRIOR_WEIGHT * shared
    kept = []
    for residual, by_shared, by_pose in parts:
        own = by_pose.T @ by_pose
        inverse = np.linalg.inv(own + np.diag(damping * np.diag(own)))
        cross, gradient = by_shared.T @ by_pose, by_pose.T @ residual
        reduced += by_shared.T @ by_shared - cross @ inverse @ cross.T
        right_side += by_shared.T @ residual - cross @ inverse @ gradient
        kept.append((inverse, cross, gradient))
    step = np.zeros(SHARED_PARAMETERS)
    if free_rig:
        scale = np.sqrt(np.maximum(np.diag(reduced), 1e-30))  # focal lengths and k3 differ by eight digits
        system = reduced / np.outer(scale, scale) + np.eye(SHARED_PARAMETERS) * damping
        step = -np.linalg.solve(system, right_side / scale) / scale
    poses = np.stack([-inverse @ (gradient + cross.T @ step) for inverse, cross, gradient in kept])
    return step, poses


def _covariance(parts: Parts) -> FloatArray:
    """Return the shared parameters' covariance (24, 24): the reduced normal equations, times the residual variance."""
    reduced = np.diag(_PRIOR_WEIGHT)
    for _, by_shared, by_pose in parts:
        cross = by_shared.T @ by_pose
        reduced += by_shared.T @ by_shared - cross @ np.linalg.inv(by_pose.T @ by_pose) @ cross.T
    count = sum(len(residual) for residual, _, _ in parts)
    freedom = max(count - SHARED_PARAMETERS - 6 * len(parts), 1)
    variance = sum(float(residual @ residual) for residual, _, _ in parts) / freedom
    scale = np.sqrt(np.maximum(np.diag(reduced), 1e-30))
    inverse: FloatArray = np.linalg.inv(reduced / np.outer(scale, scale)) / np.outer(scale, scale) * variance
    return inverse
