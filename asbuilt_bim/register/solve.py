"""A camera's pose from points of the world seen in one or both rectified photos: start, least squares, covariance."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.robust_least_squares import fit
from asbuilt_bim.geometry.transform import inverse, rigid, rotation_from_vector, skew

COMMON_SHARE = 0.5
"""Share of a survey's variance that one marker's points have in common: set-up and prism err alike for all four."""

_NOISE_ROUNDS = 2  # the survey's noise in the photo is the start's, then the pose's own
_MOST_CONDITION = 1e14


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
    try:
        for _ in range(_NOISE_ROUNDS):
            pose = None if pose is None else _settled(camera, pose, seen)
        return None if pose is None else _finish(camera, pose, seen)
    except np.linalg.LinAlgError:  # a marker would lie in the camera's own plane: no photo shows it there
        return None


def _settled(camera: RectifiedCamera, pose: FloatArray, seen: Sequence[Sighted]) -> FloatArray | None:
    """Return the pose nearest to all sightings, with the noise seen from `pose`; None where they don't hold it."""
    factors = [_factor(camera, pose, group) for group in seen]

    last: list[tuple[bytes, FloatArray]] = []

    def at(step: FloatArray) -> FloatArray:
        key = step.tobytes()
        if not last or last[0][0] != key:  # residuals and Jacobian are asked for one after the other
            there = moved(pose, step)
            rows = np.concatenate([whitened(camera, there, *both) for both in zip(seen, factors, strict=True)])
            last[:] = [(key, rows)]
        return last[0][1]

    if not np.all(np.isfinite(at(np.zeros(6)))):
        return None
    found = fit(lambda step: at(step)[:, 0], np.zeros(6), lambda step: -at(step)[:, 1:])
    return moved(pose, found.parameters) if np.linalg.cond(found.information) < _MOST_CONDITION else None


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
    pixels, rows = np.empty((len(z), 4)), np.zeros((len(z), 4, 3))
    for place, across in ((0, x), (2, x - b)):
        pixels[:, place] = f * across / z + camera.cx_px
        rows[:, place, 0] = f / z
        rows[:, place, 2] = -f * across / z**2
    for place in (1, 3):
        pixels[:, place] = f * y / z + camera.cy_px
        rows[:, place, 1] = f / z
        rows[:, place, 2] = -f * y / z**2
    return pixels, rows @ turn


def residuals(camera: RectifiedCamera, world_from_left: FloatArray, group: Sighted) -> tuple[FloatArray, FloatArray]:
    """Return seen minus predicted (n, k) in pixels, k = 2 or 4, and the Jacobian (n, k, 3) by the world point."""
    pixels, jacobian = project_both(camera, world_from_left, group.world_m)
    if group.right_px is None:
        return group.left_px - pixels[:, :2], jacobian[:, :2]
    return np.concatenate([group.left_px, group.right_px], axis=1) - pixels, jacobian


def pose_jacobian(world_from_left: FloatArray, world_m: FloatArray, by_point: FloatArray) -> FloatArray:
    """Return the Jacobian (n, k, 6) by a small motion of the camera from that (n, k, 3) by the point."""
    return np.concatenate([by_point @ skew(world_m - world_from_left[:3, 3]), -by_point], axis=-1)


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


def whitened(
    camera: RectifiedCamera, world_from_left: FloatArray, group: Sighted, factor: FloatArray | None = None
) -> FloatArray:
    """Return a group's residuals, and beside them its pose Jacobian (m, 1 + 6), both divided by their noise.

    `factor` (m, m) is the root of the noise's covariance, where it isn't the one seen from here.
    """
    residual, by_point = residuals(camera, world_from_left, group)
    jacobian = pose_jacobian(world_from_left, group.world_m, by_point).reshape(-1, 6)
    factor = _factor(camera, world_from_left, group) if factor is None else factor
    return np.asarray(np.linalg.solve(factor, np.column_stack([residual.ravel(), jacobian])), dtype=np.float64)


def _factor(camera: RectifiedCamera, world_from_left: FloatArray, group: Sighted) -> FloatArray:
    return np.asarray(np.linalg.cholesky(noise(group, residuals(camera, world_from_left, group)[1])), dtype=np.float64)


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
    try:
        found, vector, shift = cv2.solvePnP(
            np.ascontiguousarray(world - middle), np.ascontiguousarray(rays[:, :2] / rays[:, 2:]), np.eye(3),
            np.zeros(0), flags=cv2.SOLVEPNP_SQPNP,
        )  # fmt: skip
    except cv2.error:  # OpenCV gives up where no pose is near
        return None
    if not found or not np.all(np.isfinite(shift)):
        return None
    middle_from_left = inverse(rigid(vector, shift))
    pose = middle_from_left.copy()
    pose[:3, 3] += middle
    return pose


def _finish(camera: RectifiedCamera, pose: FloatArray, seen: Sequence[Sighted]) -> Solution | None:
    ahead = [(group.world_m - pose[:3, 3]) @ pose[:3, 2] for group in seen]
    rows = np.concatenate([whitened(camera, pose, group) for group in seen])
    if not np.all(np.isfinite(rows)) or min(float(one.min()) for one in ahead) <= 0.0:
        return None
    factor = float(rows[:, 0] @ rows[:, 0]) / max(len(rows) - 6, 1)
    covariance = np.linalg.inv(rows[:, 1:].T @ rows[:, 1:]) * max(factor, 1.0)
    left_over = np.concatenate([residuals(camera, pose, group)[0].ravel() for group in seen])
    return Solution(
        world_from_left=pose,
        covariance=0.5 * (covariance + covariance.T),
        residual_px=float(np.sqrt(np.mean(left_over**2))),
        variance_factor=factor,
    )
