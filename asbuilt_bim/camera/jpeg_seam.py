"""A step in a decoded JPEG that only damage leaves: from one coded unit (MCU) on, all is brighter or darker.

JPEG codes a block's mean as its difference from the last one's, so one turned bit in such a difference is added to all
blocks that follow, row after row. The seam is a staircase on the grid of the MCUs: above the rest of one row of them,
and below its beginning, with the same height everywhere. Nothing that can be photographed does that.
Not found: steps of less than `LEAST_STEPS[0]` grey levels, steps in the first or last `_ENDS` MCUs of a row (there the
staircase is a straight line, as a horizon may be) or in the first and last row, and what a restart marker ends at once.
"""

from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, FloatArray

LEAST_STEPS = (2.5, 5.0, 10.0, 20.0, 40.0)
"""A step is told from the picture's own edges by those of half its height: looked for at several heights."""
_ENDS = 4  # MCUs
_LEAST_COLUMNS = 32  # fewer say too little: of 500 sound pictures one of 40 columns came near
_SUPPORT = 0.80  # of the MCUs on either part of the staircase step in the same direction
_ELSEWHERE = 0.30  # at most this share steps so where the staircase is not
_SPREAD = 0.35  # of the step's height: half of the MCUs' steps lie this near to their median
_BLACK, _WHITE = 4.0, 251.0  # what is beyond is cut off and shows no step


def seam(image: ByteImage, mcu_px: tuple[int, int]) -> tuple[int, int, float] | None:
    """Return the pixel row and column of the MCU where a step begins and its grey levels; None where there is none."""
    planes = cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb)
    for channel in range(3):
        found = _staircase(np.asarray(planes[:, :, channel], dtype=np.float64), *mcu_px)
        if found is not None:
            return found
    return None


def _staircase(plane: FloatArray, width: int, height: int) -> tuple[int, int, float] | None:
    rows, columns = plane.shape[0] // height, plane.shape[1] // width
    if rows < 4 or columns < _LEAST_COLUMNS:
        return None
    jump, dark, light = _jumps(plane[: rows * height, : columns * width], width, height)
    for sign, cut_off in ((1.0, light), (-1.0, dark)):
        for least in LEAST_STEPS:
            up = sign * jump > least
            known = up | ~cut_off
            before, behind = _shares(up, known)
            fits = (behind[:-1] >= _SUPPORT) & (before[1:] >= _SUPPORT)
            fits &= (before[:-1] <= _ELSEWHERE) & (behind[1:] <= _ELSEWHERE)
            for above, column in np.argwhere(fits):
                row = np.r_[np.arange(column) * 0 + above + 1, np.arange(column, columns) * 0 + above]
                steps = jump[row, np.arange(columns)][known[row, np.arange(columns)]]
                step = float(np.median(steps))
                if np.median(np.abs(steps - step)) <= _SPREAD * abs(step):
                    return int(above + 1) * height, int(column) * width, step
    return None


def _jumps(plane: FloatArray, width: int, height: int) -> tuple[FloatArray, BoolArray, BoolArray]:
    """Return (rows - 1, columns): how much lighter an MCU begins than the one above ends, slopes aside.

    And where either is black, or white: a step down, or up, is cut off there. The two rows beside the border are left
    out: decoders smooth colours over them.
    """
    at = np.arange(height, plane.shape[0], height)
    row = {k: plane[at + k].reshape(len(at), -1, width).mean(axis=2) for k in (-5, -3, -2, 1, 2, 4)}
    slope = (row[-2] - row[-5] + row[4] - row[1]) / 6.0  # per pixel row
    jump = (row[1] + row[2] - row[-2] - row[-3]) / 2.0 - 4.0 * slope
    return jump, np.minimum(row[-2], row[1]) < _BLACK, np.maximum(row[-2], row[1]) > _WHITE


def _shares(up: BoolArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return by border and column the share of known MCUs that step, of those before the column and from it on.

    Where fewer than `_ENDS` are known on a part it is half: neither a step nor none.
    """
    shares = []
    for turn in (1, -1):
        stepped, all_known = (np.cumsum(a[:, ::turn], axis=1)[:, ::turn].astype(np.float64) for a in (up, known))
        shares.append(np.where(all_known >= _ENDS, stepped / np.maximum(all_known, 1.0), 0.5))
    before = np.full(up.shape, 0.5)
    before[:, 1:] = shares[0][:, :-1]
    return before, shares[1]
