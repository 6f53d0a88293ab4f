"""What counts as hidden: a thing nearer than the face beside its outline, along enough of it or of one of its sides."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.measure.outline.edges import EdgeFit, Line
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline, Source
from asbuilt_bim.measure.outline.occlusion import how_seen

HEIGHT, WIDTH = 700, 160
LEFT, RIGHT, TOP, FOOT = 50, 110, 40, 640
FACE_PX, BARS = 30.0, 9
PLANE = np.array([0.0, 0.0, FACE_PX])


def bench() -> SimpleNamespace:
    """Return a workbench with a face of 60 x 600 px and nothing measured around it."""
    measured = np.zeros((HEIGHT, WIDTH), dtype=bool)
    measured[TOP:FOOT, LEFT:RIGHT] = True
    level = SimpleNamespace(
        disparity_px=np.full((HEIGHT, WIDTH), FACE_PX), sigma_px=np.full((HEIGHT, WIDTH), 0.1), measured=measured
    )
    pair = SimpleNamespace(
        camera=SimpleNamespace(f_px=1000.0, cx_px=80.0, cy_px=350.0), valid_right=np.ones((HEIGHT, WIDTH), dtype=bool)
    )
    scene = SimpleNamespace(level=level, labels=np.full((HEIGHT, WIDTH), -1, dtype=np.int16), bars_label=BARS)
    return SimpleNamespace(pair=pair, scene=scene, frame=np.zeros((HEIGHT, WIDTH), dtype=bool))


def outline(foot: Source = "photo") -> Outline:
    """Return the face's outline, its foot put there by `foot`."""
    ring = np.array([[LEFT, TOP], [RIGHT, TOP], [RIGHT, FOOT], [LEFT, FOOT]]) - 0.5
    edges = []
    for number, (start, stop) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
        line = Line(start=start, stop=stop)
        fit = EdgeFit(line=line, sigma_px=0.2, strength=0.6, contrast=5.0, disparity_miss_px=0.0, miss_sigma_px=0.2)
        source: Source = foot if number == 2 else "photo"
        edges.append(
            FaceEdge(
                line=line, sigma_px=0.2, source=source, course="upright" if number % 2 else "level", neighbour=-1,
                fit=fit if source == "photo" else None,
            )
        )  # fmt: skip
    return Outline(rings=(ring,), edges=tuple(edges))


def put(on: SimpleNamespace, rows: slice, columns: slice, step_px: float) -> None:
    """Measure something there, nearer than the face by a step in disparity."""
    on.scene.level.measured[rows, columns] = True
    on.scene.level.disparity_px[rows, columns] = FACE_PX + step_px


def hidden(on: SimpleNamespace, foot: Source = "photo") -> bool:
    return how_seen(on, outline(foot), PLANE).occluded  # type: ignore[arg-type]


def test_a_face_with_nothing_measured_around_it_is_not_hidden() -> None:
    assert not hidden(bench())


@pytest.mark.parametrize(("width_px", "is_hidden"), [(36, True), (20, False)])
def test_a_foot_with_a_near_thing_along_half_of_it_is_hidden_however_tall_the_face(
    width_px: int, is_hidden: bool
) -> None:
    on = bench()
    put(on, slice(FOOT, FOOT + 40), slice(LEFT, LEFT + width_px), 20.0)
    assert hidden(on) is is_hidden


@pytest.mark.parametrize(("step_px", "is_hidden"), [(20.0, True), (4.0, False)])
def test_one_place_is_enough_for_a_clear_step_alone(step_px: float, is_hidden: bool) -> None:
    on = bench()
    put(on, slice(FOOT + 2, FOOT + 4), slice(LEFT, RIGHT), step_px)
    assert hidden(on) is is_hidden


@pytest.mark.parametrize(("foot", "is_hidden"), [("mask", True), ("photo", False)])
def test_past_a_border_that_only_a_mask_draws_the_first_thing_measured_counts(foot: Source, is_hidden: bool) -> None:
    on = bench()
    put(on, slice(FOOT + 7, FOOT + 40), slice(LEFT, RIGHT), 20.0)
    assert hidden(on, foot) is is_hidden


def test_bars_past_a_masks_border_hide_nothing() -> None:
    on = bench()
    put(on, slice(FOOT + 7, FOOT + 40), slice(LEFT, RIGHT), 20.0)
    on.scene.labels[FOOT:] = BARS
    assert not hidden(on, "mask")


def test_a_floor_that_rises_from_the_foot_hides_nothing() -> None:
    on = bench()
    for row in range(FOOT, FOOT + 40):
        put(on, slice(row, row + 1), slice(LEFT, RIGHT), 0.3 * (row - FOOT))
    assert not hidden(on, "mask")
