"""Bounds on outlines that somebody gives: what crosses itself all over is no outline, and takes hours to fill."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.errors import MaskError
from asbuilt_bim.geometry.polygon import Rings, crossings
from asbuilt_bim.vision.masks.given import GivenMask

MAX_POINTS = 200_000
"""Of all masks of a photo: the outlines of a whole photo, pixel by pixel."""
MAX_POLYGONS = 2_000
MAX_CROSSINGS = 100
"""Slips of a hand or of a simplified outline are a few; mending takes seconds from a thousand on."""
MAX_CROSSING_POINTS = 10_000
MAX_LENGTH_PX = 1_000_000.0
"""Of all outlines together: each is walked in steps of 8 px through the lens."""


def check_outlines(masks: Sequence[GivenMask]) -> None:
    """Refuse masks whose polygons can't be filled in time.

    Raises:
        MaskError: there are too many polygons or points, or an outline is too long or crosses itself too often.
    """
    outlines = [(mask.name, rings) for mask in masks for rings in mask.polygons]
    points = sum(len(ring) for _, rings in outlines for ring in rings)
    if len(outlines) > MAX_POLYGONS or points > MAX_POINTS:
        raise MaskError(
            f"{len(outlines):,} polygons with {points:,} points (limits {MAX_POLYGONS:,} and {MAX_POINTS:,}); "
            "simplify them"
        )
    length_px = sum(_length_px(rings) for _, rings in outlines)
    if length_px > MAX_LENGTH_PX:
        raise MaskError(f"outlines of {length_px:,.0f} px together (limit {MAX_LENGTH_PX:,.0f} px); simplify them")
    for name, rings in outlines:
        count = crossings(rings, MAX_CROSSINGS, MAX_CROSSING_POINTS)
        if count > MAX_CROSSINGS:
            raise MaskError(f"{name}: its outline crosses itself more than {MAX_CROSSINGS} times; draw it again")


def _length_px(rings: Rings) -> float:
    return float(sum(np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).sum() for ring in rings))
