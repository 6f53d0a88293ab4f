"""A rig from control points, for cameras that can't see a board: DLT of each camera, then one adjustment of both."""

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.calibrate import Calibration, rig_of_adjustment, view_fit
from asbuilt_bim.camera.calibration.checks import (
    Checks,
    corner_fits,
    length_error,
    refuse_impossible,
    scale_sigmas,
    share_covered,
    warning,
)
from asbuilt_bim.camera.calibration.control_file import ControlPoints
from asbuilt_bim.camera.calibration.dlt import camera_from_points
from asbuilt_bim.camera.calibration.parameters import (
    CORNER_SIGMA_PX,
    BoardView,
    camera_of,
    layout_of,
    pack,
    right_from_left_of,
)
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import rig_problems
from asbuilt_bim.codes import Note, Reason, SubjectKind, about
from asbuilt_bim.errors import CalibrationError, Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid, vector_from_rotation

FEWEST_FOR_LENS = 15
"""Points a photo: thirty numbers for the fifteen of a camera, its lens and its pose, twice over."""
_BLUNDER, _BLUNDER_FLOOR_PX = 5.0, 2.0  # sigmas of all points; a hand is good to better than two pixels
_FOLDS = 4
_LOW_REACH = 0.6  # of the photo, as of boards; a lens runs away soon beyond the last point


def rig_from_control_points(control: ControlPoints, size: tuple[int, int]) -> Calibration:
    """Calibrate both cameras from points that don't lie in one plane, at least six in each photo of `size` (w, h).

    The lens is fitted from `FEWEST_FOR_LENS` points in each photo on. A point that misses far more than the others is
    left out by name. The scale is the points' own.

    Raises: CalibrationError for too few points, points in one plane, and cameras that can't be.
    Reference: Hartley & Zisserman 2004, algorithm 7.1; Perez & Tah 2023, section 3.2.
    """
    _check_pixels(control, size)
    origin = control.points_m.mean(axis=0) if len(control.names) else np.zeros(3)  # surveys are far from the origin
    points = control.points_m - origin
    used = np.ones(len(points), dtype=bool)
    left_out: list[Rejection] = []
    while True:
        view = _view(control, points, used)
        adjusted = _adjusted(view, size)
        blunder = _worst(control, points, used, adjusted, left_out)
        if blunder is None:
            break
        used[blunder] = False
    refuse_impossible(
        right_from_left_of(adjusted.shared), "the control points as they are", "give their coordinates in metres"
    )
    rig = rig_of_adjustment(adjusted, size, rig_covariance(adjusted), 1)
    if problems := rig_problems(rig):
        raise CalibrationError("calibration: the control points give no usable rig:\n  " + "\n  ".join(problems))
    fits = corner_fits([view], adjusted)
    return Calibration(
        rig=rig,
        views=(view_fit(view, adjusted.poses[0], adjusted.residuals[0]),),
        left_out=tuple(left_out),
        checks=_checks(view, adjusted, rig),
        corners_left=fits[0],
        corners_right=fits[1],
        from_control_points=True,
    )


def _check_pixels(control: ControlPoints, size: tuple[int, int]) -> None:
    """Refuse marks that lie outside a photo of `size`: another size was given, or a mark is wrong.

    Raises: CalibrationError with the first of them.
    """
    for side, pixels in (("left", control.left_px), ("right", control.right_px)):
        outside = np.any((pixels < -0.5) | (pixels > np.array(size) - 0.5), axis=1)
        for name, (x, y) in [(control.names[i], pixels[i]) for i in np.flatnonzero(outside)][:1]:
            raise CalibrationError(
                f"control point {name}: {x:g}, {y:g} px lies outside the {side} photo of {size[0]} x {size[1]} px (and "
                f"{outside.sum() - 1} more do); correct the mark, or the photos' size"
            )


def _view(control: ControlPoints, points: FloatArray, used: BoolArray) -> BoardView:
    in_left, in_right = (used & np.isfinite(pixels[:, 0]) for pixels in (control.left_px, control.right_px))
    return BoardView(
        name="control points",
        left_points_m=points[in_left],
        left_px=control.left_px[in_left],
        right_points_m=points[in_right],
        right_px=control.right_px[in_right],
    )


def _adjusted(view: BoardView, size: tuple[int, int]) -> Adjustment:
    """Find both cameras by DLT and adjust them together."""
    cameras, poses = [], []
    for side, points, pixels in (
        ("left", view.left_points_m, view.left_px),
        ("right", view.right_points_m, view.right_px),
    ):
        try:
            found = camera_from_points(points, pixels)
        except CalibrationError as error:
            raise CalibrationError(f"control points in the {side} photo: {error}") from error
        K = frozen([[found.K[0, 0], 0.0, found.K[0, 2]], [0.0, found.K[1, 1], found.K[1, 2]], [0.0, 0.0, 1.0]])
        cameras.append(Intrinsics(K=K, distortion=frozen(np.zeros(5)), width_px=size[0], height_px=size[1]))
        poses.append(found.camera_from_world)
    shared = pack(cameras[0], cameras[1], poses[1] @ inverse(poses[0]))
    start = np.r_[vector_from_rotation(poses[0][:3, :3]), poses[0][:3, 3]]
    try:
        return _fitted(shared, start[None], view)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"calibration: the control points leave the rig undetermined ({error}); spread them over frame and depth"
        ) from error


def _fitted(shared: FloatArray, poses: FloatArray, view: BoardView) -> Adjustment:
    """Adjust cameras and pose with straight lenses; then, where there are points enough, with the lenses.

    The marks' own scatter, unknown before, weighs what lenses are like against them.
    """
    straight = adjust(shared, poses, [view], free=layout_of(shared).prior_weight() == 0.0)
    if not _fits_lens(view):
        return straight
    first = adjust(straight.shared, straight.poses, [view], sigma_px=_sigma_px(straight))
    return adjust(first.shared, first.poses, [view], sigma_px=_sigma_px(first))


def _fits_lens(view: BoardView) -> bool:
    return min(len(view.left_px), len(view.right_px)) >= FEWEST_FOR_LENS


def _sigma_px(adjusted: Adjustment) -> float:
    return max(float(adjusted.rms_px / np.sqrt(2.0)), CORNER_SIGMA_PX)


def _worst(
    control: ControlPoints, points: FloatArray, used: BoolArray, adjusted: Adjustment, left_out: list[Rejection]
) -> int | None:
    """Return the point that misses most, where it misses far more than the others; None where none does."""
    split = 2 * int(np.count_nonzero(used & np.isfinite(control.left_px[:, 0])))
    miss = np.zeros(len(points))
    for pixels, residual in ((control.left_px, adjusted.residuals[0][:split]),
                             (control.right_px, adjusted.residuals[0][split:])):  # fmt: skip
        seen = used & np.isfinite(pixels[:, 0])
        miss[seen] = np.maximum(miss[seen], np.linalg.norm(residual.reshape(-1, 2), axis=1))
    # The median length of a residual with sigma s in x and y is 1.18 s (Rayleigh).
    limit = max(_BLUNDER * float(np.median(miss[used])) / 1.1774, _BLUNDER_FLOOR_PX)
    worst = int(np.argmax(miss))
    if miss[worst] <= limit:
        return None
    left_out.append(
        rejected(
            Reason.CONTROL_POINT_MISFIT,
            about(SubjectKind.CONTROL_POINT, control.names[worst]),
            miss_px=float(miss[worst]),
            limit_px=limit,
        )
    )
    return worst


def _checks(view: BoardView, adjusted: Adjustment, rig: StereoRig) -> Checks:
    """Judge by points kept back, a known length, and the sigma of focal length and baseline."""
    size = rig.left.width_px, rig.left.height_px
    left, right = share_covered(view.left_px, size), share_covered(view.right_px, size)
    hold_out = _hold_out(view, adjusted)
    focal, baseline, relative = scale_sigmas(rig)
    length = length_error(adjusted.shared, view, size)
    warnings: list[Note] = []
    if not _fits_lens(view):
        warnings.append(warning(Reason.CONTROL_POINTS_FEW, {"fewest": FEWEST_FOR_LENS}))
    if (reach := min(_reach(view.left_px, size), _reach(view.right_px, size))) < _LOW_REACH:
        warnings.append(warning(Reason.CONTROL_POINTS_REACH, {"share": reach}))
    if hold_out > max(2.0 * adjusted.rms_px, 1.0):
        warnings.append(warning(Reason.CONTROL_POINTS_HOLD_OUT, {"hold_out_px": hold_out, "rms_px": adjusted.rms_px}))
    if relative > 0.005:
        warnings.append(warning(Reason.CALIBRATION_SCALE, {"share": relative}))
    return Checks(
        coverage_left=left, coverage_right=right, hold_out_rms_px=hold_out, length_error=length,
        focal_sigma_px=focal, baseline_sigma_m=baseline, lens_left_px=0.0, warnings=tuple(warnings),
    )  # fmt: skip


def _reach(pixels: FloatArray, size: tuple[int, int]) -> float:
    """Return the share of a photo of `size` that lies within the points' hull."""
    return float(cv2.contourArea(cv2.convexHull(pixels.astype(np.float32)))) / (size[0] * size[1])


def _hold_out(view: BoardView, adjusted: Adjustment) -> float:
    """Return the rms in pixels of points that a quarter at a time were kept from the adjustment."""
    misses: list[float] = []
    for fold in range(_FOLDS):
        keep = [np.arange(len(px)) % _FOLDS != fold for px in (view.left_px, view.right_px)]
        if min(int(one.sum()) for one in keep) < 6:
            continue
        part, rest = (
            BoardView(
                name=view.name,
                left_points_m=view.left_points_m[a],
                left_px=view.left_px[a],
                right_points_m=view.right_points_m[b],
                right_px=view.right_px[b],
            )
            for a, b in ((keep[0], keep[1]), (~keep[0], ~keep[1]))
        )
        fitted = _fitted(adjusted.shared, adjusted.poses, part)
        size = 1, 1  # a projection doesn't ask for the frame
        left, right = (camera_of(fitted.shared, side, size) for side in (0, 1))
        left_from_world = rigid(fitted.poses[0][:3], fitted.poses[0][3:])
        in_left, in_right = apply(left_from_world, rest.left_points_m), apply(left_from_world, rest.right_points_m)
        in_right = apply(right_from_left_of(fitted.shared), in_right)
        for camera, points, pixels in ((left, in_left, rest.left_px), (right, in_right, rest.right_px)):
            misses += np.sum((camera.project(points) - pixels) ** 2, axis=1).tolist()
    return float(np.sqrt(np.mean(misses))) if misses else adjusted.rms_px
