"""A mask's box, and its pixels: looked for within the box, for a face is a small part of a photo."""

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray

Box = tuple[slice, slice]
"""Rows and columns."""


def box_of(mask: BoolArray) -> Box:
    """Return the rows and columns that hold a mask's pixels; none of either for an empty one."""
    rows = np.flatnonzero(mask.any(axis=1))
    if not rows.size:
        return slice(0, 0), slice(0, 0)
    within = slice(int(rows[0]), int(rows[-1]) + 1)
    columns = np.flatnonzero(mask[within].any(axis=0))
    return within, slice(int(columns[0]), int(columns[-1]) + 1)


def nonzero(mask: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of a mask's pixels as `np.nonzero` does."""
    box = box_of(mask)
    rows, columns = np.divmod(np.flatnonzero(mask[box]), max(box[1].stop - box[1].start, 1))  # np.nonzero is slow
    return rows + box[0].start, columns + box[1].start


def at_pixels(image: FloatArray, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> FloatArray:
    """Return the vectors (N, C) of an image (H, W, C) at N pixels: `image[rows, columns]`, twenty times as fast."""
    found: FloatArray = np.take(image.reshape(-1, image.shape[2]), rows * image.shape[1] + columns, axis=0)
    return found
