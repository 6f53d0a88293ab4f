"""Instances from their centres: each pixel of a wall or column says where the middle of its instance lies.

The votes are piled up, the piles are the instances, and each pixel goes with the pile that it votes for. So pieces of
one wall to the left and right of a column stay one instance, and two walls that touch are two.

Reference: Cheng et al. 2020, Panoptic-DeepLab (offsets to centres); here the piles are found in the votes themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array

SPREAD = 1.0 / 80.0
"""Standard deviation, as a share of the map's width, of the smoothing that makes piles of votes, and the least width of
a pile."""
LEAST_SHARE = 1.0 / 1000.0
"""A thing of fewer pixels, as a share of the map's, is a crumb."""
ONE_INSTANCE = 1.7
"""Two piles nearer to each other than this many standard deviations of either one's own pixels are one instance.

Those of two things side by side are 3.5 apart (a bar's standard deviation is its length / 3.5), of pieces of one
instance 0.
"""
WINDOW_PX = 5
"""Side of the window that pixels choose their pile together in."""
MOST_MISFIT = 36.0
"""Six standard deviations off is off: one stray vote mustn't outweigh its neighbours."""
MISFIT = np.float32(1e4)
"""Of a pixel that is known to be another thing's."""
MOST_PILES = 64
"""More things than this in one photo are noise: the highest piles count."""
MOST_VOTES = 6000
"""Votes that the piles' middles and widths are measured by."""
PASSED_ON = 1
"""Times that a vote is passed on by the pixel that it falls on; further rounds gain nothing."""
ROUNDS = 2
"""Times that pixels choose among the piles; from the second on by the piles' widths too: large things scatter more."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Groups:
    """Pixels of a small map by thing: `number` int32 (h, w), -1 nothing.

    `misfit` float32 (N, h, w) says how badly each pixel's vote fits each thing, in squared standard deviations.
    """

    number: NDArray[np.int32]
    misfit: Float32Array

    def lead(self) -> Float32Array:
        """Return (N, h, w) how much better a pixel fits a thing than any other; 0 where one ends and another starts."""
        if len(self.misfit) < 2:
            return np.full_like(self.misfit, np.inf)
        first, second = np.partition(self.misfit, 1, axis=0)[:2]
        return np.asarray(np.where(self.misfit > first, first, second) - self.misfit)

    def renumbered(self, number: NDArray[np.int32]) -> Groups:
        """Return the things by another numbering (h, w) of the same pixels: some made one, some divided."""
        there = number >= 0
        kept, parts = np.unique(number[there], return_inverse=True)
        if len(kept) == len(self.misfit) and np.array_equal(parts, self.number[there]):
            return self
        ordered = np.full(number.shape, -1, dtype=np.int32)
        ordered[there] = parts
        misfit = np.empty((len(kept), *number.shape), dtype=np.float32)
        for k, row in enumerate(misfit):
            members = np.unique(self.number[ordered == k])
            self.misfit[members].min(axis=0, out=row)
            row[np.isin(self.number, members) & there & (ordered != k)] = MISFIT
        return Groups(number=ordered, misfit=misfit)


def grouped(concrete: BoolArray, offsets: Float32Array) -> Groups:
    """Group the pixels `concrete` (h, w) of a small map by where they vote; `offsets` (2, h, w) in its pixels."""
    votes = _votes(concrete, offsets)
    least, spread = max(4, round(LEAST_SHARE * concrete.size)), SPREAD * concrete.shape[1]
    spots = np.argwhere(concrete)[:, ::-1].astype(np.float32)
    own = votes[:, concrete].T
    centres = _piles(own, concrete.shape, spread, least)
    thin = max(1, len(own) // MOST_VOTES)  # all make the piles, some are enough to measure them by
    own, spots, least = own[::thin], spots[::thin], max(4, least // thin)
    widths = np.full(len(centres), spread, dtype=np.float32)
    while len(centres):
        for _ in range(ROUNDS):
            chosen = _misfit(own.T, centres, widths).argmin(axis=0)
            counts = np.bincount(chosen, minlength=len(centres))
            centres, widths = _settled(own, chosen, centres, spread)
        into = _joined(spots, chosen, centres, counts >= least)
        if into is None:
            break
        chosen = into[chosen]
        kept = np.unique(into[into >= 0])
        centres = np.stack([np.median(own[chosen == k], axis=0) for k in kept]) if len(kept) else centres[:0]
        widths = np.full(len(centres), spread, dtype=np.float32)
    number = np.full(concrete.shape, -1, dtype=np.int32)
    misfit = _smoothed(_misfit(votes, centres, widths), concrete)
    if len(centres):
        number[concrete] = misfit[:, concrete].argmin(axis=0)
    return Groups(number=number, misfit=misfit).renumbered(number)  # without piles that no pixel chose


def _votes(concrete: BoolArray, offsets: Float32Array) -> Float32Array:
    """Return where each pixel votes (2, h, w), the pixels that it votes for having their say in turn.

    A network that isn't sure points towards the middle and falls short of it; what lies there points on. A vote that
    falls on no wall and no column stays.
    """
    height, width = concrete.shape
    votes = offsets.copy()
    votes[0] += np.arange(width, dtype=np.float32)
    votes[1] += np.arange(height, dtype=np.float32)[:, None]
    for _ in range(PASSED_ON):
        columns = np.clip(np.rint(votes[0]), 0, width - 1).astype(np.intp)
        rows = np.clip(np.rint(votes[1]), 0, height - 1).astype(np.intp)
        votes += offsets[:, rows, columns] * concrete[rows, columns]
    return votes


def _misfit(votes: Float32Array, centres: Float32Array, widths: Float32Array) -> Float32Array:
    """Return (N, ...) how badly votes (2, ...) fit each pile, as its squared standard deviations, widths weighed in."""
    found = np.empty((len(centres), *votes.shape[1:]), dtype=np.float32)
    for row, (x, y), width in zip(found, centres, widths, strict=True):
        away = np.square(votes[0] - x) + np.square(votes[1] - y)
        np.multiply(away, np.float32(1.0 / width**2), out=row)
        row += np.float32(4.0 * np.log(width))  # a normal distribution's height in two dimensions
    return found


def _smoothed(misfit: Float32Array, concrete: BoolArray) -> Float32Array:
    """Return misfits (N, h, w) as means over a window's walls and columns: neighbours are mostly of one instance."""
    side = (WINDOW_PX, WINDOW_PX)
    weight = concrete.astype(np.float32)
    share = np.maximum(cv2.blur(weight, side), 1e-3)
    for row in misfit:
        np.minimum(row, row.min() + MOST_MISFIT, out=row)
        row[:] = np.where(concrete, cv2.blur(row * weight, side) / share, row)
    return misfit


def _piles(votes: Float32Array, shape: tuple[int, ...], spread: float, least: int) -> Float32Array:
    """Return the places (N, 2) where votes (M, 2) pile up."""
    height, width = shape
    cells = np.clip(np.rint(votes), 0, [width - 1, height - 1]).astype(np.intp)
    heap = np.bincount(cells[:, 1] * width + cells[:, 0], minlength=height * width).astype(np.float32)
    heap = np.asarray(cv2.GaussianBlur(heap.reshape(height, width), (0, 0), spread), dtype=np.float32)
    reach = 2 * round(2.0 * spread) + 1
    crest = cv2.dilate(heap, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach)))
    low = 0.25 * least / (2.0 * np.pi * spread**2)  # a quarter of the smallest thing's votes at one place
    tops = np.argwhere((heap >= crest) & (heap > low))
    highest = np.argsort(-heap[tops[:, 0], tops[:, 1]], kind="stable")[:MOST_PILES]
    return tops[highest, ::-1].astype(np.float32)


def _settled(
    votes: Float32Array, chosen: NDArray[np.intp], centres: Float32Array, spread: float
) -> tuple[Float32Array, Float32Array]:
    """Return each pile's middle and width, by medians of its votes."""
    middles, widths = centres.copy(), np.full(len(centres), spread, dtype=np.float32)
    for k in range(len(centres)):
        own = votes[chosen == k]
        if len(own):
            middles[k] = np.median(own, axis=0)
            away = np.hypot(*(own - middles[k]).T)
            widths[k] = max(spread, float(np.median(away)) / 1.18)  # of a normal distribution in two dimensions
    return middles, widths


def _joined(
    spots: Float32Array, chosen: NDArray[np.intp], centres: Float32Array, large: BoolArray
) -> NDArray[np.intp] | None:
    """Return which pile each pile becomes, -1 none; None where all stay.

    `spots` (M, 2) are the voting pixels themselves, whose scatter is the size of their thing.
    """
    count = len(centres)
    into = np.where(large, np.arange(count), -1)
    inverse = np.zeros((count, 2, 2))
    for k in np.flatnonzero(large):
        own = (spots[chosen == k] - centres[k]).astype(np.float64)
        inverse[k] = np.linalg.inv(own.T @ own / len(own) + np.eye(2) / 12.0)  # a pixel's own size
    for one in np.flatnonzero(large):
        for other in np.flatnonzero(large[:one]):
            apart = (centres[one] - centres[other]).astype(np.float64)
            far = max(float(apart @ inverse[k] @ apart) for k in (one, other))
            if far < ONE_INSTANCE**2:
                into[into == into[one]] = into[other]
    return None if np.array_equal(into, np.arange(count)) else into
