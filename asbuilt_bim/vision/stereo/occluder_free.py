"""Occluder-free stereo: a second look past thin dark things, for what is seen between bars, wires and props.

Dense stereo smears bars and gaps into one, or gives up on them. They are first taken out of both photos. A
morphological closing fills what is dark and thin with what is seen beside it, and leaves solid things as they are.
"""

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array
from asbuilt_bim.vision.scene.sky import coloured_like
from asbuilt_bim.vision.stereo.matching import (
    NEAREST_M,
    carried_sigma_px,
    disparity_steps,
    grey,
    lands_inside,
    semi_global,
)

THIN_RAD = 0.01
"""What looks thinner than this is taken out: a bar of 25 mm from 2.5 m on. A column of 0.3 m looks so at 30 m."""
SMALLER = 2
"""The photos are halved first: no more detail is asked for, and it takes a quarter of the time."""
OCCLUDER_FREE_SIGMA_PX = 0.5
"""Of these disparities, in pixels of full size: a quarter of a halved pixel, since nothing polishes them.
What was carried over an even place by more is left out: a plain wall shows nothing past it."""


def occluder_free_disparity(pair: RectifiedPair, sky: BoolArray) -> Float32Array:
    """Return the disparity (H, W) in pixels of what is seen past thin dark things; NaN not found, 0 sky.

    What stands solid is found as it is anywhere, so only what is farther than expected tells something new. `sky`
    (H, W) is known by its colour between bars too, where stereo smears them, and grown over the thin things before it.
    """
    camera = pair.camera
    width = max(3, round(THIN_RAD * camera.f_px / SMALLER) | 1)
    left, right = (_closed(_halved(grey(photo)), width) for photo in (pair.left, pair.right))
    most = camera.f_px * camera.baseline_m / NEAREST_M / SMALLER
    found = semi_global(left, right, disparity_steps(most, left.shape[1]))
    found[carried_sigma_px(left, right, found) > OCCLUDER_FREE_SIGMA_PX / SMALLER] = np.nan
    found *= np.float32(SMALLER)
    size = (camera.width_px, camera.height_px)
    full = np.asarray(cv2.resize(found, size, interpolation=cv2.INTER_NEAREST), dtype=np.float32)
    known = np.isfinite(full) & pair.valid_left & lands_inside(full, pair.valid_right)
    disparity = np.where(known, full, np.float32(np.nan)).astype(np.float32)
    disparity[_sky_between(pair, sky, SMALLER * width + 1)] = 0.0
    return disparity


def _sky_between(pair: RectifiedPair, sky: BoolArray, width_px: int) -> BoolArray:
    """Return the sky (H, W) with the gaps between thin things before it, and these filled, as far as it hangs together.

    It is seen through a cage wherever the cage is; what has its colour by chance, such as a pale wall, stands apart.
    """
    seen = sky | (coloured_like(pair.left, sky) & pair.valid_left)
    filled = _closed(seen.astype(np.float32), width_px) > 0
    count, labels = cv2.connectedComponents(filled.astype(np.uint8), connectivity=4)
    parts = np.asarray(labels, dtype=np.int32)
    with_sky = np.bincount(parts[sky], minlength=count) > 0
    together: BoolArray = filled & with_sky[parts]
    return together


def _halved(picture: Float32Array) -> Float32Array:
    half = cv2.resize(picture, None, fx=1.0 / SMALLER, fy=1.0 / SMALLER, interpolation=cv2.INTER_AREA)
    return np.asarray(half, dtype=np.float32)


def _closed(picture: Float32Array, width_px: int) -> Float32Array:
    """Fill what is dark and thinner than so much. (Filling with a mean of what lies about it leaves stripes: worse.)"""
    square = np.ones((width_px, width_px), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(picture, cv2.MORPH_CLOSE, square), dtype=np.float32)
