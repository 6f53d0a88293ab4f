"""Were the photos of a pair exchanged, or both turned upside down? Taken the other way, they would fit the rig."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.overlap import BEHIND_LIMIT, ROW_LIMIT_PX, UPRIGHT, PairMatches, nearer_below
from asbuilt_bim.camera.rectify import RectifiedCamera, turns
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray

_FEWEST = 25
_BETTER = 3.0
"""Taken the other way, the rows must correspond this many times better: two cameras that are alike fit either way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Way:
    """What may have happened to a pair, and the code for it."""

    exchanged: bool
    turned: bool  # both, by 180 degrees
    code: Reason


_WAYS = (
    _Way(exchanged=True, turned=False, code=Reason.PHOTOS_SWAPPED),
    _Way(exchanged=False, turned=True, code=Reason.PHOTOS_UPSIDE_DOWN),
    _Way(exchanged=True, turned=True, code=Reason.PHOTOS_UPSIDE_DOWN_SWAPPED),
)


def swapped_rejection(station: str, matches: PairMatches, rig: StereoRig, camera: RectifiedCamera) -> Rejection | None:
    """Return the rejection of a pair whose photos are exchanged, upside down, or both; None where they aren't.

    Each photo is given the lens and place that it would have then. Rows that correspond, with the scene before the
    rig, can't be chance; a camera that was turned doesn't give them. `rig` is that of the `matches`' size.
    """
    if len(matches.left_px) < _FEWEST:
        return None
    as_given = float(np.median(np.abs(matches.rows_px)))
    rows = [_rows(way, matches, rig, camera) for way in _WAYS]
    best = int(np.argmin(rows))
    if rows[best] > ROW_LIMIT_PX or as_given < _BETTER * rows[best]:
        return None
    return rejected(
        _WAYS[best].code,
        about(SubjectKind.STATION, station),
        rows_px=as_given,
        undone_rows_px=rows[best],
        limit_px=ROW_LIMIT_PX,
    )


def _rows(way: _Way, matches: PairMatches, rig: StereoRig, camera: RectifiedCamera) -> float:
    """Return how far apart the rows lie (px) once a mistake is undone; infinite where the scene lies behind the rig.

    Both mistakes at once leave the scene before the rig, and shift the rows as a knock may. Only an upside-down scene,
    its lower things further away, shows the difference.
    """
    if way.exchanged and way.turned and nearer_below(matches) > -UPRIGHT:
        return float(np.inf)
    left_turn, right_turn = turns(rig)
    sides = (matches.left_px, rig.left, left_turn), (matches.right_px, rig.right, right_turn)
    first, second = reversed(sides) if way.exchanged else sides
    left = _through(*first, rig.left, left_turn, camera, turned=way.turned)
    right = _through(*second, rig.right, right_turn, camera, turned=way.turned)
    known = np.all(np.isfinite(left) & np.isfinite(right), axis=1)
    if np.count_nonzero(known) < _FEWEST or np.mean(left[known, 0] - right[known, 0] < -1.0) > BEHIND_LIMIT:
        return float(np.inf)
    return float(np.median(np.abs(left[known, 1] - right[known, 1])))


def _through(
    pixels: FloatArray, taken: Intrinsics, turn: FloatArray, given: Intrinsics, given_turn: FloatArray,
    camera: RectifiedCamera, *, turned: bool,
) -> FloatArray:  # fmt: skip
    """Carry pixels (N, 2), rectified with the camera `taken`, to where they are rectified with the camera `given`.

    `turned`: the photo is turned by 180 degrees in between.
    """
    photo = taken.project(camera.rectified_rays(pixels) @ turn)
    if turned:
        photo = np.array([taken.width_px - 1.0, taken.height_px - 1.0]) - photo
    away = given.rays(photo) @ given_turn.T
    carried: FloatArray = away[:, :2] / away[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    return carried
