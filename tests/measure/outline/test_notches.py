"""An outline that turns inwards where only a mask says so has lost a part of its face."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.measure.outline.edge_evidence import is_notched
from asbuilt_bim.measure.outline.edges import Line
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline, Source

PLANE = np.array([0.0, 0.0, 30.0])
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


def with_corner_lost(width_px: float, height_px: float = 80.0) -> list[list[float]]:
    """Return the box without a piece at its foot."""
    foot = 300.0 - height_px
    return [*BOX[:3], [100.0 + width_px, 300.0], [100.0 + width_px, foot], [100.0, foot]]


def notched(outline: Outline, occluder_free_px: float = 30.0) -> bool:
    """Ask it of a face of 30 px of disparity, in whose notch `occluder_free_px` is measured."""
    disparity = np.full((400, 240), 30.0)
    disparity[:, :120] = occluder_free_px
    shape = disparity.shape
    level = SimpleNamespace(disparity_px=disparity, measured=np.ones(shape, dtype=bool), sigma_px=np.full(shape, 0.2))
    scene = SimpleNamespace(level=level, labels=np.zeros(shape, dtype=np.int32))
    camera = SimpleNamespace(f_px=1000.0, cx_px=120.0, cy_px=200.0)
    bench = SimpleNamespace(pair=SimpleNamespace(camera=camera), scene=scene)
    return is_notched(bench, outline, PLANE)  # type: ignore[arg-type]


@pytest.mark.parametrize("by_mask", [(3,), (4,), (3, 4)])
def test_a_notch_that_only_a_mask_draws_leaves_the_face_open(by_mask: tuple[int, ...]) -> None:
    assert notched(drawn(with_corner_lost(20.0), by_mask=by_mask))


def test_what_is_seen_through_a_notch_shows_that_the_face_ends_there() -> None:
    assert not notched(drawn(with_corner_lost(20.0), by_mask=(3,)), occluder_free_px=20.0)


def test_a_door_whose_sides_the_photos_show_leaves_a_wall_whole() -> None:
    assert not notched(drawn(with_corner_lost(20.0)))


def test_a_border_of_a_mask_may_be_ragged_by_what_it_errs() -> None:
    assert not notched(drawn(with_corner_lost(2.0), by_mask=(3, 4)))


def test_a_notch_of_a_hundredth_of_the_face_leaves_it_whole() -> None:
    assert not notched(drawn(with_corner_lost(6.0, 14.0), by_mask=(3, 4)))


def test_an_outline_without_a_notch_may_have_sides_that_only_a_mask_draws() -> None:
    assert not notched(drawn(BOX, by_mask=(0, 1, 2, 3)))
    assert not notched(Outline(rings=(), edges=()))
