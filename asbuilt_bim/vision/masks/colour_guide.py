"""Masks drawn to a photo's edges in all its colours: a blunt border finds the edge that grey alone doesn't show.

A guided filter makes how deep a pixel lies in a mask a linear function of its colour, window by window. What that needs
of the photo is computed once, for all its masks. Coefficients are smooth, so they are found on a map of half the size
and used on the photo itself.

Reference: He, Sun & Tang 2013, Guided image filtering, equations 19 to 21; He & Sun 2015, Fast guided filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array
from asbuilt_bim.vision.masks.refinement import EVEN, inside_px

LOOKED_AT_PX = 700.0
"""Most width that masks are drawn at: a network's map has 192 to 256 cells there."""
THINNED = 2
"""Coefficients are found at every so many pixels."""
FINEST_PX = 3.0
"""What a border may be off in the last round: it can't be seen much better."""
FALL = 0.5
"""What a border may be off in a round, of what it might in the round before."""
WINDOW = 0.7
"""A window's reach, as a share of what the border may be off."""
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Round:
    """One round: how far the border may be off, the window's reach in thinned pixels, the colours' statistics in it."""

    band_px: float
    reach: int
    mean: Float32Array  # (3, h, w)
    inverse: Float32Array  # (6, h, w): of the covariance matrix, by `_PAIRS`


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ColourGuide:
    """A BGR photo, looked at up to `LOOKED_AT_PX` wide, as what masks are drawn to."""

    colours: Float32Array  # (3, h, w), 0..1; h and w multiples of `THINNED`; each colour by itself: that is faster
    shrunk: tuple[float, float]  # (x, y): the looked-at pixels of one of the photo's; 1, 1 where it is only padded
    thinned: Float32Array  # (3, h / 2, w / 2)
    rounds: tuple[_Round, ...]

    @classmethod
    def of(cls, photo: ByteImage, off_share: float) -> ColourGuide:
        """Prepare a BGR photo for masks whose border is off by up to `off_share` of its width."""
        height, width = photo.shape[:2]
        scale = min(1.0, LOOKED_AT_PX / width)
        if scale < 1.0:
            size = (max(1, round(scale * s / THINNED)) * THINNED for s in (width, height))
            way = cv2.INTER_LINEAR if scale > 0.5 else cv2.INTER_AREA  # means over fractions of pixels cost the most
            small = np.asarray(cv2.resize(photo, tuple(size), interpolation=way))
            shrunk = (small.shape[1] / width, small.shape[0] / height)
        else:
            small, shrunk = _padded(photo), (1.0, 1.0)
        colours = np.stack(cv2.split(small)).astype(np.float32) * np.float32(1.0 / 255.0)
        thinned = np.stack([_thinned(one) for one in colours])
        band = max(off_share * colours.shape[2], FINEST_PX)
        rounds = [_round(thinned, band)]
        while band > FINEST_PX:
            band = max(FALL * band, FINEST_PX)
            rounds.append(_round(thinned, band))
        return cls(colours=colours, shrunk=shrunk, thinned=thinned, rounds=tuple(rounds))

    def drawn(self, mask: BoolArray) -> BoolArray:
        """Return a mask (H, W) of the photo with its border at the photo's edges."""
        height, width = self.colours.shape[1:]
        whole = self.shrunk == (1.0, 1.0)
        own = _padded(mask.view(np.uint8)) if whole else _nearest(mask.view(np.uint8), (width, height))
        found = np.zeros_like(mask)
        for one in self.rounds:
            if not own.any():
                return found
            (top, left), deep = self._drawn_once(own, one)
            own = np.zeros((height, width), dtype=np.uint8)
            own[top : top + deep.shape[0], left : left + deep.shape[1]] = deep > 0.0
        if whole:
            return own[: mask.shape[0], : mask.shape[1]] > 0
        window, deep = _raised((top, left), deep, self.shrunk, mask.shape)
        found[window] = deep > 0.0
        return found

    def _drawn_once(self, own: NDArray[np.uint8], one: _Round) -> tuple[tuple[int, int], Float32Array]:
        """Return how deep in a mask (H, W) pixels lie, by their colour too, within the round's band.

        That is of the part of the photo around the mask, whose upper left corner (row, column) comes with it.
        """
        x, y, width, height = cv2.boundingRect(own)
        margin = 2 * round(one.band_px) + 2
        left, top = (max(0, at - margin) // THINNED * THINNED for at in (x, y))
        right = min(own.shape[1], -(-(x + width + margin) // THINNED) * THINNED)
        bottom = min(own.shape[0], -(-(y + height + margin) // THINNED) * THINNED)
        window = (slice(top, bottom), slice(left, right))
        small = (slice(top // THINNED, bottom // THINNED), slice(left // THINNED, right // THINNED))
        deep = _thinned(inside_px(own[window].view(bool), one.band_px))
        *slopes, value = (
            np.asarray(cv2.resize(line, (right - left, bottom - top), interpolation=cv2.INTER_LINEAR))
            for line in _coefficients(deep, self.thinned[:, *small], one, small)
        )
        for slope, colour in zip(slopes, self.colours[:, *window], strict=True):
            value += slope * colour
        return (top, left), np.asarray(value, dtype=np.float32)


def _raised(
    corner: tuple[int, int], deep: Float32Array, shrunk: tuple[float, float], size: tuple[int, ...]
) -> tuple[tuple[slice, slice], Float32Array]:
    """Return the window of the whole photo that a part of the looked-at one covers, and the part's values there."""
    low = [round(at / s) for at, s in zip(corner, shrunk[::-1], strict=True)]
    high = [min(round((at + n) / s), m) for at, n, s, m in zip(corner, deep.shape, shrunk[::-1], size, strict=True)]
    turn = np.array([
        [shrunk[0], 0.0, (low[1] + 0.5) * shrunk[0] - 0.5 - corner[1]],
        [0.0, shrunk[1], (low[0] + 0.5) * shrunk[1] - 0.5 - corner[0]],
    ])  # fmt: skip
    raised = cv2.warpAffine(
        deep, turn, (high[1] - low[1], high[0] - low[0]), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return (slice(low[0], high[0]), slice(low[1], high[1])), np.asarray(raised, dtype=np.float32)


def _nearest(mask: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    return np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST_EXACT), dtype=np.uint8)


def _padded(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image with its last row and column repeated until both sizes are multiples of `THINNED`."""
    below, right = (-size % THINNED for size in image.shape[:2])
    return np.asarray(cv2.copyMakeBorder(image, 0, below, 0, right, cv2.BORDER_REPLICATE))


def _coefficients(
    deep: Float32Array, colours: Float32Array, one: _Round, window: tuple[slice, slice]
) -> list[Float32Array]:
    """Return three slopes and the offset (h, w) of `deep` (h, w) over colours (3, h, w), means of a pixel's windows."""
    side = (2 * one.reach + 1, 2 * one.reach + 1)
    mean_deep, mean = np.asarray(cv2.blur(deep, side)), one.mean[:, *window]
    b, g, r = (np.asarray(cv2.blur(c * deep, side)) - m * mean_deep for c, m in zip(colours, mean, strict=True))
    i = one.inverse[:, *window]
    slopes = (i[0] * b + i[1] * g + i[2] * r, i[1] * b + i[3] * g + i[4] * r, i[2] * b + i[4] * g + i[5] * r)
    offset = mean_deep - slopes[0] * mean[0] - slopes[1] * mean[1] - slopes[2] * mean[2]
    return [np.asarray(cv2.blur(line, side), dtype=np.float32) for line in (*slopes, offset)]


def _round(thinned: Float32Array, band_px: float) -> _Round:
    """Return the statistics of a thinned photo's colours in windows about as wide as the band."""
    reach = max(1, round(WINDOW * band_px / THINNED))
    side = (2 * reach + 1, 2 * reach + 1)
    mean = np.stack([np.asarray(cv2.blur(colour, side), dtype=np.float32) for colour in thinned])
    spread = [np.asarray(cv2.blur(thinned[a] * thinned[b], side)) - mean[a] * mean[b] for a, b in _PAIRS]
    bb, bg, br, gg, gr, rr = spread
    bb, gg, rr = bb + EVEN, gg + EVEN, rr + EVEN
    cofactors = np.stack(
        [
            gg * rr - gr * gr,
            br * gr - bg * rr,
            bg * gr - br * gg,
            bb * rr - br * br,
            bg * br - bb * gr,
            bb * gg - bg * bg,
        ]
    )
    whole = bb * cofactors[0] + bg * cofactors[1] + br * cofactors[2]
    return _Round(band_px=band_px, reach=reach, mean=mean, inverse=(cofactors / whole).astype(np.float32))


def _thinned(image: Float32Array) -> Float32Array:
    """Return the means (h / 2, w / 2) of an image's pixels."""
    size = (image.shape[1] // THINNED, image.shape[0] // THINNED)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
