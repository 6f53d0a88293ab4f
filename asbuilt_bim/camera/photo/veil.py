"""Is a part of one lens veiled: dirty, wet, fogged, a finger's blur, the sun on it? Then it shows less contrast there.

Both lenses see the same things, so what one photo shows of them with less contrast than the other is the lens's doing.
"""

from collections.abc import Iterator

import cv2
import numpy as np

from asbuilt_bim.camera.photo.overlap import PairMatches
from asbuilt_bim.camera.photo.sharpness import PARTS
from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray

PATCH_PX = 15
"""About a feature: what its code was made of, and a bit."""
FEWEST_IN_PART = 3
LEAST_CONTRAST = 2.0**-0.5
"""Of the other photo's, half a stop: no part of a clean real pair has less, but for one in thirty."""
MOST_VEILED = 0.10
"""Of the parts in which both photos show the same things."""


def veil_faults(pair: RectifiedPair, matches: PairMatches) -> Iterator[Rejection]:
    """Name the photo that shows a good part of what both show with less contrast than the other, and by how much."""
    if not len(matches.left_px):
        return
    contrast = _contrast(pair.left, matches.left_px) / _contrast(pair.right, matches.right_px)
    station = about(SubjectKind.STATION, pair.name)
    photos = (("left", matches.left_px, contrast), ("right", matches.right_px, 1.0 / contrast))
    for side, at_px, own in photos:
        parts = _in_parts(at_px, own, pair.camera.width_px)
        veiled = parts[parts < LEAST_CONTRAST]
        if len(veiled) > max(1.0, MOST_VEILED * len(parts)):
            share = len(veiled) / len(parts)
            yield rejected(
                Reason.PHOTO_VEILED, station, side=side, share=share, contrast=float(np.median(veiled)),
                limit_share=MOST_VEILED,
            )  # fmt: skip


def _contrast(photo: ByteImage, at_px: FloatArray) -> FloatArray:
    """Return how far the grey levels about each place (N, 2) scatter, over their mean: exposure doesn't change that."""
    grey = cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY)
    about = np.arange(PATCH_PX) - PATCH_PX // 2
    column, row = np.rint(at_px).astype(np.intp).T
    rows = np.clip(row[:, None] + about, 0, grey.shape[0] - 1)
    columns = np.clip(column[:, None] + about, 0, grey.shape[1] - 1)
    patches = grey[rows[:, :, None], columns[:, None, :]].astype(np.float64)
    scatter = np.maximum(patches.std(axis=(1, 2)), 1.0)  # no less than a grey level
    contrast: FloatArray = scatter / np.maximum(patches.mean(axis=(1, 2)), 1.0)
    return contrast


def _in_parts(at_px: FloatArray, values: FloatArray, width_px: int) -> FloatArray:
    """Return the median of the values (N,) in each part of the photo that has a few of them."""
    column, row = (at_px * PARTS / width_px).astype(np.intp).T
    part = row * PARTS + column
    found = [values[part == one] for one in np.unique(part)]
    return np.array([float(np.median(own)) for own in found if len(own) >= FEWEST_IN_PART])
