"""Projects points into distorted photos, and finds the ray of every distorted pixel (exact to 1e-9)."""

from __future__ import annotations

import numpy as np

from asbuilt_synthetic.model import CameraTruth, FloatArray, RigTruth, Station

_FOLD_LIMIT = 1.15  # beyond this tangent the distortion polynomial is not trusted: such points are out of frame


def distort(camera: CameraTruth, xy: FloatArray) -> FloatArray:
    """Map normalised pinhole coordinates (N, 2) to distorted normalised coordinates (OpenCV's model)."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    skew_x, skew_y = 2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.asarray(np.c_[x * radial + skew_x, y * radial + skew_y])


def project(camera: CameraTruth, points_m: FloatArray) -> FloatArray:
    """Project camera-frame points (N, 3) to pixels (N, 2); NaN behind the camera or far outside the frame."""
    z = points_m[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        xy = np.where((z > 1e-6)[:, None], points_m[:, :2] / z[:, None], np.nan)
    xy[np.hypot(xy[:, 0], xy[:, 1]) > _FOLD_LIMIT] = np.nan
    d = distort(camera, xy)
    return np.asarray(d @ camera.K[:2, :2].T + camera.K[:2, 2], np.float64)


def in_frame(camera: CameraTruth, pixels: FloatArray, margin_px: float = 0.0) -> np.ndarray:
    """Tell which pixels (N, 2) lie in the photo, NaN being outside."""
    low, high = margin_px - 0.5, np.array([camera.width_px, camera.height_px]) - 0.5 - margin_px
    with np.errstate(invalid="ignore"):
        return np.asarray(((pixels > low) & (pixels < high)).all(1))


def directions(camera: CameraTruth, pixels: FloatArray) -> FloatArray:
    """Find the camera-frame rays (N, 3), z = 1, of distorted pixels (N, 2) by fixed-point iteration."""
    k1, k2, p1, p2, k3 = camera.distortion
    target = np.linalg.solve(camera.K[:2, :2], (pixels - camera.K[:2, 2]).T).T
    xy = target.copy()
    for _ in range(40):
        x, y = xy[:, 0], xy[:, 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        step = np.c_[2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y]
        new = (target - step) / radial[:, None]
        done = np.abs(new - xy).max() < 1e-10
        xy = new
        if done:
            break
    return np.asarray(np.c_[xy, np.ones(len(xy))])


def camera_of(rig: RigTruth, side: str) -> CameraTruth:
    """Return the camera of a side."""
    return rig.left if side == "left" else rig.right


def world_from_camera(rig: RigTruth, station: Station, side: str) -> FloatArray:
    """Return the pose (4, 4) of the left or right camera at a station."""
    if side == "left":
        return station.world_from_left
    return np.asarray(station.world_from_left @ np.linalg.inv(rig.right_from_left), np.float64)
