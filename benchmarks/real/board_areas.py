"""The area of a board in a pair of photos, by the plane and polygon code that measures walls."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import Board, find_board, same_way_round
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.camera.rectify import Rectification, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_numbers import seen_points
from asbuilt_bim.camera.triangulate import midpoints
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.disparity_plane import fit_q, plane_of
from asbuilt_bim.geometry.plane import frame_on_plane
from asbuilt_bim.geometry.polygon import contains, polygon, ring_area
from asbuilt_bim.geometry.transform import apply, rotation_from_vector
from asbuilt_bim.measure.planes.refine import pictures, refine_plane
from asbuilt_bim.measure.sigma.area import polygon_area
from asbuilt_bim.vision.stereo.matching import grey

CORNER_SIGMA_PX = 0.1
_DRAWS = 40


@lru_cache(maxsize=64)  # a board is looked for once, however often it is measured
def corners(pair: tuple[Photo, Photo], board: Board) -> tuple[FloatArray, FloatArray] | None:
    """Return the board's corners in both photos, numbered alike; None where it isn't found in both."""
    seen = [find_board(decode(photo), board) for photo in pair]
    if seen[0] is None or seen[1] is None:
        return None
    return seen[0].pixels, same_way_round(seen[0], seen[1], board).pixels


def size_error(pair: tuple[Photo, Photo], board: Board, rig: StereoRig) -> float | None:
    """Return the relative error of the board's area where its squares' size is fitted with its pose to both photos.

    All of a board's corners hold its slant by perspective too, where their disparities alone hold it badly.
    """
    pixels = corners(pair, board)
    if pixels is None:
        return None
    points = np.asarray(board.points_m, dtype=np.float64)
    _, turn, shift = cv2.solvePnP(points, pixels[0], rig.left.K, rig.left.distortion)

    def misses(at: FloatArray) -> FloatArray:
        placed = at[6] * points @ rotation_from_vector(at[:3]).T + at[3:6]
        left, right = rig.left.project(placed), rig.right.project(apply(rig.right_from_left, placed))
        return np.concatenate([(left - pixels[0]).ravel(), (right - pixels[1]).ravel()])

    at = np.concatenate([turn.ravel(), shift.ravel(), [1.0]])
    for _ in range(12):  # Gauss-Newton from a pose that one photo gave: it settles in five
        slope = np.stack([(misses(at + step) - misses(at - step)) / 2e-6 for step in 1e-6 * np.eye(7)], axis=1)
        at = at - np.linalg.lstsq(slope, misses(at), rcond=None)[0]
    return float(at[6] ** 2 - 1.0)


def errors_by(rig: StereoRig, pairs: Sequence[tuple[Photo, Photo]], board: Board) -> FloatArray:
    """Return the area errors (N, 2) of the boards that are found: plane from corners, plane from pixels."""
    prepared = rectification(rig)
    found = [area_errors(pair, board, rig, prepared) for pair in pairs]
    return np.array([one for one in found if one is not None]).reshape(-1, 2)


def area_errors(
    pair: tuple[Photo, Photo], board: Board, rig: StereoRig, prepared: Rectification
) -> tuple[float, float] | None:
    """Return the relative errors of the board's area: its plane from the corners, and from the pixels within.

    The outline is the ring of its outer inner-corners in the left photo, met with the plane, by Green's theorem. None
    where the board isn't found in both photos; NaN where the pixels don't hold the plane.
    """
    pixels = corners(pair, board)
    if pixels is None:
        return None
    images = [decode(photo) for photo in pair]
    left, right = (_rectified(rig, prepared, pixels[side], side) for side in (0, 1))
    rays = _rays(prepared, left)
    corner_q, _ = fit_q(rays, left[:, 0] - right[:, 0], np.full(len(left), CORNER_SIGMA_PX))
    ring = left[_border(board)]
    pixel_q = _pixel_plane(rectify(prepared, images[0], images[1], pair[0].name), prepared, ring, corner_q)
    true_m2 = (board.inner[0] - 1) * (board.inner[1] - 1) * board.square_m**2
    return _area(corner_q, ring, prepared) / true_m2 - 1.0, _area(pixel_q, ring, prepared) / true_m2 - 1.0


def area_sigma(pair: tuple[Photo, Photo], board: Board, made: Calibration) -> float | None:
    """Return the relative sigma of what `area_errors` measures from corners: by the rig, and by the corners themselves.

    The rig's share is that of the outline's rays; the corners' is drawn, which err as those of the rig's own boards.
    """
    rig = made.rig
    pixels = corners(pair, board)
    if pixels is None:
        return None
    prepared = rectification(rig)
    true_m2 = (board.inner[0] - 1) * (board.inner[1] - 1) * board.square_m**2
    rays = [camera.rays(seen[_border(board)]) for camera, seen in zip((rig.left, rig.right), pixels, strict=True)]
    seen = seen_points(rig, rays[0][:, :2], rays[1][:, :2])
    steps = np.sqrt(np.maximum(np.diag(rig.covariance), 1e-20))
    moved = [
        (polygon_area(midpoints(*seen.rays(change))) - polygon_area(midpoints(*seen.rays(-change)))) / (2.0 * step)
        for change, step in zip(np.diag(steps), steps, strict=True)
    ]
    by_rig = np.array(moved) / true_m2
    assert made.corner_errors is not None  # calibrated from boards
    points = board.points_m
    view = BoardView(name="", left_points_m=points, left_px=pixels[0], right_points_m=points, right_px=pixels[1])
    errors = made.corner_errors.typical.covariance(0, view)
    rng, drawn = np.random.default_rng(len(pixels[0])), []
    for error in rng.multivariate_normal(np.zeros(len(errors)), errors, _DRAWS):
        noisy = [one + off.reshape(-1, 2) for one, off in zip(pixels, np.split(error, 2), strict=True)]
        left, right = (_rectified(rig, prepared, noisy[side], side) for side in (0, 1))
        q, _ = fit_q(_rays(prepared, left), left[:, 0] - right[:, 0], np.full(len(left), CORNER_SIGMA_PX))
        drawn.append(_area(q, left[_border(board)], prepared) / true_m2)
    return float(np.hypot(np.sqrt(by_rig @ rig.covariance @ by_rig), np.std(drawn)))


def _pixel_plane(both: RectifiedPair, prepared: Rectification, ring: FloatArray, start: FloatArray) -> FloatArray:
    """Refine the plane on the pixels within the ring, as faces are; NaN where they don't hold it."""
    rows, columns = np.indices(both.valid_left.shape)
    every = np.stack([columns, rows], axis=-1).astype(np.float64)
    levels = pictures(grey(both.left), grey(both.right), both.valid_right)
    fit = refine_plane(levels, _rays(prepared, every), contains(polygon([ring]), every), start)
    return fit.q_px if fit is not None else np.full(3, np.nan)


def _border(board: Board) -> FloatArray:
    """Return the indices of the corners round the board's outline, in order."""
    across, down = board.inner
    grid = np.arange(across * down).reshape(down, across)
    return np.concatenate([grid[0], grid[1:, -1], grid[-1, -2::-1], grid[-2:0:-1, 0]])


def _rectified(rig: StereoRig, prepared: Rectification, pixels: FloatArray, side: int) -> FloatArray:
    """Carry pixels (N, 2) of an original photo to the rectified one."""
    camera = prepared.camera
    lens, turn = (rig.left, camera.rectified_from_left) if side == 0 else (rig.right, prepared.rectified_from_right)
    turned = lens.rays(pixels) @ turn.T
    return np.array(turned[:, :2] / turned[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px])


def _rays(prepared: Rectification, pixels: FloatArray) -> FloatArray:
    camera = prepared.camera
    rays = (pixels - [camera.cx_px, camera.cy_px]) / camera.f_px
    return np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1)


def _area(q_px: FloatArray, ring: FloatArray, prepared: Rectification) -> float:
    """Return the area that a ring of rectified pixels (N, 2) encloses on the plane of q (3,)."""
    if not np.all(np.isfinite(q_px)):
        return float("nan")
    plane = plane_of(q_px, prepared.camera.f_px * prepared.camera.baseline_m)
    points = plane.intersect(np.zeros(3), _rays(prepared, ring))
    return abs(ring_area(frame_on_plane(plane, points[0], [0.0, -1.0, 0.0]).to_uv(points)))
