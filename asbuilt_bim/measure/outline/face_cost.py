"""How much each place of a face's raster looks like the face: disparity, both pictures' agreement, colour."""

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, median
from asbuilt_bim.geometry.robust_least_squares import robust_sigma

ON_PX, OFF_PX = 0.8, 1.0
"""Disparity nearer the face's plane is on it, further from it is off it."""
OWN, SAME, OPEN, FOREIGN = -0.3, 0.01, 0.02, 0.3
"""Costs per pixel of calling it face: labelled so; at its depth but labelled otherwise; nothing known; another's."""
SHADE_GREY = 8.0
"""Grey levels beyond what the face itself shows that still count as the face."""
SHADE_FREE_AB = 7.0
"""Chroma apart (Lab) that stains and a shadow's blue make on one wall."""


def face_cost(
    own: BoolArray,
    other: BoolArray,
    off_px: Float32Array,
    difference: Float32Array,
    paired: BoolArray,
    chroma: Float32Array,
    ended: BoolArray,
) -> Float32Array:
    """Return per raster pixel (h, w) what calling it the face costs: below 0 where it looks like it, above where not.

    `own`, `other`: labelled as this face, as something else that is not nearer. `off_px`: measured disparity less the
    face's plane, NaN where not measured. `difference`: left picture less right, `paired` where the right one shows it.
    `chroma`: of the left picture, see `chroma_of`. `ended`: beyond the left frame.
    """
    smooth = cv2.blur(np.abs(difference), (3, 3))
    usual = median(smooth[own]) + 0.5 if own.any() else 2.0
    mismatch = np.where(paired, smooth / usual, 2.0)
    strange = _strangeness(chroma, own)
    cost = np.where(paired, np.clip(OPEN + 0.08 * (mismatch - 2.0), 0.5 * OPEN, 0.2), OPEN).astype(np.float32)
    known = np.isfinite(off_px)
    cost[known & (np.abs(off_px) < ON_PX)] = SAME
    cost[known & (off_px < -OFF_PX)] = FOREIGN
    cost[other] = FOREIGN
    cost[known & (off_px > OFF_PX)] = OPEN  # something nearer: the face may go on behind it
    cost[own] = OWN + np.clip(0.1 * (mismatch[own] - 3.0), 0.0, 0.4)
    cost += 0.35 * strange
    cost[ended] = FOREIGN
    return cost.astype(np.float32)


def bridged(
    own: BoolArray,
    meets: BoolArray,
    other: BoolArray,
    off_px: Float32Array,
    colour: ByteImage,
    chroma: Float32Array,
    gap_px: int,
) -> BoolArray:
    """Return the face's pixels with gaps of up to `gap_px` in their rows filled, unless something contradicts them.

    A gap may also lie between the face and one that it `meets` in an edge: there is nothing between the two. A dark or
    smooth patch of concrete has no disparity, but it looks like the rest; sky between starter bars doesn't.
    """
    kernel = np.ones((1, gap_px), np.uint8)  # along a row, between two sides that are sure: never at the border
    # padded: at its border OpenCV closes towards the outside
    padded = cv2.copyMakeBorder((own | meets).astype(np.uint8), 0, 0, gap_px, gap_px, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, kernel)[:, gap_px:-gap_px] > 0
    light = cv2.cvtColor(cv2.blur(colour, (5, 5)), cv2.COLOR_BGR2GRAY).astype(np.float32)
    pixels = light[own]
    if len(pixels) < 30:
        return own
    low, high = np.quantile(pixels, [0.02, 0.98])
    against = other | (np.abs(off_px) > OFF_PX) | (_strangeness(chroma, own) > 0.1)
    filled: BoolArray = own | (closed & ~against & (light > low - SHADE_GREY) & (light < high + SHADE_GREY))
    return filled


def chroma_of(colour: ByteImage) -> Float32Array:
    """Return a and b of CIE Lab (2, h, w) of a picture, over 3 px."""
    _, *chroma = cv2.split(cv2.cvtColor(cv2.blur(colour, (3, 3)), cv2.COLOR_BGR2Lab))
    return np.array(chroma, dtype=np.float32)


def _strangeness(chroma: Float32Array, own: BoolArray) -> NDArray[np.float32]:
    """Return 0..1: how far a pixel's chroma is from what the face's own pixels have; lightness doesn't count."""
    if np.count_nonzero(own) < 30:
        return np.zeros(own.shape, np.float32)
    a, b = (channel - np.float32(median(channel[own])) for channel in chroma)
    apart = np.sqrt(a * a + b * b)
    limit = 2.0 * robust_sigma(apart[own]) + SHADE_FREE_AB
    strange: Float32Array = np.clip((apart - limit) / limit, 0.0, 1.0).astype(np.float32)
    return strange
