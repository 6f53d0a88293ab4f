"""The foot of a straight face: what hangs from it is floor, steps of it are concrete."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.measure.outline.straight import _without_tabs


def region(*feet: tuple[int, int]) -> np.ndarray:
    """Return a region of pieces side by side, (width, foot) each, all from row 5 on."""
    pieces = [
        np.repeat((np.arange(100) >= 5)[:, None] & (np.arange(100) < foot)[:, None], w, axis=1) for w, foot in feet
    ]
    return np.concatenate(pieces, axis=1)


def test_a_tab_below_the_foot_is_cut_to_the_lower_of_its_neighbours() -> None:
    assert (_without_tabs(region((10, 60), (20, 68), (10, 62)), 15.0) == region((10, 60), (20, 62), (10, 62))).all()


@pytest.mark.parametrize(
    "feet",
    [
        ((10, 60), (20, 68)),
        ((10, 60), (10, 64), (10, 68)),
        ((10, 60), (20, 30), (10, 62)),
        ((10, 60), (9, 90), (8, 60)),
    ],
    ids=["a step", "stairs", "a doorway", "a lift lower"],
)
def test_steps_doorways_and_what_is_a_lift_lower_stay(feet: tuple[tuple[int, int], ...]) -> None:
    assert (_without_tabs(region(*feet), 15.0) == region(*feet)).all()
