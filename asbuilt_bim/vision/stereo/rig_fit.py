"""How the right camera stands now, against the calibration: rotation and baseline direction fitted to matches.

A turn about the vertical (yaw) hides from the rows' mean difference and ruins every distance; it shows in how the rows
differ over the frame. So all five numbers of the essential matrix are fitted, with what the matches leave open.
Also what such a correction does to a measured area and to the rows of the photos, used as they were calibrated.
"""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, SIDE_M
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import in_pixels, seen_points
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.robust_least_squares import by_differences, robust_fit
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, skew, unit

PRIOR_RAD = 0.1
"""Of each number: a rig knocked by more than about six degrees is another rig; it keeps a poor fit finite."""
STEP_PX, STEP_RAD = 1e-2, 1e-6  # and of a metre
_LEAST_SIGMA_PX = 0.02
_PLACES = ((0.0, 0.0), (-0.25, 0.0), (0.25, 0.0), (0.0, -0.25), (0.0, 0.25))  # of the frame, about its middle
LENS_CELLS = (6, 4)
"""Of the frame: what a lens model leaves changes over about a quarter of the photo."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigFit:
    """A correction (5,) in radians: the right camera's turn about x, y, z, the baseline's direction along y and z.

    In the rectified frame of the rig that it corrects, a point X seen by the left camera lies at `R(turn) (X - b
    unit(1, ty, tz))` for the right one. The calibration says `X - b (1, 0, 0)`. `information` (5, 5) is the matches'
    own. `from_rig` (5, P) carries errors of the rig's calibrated numbers, in `relative_units`, into `information @
    correction`. So it is the same for photos worked on at a smaller size. `from_lens` (5, 24) does so with what the
    lenses leave across the rows, in pixels, in each of 6 x 4 cells of the left photo. That error is common to all
    matches of a cell, at every station.
    """

    correction_rad: FloatArray
    information: FloatArray
    from_rig: FloatArray
    from_lens: FloatArray
    matches: int  # those that the fit rests on
    rows_px: float  # how far apart rows lie in the photos as they are: the worse median of the left and right half


def fit_rig(
    left_px: FloatArray, right_px: FloatArray, camera: RectifiedCamera, rig: StereoRig, pixels_per_point: float = 1.0
) -> RigFit | None:
    """Fit the correction to matches (N, 2) in rectified pixels; None where they leave it undetermined.

    `pixels_per_point` above 1 says how many matches share one measurement (their windows overlap).
    Foreign matches count less and less as the fit closes in (Tukey's weights on a robust sigma).
    """
    a, b = camera.rectified_rays(left_px), camera.rectified_rays(right_px)

    def misfit(correction: FloatArray) -> FloatArray:
        essential = rotation_from_vector(correction[:3]) @ skew(_along(correction))
        return camera.f_px / _LEAST_SIGMA_PX * _sampson(a, b, essential)

    fit = robust_fit(misfit, np.zeros(5), np.full(5, STEP_RAD), np.full(5, 1.0 / PRIOR_RAD))
    used = int(np.sum(fit.weights > 0.1))
    if used < 8:
        return None
    sigma_px = _LEAST_SIGMA_PX * fit.scale
    influence = (fit.jacobian * fit.weights[:, None]).T / (fit.scale * sigma_px * pixels_per_point)
    return RigFit(
        correction_rad=frozen(fit.parameters),
        information=frozen(fit.information / pixels_per_point),
        from_rig=frozen(influence @ _rig_jacobian(a, b, rig, camera) * relative_units(rig)),
        from_lens=frozen(influence @ _cells(left_px, camera)),
        matches=used,
        rows_px=_rows_px(left_px[fit.weights > 0.1], right_px[fit.weights > 0.1], camera),
    )


def _rows_px(left_px: FloatArray, right_px: FloatArray, camera: RectifiedCamera) -> float:
    apart, is_left = right_px[:, 1] - left_px[:, 1], left_px[:, 0] < 0.5 * camera.width_px
    halves = [float(np.median(apart[half])) for half in (is_left, ~is_left) if half.any()]
    return max(map(abs, halves))


def corrected_rig(rig: StereoRig, camera: RectifiedCamera, correction_rad: FloatArray) -> StereoRig:
    """Return the rig with the correction (5,) applied; the baseline keeps its length. Its covariance is left as is."""
    left_turn = camera.rectified_from_left
    right_turn = left_turn @ rig.right_from_left[:3, :3].T
    turn = right_turn.T @ rotation_from_vector(correction_rad[:3]) @ left_turn
    centre = rig.baseline_m * left_turn.T @ _along(correction_rad)
    return replace(rig, right_from_left=frozen(rigid(turn, -turn @ centre)))


def relative_units(rig: StereoRig) -> FloatArray:
    """Return the unit (P,) of each of the rig's numbers in `RigFit.from_rig`: pixels count in focal lengths."""
    return np.where(in_pixels(rig), rig.left.K[0, 0], 1.0)


def area_effects(correction_rad: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return the relative errors (5,) of an area of 1 m2 at 5 m: in the middle, left, right, above, below.

    The square faces the camera; the photos are those of the corrected rig, and the calibration's is used on them.
    A turn about the camera's axis tilts what it sees: it leaves the middle right and moves the sides.
    """
    corners = 0.5 * SIDE_M * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    span = np.array([camera.width_px, camera.height_px]) / camera.f_px * DISTANCE_M
    middle = camera.rectified_rays(np.array([camera.width_px, camera.height_px]) / 2)[:2]
    centres = middle * DISTANCE_M + np.array(_PLACES) * span
    xy = centres[:, None, :] + corners[None]
    points = np.concatenate([xy, np.full((*xy.shape[:2], 1), DISTANCE_M)], axis=-1)
    left, right = seen_by(points, correction_rad, camera)
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
    left, right = seen_by(rays * DISTANCE_M, correction_rad, camera)
    return float(camera.f_px * np.abs(left[..., 1] - right[..., 1]).max())


def _cells(pixels: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return (N, cells), 1 in the cell of the frame in which each match lies."""
    across, down = LENS_CELLS
    column = np.clip(pixels[:, 0] * across / camera.width_px, 0, across - 1).astype(np.intp)
    row = np.clip(pixels[:, 1] * down / camera.height_px, 0, down - 1).astype(np.intp)
    inside: FloatArray = np.eye(across * down)[row * across + column]
    return inside


def _along(correction: FloatArray) -> FloatArray:
    direction: FloatArray = unit(np.array([1.0, correction[3], correction[4]]))
    return direction


def _sampson(a: FloatArray, b: FloatArray, essential: FloatArray) -> FloatArray:
    """Return the signed distance (N,) of ray pairs (N, 3) from `b E a = 0`, in units of z = 1.

    Reference: Sampson 1982; Hartley & Zisserman 2004, eq. 11.9. The root of 2 makes it the rows' difference, whose
    sigma is that of one match.
    """
    forward, back = a @ essential.T, b @ essential
    slope = np.sqrt((forward[:, :2] ** 2).sum(axis=1) + (back[:, :2] ** 2).sum(axis=1))
    distance: FloatArray = np.sqrt(2.0) * np.sum(b * forward, axis=1) / np.maximum(slope, 1e-12)
    return distance


def _rig_jacobian(a: FloatArray, b: FloatArray, rig: StereoRig, camera: RectifiedCamera) -> FloatArray:
    """Return how the misfits in pixels (N, P) change with each of the rig's numbers, the photos being fixed."""
    left = a @ camera.rectified_from_left
    right = b @ camera.rectified_from_left @ rig.right_from_left[:3, :3].T
    seen = seen_points(rig, left[:, :2] / left[:, 2:], right[:, :2] / right[:, 2:])

    def misfit(change: FloatArray) -> FloatArray:
        from_left, from_right, pose = seen.rays(change)
        turn = pose[:3, :3]
        return camera.f_px * _sampson(from_left, from_right, turn @ skew(unit(-turn.T @ pose[:3, 3])))

    steps = np.where(in_pixels(rig), STEP_PX, STEP_RAD)
    return by_differences(misfit, np.zeros(len(steps)), steps)


def seen_by(points_m: FloatArray, correction: FloatArray, camera: RectifiedCamera) -> tuple[FloatArray, FloatArray]:
    """Return x/z and y/z (..., 2) of points (..., 3) in the rectified left frame, in both photos as they are."""
    eye = camera.baseline_m * unit(np.array([1.0, correction[3], correction[4]]))
    right = (points_m - eye) @ rotation_from_vector(correction[:3]).T
    return points_m[..., :2] / points_m[..., 2:], right[..., :2] / right[..., 2:]
