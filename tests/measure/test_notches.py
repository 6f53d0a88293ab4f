"""An outline that turns inwards where only a mask says so has lost a part of its face."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.measure.edges import Line
from asbuilt_bim.measure.notches import is_notched
from asbuilt_bim.measure.outline import FaceEdge, Outline, Source

BOX = [[100.0, 100.0], [140.0, 100.0], [140.0, 300.0], [100.0, 300.0]]


def drawn(ring: list[list[float]], *, by_mask: tuple[int, ...] = ()) -> Outline:
    """Return an outline whose sides the photos show, but for those numbered in `by_mask`."""
    corners = np.array(ring)
    edges = []
    for number, (start, stop) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        source: Source = "mask" if number in by_mask else "photo"
        line = Line(start=start, stop=stop)
        edges.append(FaceEdge(line=line, sigma_px=0.2, source=source, course="upright", neighbour=-1, fit=None))
    return Outline(rings=(corners,), edges=tuple(edges))


def with_corner_lost(width_px: float) -> list[list[float]]:
    """Return the box without a piece 80 px high at its foot."""
    return [*BOX[:3], [100.0 + width_px, 300.0], [100.0 + width_px, 220.0], [100.0, 220.0]]


@pytest.mark.parametrize("by_mask", [(3,), (4,), (3, 4)])
def test_a_notch_that_only_a_mask_draws_leaves_the_face_open(by_mask: tuple[int, ...]) -> None:
    assert is_notched(drawn(with_corner_lost(20.0), by_mask=by_mask))


def test_a_door_whose_sides_the_photos_show_leaves_a_wall_whole() -> None:
    assert not is_notched(drawn(with_corner_lost(20.0)))


def test_a_border_of_a_mask_may_be_ragged_by_what_it_errs() -> None:
    assert not is_notched(drawn(with_corner_lost(2.0), by_mask=(3, 4)))


def test_an_outline_without_a_notch_may_have_sides_that_only_a_mask_draws() -> None:
    assert not is_notched(drawn(BOX, by_mask=(0, 1, 2, 3)))
    assert not is_notched(Outline(rings=(), edges=()))
