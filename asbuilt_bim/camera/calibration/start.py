"""One camera from its photos of a board, by itself: Zhang's method, or where that fails the focal length that fits."""

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.adjust import adjust, rms_px
from asbuilt_bim.camera.calibration.parameters import BoardView, camera_of, layout_of, pack
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import COEFFICIENTS, LensModel
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid, vector_from_rotation

_POOR_PX = 2.0
"""A median view that misses by more was not understood: corners are good to tenths of a pixel."""
_FOCAL_TRIED = np.geomspace(0.25, 4.0, 15)  # of the frame's width: a fisheye's 120 degrees to a telephoto lens
_FEWEST_CORNERS = 6

Seen = list[tuple[FloatArray, FloatArray]]
"""Of each view: the corners (N, 3) in metres on the board, and their pixels (N, 2)."""
Start = tuple[Intrinsics, list[FloatArray], FloatArray]
"""A camera, camera_from_board (4, 4) of each view, and each view's rms (V,) in pixels."""


def start_camera(seen: Seen, size: tuple[int, int], lens: LensModel) -> Start:
    """Calibrate one camera.

    OpenCV's version of Zhang's method gives a start or, with wide lenses and flat views, nonsense. Then focal lengths
    are tried with an ideal lens, each board's pose by its homography. The best one is adjusted.

    Raises: CalibrationError where neither gives a camera.
    Reference: Zhang 2000, A flexible new technique for camera calibration.
    """
    found = None if lens == "fisheye" else _zhang(seen, size)
    if found is not None and np.median(found[2]) < _POOR_PX:
        return found if lens == "five" else _adjusted(found, seen, lens)
    tried = _adjusted(_tried(seen, size, lens), seen, lens)
    if found is not None and np.median(found[2]) <= np.median(tried[2]):
        tried = found if lens == "five" else _adjusted(found, seen, lens)
    if not np.all(np.isfinite(tried[0].K)) or not np.all(np.isfinite(tried[2])):
        raise CalibrationError("calibration: the boards don't give a camera; tilt the board in different directions")
    return tried


def _zhang(seen: Seen, size: tuple[int, int]) -> Start | None:
    """Calibrate with a five-parameter lens by OpenCV; None where it gives no camera."""
    points = [p.astype(np.float32).reshape(-1, 1, 3) for p, _ in seen]
    pixels = [p.astype(np.float32).reshape(-1, 1, 2) for _, p in seen]
    try:
        _, K, distortion, turns, shifts = cv2.calibrateCamera(points, pixels, size, None, None)
    except cv2.error:
        return None
    if not np.all(np.isfinite(K)):
        return None
    camera = Intrinsics(K=frozen(K), distortion=frozen(np.ravel(distortion)[:5]), width_px=size[0], height_px=size[1])
    poses = [rigid(np.ravel(turn), np.ravel(shift)) for turn, shift in zip(turns, shifts, strict=True)]
    return camera, poses, _misses(camera, poses, seen)


def _misses(camera: Intrinsics, poses: list[FloatArray], seen: Seen) -> FloatArray:
    return np.array(
        [rms_px((camera.project(apply(pose, p)) - px).ravel()) for (p, px), pose in zip(seen, poses, strict=True)]
    )


def _tried(seen: Seen, size: tuple[int, int], lens: LensModel) -> Start:
    """Return the ideal lens, at the middle of the frame, whose focal length fits the boards best."""
    best: Start | None = None
    for share in _FOCAL_TRIED:
        f = float(share) * size[0]
        K = frozen([[f, 0.0, 0.5 * (size[0] - 1)], [0.0, f, 0.5 * (size[1] - 1)], [0.0, 0.0, 1.0]])
        camera = Intrinsics(K=K, distortion=frozen(np.zeros(COEFFICIENTS[lens])), width_px=size[0], height_px=size[1])
        poses = [_board_pose(camera, points, pixels) for points, pixels in seen]
        if any(pose is None for pose in poses):
            continue
        whole = [pose for pose in poses if pose is not None]
        found = camera, whole, _misses(camera, whole, seen)
        if best is None or np.median(found[2]) < np.median(best[2]):
            best = found
    if best is None:
        raise CalibrationError("calibration: the boards don't give a camera; show the board larger and tilt it more")
    return best


def _board_pose(camera: Intrinsics, points: FloatArray, pixels: FloatArray) -> FloatArray | None:
    """Return camera_from_board (4, 4) by the homography of the corners that the camera can see."""
    rays = camera.rays(pixels)
    seen = np.all(np.isfinite(rays), axis=1)
    if np.count_nonzero(seen) < _FEWEST_CORNERS:
        return None
    try:
        found, turn, shift = cv2.solvePnP(
            points[seen].copy(), rays[seen, :2].copy(), np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return None
    return rigid(np.ravel(turn), np.ravel(shift)) if found else None


def _adjusted(start: Start, seen: Seen, lens: LensModel) -> Start:
    """Adjust a camera with the lens model asked for, and its boards' poses."""
    camera, poses, _ = start
    coefficients = np.zeros(COEFFICIENTS[lens])
    known = min(len(coefficients), len(camera.distortion))
    coefficients[:known] = camera.distortion[:known]
    size = camera.width_px, camera.height_px
    begun = Intrinsics(K=camera.K, distortion=frozen(coefficients), width_px=size[0], height_px=size[1])
    shared = pack(begun, begun, np.eye(4))
    vectors = np.stack([np.r_[vector_from_rotation(pose[:3, :3]), pose[:3, 3]] for pose in poses])
    none, nowhere = np.zeros((0, 3)), np.zeros((0, 2))
    views = [
        BoardView(name="", left_points_m=points, left_px=pixels, right_points_m=none, right_px=nowhere)
        for points, pixels in seen
    ]
    try:
        done = adjust(shared, vectors, views, free=layout_of(shared).of_side(0))
    except np.linalg.LinAlgError as error:
        raise CalibrationError(
            f"calibration: the boards don't give a camera ({error}); tilt the board in different directions"
        ) from error
    residuals = np.array([rms_px(residual) for residual in done.residuals])
    return camera_of(done.shared, 0, size), [rigid(pose[:3], pose[3:]) for pose in done.poses], residuals
