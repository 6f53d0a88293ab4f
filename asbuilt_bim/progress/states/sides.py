"""Where one side of a cell is known to be built far better than another is seen open, the other was mistaken."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray

OVERRULES = 10.0
"""Times the weight: what is seen from a third of the distance. Less is a conflict, and a person is to look."""


def mistaken(samples: CellSamples, firm: FloatArray, opened: FloatArray) -> BoolArray:
    """Say which samples (N,) are seen open while other faces of their cell are measured to be built.

    `firm` (N,) is the weight of built by measured outlines alone, `opened` that of open, both 1 / m2. A column stands
    on all of its sides or on none: past bars and rails from far off, stereo finds now and then what lies beyond it.
    """
    if not (firm.any() and opened.any()):
        return np.zeros(len(opened), dtype=bool)
    shape = (int(samples.face.max()) + 1, int(samples.cell.max()) + 1)
    by_side = [np.zeros(shape) for _ in range(2)]
    for weights, sums in zip((firm, opened), by_side, strict=True):
        np.add.at(sums, (samples.face, samples.cell), weights)
    standing, seen_open = by_side
    elsewhere = standing.sum(axis=0) - standing
    outweighed = elsewhere >= OVERRULES * seen_open.sum(axis=0)
    overruled: BoolArray = (opened > 0.0) & outweighed[samples.face, samples.cell]
    return overruled
