"""A step in a decoded JPEG that only damage leaves: from one coded unit (MCU) on, all is brighter or darker.

JPEG codes a block's mean as its difference from the last one's, so one turned bit in such a difference is added to all
blocks that follow, row after row. The seam is a staircase on the grid of the MCUs: above the rest of one row of them,
and below its beginning, with the same height everywhere. Nothing that can be photographed does that. Not found: steps
of less than three grey levels, or of less than ten where a picture is full of texture. Nor steps in the first or last
row, or in the first or last `_ENDS` MCUs of a row. There the staircase is a straight line, as a horizon may be. Nor
what a restart marker ends at once.
"""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray

_STEPS = 3.0 * 1.35 ** np.arange(14)  # grey levels, to 148; one between two of them is found by either
_ENDS = 4  # MCUs
_LEAST_COLUMNS = 32
_LEAST_GAIN, _AT_COLUMNS = 0.35, 80.0
"""The gain is a mean over a row of MCUs, so by chance it is larger where there are fewer: by the root of their
number. Of 522 sound pictures of real and drawn cameras one came to 0.9 of the limit and the next to 0.65. Of 32 with
a turned bit that counting blocks didn't find, 24 passed the limit."""
_BLACK, _WHITE = 4.0, 251.0  # what is beyond is cut off and shows no step


def seam(image: ByteImage, mcu_px: tuple[int, int]) -> tuple[int, int, float] | None:
    """Return the pixel row and column of the MCU where a step begins and its grey levels; None where there is none."""
    planes = cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb)
    for channel in range(3):
        plane = np.asarray(planes[:, :, channel], dtype=np.uint8)
        found = _staircase(plane, mcu_px, smoothed=channel > 0)
        if found is not None:
            return found
    return None


def _staircase(plane: ByteImage, mcu_px: tuple[int, int], *, smoothed: bool) -> tuple[int, int, float] | None:
    width, height = mcu_px
    rows, columns = plane.shape[0] // height, plane.shape[1] // width
    if rows < 4 or columns < _LEAST_COLUMNS:
        return None
    jump, dark, light = _jumps(plane[: rows * height, : columns * width], width, height, smoothed=smoothed)
    best, place = _LEAST_GAIN * max(1.0, (_AT_COLUMNS / columns) ** 0.5), None
    for sign, cut_off in ((1.0, light), (-1.0, dark)):
        for step in sign * _STEPS:
            gain = _gain(jump, step, cut_off)
            if gain.max() > best:
                above, column = np.unravel_index(int(gain.argmax()), gain.shape)
                begins = int(column) + _ENDS
                on_it = np.concatenate([jump[above, begins:], jump[above + 1, :begins]])
                best, place = float(gain.max()), (int(above + 1) * height, begins * width, float(np.median(on_it)))
    return place


def _jumps(plane: ByteImage, width: int, height: int, *, smoothed: bool) -> tuple[FloatArray, BoolArray, BoolArray]:
    """Return (rows - 1, columns): how much lighter an MCU begins than the one above ends, slopes aside.

    And where either is black, or white: a step down, or up, is cut off there. `smoothed` planes are colours, which
    decoders smooth over the border: there the two rows beside it are left out.
    """
    at = np.arange(height, plane.shape[0], height)
    row = {
        k: plane[at + k].reshape(len(at), -1, width).mean(axis=2, dtype=np.float64)
        for k in (-5, -3, -2, -1, 0, 1, 2, 4)
    }
    if smoothed:
        slope = (row[-2] - row[-5] + row[4] - row[1]) / 6.0  # per pixel row
        jump = (row[1] + row[2] - row[-2] - row[-3]) / 2.0 - 4.0 * slope
    else:
        jump = row[0] - row[-1] - (row[-1] - row[-2] + row[1] - row[0]) / 2.0
    return jump, np.minimum(row[-2], row[1]) < _BLACK, np.maximum(row[-2], row[1]) > _WHITE


def _gain(jump: FloatArray, step: float, cut_off: BoolArray) -> FloatArray:
    """Return by upper border and column how much better a staircase of this height explains the jumps than none.

    1 where each MCU on the staircase jumps by `step` and no other does. 0 or less where one of the four parts (on it
    and beside it, above and below) speaks against it. The columns begin at `_ENDS` and end as far from the other side.
    """
    each = (np.abs(jump) - np.abs(jump - step)) / abs(step)
    known = ~cut_off | (each > 0.0)
    sums = np.cumsum(np.where(known, each, 0.0), axis=1)
    counts = np.cumsum(known, axis=1).astype(np.float64)
    first, second = slice(_ENDS - 1, -_ENDS - 1), slice(-1, None)
    before, before_count = sums[:, first], counts[:, first]
    behind, behind_count = sums[:, second] - before, counts[:, second] - before_count
    before = np.where(before_count >= _ENDS, before / np.maximum(before_count, 1.0), 0.0)
    behind = np.where(behind_count >= _ENDS, behind / np.maximum(behind_count, 1.0), 0.0)
    on_it = np.minimum(behind[:-1], before[1:])
    beside = np.maximum(before[:-1], behind[1:])
    gain: FloatArray = np.minimum(on_it, -beside)
    return gain
