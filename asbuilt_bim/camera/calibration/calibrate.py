"""Calibration: pairs of photos of a board in, a stereo rig with its covariance out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust, rms_px
from asbuilt_bim.camera.calibration.board_sigma import board_sigma
from asbuilt_bim.camera.calibration.board_views import Progress, read_views, require_enough
from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.checks import Checks, check_calibration, corner_fits, refuse_impossible
from asbuilt_bim.camera.calibration.corner_errors import CornerErrors
from asbuilt_bim.camera.calibration.lens_check import CornerFit
from asbuilt_bim.camera.calibration.pairing import median_relative
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, pack, right_from_left_of
from asbuilt_bim.camera.calibration.photo_advice import PhotoAdvice, photo_advice
from asbuilt_bim.camera.calibration.zhang import (
    bad_view_limit_px,
    bad_views,
    first_estimate,
    misfit,
    pose_vectors,
)
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.photo.read import Photo, PhotoExif
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import rig_problems
from asbuilt_bim.errors import CalibrationError, Rejection
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_BAD_CORNER, _BAD_CORNER_FLOOR_PX = 5.0, 0.2  # in sigmas of all corners: of 3000 honest ones none lies there


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewFit:
    """How one pair of board photos fits the rig: reprojection error in both photos, corners used, how it stood."""

    name: str
    rms_left_px: float
    rms_right_px: float
    corners: int
    distance_m: float
    tilt_rad: float  # of the board against the left photo's plane


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A calibrated rig, the pairs it was made from, the ones left out, and what is known of its quality."""

    rig: StereoRig
    views: tuple[ViewFit, ...]
    left_out: tuple[Rejection, ...]
    checks: Checks
    corners_left: CornerFit
    corners_right: CornerFit
    from_control_points: bool = False  # in the place of boards: one view, whose corners are the points
    from_tags: bool = False  # in the place of boards: each sighting of a tag is a view
    by_source: FloatArray | None = None  # (4, P, P): the rig's covariance by `board_sigma.SOURCES`
    advice: tuple[PhotoAdvice, ...] = ()
    corner_errors: CornerErrors | None = None


def calibrate_stereo(
    pairs: Sequence[tuple[Photo, Photo]],
    board: Board,
    progress: Progress | None = None,
    lens: LensModel = "five",
) -> Calibration:
    """Calibrate a stereo rig from pairs (left, right) of photos of a board.

    Zhang's method gives each camera, the median pair the relative pose, and one adjustment of everything the result
    and its covariance. Pairs without a board in both photos, and pairs that don't fit the others, are left out by name.

    Raises: CalibrationError where fewer than six pairs are left, left and right are swapped, or the baseline can't be.
    Reference: Zhang 2000, A flexible new technique for camera calibration; Perez & Tah 2023, section 3.2.
    """
    views, size, left_out = read_views(pairs, board, progress)
    made = calibrate_views(views, size, board, lens, left_out)
    used = {view.name for view in made.views}
    left, right = next((a.exif, b.exif) for a, b in pairs if f"{a.name} + {b.name}" in used)
    return replace(made, rig=named(made.rig, left, right))


def calibrate_views(
    views: list[BoardView],
    size: tuple[int, int],
    board: Board,
    lens: LensModel = "five",
    already_out: Sequence[Rejection] = (),
) -> Calibration:
    """Calibrate from corners that were found in photos of `size` (width, height); the rig's cameras have no names.

    Raises: CalibrationError, as `calibrate_stereo`.
    """
    left_out = list(already_out)
    require_enough(views, left_out)
    views, left, right, poses = first_estimate(views, size, lens, left_out)
    shared = pack(left, right, median_relative(poses))
    refuse_impossible(right_from_left_of(shared), *_scale(board))
    try:
        adjusted = adjust(shared, pose_vectors(poses), views)
        views, adjusted = _without_bad(views, adjusted, left_out)
        sigma = board_sigma(adjusted, views, board)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"calibration: {len(views)} pairs of boards leave the rig undetermined ({error}); tilt the board every way"
        ) from error
    refuse_impossible(right_from_left_of(adjusted.shared), *_scale(board))
    rig = rig_of_adjustment(adjusted, size, sigma.covariance, len(views))
    if problems := rig_problems(rig):
        raise CalibrationError("calibration: the boards give no usable rig:\n  " + "\n  ".join(problems))
    fits = corner_fits(views, adjusted)
    shown = tuple(view_fit(view, pose, residual) for view, pose, residual in _each(views, adjusted))
    near, usual = np.quantile([view.distance_m for view in shown], [0.1, 0.5])
    return Calibration(
        rig=rig,
        views=shown,
        left_out=tuple(left_out),
        checks=check_calibration(views, adjusted, rig),
        corners_left=fits[0],
        corners_right=fits[1],
        by_source=sigma.by_source,
        corner_errors=sigma.errors,
        advice=photo_advice(adjusted.shared, rig, board, sigma, (float(near), float(usual))),
    )


def _scale(board: Board) -> tuple[str, str]:
    return f"squares of {board.square_m:g} m", "give board.square_m in metres, as measured on the print"


def _without_bad(
    views: list[BoardView], adjusted: Adjustment, left_out: list[Rejection]
) -> tuple[list[BoardView], Adjustment]:
    """Leave out the views that fit badly in the common adjustment, and adjust again, until none is left out."""
    while True:
        rms = np.array([rms_px(residual) for residual in adjusted.residuals])
        bad = bad_views(rms)
        if not bad.any():
            return _without_bad_corners(views, adjusted)
        limit = bad_view_limit_px(rms)
        for view, one, is_bad in zip(views, rms, bad, strict=True):
            if is_bad:
                left_out.append(misfit(view.name, float(one), float(limit)))
        views = [view for view, is_bad in zip(views, bad, strict=True) if not is_bad]
        require_enough(views, left_out)
        adjusted = adjust(adjusted.shared, adjusted.poses[~bad], views)


def _without_bad_corners(views: list[BoardView], adjusted: Adjustment) -> tuple[list[BoardView], Adjustment]:
    """Leave out single corners that lie far off, such as ones half hidden or in a reflection, and adjust once more."""
    norms = [np.linalg.norm(residual.reshape(-1, 2), axis=1) for residual in adjusted.residuals]
    # The median length of a residual with sigma s in x and y is 1.18 s (Rayleigh).
    limit = max(_BAD_CORNER * float(np.median(np.concatenate(norms))) / 1.1774, _BAD_CORNER_FLOOR_PX)
    if all(np.all(norm < limit) for norm in norms):
        return views, adjusted
    kept = [_with_corners(view, norm < limit) for view, norm in zip(views, norms, strict=True)]
    return kept, adjust(adjusted.shared, adjusted.poses, kept)


def _with_corners(view: BoardView, good: BoolArray) -> BoardView:
    left, right = good[: len(view.left_px)], good[len(view.left_px) :]
    return BoardView(
        name=view.name,
        left_points_m=frozen(view.left_points_m[left]),
        left_px=frozen(view.left_px[left]),
        right_points_m=frozen(view.right_points_m[right]),
        right_px=frozen(view.right_px[right]),
    )


def _each(views: list[BoardView], adjusted: Adjustment) -> list[tuple[BoardView, FloatArray, FloatArray]]:
    return list(zip(views, adjusted.poses, adjusted.residuals, strict=True))


def view_fit(view: BoardView, pose: FloatArray, residual: FloatArray) -> ViewFit:
    """Say how a view fits, from its board's pose (6,) in the left frame and its residual (R,), left first."""
    split = 2 * len(view.left_px)
    board = rigid(pose[:3], pose[3:])
    middle = board[:3, :3] @ view.left_points_m.mean(axis=0) + board[:3, 3]
    return ViewFit(
        name=view.name,
        rms_left_px=rms_px(residual[:split]),
        rms_right_px=rms_px(residual[split:]),
        corners=len(view.left_px),
        distance_m=float(np.linalg.norm(middle)),
        tilt_rad=float(np.arccos(np.clip(abs(board[2, 2]), 0.0, 1.0))),
    )


def rig_of_adjustment(adjusted: Adjustment, size: tuple[int, int], covariance: FloatArray, count: int) -> StereoRig:
    """Return the adjusted rig of photos of `size` with its covariance (P, P); its cameras have no names yet."""
    return StereoRig(
        left=camera_of(adjusted.shared, 0, size),
        right=camera_of(adjusted.shared, 1, size),
        right_from_left=right_from_left_of(adjusted.shared),
        covariance=covariance,
        rms_px=adjusted.rms_px,
        views_used=count,
    )


def named(rig: StereoRig, left: PhotoExif, right: PhotoExif) -> StereoRig:
    """Return a rig with its cameras' names, as the photos that it was made from tell them."""
    return replace(
        rig,
        camera_model=left.model,
        camera_serial=left.serial,
        focal_length_mm=left.focal_length_mm,
        camera_serial_right=right.serial,
        exif_orientation=left.orientation,
    )
