"""Planes as stereo sees them: disparity is linear in the pixel, d = q . r.

`r` is the rectified ray ((x - cx) / f, (y - cy) / f, 1) and q = f b n / h for the plane n . X = h in the rectified
frame (n away from the camera, h > 0). Two planes meet in the image on the line (q1 - q2) . r = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.plane import Plane
from asbuilt_bim.geometry.transform import unit


def plane_of(q_px: ArrayLike, focal_baseline: float) -> Plane:
    """Return the metric plane of q (3,) in the rectified frame, its normal towards the camera.

    `focal_baseline` is f b in px m. A q of zero (a plane at infinity) has no metric plane: offset -inf.
    """
    q = np.asarray(q_px, dtype=np.float64)
    length = float(np.linalg.norm(q))
    offset = -focal_baseline / length if length > 0.0 else -np.inf
    return Plane(normal=frozen(-unit(q)), offset_m=offset)


def q_of(plane: Plane, focal_baseline: float) -> FloatArray:
    """Return q (3,) of a plane in the rectified frame."""
    return np.asarray(plane.normal * (focal_baseline / plane.offset_m), dtype=np.float64)


def fit_q(
    rays: FloatArray, disparity_px: FloatArray, sigma_px: FloatArray, steps: int = 6
) -> tuple[FloatArray, FloatArray]:
    """Fit q to rays (N, 3) and disparities (N,) by reweighted least squares (Tukey, 4 sigma); returns q, covariance.

    The scale of the residuals is estimated (never under the given sigma), so the covariance holds for the data as
    they scatter, if not for what neighbours share.

    Raises: ValueError for fewer than 3 points.
    """
    if len(rays) < 3:
        raise ValueError(f"a plane needs 3 points, not {len(rays)}")
    weight: FloatArray = 1.0 / np.square(sigma_px)
    q: FloatArray = np.zeros(3)
    normal_matrix: FloatArray = np.eye(3)
    scale = 1.0
    tukey: FloatArray = np.ones_like(weight)
    for _ in range(steps):
        weighted = rays * (weight * tukey)[:, None]
        normal_matrix = weighted.T @ rays + 1e-9 * np.eye(3)
        q = np.asarray(np.linalg.solve(normal_matrix, weighted.T @ disparity_px))
        residual = (disparity_px - rays @ q) / sigma_px
        scale = max(1.0, 1.4826 * float(np.median(np.abs(residual))))
        tukey = np.asarray(np.square(np.clip(1.0 - np.square(residual / (4.0 * scale)), 0.0, None)), np.float64)
    covariance: FloatArray = np.asarray(np.linalg.inv(normal_matrix), np.float64) * scale**2
    return q, covariance
