"""How far the rows of a rectified pair lie apart: what its rig leaves, seen on the photos themselves."""

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, median
from asbuilt_bim.vision.stereo.rig_fit import LENS_CELLS
from asbuilt_bim.vision.stereo.warp import right_at

LEAST_KNOWN = 0.2
LEAST_STEEPNESS_GREY2 = 500.0
"""A cell with less structure across its rows, or less depth, says nothing."""
FAR = 3.0  # times the rest's: pixels and whole cells that are off by more were matched falsely


def rows_apart_px(left: Float32Array, right: Float32Array, disparity_px: Float32Array, measured: BoolArray) -> float:
    """Return the root mean square over the frame's like cells of how far rows lie apart, 0 where none can tell.

    `left` and `right` (H, W) are grey levels, `disparity_px` (H, W) holds where `measured` (H, W). A rig that lifts one
    photo's rows by so much moves its columns by as much, and no match along the rows shows that.
    """
    start = np.where(measured, disparity_px, np.float32(0.0)).astype(np.float32)
    difference = left - right_at(right, start)
    left_slope, right_slope = _down(left), right_at(_down(right), start)
    found = [_of_cell(difference[cell], left_slope[cell], right_slope[cell], measured[cell]) for cell in _cells(left)]
    told = np.sort(np.abs([one for one in found if np.isfinite(one)]))
    while len(told) > 1 and told[-1] > FAR * np.sqrt(np.mean(told[:-1] ** 2)):
        told = told[:-1]
    return float(np.sqrt(np.mean(told**2))) if len(told) else 0.0


def _of_cell(difference: Float32Array, left: Float32Array, right: Float32Array, measured: BoolArray) -> float:
    """Solve for one shift down the photo; both slopes' product counts structure, and grain doesn't pass for it."""
    if np.mean(measured) < LEAST_KNOWN:
        return float("nan")
    off = difference[measured] - median(difference[measured])
    alike = np.abs(off) < FAR * median(np.abs(off)) + 1.0
    one, other = left[measured][alike].astype(np.float64), right[measured][alike].astype(np.float64)
    steepness = float(one @ other)
    return float(one @ off[alike]) / steepness if steepness > LEAST_STEEPNESS_GREY2 else float("nan")


def _down(image: Float32Array) -> Float32Array:
    return np.pad(0.5 * (image[2:] - image[:-2]), ((1, 1), (0, 0)))


def _cells(image: Float32Array) -> list[tuple[slice, slice]]:
    (height, width), (across, down) = image.shape, LENS_CELLS
    return [
        (slice(i * height // down, (i + 1) * height // down), slice(j * width // across, (j + 1) * width // across))
        for i in range(down)
        for j in range(across)
    ]
