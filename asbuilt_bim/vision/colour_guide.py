"""Masks drawn to a photo's edges in all its colours: a blunt border finds the edge that grey alone doesn't show.

A guided filter makes how deep a pixel lies in a mask a linear function of its colour, window by window. What
that needs of the photo is worked out once, for all its masks; coefficients are found on a map of half the size, as they
are smooth, and used on the photo itself.

Reference: He, Sun & Tang 2013, Guided image filtering, equations 19 to 21; He & Sun 2015, Fast guided filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array
from asbuilt_bim.vision.finer import EVEN, inside_px

LOOKED_AT_PX = 700.0
"""Most width that masks are drawn at: a network's map has 192 to 256 cells there."""
THINNED = 2
"""Coefficients are found at every so many pixels."""
FINEST_PX = 3.0
"""What a border may be off in the last round: it can't be seen much better."""
WINDOW = 0.7
"""A window's reach, as a share of what the border may be off."""
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Round:
    """One round: how far the border may be off, the window's reach in thinned pixels, the colours' statistics in it."""

    band_px: float
    reach: int
    mean: Float32Array  # (h, w, 3)
    inverse: Float32Array  # (6, h, w): of the covariance matrix, by `_PAIRS`


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ColourGuide:
    """A BGR photo, at most `LOOKED_AT_PX` wide, as what masks are drawn to."""

    scale: float
    colours: Float32Array  # (H, W, 3), 0..1
    thinned: Float32Array
    rounds: tuple[_Round, ...]

    @classmethod
    def of(cls, photo: ByteImage, off_share: float) -> ColourGuide:
        """Prepare a BGR photo for masks whose border is off by up to `off_share` of its width."""
        scale = min(1.0, LOOKED_AT_PX / photo.shape[1])
        small = photo if scale == 1.0 else cv2.resize(photo, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        colours = small.astype(np.float32) * np.float32(1.0 / 255.0)
        thinned = _thinned(colours)
        rounds: list[_Round] = []
        band = max(off_share * colours.shape[1], FINEST_PX)
        while True:
            rounds.append(_round(thinned, band))
            if band <= FINEST_PX:
                break
            band = max(0.5 * band, FINEST_PX)
        return cls(scale=scale, colours=colours, thinned=thinned, rounds=tuple(rounds))

    def drawn(self, mask: BoolArray) -> BoolArray:
        """Return a mask (H, W) of the photo with its border at the photo's edges."""
        if not mask.any():
            return mask
        own = mask
        if self.scale < 1.0:
            size = (self.colours.shape[1], self.colours.shape[0])
            own = np.asarray(cv2.resize(mask.view(np.uint8) * 255, size, interpolation=cv2.INTER_AREA) > 127)
        value = np.where(own, np.float32(1.0), np.float32(-1.0))
        for one in self.rounds:
            value = self._drawn_once(value > 0.0, one)
        if self.scale < 1.0:
            value = np.asarray(cv2.resize(value, mask.shape[::-1], interpolation=cv2.INTER_LINEAR), dtype=np.float32)
        return np.asarray(value > 0.0)

    def _drawn_once(self, own: BoolArray, one: _Round) -> Float32Array:
        """Return (H, W) how deep in a mask each pixel lies, by its colour too, within the round's band."""
        value = np.where(own, np.float32(one.band_px), np.float32(-one.band_px))
        x, y, width, height = cv2.boundingRect(own.view(np.uint8))
        margin = 2 * round(one.band_px) + 2
        left, top = (max(0, at - margin) // THINNED * THINNED for at in (x, y))
        right, bottom = (
            min(size, at + long + margin) // THINNED * THINNED
            for size, at, long in ((own.shape[1], x, width), (own.shape[0], y, height))
        )
        if min(right - left, bottom - top) < 2 * THINNED:
            return value
        window = (slice(top, bottom), slice(left, right))
        small = (slice(top // THINNED, bottom // THINNED), slice(left // THINNED, right // THINNED))
        deep = _thinned(inside_px(own[window], one.band_px))
        lines = _coefficients(deep, self.thinned[small], one, small)
        lines = np.asarray(cv2.resize(lines, (right - left, bottom - top), interpolation=cv2.INTER_LINEAR))
        value[window] = np.einsum("hwc,hwc->hw", lines[..., :3], self.colours[window]) + lines[..., 3]
        return value


def _coefficients(deep: Float32Array, colours: Float32Array, one: _Round, window: tuple[slice, slice]) -> Float32Array:
    """Return slopes and offset (h, w, 4) of `deep` (h, w) over colour (h, w, 3), means over all windows of a pixel."""
    side = (2 * one.reach + 1, 2 * one.reach + 1)
    mean_deep, mean = np.asarray(cv2.blur(deep, side)), one.mean[window]
    common = np.asarray(cv2.blur(colours * deep[..., None], side)) - mean * mean_deep[..., None]
    b, g, r = np.moveaxis(common, 2, 0)
    i = one.inverse[:, *window]
    slopes = np.dstack([i[0] * b + i[1] * g + i[2] * r, i[1] * b + i[3] * g + i[4] * r, i[2] * b + i[4] * g + i[5] * r])
    offset = mean_deep - np.einsum("hwc,hwc->hw", slopes, mean)
    return np.asarray(cv2.blur(np.dstack([slopes, offset]), side), dtype=np.float32)


def _round(thinned: Float32Array, band_px: float) -> _Round:
    """Return the statistics of a thinned photo's colours in windows about as wide as the band."""
    reach = max(1, round(WINDOW * band_px / THINNED))
    side = (2 * reach + 1, 2 * reach + 1)
    mean = np.asarray(cv2.blur(thinned, side), dtype=np.float32)
    spread = [
        np.asarray(cv2.blur(thinned[..., a] * thinned[..., b], side)) - mean[..., a] * mean[..., b] for a, b in _PAIRS
    ]
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
    """Return the means (h / 2, w / 2) of an image's pixels; an odd row or column at the end is left out."""
    height, width = (size // THINNED for size in image.shape[:2])
    whole = image[: THINNED * height, : THINNED * width]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), dtype=np.float32)
