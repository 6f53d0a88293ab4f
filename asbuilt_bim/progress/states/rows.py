"""The rows of an element's cells, each about one sample high: which samples lie in each, and what they say of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.cells import cell_numbers, cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray
from asbuilt_bim.geometry.cylinder import CylinderFrame

ROUND_SIDES = 8
"""Sides that a round column is taken to have: no station sees half of it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Side:
    """A side of an element, a face or a part of a lateral surface: its `samples` (n,), and the row (n,) of each."""

    face: int
    samples: IntArray
    row: IntArray
    shape: tuple[int, int]

    def count(self, of: BoolArray | FloatArray) -> FloatArray:
        """Add up what is said of each sample (N,) of the element by rows: (nx, rows)."""
        weights = of[self.samples].astype(np.float64)
        total = np.bincount(self.row, weights=weights, minlength=self.shape[0] * self.shape[1])
        return total.reshape(self.shape).astype(np.float64)

    def share(self, of: BoolArray | FloatArray) -> FloatArray:
        """Return the mean of what is said of each sample (N,) by rows: (nx, rows), 0 where there is none."""
        mean: FloatArray = self.count(of) / np.maximum(self.count(np.ones(len(of))), 1.0)
        return mean


def rows_shape(element: BimElement, spacing_m: float) -> tuple[int, int]:
    """Return how many upright lines of cells an element has, and rows in each: a row is about a sample high."""
    lines, cells = element_cells(element).shape
    return lines, cells * max(1, round(element.height_m / cells / spacing_m))


def sides_of(element: BimElement, spacing_m: float) -> Iterator[Side]:
    """Return the sides that show anything of an element, face by face."""
    samples, shape = cell_samples(element, spacing_m), rows_shape(element, spacing_m)
    row = cell_numbers(element, samples.points_m, shape)
    for index, face in enumerate(element.faces):
        own = np.flatnonzero(samples.face == index)
        part = np.zeros(len(own), dtype=int)
        if isinstance(face.frame, CylinderFrame):
            turns = samples.uv_m[own, 0] / face.frame.radius_m / (2.0 * np.pi) + 0.5
            part = np.floor(turns * ROUND_SIDES).astype(int)
        for number in np.unique(part):
            some = own[part == number]
            yield Side(face=index, samples=some, row=row[some], shape=shape)


def and_under(rows: BoolArray) -> BoolArray:
    """Return each of the rows (nx, rows), and all under it."""
    return np.logical_or.accumulate(rows[:, ::-1], axis=1)[:, ::-1]


def row_log_odds(sides: Sequence[Side], odds: FloatArray) -> FloatArray:
    """Return how clearly a face's rows are built or open: mean log-odds of its samples (N,) in whole nats.

    (sides * nx, rows), 0 where this visit shows nothing.
    """
    rows = [side.share(odds) for side in sides]
    found: FloatArray = np.concatenate(rows) if rows else np.zeros((0, 0))
    return np.asarray(np.round(found) + 0.0)  # never -0.0


def of_sides(rows: FloatArray | None, sides: Sequence[Side]) -> FloatArray | None:
    """Return a face's rows by its sides, (sides, nx, rows); None where they are of another form, or nobody knows."""
    if rows is None or not sides or rows.shape != (len(sides) * sides[0].shape[0], sides[0].shape[1]):
        return None
    return rows.reshape(len(sides), *sides[0].shape)
