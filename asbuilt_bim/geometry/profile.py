"""The plan drawing of what stands upright: modes of disparity per column, chained from column to column.

A chain is what one walks along without a jump in depth: the sides of one column, a wall and its end.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, IntArray

COLUMN_PX = 2.0
"""Columns of two pixels: a side face 12 px wide still gives six points to fit its line to."""
BIN_PX = 0.25
"""Twice the scatter of a refined disparity."""
GAP_COLUMNS = 4
"""A cable or a tube of 8 px doesn't end a chain."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """Points of one chain, by rising x: level x, level disparity, pixels that support it, each (N,)."""

    x_px: FloatArray
    d_px: FloatArray
    support: FloatArray


def modes(
    x_px: FloatArray, d_px: FloatArray, least_height: float, largest_d_px: float
) -> tuple[IntArray, FloatArray, FloatArray, float]:
    """Find, per column of the level view, the disparities at which something stands upright.

    `x_px`, `d_px` (N,) are the upright-looking pixels. A mode counts where its pixels stack up to `least_height` (in
    baselines: what stands h metres high covers h d / b pixels). Returns column numbers, disparities and support, each
    (M,), and the x of column 0.
    """
    start = float(np.floor(x_px.min()))
    column = ((x_px - start) / COLUMN_PX).astype(np.int64)
    row = np.clip((d_px / BIN_PX).astype(np.int64), 0, int(largest_d_px / BIN_PX))
    columns, rows = int(column.max()) + 1, int(largest_d_px / BIN_PX) + 1
    flat = column * rows + row
    count = np.bincount(flat, minlength=columns * rows).reshape(columns, rows).astype(np.float64)
    total: FloatArray = (
        np.bincount(flat, weights=d_px, minlength=columns * rows).reshape(columns, rows).astype(np.float64)
    )
    near_count, near_total = _windowed(count, 3), _windowed(total, 3)
    smooth: FloatArray = near_count + _windowed(count, 1)
    peak = smooth >= _running_max(smooth, 4)
    height = np.arange(rows) * BIN_PX
    peak &= near_count >= np.maximum(least_height * height[None, :] * COLUMN_PX, 12.0)
    at_column, at_row = np.nonzero(peak)
    support = near_count[at_column, at_row]
    level = near_total[at_column, at_row] / support
    # a plateau of equal bins is one mode
    fresh = np.ones(len(level), dtype=bool)
    fresh[1:] = (np.diff(at_column) > 0) | (np.diff(level) > 4 * BIN_PX)
    return at_column[fresh].astype(np.int32), level[fresh], support[fresh], start + 0.5 * COLUMN_PX - 0.5


def chains(
    columns: IntArray, d_px: FloatArray, support: FloatArray, start_px: float, jump_px: float = 0.9
) -> list[Chain]:
    """Link modes of neighbouring columns that differ from the prediction by under `jump_px`, the best links first."""
    finished: list[list[int]] = []
    active: list[list[int]] = []
    order = np.searchsorted(columns, np.arange(columns.max() + 2 if len(columns) else 1))
    for column in range(len(order) - 1):
        fresh = list(range(order[column], order[column + 1]))
        finished += [chain for chain in active if column - columns[chain[-1]] > GAP_COLUMNS]
        active = [chain for chain in active if column - columns[chain[-1]] <= GAP_COLUMNS]
        offers = sorted(
            (abs(_predict(chain, columns, d_px, column) - d_px[mode]), i, mode)
            for i, chain in enumerate(active)
            for mode in fresh
        )
        taken: set[int] = set()
        used: set[int] = set()
        for miss, i, mode in offers:
            if miss < jump_px and i not in taken and mode not in used:
                active[i].append(mode)
                taken.add(i)
                used.add(mode)
        active += [[mode] for mode in fresh if mode not in used]
    return [
        Chain(x_px=start_px + COLUMN_PX * columns[chain], d_px=d_px[chain], support=support[chain])
        for chain in (np.array(one) for one in finished + active)
        if len(chain) >= 4
    ]


def _predict(chain: list[int], columns: IntArray, d_px: FloatArray, column: int) -> float:
    last = chain[-6:]
    end = float(d_px[last[-1]])
    if len(last) < 4:
        return end
    slope = (end - float(d_px[last[0]])) / float(columns[last[-1]] - columns[last[0]])
    return end + slope * (column - float(columns[last[-1]]))


def _windowed(grid: FloatArray, half: int) -> FloatArray:
    padded = np.pad(grid, ((0, 0), (half + 1, half)))
    sums = np.cumsum(padded, axis=1)
    windowed: FloatArray = sums[:, 2 * half + 1 :] - sums[:, : -2 * half - 1]
    return windowed


def _running_max(grid: FloatArray, half: int) -> FloatArray:
    kernel = np.ones((1, 2 * half + 1), np.uint8)
    return np.asarray(cv2.dilate(grid, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0.0), dtype=np.float64)
