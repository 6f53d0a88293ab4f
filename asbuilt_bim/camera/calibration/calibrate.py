"""Calibration: pairs of photos of a board in, a stereo rig with its covariance out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust, rms_px
from asbuilt_bim.camera.calibration.board_views import Progress, read_views, require_enough
from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.checks import Checks, check_calibration, corner_fits, refuse_impossible
from asbuilt_bim.camera.calibration.lens_check import CornerFit
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, layout_of, pack, right_from_left_of
from asbuilt_bim.camera.calibration.zhang import (
    bad_view_limit_px,
    bad_views,
    first_estimate,
    median_relative,
    misfit,
    pose_vectors,
)
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import LensModel, bend, straighten
from asbuilt_bim.camera.photo.read import Photo, PhotoExif
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import rig_problems
from asbuilt_bim.errors import CalibrationError, Rejection
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid

_BAD_CORNER, _BAD_CORNER_FLOOR_PX = 5.0, 0.2  # in sigmas of all corners: of 3000 honest ones none lies there
_GRID = (13, 11)
_INNER = 0.6  # of the frame: where faces that are seen whole lie; the rim is the lens's, and boards seldom pin it down
_STEP = 1e-5


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
    require_enough(views, left_out)
    views, left, right, poses = first_estimate(views, size, lens, left_out)
    shared = pack(left, right, median_relative(poses))
    refuse_impossible(right_from_left_of(shared), *_scale(board))
    try:
        adjusted = adjust(shared, pose_vectors(poses), views)
        views, adjusted = _without_bad(views, adjusted, left_out)
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"calibration: {len(views)} pairs of boards leave the rig undetermined ({error}); tilt the board every way"
        ) from error
    right_from_left = right_from_left_of(adjusted.shared)
    refuse_impossible(right_from_left, *_scale(board))
    used = {view.name for view in views}
    exif_left, exif_right = next((a.exif, b.exif) for a, b in pairs if f"{a.name} + {b.name}" in used)
    rig = _rig(adjusted, size, right_from_left, len(views), exif_left, exif_right)
    if problems := rig_problems(rig):
        raise CalibrationError("calibration: the boards give no usable rig:\n  " + "\n  ".join(problems))
    fits = corner_fits(views, adjusted)
    return Calibration(
        rig=rig,
        views=tuple(view_fit(view, pose, residual) for view, pose, residual in _each(views, adjusted)),
        left_out=tuple(left_out),
        checks=check_calibration(views, adjusted, size),
        corners_left=fits[0],
        corners_right=fits[1],
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


def _rig(
    adjusted: Adjustment,
    size: tuple[int, int],
    right_from_left: FloatArray,
    count: int,
    left: PhotoExif,
    right: PhotoExif,
) -> StereoRig:
    return StereoRig(
        left=camera_of(adjusted.shared, 0, size),
        right=camera_of(adjusted.shared, 1, size),
        right_from_left=right_from_left,
        covariance=pinhole_covariance(adjusted, size),
        rms_px=adjusted.rms_px,
        views_used=count,
        camera_model=left.model,
        camera_serial=left.serial,
        focal_length_mm=left.focal_length_mm,
        camera_serial_right=right.serial,
        exif_orientation=left.orientation,
    )


def pinhole_covariance(adjusted: Adjustment, size: tuple[int, int]) -> FloatArray:
    """Return the covariance (14, 14) of `rig.PARAMETERS`, each lens coefficient as what it does to the picture.

    What a coefficient moves in a frame of `size` (width, height) px is written as a change of focal lengths and
    principal point: the one that moves it most alike. The rest bends within a face and is small.
    """
    layout = layout_of(adjusted.shared)
    carried = np.zeros((len(layout.rig_rows), layout.shared))
    carried[np.arange(len(layout.rig_rows)), layout.rig_rows] = 1.0
    for side in (0, 1):
        own = np.flatnonzero(layout.of_side(side))
        carried[4 * side : 4 * side + 4, own[4:]] = _as_pinhole(camera_of(adjusted.shared, side, size))
    return frozen(carried @ adjusted.covariance @ carried.T)


def _as_pinhole(camera: Intrinsics) -> FloatArray:
    """Return the change (4, C) of fx, fy, cx, cy that comes nearest to a unit change of each coefficient."""
    across, down = (0.5 + 0.5 * _INNER * np.linspace(-1.0, 1.0, count) for count in _GRID)
    pixels = np.stack(np.meshgrid(across * camera.width_px, down * camera.height_px), axis=-1).reshape(-1, 2)
    focal, centre = camera.K[[0, 1], [0, 1]], camera.K[:2, 2]
    rays = straighten(camera.distortion, (pixels - centre) / focal)
    rays = rays[np.isfinite(rays).all(axis=1)]
    bent = bend(camera.distortion, rays)
    zero, one = np.zeros(len(rays)), np.ones(len(rays))
    pinhole = np.stack([np.r_[bent[:, 0], zero], np.r_[zero, bent[:, 1]], np.r_[one, zero], np.r_[zero, one]], axis=1)
    lens = []
    for step in _STEP * np.eye(len(camera.distortion)):
        moved = (bend(camera.distortion + step, rays) - bent) / _STEP * focal
        lens.append(np.r_[moved[:, 0], moved[:, 1]])
    return np.asarray(np.linalg.lstsq(pinhole, np.stack(lens, axis=1), rcond=None)[0], dtype=np.float64)
