"""All boards, both cameras and the rig in one least-squares adjustment, and the covariance that it gives."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.parameters import CORNER_SIGMA_PX, BoardView, layout_of, view_residual
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen

_ROUNDS = 60
_ENOUGH = 1e-10  # relative gain of a step


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjustment:
    """The adjusted rig: `shared` parameters (S,) as `parameters` lays them out, and the boards' `poses` (V, 6).

    `covariance` (S, S) of the shared parameters, poses marginalised, as if all corners erred each by itself (of boards
    `board_sigma` knows better); `residuals` one (2 (N + M),) a view, in pixels, left first.
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


def adjust(
    shared: FloatArray,
    poses: FloatArray,
    views: list[BoardView],
    *,
    free: BoolArray | None = None,
    sigma_px: float = CORNER_SIGMA_PX,
) -> Adjustment:
    """Adjust the shared parameters (S,) and the boards' poses (V, 6) to all corners (Levenberg-Marquardt).

    The poses are eliminated view by view (Schur complement), so that the work grows with the number of views only.
    Shared parameters that are not `free` (S,) stay, and have no covariance; by default all are free. `sigma_px` weighs
    what lenses are like against corners.
    """
    prior = layout_of(shared).prior_weight(sigma_px)
    free = np.ones(len(shared), dtype=bool) if free is None else free
    damping, gained = 1e-4, 1.0
    parts = [view_residual(shared, pose, view) for pose, view in zip(poses, views, strict=True)]
    cost = _cost(shared, parts, prior)
    for _ in range(_ROUNDS):
        step, pose_steps = _step(shared, parts, damping, free, prior)
        tried, tried_poses = shared + step, poses + pose_steps
        after = [view_residual(tried, pose, view) for pose, view in zip(tried_poses, views, strict=True)]
        new_cost = _cost(tried, after, prior)
        if np.isfinite(new_cost) and new_cost <= cost:
            gained = (cost - new_cost) / max(cost, 1e-30)
            shared, poses, parts, cost, damping = tried, tried_poses, after, new_cost, damping * 0.1
            if gained < _ENOUGH:
                break
        else:
            damping *= 10.0
            if damping > 1e12:
                break
    return Adjustment(
        shared=frozen(shared),
        poses=frozen(poses),
        covariance=frozen(_covariance(parts, free, prior)),
        residuals=tuple(frozen(r) for r, _, _ in parts),
    )


Parts = list[tuple[FloatArray, FloatArray, FloatArray]]


def _cost(shared: FloatArray, parts: Parts, prior: FloatArray) -> float:
    return sum(float(residual @ residual) for residual, _, _ in parts) + float(prior @ shared**2)


def _step(
    shared: FloatArray, parts: Parts, damping: float, free: BoolArray, prior: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the step of the shared parameters (S,) and of the poses (V, 6)."""
    reduced, right_side = np.diag(prior), prior * shared
    kept = []
    for residual, by_shared, by_pose in parts:
        own = by_pose.T @ by_pose
        inverse = np.linalg.inv(own + np.diag(damping * np.diag(own)))
        cross, gradient = by_shared.T @ by_pose, by_pose.T @ residual
        reduced += by_shared.T @ by_shared - cross @ inverse @ cross.T
        right_side += by_shared.T @ residual - cross @ inverse @ gradient
        kept.append((inverse, cross, gradient))
    step = np.zeros(len(shared))
    if free.any():
        moving = np.ix_(free, free)
        scale = np.sqrt(np.maximum(np.diag(reduced)[free], 1e-30))  # focal lengths and k3 differ by eight digits
        system = reduced[moving] / np.outer(scale, scale) + np.eye(len(scale)) * damping
        step[free] = -np.linalg.solve(system, right_side[free] / scale) / scale
    poses = np.stack([-inverse @ (gradient + cross.T @ step) for inverse, cross, gradient in kept])
    return step, poses


def _covariance(parts: Parts, free: BoolArray, prior: FloatArray) -> FloatArray:
    """Return the shared parameters' covariance (S, S): the reduced normal equations, times the residual variance."""
    whole = np.zeros((len(prior), len(prior)))
    if not free.any():
        return whole
    reduced = np.diag(prior)
    for _, by_shared, by_pose in parts:
        cross = by_shared.T @ by_pose
        reduced += by_shared.T @ by_shared - cross @ np.linalg.inv(by_pose.T @ by_pose) @ cross.T
    count = sum(len(residual) for residual, _, _ in parts)
    freedom = max(count - int(free.sum()) - 6 * len(parts), 1)
    variance = sum(float(residual @ residual) for residual, _, _ in parts) / freedom
    moving = np.ix_(free, free)
    scale = np.sqrt(np.maximum(np.diag(reduced)[free], 1e-30))
    whole[moving] = np.linalg.inv(reduced[moving] / np.outer(scale, scale)) / np.outer(scale, scale) * variance
    return whole
