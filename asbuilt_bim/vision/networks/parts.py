"""Parts of walls and columns: connected pixels of one pile of votes, one surface and one class, and what they are like.

A part is as large as what is surely one instance; `part_affinity.py` says which parts belong together.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.vision.networks.map_geometry import Relief

LEAST_PIXELS = 12
"""A part of fewer pixels goes with the nearest one."""
MOST_PARTS = 96
"""More parts than this are noise: the smallest go with the nearest one."""
REACH_PX = 4.0
"""How far the nearest may be; crumbs that stand alone are dropped."""
MOST_SPOTS = 240
"""Pixels that a part's plane and the misses from other planes are measured at."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """What is known of a part, in pixels of the small map.

    `spots` (M, 3): columns, rows and 1 of some of its measured pixels; `inverse` (M,) their 1/Z; `plane` (3,) fits it.
    """

    size: int
    box: tuple[float, float, float, float]  # x0, y0, x1, y1
    vote: FloatArray  # (2,) where its pixels vote, and how far from it by median
    spread: float
    column: float  # 0..1: how much likelier a column than a wall
    spots: FloatArray
    inverse: FloatArray
    plane: FloatArray

    @property
    def measured(self) -> bool:
        """Say whether stereo knows enough of the part."""
        return len(self.inverse) >= LEAST_PIXELS // 2

    def misses(self, other: Part) -> float:
        """Return by which share of its 1/Z this part lies nearer than the other's plane, the median over its pixels."""
        return float(np.median((self.inverse - self.spots @ other.plane) / self.inverse))


def numbered_parts(key: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the connected parts (h, w) of pixels with the same `key` (h, w), -1 nothing; crumbs join the nearest."""
    found: list[tuple[int, tuple[slice, slice], BoolArray]] = []
    for value in np.unique(key[key >= 0]):
        own = key == value
        x, y, width, height = cv2.boundingRect(own.view(np.uint8))
        window = (slice(y, y + height), slice(x, x + width))
        count, labels, stats, _ = cv2.connectedComponentsWithStats(own[window].view(np.uint8), connectivity=4)
        for k in range(1, count):
            size = int(stats[k, cv2.CC_STAT_AREA])
            if size >= LEAST_PIXELS:
                found.append((size, window, np.asarray(labels == k)))
    number = np.full(key.shape, -1, dtype=np.int32)
    for k, (_, window, own) in enumerate(sorted(found, key=lambda part: -part[0])[:MOST_PARTS]):
        number[window][own] = k
    return with_crumbs(number, key >= 0)


def with_crumbs(number: NDArray[np.int32], inside: BoolArray) -> NDArray[np.int32]:
    """Return numbers (h, w) in which the pixels `inside` that have none took the nearest one's, within reach."""
    empty = (number < 0).astype(np.uint8)
    if empty.all() or not empty.any():
        return number
    away, seeds = cv2.distanceTransformWithLabels(empty, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    number_of_seed = np.full(int(np.max(seeds)) + 1, -1, dtype=np.int32)
    number_of_seed[np.asarray(seeds)[empty == 0]] = number[empty == 0]
    return np.where(inside & (np.asarray(away) < REACH_PX), number_of_seed[seeds], -1)


def described(
    number: NDArray[np.int32], votes: Float32Array, against: Float32Array, relief: Relief | None
) -> list[Part]:
    """Describe each part of `number` (h, w); `votes` (2, h, w), `against` (h, w) the logarithm of wall over column."""
    found: list[Part] = []
    for k in range(int(number.max()) + 1):
        rows, columns = np.nonzero(number == k)
        vote = np.median(votes[:, rows, columns], axis=1).astype(np.float64)
        away = np.hypot(votes[0, rows, columns] - vote[0], votes[1, rows, columns] - vote[1])
        spots, inverse, plane = _surface(rows, columns, relief)
        found.append(
            Part(
                size=len(rows), vote=vote, spread=float(np.median(away)), spots=spots, inverse=inverse, plane=plane,
                box=(float(columns.min()), float(rows.min()), float(columns.max()), float(rows.max())),
                column=float(1.0 / (1.0 + np.exp(np.clip(against[rows, columns].mean(), -30.0, 30.0)))),
            )
        )  # fmt: skip
    return found


def gaps(number: NDArray[np.int32], count: int) -> FloatArray:
    """Return (N, N) how far in pixels two parts are from each other at the nearest; 1 where they touch."""
    inside = np.flatnonzero(number.ravel() >= 0)
    order = inside[np.argsort(number.ravel()[inside], kind="stable")]
    starts = np.searchsorted(number.ravel()[order], np.arange(count))
    found = np.zeros((count, count))
    for k in range(count):
        away = cv2.distanceTransform((number != k).view(np.uint8), cv2.DIST_L2, 3)
        found[k] = np.minimum.reduceat(np.asarray(away).ravel()[order], starts)
    return found


def _surface(
    rows: NDArray[np.intp], columns: NDArray[np.intp], relief: Relief | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return spots, their 1/Z, and the plane through them; nothing where stereo knows too little."""
    inverse, known = np.zeros(0), np.zeros(0, dtype=np.intp)
    if relief is not None:
        inverse = relief.inverse_depth_per_m[rows, columns].astype(np.float64)
        known = np.flatnonzero(inverse > 0.0)
    if len(known) < LEAST_PIXELS // 2:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(3)
    known = known[:: max(1, len(known) // MOST_SPOTS)]
    spots = np.stack([columns[known], rows[known], np.ones(len(known))], axis=1).astype(np.float64)
    values = inverse[known]
    plane = np.linalg.lstsq(spots, values, rcond=None)[0]
    miss = np.abs(spots @ plane - values)
    near = miss <= 2.0 * np.median(miss) + 1e-9  # once more without what stands before it or behind
    return spots, values, np.asarray(np.linalg.lstsq(spots[near], values[near], rcond=None)[0])
