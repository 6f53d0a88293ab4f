"""Planes as stereo sees them: disparity is linear in the pixel, d = q . r.

`r` is the rectified ray ((x - cx) / f, (y - cy) / f, 1) and q = f b n / h for the plane n . X = h in the rectified
frame (n away from the camera, h > 0). Two planes meet in the image on the line (q1 - q2) . r = 0.
"""

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.plane import Plane
from asbuilt_bim.geometry.robust_least_squares import robust_sigma, tukey
from asbuilt_bim.geometry.transform import unit

ROUNDS, LEAST_INFORMATION = 6, 1e-9  # one round less moves a narrow face by 0.2 of its sigma


def plane_of(q_px: ArrayLike, focal_baseline: float) -> Plane:
    """Return the metric plane of q (3,) in the rectified frame, its normal towards the camera.

    `focal_baseline` is f b in px m. A q of zero (a plane at infinity) has no metric plane: offset -inf.
    """
    q = np.asarray(q_px, dtype=np.float64)
    length = float(np.linalg.norm(q))
    offset = -focal_baseline / length if length > 0.0 else -np.inf
    return Plane(normal=frozen(-unit(q)), offset_m=offset)


def fit_q(rays: FloatArray, disparity_px: FloatArray, sigma_px: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Fit q to rays (N, 3) and disparities (N,) robustly; returns q and its covariance.

    The scale of the residuals is estimated (never under the given sigma), so the covariance holds for the data as
    they scatter, if not for what neighbours share.

    Raises: ValueError for fewer than 3 points.
    """
    if len(rays) < 3:
        raise ValueError(f"a plane needs 3 points, not {len(rays)}")
    weight = np.broadcast_to(1.0 / np.square(sigma_px), disparity_px.shape)
    trust, scale = np.ones(len(rays)), 1.0
    for _ in range(ROUNDS):
        weighted = rays * (weight * trust)[:, None]
        information = weighted.T @ rays + LEAST_INFORMATION * np.eye(3)
        q = np.asarray(np.linalg.solve(information, weighted.T @ disparity_px))
        residual = (disparity_px - rays @ q) / sigma_px
        scale = max(1.0, robust_sigma(residual))
        trust = tukey(residual / scale)
    return q, np.asarray(np.linalg.inv(information) * scale**2, dtype=np.float64)
