"""The direct linear transformation: a camera from points whose places in space are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

FEWEST_POINTS = 6
_FLAT = 1e-3
"""Smallest over largest extent of the points: flatter than this and a plane's camera is not unique."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearCamera:
    """`P` (3, 4) with pixels ~ P world, and its parts K (3, 3) and `camera_from_world` (4, 4); misfit in pixels."""

    P: FloatArray
    K: FloatArray
    camera_from_world: FloatArray
    rms_px: float


def camera_from_points(points_m: ArrayLike, pixels: ArrayLike) -> LinearCamera:
    """Find the camera that sees points (N, 3), N >= 6 and not in one plane, at pixels (N, 2) of an undistorted photo.

    Raises: CalibrationError for too few points, for points in one plane, and for a camera that is not one.
    Reference: Abdel-Aziz & Karara 1971; Hartley & Zisserman 2004, algorithm 7.1; Perez & Tah 2023, section 3.2.
    """
    points, seen = np.asarray(points_m, dtype=np.float64), np.asarray(pixels, dtype=np.float64)
    if points.shape != (len(seen), 3) or seen.shape != (len(points), 2):
        raise CalibrationError(f"DLT: points {points.shape} and pixels {seen.shape} must be (N, 3) and (N, 2)")
    if len(points) < FEWEST_POINTS:
        raise CalibrationError(f"DLT: {len(points)} points, at least {FEWEST_POINTS} are needed; measure more")
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if extent[2] <= _FLAT * extent[0]:
        raise CalibrationError(
            f"DLT: the points lie in one plane (extent {extent[2]:.3g} of {extent[0]:.3g} m, limit {_FLAT:g}); "
            "add points before or behind it"
        )
    in_space, in_photo = _normaliser(points), _normaliser(seen)
    X, x = _homogeneous(points) @ in_space.T, _homogeneous(seen) @ in_photo.T
    zero = np.zeros_like(X)
    rows = np.concatenate([np.hstack([X, zero, -x[:, :1] * X]), np.hstack([zero, X, -x[:, 1:2] * X])])
    try:
        P = np.linalg.inv(in_photo) @ np.linalg.svd(rows, full_matrices=False)[2][-1].reshape(3, 4) @ in_space
        return _taken_apart(P, points, seen)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"DLT: points and pixels determine no camera ({error}); check that they are paired rightly"
        ) from error


def _taken_apart(P: FloatArray, points: FloatArray, seen: FloatArray) -> LinearCamera:
    """Split P = K [R | t] with K upper triangular, its diagonal positive, and the points in front."""
    if np.linalg.det(P[:, :3]) < 0.0:
        P = -P
    # RQ by QR: reversing rows and columns turns one into the other.
    flip = np.eye(3)[::-1]
    q, r = np.linalg.qr((flip @ P[:, :3]).T)
    K, R = flip @ r.T @ flip, flip @ q.T
    sign = np.diag(np.where(np.diag(K) < 0.0, -1.0, 1.0))
    K, R = K @ sign, sign @ R
    scale = K[2, 2]
    shift = np.linalg.solve(K, P[:, 3])
    K, P = K / scale, P / scale
    depth = points @ R[2] + shift[2]
    if not np.all(np.isfinite(K)) or np.any(depth <= 0.0):
        raise CalibrationError(
            "DLT: points come out behind the camera; check that points and pixels are paired rightly"
        )
    projected = _homogeneous(points) @ P.T
    miss = projected[:, :2] / projected[:, 2:] - seen
    return LinearCamera(
        P=frozen(P),
        K=frozen(K),
        camera_from_world=frozen(rigid(R, shift)),
        rms_px=float(np.sqrt(np.mean(np.sum(miss * miss, axis=1)))),
    )


def _homogeneous(points: FloatArray) -> FloatArray:
    extended: FloatArray = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    return extended


def _normaliser(points: FloatArray) -> FloatArray:
    """Return the similarity that centres the points and scales them to sqrt(dimension) from the centre."""
    dimension = points.shape[1]
    middle = points.mean(axis=0)
    scale = np.sqrt(dimension) / max(float(np.mean(np.linalg.norm(points - middle, axis=1))), 1e-12)
    matrix: FloatArray = np.eye(dimension + 1) * scale
    matrix[:-1, -1], matrix[-1, -1] = -scale * middle, 1.0
    return matrix
