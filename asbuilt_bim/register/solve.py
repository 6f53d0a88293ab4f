"""A camera's pose from points of the world seen in one or both rectified photos: start, Gauss-Newton, covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import inverse, rigid, rotation_from_vector, skew

COMMON_SHARE = 0.5
"""Share of a survey's variance that one marker's points have in common: set-up and prism err alike for all four."""

ITERATIONS = 20
STEP_DONE = 1e-9  # radians and metres


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sighted:
    """Named points of the world (n, 3) in metres, and where the rectified photos show them (n, 2).

    `sigma_px` is each picture coordinate's standard deviation, `sigma_m` each world coordinate's.
    """

    name: str
    world_m: FloatArray
    left_px: FloatArray
    right_px: FloatArray | None
    sigma_px: float
    sigma_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """A pose, its covariance (6, 6) in world axes about the camera's centre, and what is left over.

    `variance_factor` is the weighted sum of squares over the degrees of freedom: 1 where the sigmas are right.
    """

    world_from_left: FloatArray
    covariance: FloatArray
    residual_px: float
    variance_factor: float


def solve_pose(camera: RectifiedCamera, seen: Sequence[Sighted]) -> Solution | None:
    """Find the pose that explains all the sightings; None where there is no sound one.

    The covariance holds picture noise and survey noise, and grows where the residuals say more than the sigmas.
    """
    pose = _start(camera, seen)
    if pose is None:
        return None
    for _ in range(ITERATIONS):
        normal, gradient = np.zeros((6, 6)), np.zeros(6)
        for group in seen:
            residual, jacobian = whitened(camera, pose, group)
            normal += jacobian.T @ jacobian
            gradient += jacobian.T @ residual
        if not np.all(np.isfinite(normal)) or np.linalg.cond(normal) > 1e14:
            return None
        step = np.asarray(np.linalg.solve(normal, gradient), dtype=np.float64)
        pose = moved(pose, step)
        if np.max(np.abs(step)) < STEP_DONE:
            break
    return _finish(camera, pose, seen)


def moved(world_from_left: FloatArray, step: FloatArray) -> FloatArray:
    """Apply a small motion (6,) [rotation vector, translation] in world axes about the camera's centre."""
    turn = rotation_from_vector(step[:3]) @ world_from_left[:3, :3]
    return rigid(turn, world_from_left[:3, 3] + step[3:])


def project_both(
    camera: RectifiedCamera, world_from_left: FloatArray, world_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return x left, y, x right, y (n, 4) in rectified pixels, and their Jacobian (n, 4, 3) by the world point."""
    turn = camera.rectified_from_left @ world_from_left[:3, :3].T
    x, y, z = ((world_m - world_from_left[:3, 3]) @ turn.T).T
    f, b = camera.f_px, camera.baseline_m
    zero = np.zeros_like(z)
    pixels = np.stack(
        [f * x / z + camera.cx_px, f * y / z + camera.cy_px, f * (x - b) / z + camera.cx_px, f * y / z + camera.cy_px],
        axis=-1,
    )
    row_y = np.stack([zero, f / z, -f * y / z**2], axis=-1)
    rows = [
        np.stack([f / z, zero, -f * x / z**2], axis=-1),
        row_y,
        np.stack([f / z, zero, -f * (x - b) / z**2], axis=-1),
        row_y,
    ]
    return pixels, np.stack(rows, axis=1) @ turn


def residuals(camera: RectifiedCamera, world_from_left: FloatArray, group: Sighted) -> tuple[FloatArray, FloatArray]:
    """Return seen minus predicted (n, k) in pixels, k = 2 or 4, and the Jacobian (n, k, 3) by the world point."""
    pixels, jacobian = project_both(camera, world_from_left, group.world_m)
    if group.right_px is None:
        return group.left_px - pixels[:, :2], jacobian[:, :2]
    return np.concatenate([group.left_px, group.right_px], axis=1) - pixels, jacobian


def pose_jacobian(world_from_left: FloatArray, world_m: FloatArray, by_point: FloatArray) -> FloatArray:
    """Return the Jacobian (n, k, 6) by a small motion of the camera from that (n, k, 3) by the point."""
    arms = np.stack([skew(arm) for arm in world_m - world_from_left[:3, 3]])
    return np.concatenate([by_point @ arms, -by_point], axis=-1)


def noise(group: Sighted, by_point: FloatArray) -> FloatArray:
    """Return the covariance (n k, n k) of a group's residuals: picture noise and the survey's, in pixels squared."""
    n, k, _ = by_point.shape
    covariance = np.eye(n * k) * group.sigma_px**2
    own = (1.0 - COMMON_SHARE) * group.sigma_m**2 * by_point @ by_point.transpose(0, 2, 1)
    for index in range(n):
        covariance[index * k : (index + 1) * k, index * k : (index + 1) * k] += own[index]
    stacked = by_point.reshape(n * k, 3)
    result: FloatArray = covariance + COMMON_SHARE * group.sigma_m**2 * stacked @ stacked.T
    return result


def whitened(camera: RectifiedCamera, world_from_left: FloatArray, group: Sighted) -> tuple[FloatArray, FloatArray]:
    """Return a group's residuals (m,) and pose Jacobian (m, 6), divided by their noise."""
    residual, by_point = residuals(camera, world_from_left, group)
    factor = np.linalg.cholesky(noise(group, by_point))
    jacobian = pose_jacobian(world_from_left, group.world_m, by_point).reshape(-1, 6)
    return np.linalg.solve(factor, residual.ravel()), np.linalg.solve(factor, jacobian)


def disagreement(camera: RectifiedCamera, solution: Solution, group: Sighted) -> float:
    """Return how badly a group that the solution has NOT used fits it: mean square in sigmas, pose noise included."""
    residual, by_point = residuals(camera, solution.world_from_left, group)
    if not np.all(np.isfinite(residual)):
        return float("inf")
    jacobian = pose_jacobian(solution.world_from_left, group.world_m, by_point).reshape(-1, 6)
    covariance = noise(group, by_point) + jacobian @ solution.covariance @ jacobian.T
    flat = residual.ravel()
    return float(flat @ np.linalg.solve(covariance, flat) / flat.size)


def _start(camera: RectifiedCamera, seen: Sequence[Sighted]) -> FloatArray | None:
    world = np.concatenate([group.world_m for group in seen])
    if len(world) < 4 or len({tuple(point) for point in np.round(world, 6)}) < 4:
        return None
    rays = camera.rays(np.concatenate([group.left_px for group in seen]))
    middle = world.mean(axis=0)  # world coordinates are large: PnP works about the points' own mean
    found, vector, shift = cv2.solvePnP(
        np.ascontiguousarray(world - middle),
        np.ascontiguousarray(rays[:, :2] / rays[:, 2:]),
        np.eye(3),
        np.zeros(0),
        flags=cv2.SOLVEPNP_SQPNP,
    )
    if not found or not np.all(np.isfinite(shift)):
        return None
    middle_from_left = inverse(rigid(vector, shift))
    pose = middle_from_left.copy()
    pose[:3, 3] += middle
    return pose


def _finish(camera: RectifiedCamera, pose: FloatArray, seen: Sequence[Sighted]) -> Solution | None:
    normal, total, count = np.zeros((6, 6)), 0.0, 0
    left_over = []
    for group in seen:
        ahead = (group.world_m - pose[:3, 3]) @ pose[:3, 2]
        residual, jacobian = whitened(camera, pose, group)
        if not np.all(np.isfinite(residual)) or np.any(ahead <= 0.0):
            return None
        normal += jacobian.T @ jacobian
        total += float(residual @ residual)
        count += residual.size
        left_over.append(residuals(camera, pose, group)[0].ravel())
    factor = total / max(count - 6, 1)
    covariance = np.linalg.inv(normal) * max(factor, 1.0)
    return Solution(
        world_from_left=pose,
        covariance=0.5 * (covariance + covariance.T),
        residual_px=float(np.sqrt(np.mean(np.concatenate(left_over) ** 2))),
        variance_factor=factor,
    )
