"""A first estimate of the rig: each camera by itself, the relative pose as the median of all views."""

import numpy as np

from asbuilt_bim.camera.calibration.board_views import require_enough
from asbuilt_bim.camera.calibration.pairing import Poses, moved, refuse_mixed, why_moved
from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.camera.calibration.start import start_camera
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import vector_from_rotation

_BAD_VIEW = 3.0  # times the median view: corners of one detector don't vary by more
_BAD_VIEW_FLOOR_PX = 0.5  # however good the others are, half a pixel is no misfit to throw a view away for


def first_estimate(
    views: list[BoardView], size: tuple[int, int], lens: LensModel, left_out: list[Rejection]
) -> tuple[list[BoardView], Intrinsics, Intrinsics, Poses]:
    """Calibrate each camera by itself and leave out the pairs that don't fit, until none is left out.

    Returns the views kept, the cameras, and the boards' poses; what is left out is added to `left_out`.

    Raises: CalibrationError where too few pairs remain, they give no camera, or most don't belong together.
    """
    while True:
        left, left_poses, left_rms = start_camera([(v.left_points_m, v.left_px) for v in views], size, lens)
        right, right_poses, right_rms = start_camera([(v.right_points_m, v.right_px) for v in views], size, lens)
        poses = list(zip(left_poses, right_poses, strict=True))
        rms = np.maximum(left_rms, right_rms)
        bad = bad_views(rms)
        limit_px = bad_view_limit_px(rms)
        left_out += [
            misfit(view.name, float(one), limit_px) for view, one, is_bad in zip(views, rms, bad, strict=True) if is_bad
        ]
        if not bad.any():
            refuse_mixed(views, poses)
            bad = moved(poses)
            left_out += why_moved(views, poses, bad)
        if not bad.any():
            return views, left, right, poses
        views = [v for v, is_bad in zip(views, bad, strict=True) if not is_bad]
        require_enough(views, left_out)


def misfit(name: str, rms_px: float, limit_px: float) -> Rejection:
    """Return that a pair's corners don't fit the other pairs."""
    return rejected(Reason.BOARD_PAIR_MISFIT, about(SubjectKind.BOARD_PAIR, name), rms_px=rms_px, limit_px=limit_px)


def bad_view_limit_px(rms: FloatArray) -> float:
    """Return the rms in pixels above which a view doesn't fit, from the rms (V,) of all."""
    return max(_BAD_VIEW * float(np.median(rms)), _BAD_VIEW_FLOOR_PX)


def bad_views(rms: FloatArray) -> BoolArray:
    """Say which views (V,) fit far worse than the median one."""
    bad: BoolArray = rms > bad_view_limit_px(rms)
    return bad


def pose_vectors(poses: Poses) -> FloatArray:
    """Write left_from_board of each view as rotation vector and translation (V, 6)."""
    return np.stack([np.r_[vector_from_rotation(left[:3, :3]), left[:3, 3]] for left, _ in poses])
