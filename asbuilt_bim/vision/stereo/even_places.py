"""Even places of a photo: without an edge in them no depth can jump there, so what says so was matched wrongly."""

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.photo.quality import WHITE
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, IntArray

Indices = NDArray[np.intp]

WINDOW_PX = 9
MOST_TEXTURE_GREY = 3.0
"""Standard deviation in a window: sensor noise and a gradient; concrete has pores."""
LIGHT, LIGHT_EVERY = 0.98, 16
"""Quantile of grey levels that tells how bright a photo is, over every so many of its pixels."""


def window_texture(picture: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return the mean and the standard deviation (H, W) of a grey picture (H, W) in a window about each pixel."""
    mean = cv2.blur(picture, (WINDOW_PX, WINDOW_PX))
    square = cv2.blur(picture * picture, (WINDOW_PX, WINDOW_PX))
    return np.asarray(mean, np.float32), np.sqrt(np.maximum(square - mean * mean, np.float32(0.0)))


def jumps_without_edge(
    picture: Float32Array, disparity_px: Float32Array, measured: BoolArray, jump_px: float
) -> BoolArray:
    """Say which measured pixels (H, W) stand off the rest of their even place by more than a jump, in disparity.

    Where one thing hides another the photo has an edge, unless both look quite alike. On a wall of bare paint matching
    carries what it found past the wall's end into the wall. Each even place has one plane, that of the largest piece
    in it whose disparities hang together; a piece that is off it hangs on nothing. In weaker light edges are weaker,
    too.
    """
    light = float(np.quantile(picture[measured][::LIGHT_EVERY], LIGHT)) if measured.any() else 0.0
    even = window_texture(picture)[1] < MOST_TEXTURE_GREY * light / WHITE
    places = cv2.connectedComponents(even.astype(np.uint8), connectivity=4)[1]
    hanging = even & measured & ~_at_jumps(disparity_px, measured, jump_px)
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(hanging.astype(np.uint8), connectivity=4)
    size = stats[:, cv2.CC_STAT_AREA].copy()
    size[0] = 0  # what hangs together with nothing
    place_of = np.zeros(count, dtype=np.intp)
    place_of[pieces.ravel()] = places.ravel()
    ascending = np.argsort(size, kind="stable")
    largest = np.zeros(int(places.max()) + 1, dtype=np.intp)
    largest[place_of[ascending]] = ascending  # the last of each place stays
    rows, columns = np.nonzero(even & measured)
    own = largest[places[rows, columns]]
    ask = (size[own] >= WINDOW_PX**2) & (pieces[rows, columns] != own)
    rows, columns, own = rows[ask], columns[ask], own[ask]
    asked, which = np.unique(own, return_inverse=True)
    planes = _planes(np.asarray(pieces, dtype=np.int32), asked, disparity_px)
    expected = np.einsum("nk,nk->n", planes[which], _terms(rows, columns, pieces.shape))
    off = np.zeros(pieces.shape, dtype=bool)
    off[rows, columns] = np.abs(disparity_px[rows, columns] - expected) > jump_px
    return off


def _at_jumps(disparity_px: Float32Array, measured: BoolArray, jump_px: float) -> BoolArray:
    """Say after which pixels (H, W), to the right or below, disparity jumps or isn't known."""
    known = np.where(measured, disparity_px, np.float32(np.nan))
    cut = np.zeros(known.shape, dtype=bool)
    cut[:, :-1] |= ~(np.abs(np.diff(known, axis=1)) < jump_px)
    cut[:-1] |= ~(np.abs(np.diff(known, axis=0)) < jump_px)
    return cut


def _planes(pieces: IntArray, asked: Indices, disparity_px: Float32Array) -> FloatArray:
    """Return the planes of disparity (K, 3) of the pieces (H, W) whose numbers (K,) are asked, by least squares."""
    wanted = np.zeros(int(pieces.max()) + 1, dtype=bool)
    wanted[asked] = True
    rows, columns = np.nonzero(wanted[pieces])
    number, terms = np.searchsorted(asked, pieces[rows, columns]), _terms(rows, columns, pieces.shape)
    values = disparity_px[rows, columns].astype(np.float64)

    def summed(weights: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(number, weights=weights, minlength=len(asked)), dtype=np.float64)

    square = np.stack([summed(terms[:, i] * terms[:, j]) for i in range(3) for j in range(3)], axis=-1)
    right = np.stack([summed(terms[:, i] * values) for i in range(3)], axis=-1)
    inverse = np.linalg.pinv(square.reshape(-1, 3, 3), hermitian=True)
    return np.asarray(np.einsum("nij,nj->ni", inverse, right), dtype=np.float64)


def _terms(rows: Indices, columns: Indices, shape: tuple[int, ...]) -> FloatArray:
    """Return (N, 3) column, row and 1, the former as shares of the photo from its middle."""
    height, width = shape
    return np.column_stack([columns / width - 0.5, rows / height - 0.5, np.ones(len(rows))])
