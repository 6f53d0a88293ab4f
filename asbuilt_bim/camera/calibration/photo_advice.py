"""Which photos of the board would take most off what a calibration does to areas."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M, PLACES, area_slopes
from asbuilt_bim.camera.calibration.board_sigma import BoardSigma, Knowledge, view_knowledge, view_shapes
from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.corner_errors import view_system
from asbuilt_bim.camera.calibration.parameters import BoardView, layout_of, view_residual
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid

_MOST = 3
_TILT_RAD = np.deg2rad(35.0)
_TILTS = ((0.0, 0.0), (_TILT_RAD, 0.0), (-_TILT_RAD, 0.0), (0.0, _TILT_RAD), (0.0, -_TILT_RAD))
_LEAST_SEEN = 0.5  # of a ChArUco board's corners; a chessboard is found whole or not at all
_WORTH_IT = 0.03  # of the sigma that is left: less isn't worth a walk


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotoAdvice:
    """One more photo pair: where in the left frame, how far, how tilted, and the worst place's sigma with it.

    `tilt_rad` is about the board's own x axis (above 0: its lower side further) and its y axis (above 0: its left side
    further). `worst` counts the photos before it in the list, too.
    """

    place: tuple[float, float]
    distance_m: float
    tilt_rad: tuple[float, float]
    worst: float


def photo_advice(
    shared: FloatArray, rig: StereoRig, board: Board | Tag, sigma: BoardSigma, distances_m: tuple[float, float],
    times: int = 1,
) -> tuple[PhotoAdvice, ...]:  # fmt: skip
    """Return up to three photo pairs that would help most, one after the other; none where none is worth it.

    The boards' corners are taken to err as those of the photos that are there. `times` is how many of each are asked
    for at once.
    """
    tried = [
        (pose, knowledge.times(times))
        for place in PLACES
        for distance_m in distances_m
        for tilt in _TILTS
        if (knowledge := _said(pose := (place, distance_m, tilt), shared, rig, board, sigma)) is not None
    ]
    slopes = area_slopes(rig, PLACES, DISTANCE_M)
    rows = layout_of(shared).rig_rows
    known = sigma.knowledge
    found: list[PhotoAdvice] = []
    left = _worst(known, slopes, rows)
    while tried and len(found) < _MOST:
        sigmas = [_worst(known.plus(more), slopes, rows) for _, more in tried]
        best = int(np.argmin(sigmas))
        if sigmas[best] > (1.0 - _WORTH_IT) * left:
            break
        (place, distance_m, tilt), more = tried.pop(best)
        known, left = known.plus(more), sigmas[best]
        found.append(PhotoAdvice(place=place, distance_m=distance_m, tilt_rad=tilt, worst=left))
    return tuple(found)


def _worst(known: Knowledge, slopes: FloatArray, rows: IntArray) -> float:
    covariance = known.covariances().sum(axis=0)[np.ix_(rows, rows)]
    return float(np.sqrt(np.nanmax(np.einsum("ni,ij,nj->n", slopes, covariance, slopes))))


def _said(
    at: tuple[tuple[float, float], float, tuple[float, float]],
    shared: FloatArray,
    rig: StereoRig,
    board: Board | Tag,
    sigma: BoardSigma,
) -> Knowledge | None:
    """Return what a pair of photos of the board there would say; None where the cameras wouldn't see it."""
    place, distance_m, (about_x, about_y) = at
    ray = rig.left.rays(np.array(place) * [rig.left.width_px, rig.left.height_px] - 0.5)
    if not np.all(np.isfinite(ray)):
        return None
    points = board.points_m
    turned = rigid(np.array([about_x, about_y, 0.0]), np.zeros(3))
    shift = distance_m * ray / np.linalg.norm(ray) - turned[:3, :3] @ points.mean(axis=0)
    in_left = apply(rigid(np.array([about_x, about_y, 0.0]), shift), points)
    seen = []
    for camera, at_camera in ((rig.left, in_left), (rig.right, apply(rig.right_from_left, in_left))):
        pixels = camera.project(at_camera)
        inside = _inside(camera, pixels) & (at_camera[:, 2] > 0.0)
        if inside.mean() < (_LEAST_SEEN if board.kind == "charuco" else 1.0):
            return None
        seen.append((frozen(points[inside]), frozen(pixels[inside])))
    (left_m, left_px), (right_m, right_px) = seen
    view = BoardView(name="", left_points_m=left_m, left_px=left_px, right_points_m=right_m, right_px=right_px)
    pose = np.r_[about_x, about_y, 0.0, shift]
    system = view_system(*view_residual(shared, pose, view), view)
    return view_knowledge(system, view_shapes(shared, pose, view, system, board), sigma.errors.typical, 0)


def _inside(camera: Intrinsics, pixels: FloatArray) -> BoolArray:
    size = np.array([camera.width_px, camera.height_px])
    inside: BoolArray = np.all((pixels > 0.0) & (pixels < size - 1.0), axis=1)
    return inside
