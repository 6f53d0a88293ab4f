"""Round or flat? Both photos decide: which surface makes the right one look like the left one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import LevelledMap
from asbuilt_bim.geometry.polyline import fit_line
from asbuilt_bim.vision.stereo.matching import grey
from asbuilt_bim.vision.stereo.warp import sample

MOST_PIXELS = 12_000
CORE_SHARE = 0.8
"""The outer tenth on each side is where the matcher bends every surface round."""
LEAST_SURE = 3.0
"""A round surface must leave less difference by 3 sigma: a matcher's bend is no evidence, pictures are."""
BAND_PX = 8


def flat_if_flatter(piece: Piece, level: LevelledMap, pair: RectifiedPair) -> Piece:
    """Return the piece, or a flat one in its place where the photos agree as well on a plane."""
    if piece.circle is None:
        return piece
    middle, half = 0.5 * (piece.x0_px + piece.x1_px), 0.5 * CORE_SHARE * (piece.x1_px - piece.x0_px)
    with np.errstate(invalid="ignore"):
        near = np.abs(level.d_px - piece.at(level.x_px)) < 1.0
    rows, columns = np.nonzero((np.abs(level.x_px - middle) < half) & near)
    step = max(1, rows.size // MOST_PIXELS)
    rows, columns = rows[::step], columns[::step]
    if rows.size < 100:
        return piece
    x, d = level.x_px[rows, columns], level.d_px[rows, columns]
    slope, offset, rms = fit_line(x, d, 0.1)
    flat = replace(piece, circle=None, slope=slope, offset_px=offset, rms_px=rms)
    left, right = grey(pair.left), grey(pair.right)
    seen = left[rows, columns].astype(np.float64)
    forward = level.forward[rows, columns]
    misses = []
    for surface in (piece, flat):
        # each surface may shift a little in depth: its best of a few is compared
        tries = [
            _miss(seen, right, rows, columns, (surface.at(x) + shift) * forward) for shift in (-0.2, -0.1, 0, 0.1, 0.2)
        ]
        misses.append(min(tries, key=lambda miss: float(miss.sum())))
    return piece if _sureness(misses[1] - misses[0], rows) > LEAST_SURE else flat


def _sureness(gain: FloatArray, rows: np.ndarray) -> float:
    """Return how many of its own sigmas a gain per pixel is above zero; bands of rows are independent of each other."""
    bands = np.bincount((rows - rows.min()) // BAND_PX, weights=gain)
    return float(bands.sum() / max(np.sqrt(np.sum((bands - bands.mean()) ** 2)), 1e-9))


def _miss(
    seen: FloatArray, right: np.ndarray, rows: np.ndarray, columns: np.ndarray, disparity: FloatArray
) -> FloatArray:
    """Return the squared difference of grey levels (N,) along a disparity, none above the worst tenth's limit."""
    width = 2048
    pad = (-len(seen)) % width
    at = np.pad((columns - disparity).astype(np.float32), (0, pad)).reshape(-1, width)
    there = sample(right, at, np.pad(rows.astype(np.float32), (0, pad)).reshape(-1, width)).ravel()[: len(seen)]
    apart = np.square(seen - there - np.median(seen - there))
    limited: FloatArray = np.minimum(apart, np.quantile(apart, 0.9))
    return limited
