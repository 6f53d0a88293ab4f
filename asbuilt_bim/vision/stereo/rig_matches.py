"""Matches all over both photos of a station, to a tenth of a pixel: what the rig's health is judged on."""

from dataclasses import replace

import cv2
import numpy as np

from asbuilt_bim.camera.photo.overlap import PairMatches
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray
from asbuilt_bim.geometry.transform import rotation_from_vector

WINDOW_PX = 15
SPACING_PX = 10.0
MATCHES_PER_MEASUREMENT = (WINDOW_PX / SPACING_PX) ** 2 / 1.5
"""Windows overlap: neighbours see some of the same noise; two thirds of a window's weight lie in its middle third."""
_MOST_CORNERS = 4000
_CELLS = (12, 9)
_PER_CELL = 16
_QUALITY = 0.002
_THERE_AND_BACK_PX = 0.3
_NEAREST = 3
_LEVELS = 2  # of the pyramid: reaches 20 px about where the neighbours lie


def spread_matches(pair: RectifiedPair, coarse: PairMatches) -> PairMatches:
    """Follow corners spread over the whole left photo into the right one, starting from coarse matches nearby.

    A corner is kept where following it back ends where it began. Rows are free: the rig may have been turned.
    """
    none = np.zeros((0, 2))
    if len(coarse.left_px) < _NEAREST:
        return PairMatches(left_px=none, right_px=none)
    left, right = _grey(pair.left), _grey(pair.right)
    start = _corners(left, pair.valid_left)
    if not len(start):
        return PairMatches(left_px=none, right_px=none)
    guess = start + _shifts(start, coarse)
    there, seen = _follow(left, right, start, guess)
    back, seen_back = _follow(right, left, there, start)
    closed = np.linalg.norm(back - start, axis=1) < _THERE_AND_BACK_PX
    good = seen & seen_back & closed & _inside(there, pair.valid_right)
    return PairMatches(left_px=start[good].astype(np.float64), right_px=there[good].astype(np.float64))


def levelled_matches(pair: RectifiedPair, coarse: PairMatches, correction_rad: FloatArray) -> PairMatches:
    """Return `spread_matches` of a pair whose right photo is first turned back by a known correction (5,).

    Following a window to a fraction of a pixel errs by some hundredths that depend on the fraction; where rows agree it
    doesn't err across them. The matches are given in the pixels of the pair as it is.
    """
    turn = rotation_from_vector(correction_rad[:3])
    if not np.any(correction_rad):
        return spread_matches(pair, coarse)
    camera = pair.camera
    now_from_level = camera.K @ turn @ np.linalg.inv(camera.K)
    level_from_now = np.asarray(np.linalg.inv(now_from_level), dtype=np.float64)
    size, flags = (camera.width_px, camera.height_px), cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    right = np.asarray(cv2.warpPerspective(pair.right, now_from_level, size, flags=flags), dtype=np.uint8)
    valid = cv2.warpPerspective(
        pair.valid_right.astype(np.uint8), now_from_level, size, flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    )
    level = replace(pair, right=right, valid_right=np.asarray(valid) > 0)
    found = spread_matches(level, replace(coarse, right_px=_carried(coarse.right_px, level_from_now)))
    return replace(found, right_px=_carried(found.right_px, now_from_level))


def _carried(pixels: FloatArray, homography: FloatArray) -> FloatArray:
    rays = np.c_[pixels, np.ones(len(pixels))] @ homography.T
    carried: FloatArray = rays[:, :2] / rays[:, 2:]
    return carried


def _grey(image: ByteImage) -> ByteImage:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _corners(grey: ByteImage, valid: BoolArray) -> np.ndarray:
    """Return corners (N, 2) float32, the best of each cell of the frame, refined to where they are sharpest."""
    mask = cv2.erode(valid.astype(np.uint8), np.ones((WINDOW_PX + 2, WINDOW_PX + 2), dtype=np.uint8))
    found = cv2.goodFeaturesToTrack(grey, _MOST_CORNERS, _QUALITY, SPACING_PX, mask=mask, blockSize=7)
    if found is None:
        return np.zeros((0, 2), dtype=np.float32)
    corners = np.asarray(found, dtype=np.float32).reshape(-1, 2)  # the strongest first
    height, width = grey.shape
    cell = (corners[:, 0] * _CELLS[0] / width).astype(int) + _CELLS[0] * (corners[:, 1] * _CELLS[1] / height).astype(
        int
    )
    kept = [np.flatnonzero(cell == number)[:_PER_CELL] for number in range(_CELLS[0] * _CELLS[1])]
    return corners[np.concatenate(kept)]


def _shifts(start: np.ndarray, coarse: PairMatches) -> np.ndarray:
    """Return where the coarse matches nearest to each corner went (N, 2): their median."""
    apart = np.linalg.norm(start[:, None] - coarse.left_px[None], axis=-1)
    nearest = np.argpartition(apart, _NEAREST - 1, axis=1)[:, :_NEAREST]
    moved = coarse.right_px - coarse.left_px
    shifts: FloatArray = np.median(moved[nearest], axis=1)
    return shifts.astype(np.float32)


def _follow(one: ByteImage, other: ByteImage, start: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, BoolArray]:
    ended, status, _ = cv2.calcOpticalFlowPyrLK(
        one, other, start[:, None].astype(np.float32), guess[:, None].astype(np.float32),
        winSize=(WINDOW_PX, WINDOW_PX), maxLevel=_LEVELS,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.003), flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )  # fmt: skip
    return np.asarray(ended, dtype=np.float32).reshape(-1, 2), np.asarray(status).ravel() == 1


def _inside(places: np.ndarray, valid: BoolArray) -> BoolArray:
    column, row = np.rint(places).astype(int).T
    height, width = valid.shape
    within = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    inside: BoolArray = within & valid[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    return inside
