"""Where an upright surface meets the floor that it stands on: nothing of it is seen beneath that floor.

In the shade at a foot the floor looks like the wall, and the matcher carries the wall on over it for up to its window
and its smoothness. What is labelled so lies behind the floor's plane, where the floor itself hides it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.floors import Floor
from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import LevelledMap
from asbuilt_bim.geometry.masks import box_of

BENEATH_PX = 0.4
"""How far both planes may be off in disparity together: some 2 to 3 rows at the foot."""
MOST_CARRIED_PX = 4.0
"""The matcher carries a surface some 25 rows at the most, over which a floor comes nearer by this. What lies further
behind a floor's plane stands lower, and is seen past that floor's end."""
CARRIED_SHARE = 0.95
BELOW_PX = (3, 12)
LEAST_FLOOR = 0.3
"""Of what lies just below must be that floor: else the piece doesn't stand on it."""
LEAST_BELOW_CAMERA_M = 0.3
"""A floor at the camera's own height is seen edge-on: its plane's picture is a line."""


def footed(
    labels: NDArray[np.int16], level: LevelledMap, pieces: Sequence[Piece], floors: Sequence[Floor]
) -> NDArray[np.int16]:
    """Give the floor back what of a flat upright piece is labelled (H, W) beneath the floor that it stands on."""
    found = labels.copy()
    standing = [(len(pieces) + k, floor) for k, floor in enumerate(floors) if floor.below_m > LEAST_BELOW_CAMERA_M]
    for number, piece in enumerate(pieces):
        if piece.circle is not None:
            continue
        own = np.asarray(found == number)
        rows, columns = box_of(own)
        box = (slice(rows.start, rows.stop + BELOW_PX[1]), columns)
        rays = level.rays[box]
        upright = rays @ level.view.q_upright(piece.slope, piece.offset_px)
        for label, floor in standing:
            behind = rays @ floor.q_px - upright
            beneath = (found[box] == number) & (behind > BENEATH_PX)
            if beneath.any() and _stands_on(beneath, behind, found[box], number, label):
                found[box][beneath] = label
    return found


def _stands_on(
    beneath: BoolArray, behind: NDArray[np.float64], labels: NDArray[np.int16], number: int, label: int
) -> bool:
    """Say whether a piece stands on the floor `label`: it lies below most of what is `beneath`, and that isn't far."""
    if float(np.quantile(behind[beneath], CARRIED_SHARE)) > MOST_CARRIED_PX:
        return False
    columns = np.flatnonzero(beneath.any(axis=0))
    lowest = len(beneath) - 1 - np.argmax(beneath[::-1, columns], axis=0)
    rows = np.minimum(lowest[:, None] + np.arange(*BELOW_PX), len(beneath) - 1)
    below = labels[rows, columns[:, None]]
    below = below[below != number]
    return bool(below.size and np.mean(below == label) > LEAST_FLOOR)
