"""Samples of a face as the picture that they are: what hangs together, and what surrounds a sample."""

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray

Indices = NDArray[np.intp]
"""Numbers of samples."""

AROUND = 5
"""Samples, along and up, of the neighbourhood of one: a quarter of a metre at the usual spacing."""


def patches(samples: CellSamples, chosen: BoolArray) -> IntArray:
    """Number the patches of chosen samples that hang together on one face: (N,), 0 where not chosen.

    A lateral surface's first and last samples lie side by side, and so hang together as well.
    """
    numbers = np.zeros(len(chosen), dtype=np.int32)
    for index in np.unique(samples.face[chosen]):
        own = np.flatnonzero(samples.face == index)
        column, row = samples.place[own].T
        grid = np.zeros((column.max() + 1, row.max() + 1), dtype=np.uint8)
        grid[column, row] = chosen[own]
        labels: IntArray = cv2.connectedComponents(grid, connectivity=4)[1].astype(np.int32)
        if _closed(samples, own, column, row):
            _join(labels, labels[[0, -1]].T)
        label = labels[column, row]
        numbers[own] = np.where(label > 0, label + numbers.max(), 0)
    return numbers


def _closed(samples: CellSamples, own: Indices, column: IntArray, row: IntArray) -> bool:
    """Say whether a face runs round and meets itself: its first and last column of samples stand side by side."""
    height = np.bincount(row).argmax()
    ends = [own[(row == height) & (column == end)] for end in (0, column.max())]
    if min(len(end) for end in ends) == 0:
        return False
    apart = np.linalg.norm(samples.points_m[ends[0][0]] - samples.points_m[ends[1][0]])
    return bool(apart < 1.5 * samples.step_m[own[0], 0])


def _join(labels: IntArray, pairs: IntArray) -> None:
    """Give the patches on the two sides of a seam, of which `pairs` (n, 2) of labels touch, one label."""
    touching = np.unique(pairs[(pairs > 0).all(axis=1)], axis=0)
    for number in range(len(touching)):
        first, second = touching[number]
        labels[labels == second] = first
        touching[touching == second] = first


def strips(samples: CellSamples, own: Indices) -> tuple[FloatArray, FloatArray]:
    """Join samples of ONE face that stand on one another to upright strips: low and high corners (n, 2) in (u, v)."""
    column, row = samples.place[own].T
    order = np.lexsort((row, column))
    column, row, sorted_ = column[order], row[order], own[order]
    new = np.concatenate([[True], (np.diff(column) != 0) | (np.diff(row) != 1)])
    first, last = np.flatnonzero(new), np.concatenate([np.flatnonzero(new)[1:] - 1, [len(own) - 1]])
    half = 0.5 * samples.step_m[own[0]]
    return samples.uv_m[sorted_[first]] - half, samples.uv_m[sorted_[last]] + half


def share_around(samples: CellSamples, flags: BoolArray, among: BoolArray) -> FloatArray:
    """Return for each sample the share (N,) of flagged ones among those `among` its neighbourhood on its face."""
    share = np.zeros(len(flags))
    for index in np.unique(samples.face[among]):
        own = np.flatnonzero(samples.face == index)
        row, column = samples.place[own].T
        sums = []
        for values in (flags & among, among):
            grid = np.zeros((row.max() + 1, column.max() + 1), dtype=np.float32)
            grid[row, column] = values[own]
            summed = cv2.boxFilter(grid, -1, (AROUND, AROUND), normalize=False, borderType=cv2.BORDER_CONSTANT)
            sums.append(summed[row, column])
        share[own] = sums[0] / np.maximum(sums[1], 1.0)
    return share


def share_along(samples: CellSamples, flags: BoolArray, among: BoolArray) -> FloatArray:
    """Return for each sample the share (N,) of flagged ones among those `among` at about its height on its face."""
    share = np.zeros(len(flags))
    for index in np.unique(samples.face[among]):
        own = np.flatnonzero(samples.face == index)
        row = samples.place[own, 1]
        sums = [np.bincount(row, weights=values[own]) for values in (flags & among, among)]
        flagged, all_ = (np.convolve(one, np.ones(AROUND))[AROUND // 2 :] for one in sums)
        share[own] = (flagged / np.maximum(all_, 1.0))[row]
    return share


def above(samples: CellSamples, flags: BoolArray) -> BoolArray:
    """Say which samples (N,) have a flagged one above them, on the same upright line of their face."""
    higher = np.zeros(len(flags), dtype=bool)
    for index in np.unique(samples.face[flags]):
        own = np.flatnonzero(samples.face == index)
        column, row = samples.place[own].T
        grid = np.zeros((column.max() + 1, row.max() + 2), dtype=bool)
        grid[column, row] = flags[own]
        so_far = np.logical_or.accumulate(grid[:, ::-1], axis=1)[:, ::-1]
        higher[own] = so_far[column, row + 1]
    return higher
