"""What a rig that no longer stands as it was calibrated does to a measured area, and to the rows of the photos."""

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, SIDE_M
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import rotation_from_vector, unit

_PLACES = ((0.0, 0.0), (-0.25, 0.0), (0.25, 0.0), (0.0, -0.25), (0.0, 0.25))  # of the frame, about its middle
STEP_RAD = 1e-6


def area_effects(correction_rad: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return the relative errors (5,) of an area of 1 m2 at 5 m: in the middle, left, right, above, below.

    The square faces the camera; the photos are those of the corrected rig, and the calibration's is used on them.
    A turn about the camera's axis tilts what it sees: it leaves the middle right and moves the sides.
    """
    corners = 0.5 * SIDE_M * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    span = np.array([camera.width_px, camera.height_px]) / camera.f_px * DISTANCE_M
    middle = (np.array([camera.width_px, camera.height_px]) / 2 - [camera.cx_px, camera.cy_px]) / camera.f_px
    centres = middle * DISTANCE_M + np.array(_PLACES) * span
    xy = centres[:, None, :] + corners[None]
    points = np.concatenate([xy, np.full((*xy.shape[:2], 1), DISTANCE_M)], axis=-1)
    left, right = _seen(points, correction_rad, camera)
    disparity = np.maximum(left[..., 0] - right[..., 0], 1e-6)
    depth = camera.baseline_m / disparity
    rays = np.concatenate([left, np.ones((*left.shape[:2], 1))], axis=-1)
    measured = rays * depth[..., None]
    diagonals = measured[:, 2] - measured[:, 0], measured[:, 3] - measured[:, 1]
    areas = 0.5 * np.linalg.norm(np.cross(*diagonals), axis=-1)
    effects: FloatArray = areas / SIDE_M**2 - 1.0
    return effects


def worst_area_effect(
    correction_rad: FloatArray, covariance: FloatArray, camera: RectifiedCamera
) -> tuple[float, float]:
    """Return the worst of `area_effects`, and its sigma from the correction's covariance (5, 5).

    The worst place is where effect and sigma together are largest: where nothing is off, the least known one.
    """
    effects = area_effects(correction_rad, camera)
    slopes = np.array([area_effects(correction_rad + step, camera) - effects for step in STEP_RAD * np.eye(5)])
    slopes /= STEP_RAD
    variances = np.maximum(np.einsum("ip,ij,jp->p", slopes, covariance, slopes), 0.0)
    worst = int(np.argmax(effects**2 + variances))
    return float(effects[worst]), float(np.sqrt(variances[worst]))


def row_effect_px(correction_rad: FloatArray, camera: RectifiedCamera) -> float:
    """Return how far apart in pixels the rows of both photos lie at 5 m, the worst place of the frame's inner half."""
    across = np.array([-0.25, 0.0, 0.25])
    grid = np.stack(np.meshgrid(across * camera.width_px, across * camera.height_px), axis=-1).reshape(1, -1, 2)
    rays = np.concatenate([grid / camera.f_px, np.ones((1, grid.shape[1], 1))], axis=-1)
    left, right = _seen(rays * DISTANCE_M, correction_rad, camera)
    return float(camera.f_px * np.abs(left[..., 1] - right[..., 1]).max())


def _seen(points_m: FloatArray, correction: FloatArray, camera: RectifiedCamera) -> tuple[FloatArray, FloatArray]:
    """Return x/z and y/z (..., 2) of points (..., 3) in the rectified left frame, in both photos as they are."""
    eye = camera.baseline_m * unit(np.array([1.0, correction[3], correction[4]]))
    right = (points_m - eye) @ rotation_from_vector(correction[:3]).T
    return points_m[..., :2] / points_m[..., 2:], right[..., :2] / right[..., 2:]
