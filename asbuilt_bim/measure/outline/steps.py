"""Borders that run straight and step seldom: the cheapest one by dynamic programming over all of them."""

from itertools import pairwise

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, IntArray

JUMP_COST = 12.0
JUMP_SHARE = 0.10
"""A step must gain what 8 rows with a clear edge do, and more on a long border: notches in concrete are seldom."""
VOTE_WEIGHT = 1.5
"""A clear edge outweighs 5 pixels of the matcher's answer."""


def straight_region(
    cost: Float32Array, edge_across: Float32Array, edge_along: Float32Array, own: BoolArray
) -> BoolArray:
    """Return the region (h, w) with stepwise straight borders that fits the costs and the edges' votes 0..1 best.

    `edge_across` votes for upright borders, `edge_along` for level ones. Gaps of `own` within a row and a column are
    taken as face here: openings are looked for afterwards.
    """
    rows, columns = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
    if rows.size < 3 or columns.size < 3:
        return own
    left, right = _both_borders(_bridged(cost, own), edge_across, own)
    top, foot = _both_borders(_bridged(cost.T, own.T), edge_along.T, own.T)
    h, w = cost.shape
    x, y = np.arange(w)[None, :], np.arange(h)[:, None]
    region: BoolArray = (x >= left[:, None]) & (x < right[:, None]) & (y >= top[None, :]) & (y < foot[None, :])
    return region


def _bridged(cost: Float32Array, own: BoolArray) -> Float32Array:
    """Count what lies between a row's first and last face pixel as face."""
    any_row = own.any(axis=1)
    first = np.where(any_row, np.argmax(own, axis=1), own.shape[1])
    last = np.where(any_row, own.shape[1] - 1 - np.argmax(own[:, ::-1], axis=1), -1)
    x = np.arange(own.shape[1])[None, :]
    between = (x >= first[:, None]) & (x <= last[:, None])
    return np.where(between, np.minimum(cost, -0.1), cost).astype(np.float32)


def _both_borders(cost: Float32Array, votes: Float32Array, own: BoolArray) -> tuple[IntArray, IntArray]:
    """Return per row the first column of the face and the one after its last."""
    h, w = cost.shape
    middle = _middle_column(own)
    sums = np.concatenate([np.zeros((h, 1), np.float32), np.cumsum(cost, axis=1, dtype=np.float32)], axis=1)
    # a border at x lies on the edge between pixels x - 1 and x
    at_edge = np.zeros((h, w + 1), np.float32)
    at_edge[:, 1:w] = np.maximum(votes[:, 1:], votes[:, :-1])
    rows = np.flatnonzero(own.any(axis=1))
    inside = slice(int(rows[0]), int(rows[-1]) + 1)
    left_cost = (sums[:, middle : middle + 1] - sums[:, : middle + 1]) - VOTE_WEIGHT * at_edge[:, : middle + 1]
    right_cost = (sums[:, middle:] - sums[:, middle : middle + 1]) - VOTE_WEIGHT * at_edge[:, middle:]
    left, right = np.zeros(h, np.int32), np.zeros(h, np.int32)
    left[inside] = _cheapest(left_cost[inside])
    right[inside] = middle + _cheapest(right_cost[inside])
    left[: inside.start], left[inside.stop :] = left[inside.start], left[inside.stop - 1]
    right[: inside.start], right[inside.stop :] = right[inside.start], right[inside.stop - 1]
    return left, right


def _middle_column(own: BoolArray) -> int:
    """Return the median of the pixels' columns, rounded down."""
    upto = np.cumsum(np.count_nonzero(own, axis=0))
    half = [(upto[-1] - 1) // 2, upto[-1] // 2]  # the two in the middle, of an even number
    return int(np.searchsorted(upto, half, side="right").sum() // 2)


def _cheapest(cost: Float32Array) -> IntArray:
    """Return the path (h,) through costs (h, n) that stays or pays for a step, by dynamic programming."""
    h = len(cost)
    step = JUMP_COST + JUMP_SHARE * h
    total = cost.astype(np.float64)  # of the cheapest path to each place, added up row by row
    for before, here in pairwise(total):  # few steps, for this loop runs over every row of every face
        here += np.minimum(before, before[before.argmin()] + step)
    best = total.argmin(axis=1)
    path = np.full(h, best[-1], dtype=np.int32)
    jumped = total[:-1] > total[np.arange(h - 1), best[:-1], None] + step
    row = h - 1
    while (leaps := np.flatnonzero(jumped[:row, path[row]])).size:  # from the foot up, from leap to leap
        row = int(leaps[-1])
        path[: row + 1] = best[row]
    return path


def edge_votes(left: Float32Array, right: Float32Array, texture_grey: float) -> tuple[Float32Array, Float32Array]:
    """Return votes 0..1 (h, w) for upright and for level edges that both pictures of a raster show alike."""
    smooth, votes = [cv2.GaussianBlur(image, (0, 0), 0.8) for image in (left, right)], list[Float32Array]()
    for dx, dy in ((1, 0), (0, 1)):
        one, other = (np.asarray(cv2.Sobel(image, cv2.CV_32F, dx, dy, ksize=3, scale=0.125)) for image in smooth)
        agreed = np.where(one * other > 0.0, np.minimum(np.abs(one), np.abs(other)), 0.0) ** 2
        votes.append((agreed / (agreed + texture_grey**2)).astype(np.float32))
    return votes[0], votes[1]
