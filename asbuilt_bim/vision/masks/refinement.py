"""Refined borders: where two blunt opinions on a mask meet the photo's own edges.

A network's map is coarse, and a matcher's surfaces end somewhere within its window. The mean of a pixel's distances
inside both errs less than each. A guided filter draws it to the photo's edges. All this within a narrow band: what lies
deeper inside or outside of the surface than both may err stays as geometry has it.

Reference: He, Sun & Tang 2013, Guided image filtering.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array

COARSE_SHARE = 1.0 / 190.0
"""How far a network's border errs, as a share of the photo's width: a cell of its map."""
MATCHED_PX = 3.8
"""How far a matched surface's border errs: half of the matcher's window."""
LEAST_WEIGHT = 0.1
"""With less weight than this the coarse opinion isn't worth the time: the photo is large, geometry more precise."""
EVEN = 4e-4
"""Variance of grey (0..1) under which a window has no edge: (5 of 255) squared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Weights:
    """What the coarse opinion counts by, and three standard deviations of both together in pixels."""

    coarse: float
    band_px: float

    @classmethod
    def of(cls, width_px: int) -> _Weights:
        """Weigh by the inverse of the variances."""
        coarse, matched = (COARSE_SHARE * width_px) ** 2, MATCHED_PX**2
        return cls(coarse=matched / (coarse + matched), band_px=3.0 * (coarse * matched / (coarse + matched)) ** 0.5)


def refined_mask(matched: BoolArray, coarse: BoolArray, photo: ByteImage) -> BoolArray:
    """Return a mask (H, W) between geometry's and a network's of one instance, its border at the BGR photo's edges."""
    weights = _Weights.of(photo.shape[1])
    if weights.coarse < LEAST_WEIGHT or not matched.any():
        return matched
    x, y, width, height = cv2.boundingRect(matched.view(np.uint8))
    reach = round(2.0 * weights.band_px) + 1
    window = (slice(max(0, y - reach), y + height + reach), slice(max(0, x - reach), x + width + reach))
    grey = cv2.cvtColor(photo[window], cv2.COLOR_BGR2GRAY).astype(np.float32) * np.float32(1.0 / 255.0)
    own = inside_px(matched[window], weights.band_px)
    mean = (1.0 - weights.coarse) * own + weights.coarse * inside_px(coarse[window], weights.band_px)
    once = _guided(grey, mean.astype(np.float32), round(weights.band_px))
    half = np.float32(0.5 * weights.band_px)
    twice = _guided(grey, np.clip(once, -half, half), round(0.6 * weights.band_px))
    near = np.abs(own) < weights.band_px
    found = matched.copy()
    found[window] = np.where(near, twice > 0.0, matched[window])
    return found


def inside_px(mask: BoolArray, most_px: float) -> Float32Array:
    """Return how many pixels deep inside (or, negative, outside) each pixel lies, at most `most_px`."""
    inside = mask.astype(np.uint8)
    deep = np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 3), dtype=np.float32)
    deep -= np.asarray(cv2.distanceTransform(1 - inside, cv2.DIST_L2, 3), dtype=np.float32)
    return np.asarray(np.clip(deep, -np.float32(most_px), np.float32(most_px)), dtype=np.float32)


def _guided(grey: Float32Array, values: Float32Array, reach_px: int) -> Float32Array:
    """Return values (H, W) as a linear function of grey in every window of (2 reach + 1) pixels."""
    side = (2 * reach_px + 1, 2 * reach_px + 1)

    def mean(of: Float32Array) -> Float32Array:
        return np.asarray(cv2.blur(of, side), dtype=np.float32)

    mean_grey, mean_value = mean(grey), mean(values)
    slope = (mean(grey * values) - mean_grey * mean_value) / (mean(grey * grey) - mean_grey**2 + np.float32(EVEN))
    return mean(slope) * grey + mean(mean_value - slope * mean_grey)
