"""What proves that a face ends where its outline does: another depth or surface beyond it, or a plain edge."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import level_view, pixel_rays
from asbuilt_bim.measure.outline.edge_evidence import is_open
from asbuilt_bim.measure.outline.edges import EdgeFit, Line
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline, Source
from asbuilt_bim.measure.workbench import samples_of

SIZE = 240
LOW, HIGH = 80, 160
FACE_PX, BEHIND_PX = 30.0, 8.0
PLANE = np.array([0.0, 0.0, FACE_PX])
OWN, BARS = 3, 9


def scene() -> SimpleNamespace:
    """Return a workbench with a square face of 80 px before a measured background."""
    disparity = np.full((SIZE, SIZE), BEHIND_PX)
    labels = np.full((SIZE, SIZE), -1, dtype=np.int16)
    inside = slice(LOW, HIGH)
    disparity[inside, inside], labels[inside, inside] = FACE_PX, OWN
    level = SimpleNamespace(
        disparity_px=disparity, sigma_px=np.full((SIZE, SIZE), 0.1), measured=np.ones((SIZE, SIZE), dtype=bool),
        rays=pixel_rays(SIZE, SIZE, 1000.0, 120.0, 120.0), view=level_view([0.0, -1.0, 0.0], 1000.0),
    )  # fmt: skip
    camera = SimpleNamespace(f_px=1000.0, cx_px=120.0, cy_px=120.0)
    return SimpleNamespace(
        pair=SimpleNamespace(camera=camera),
        scene=SimpleNamespace(
            level=level, labels=labels, pieces=(), pixels=lambda n: np.nonzero(labels == n), bars_label=BARS
        ),
        samples={},
        frame=np.zeros((SIZE, SIZE), dtype=bool),
        grey_levels=(np.full((SIZE, SIZE), 90.0, dtype=np.float32),) * 2,
        slopes=SimpleNamespace(
            left_x=np.full((SIZE, SIZE), 4.0, np.float32), left_y=np.zeros((SIZE, SIZE), np.float32)
        ),
    )


def square(source: Source = "mask", strength: float = 0.0) -> Outline:
    """Return the face's outline; its right side was put there by `source`."""
    low, high = LOW - 0.5, HIGH - 0.5
    ring = np.array([[low, low], [high, low], [high, high], [low, high]])
    edges = []
    for k, (start, stop) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
        line = Line(start=start, stop=stop)
        fit = EdgeFit(
            line=line, sigma_px=0.2, strength=strength, contrast=5.0, disparity_miss_px=0.0, miss_sigma_px=0.2
        )
        mine = k == 1 and source != "mask"
        edges.append(
            FaceEdge(
                line=line, sigma_px=0.2, source=source if mine else "mask", course="upright" if k % 2 else "level",
                neighbour=-1, fit=fit if mine else None,
            )
        )  # fmt: skip
    return Outline(rings=(ring,), edges=tuple(edges))


def lose(bench: SimpleNamespace, columns: slice) -> None:
    """Let nothing be measured in some columns."""
    bench.scene.level.measured[:, columns] = False
    bench.scene.level.disparity_px[:, columns] = np.nan


def opened(bench: SimpleNamespace, outline: Outline) -> bool:
    """Ask whether the face is open."""
    return is_open(bench, outline, PLANE, OWN, float(HIGH - LOW))  # type: ignore[arg-type]


def test_a_face_before_a_measured_background_ends_where_its_outline_does() -> None:
    assert not opened(scene(), square())


def test_a_side_beyond_which_depth_is_lost_is_open() -> None:
    bench = scene()
    lose(bench, slice(HIGH, SIZE))
    assert opened(bench, square())


@pytest.mark.parametrize(("strength", "proves"), [(0.8, True), (0.2, False)])
def test_a_plain_edge_in_the_photos_stands_for_depth_that_is_lost(strength: float, proves: bool) -> None:
    bench = scene()
    lose(bench, slice(HIGH, SIZE))
    assert opened(bench, square("photo", strength)) is not proves


@pytest.mark.parametrize("miss_px", [-0.8, 0.8])
def test_an_edge_that_both_photos_show_off_the_faces_plane_is_not_its_end(miss_px: float) -> None:
    outline = square("photo", 0.9)
    assert not opened(scene(), outline)
    right = outline.edges[1]
    assert right.fit is not None
    missed = replace(right, fit=replace(right.fit, disparity_miss_px=miss_px))
    assert opened(scene(), replace(outline, edges=(outline.edges[0], missed, *outline.edges[2:])))
    unsure = replace(right, fit=replace(right.fit, disparity_miss_px=miss_px, miss_sigma_px=0.3))
    assert not opened(scene(), replace(outline, edges=(outline.edges[0], unsure, *outline.edges[2:])))


def test_a_step_in_brightness_is_an_end_even_where_no_pixel_votes_for_an_edge() -> None:
    bench = scene()
    lose(bench, slice(HIGH, SIZE))
    bench.grey_levels[0][:, HIGH:] = 140.0
    assert not opened(bench, square())


def test_grain_that_stops_at_a_sky_as_bright_as_the_concrete_is_an_end_but_glare_is_none() -> None:
    bench = scene()
    lose(bench, slice(HIGH, SIZE))
    bench.slopes.left_x[:, HIGH:] = 0.5
    assert not opened(bench, square())
    bench.grey_levels[0][:] = 252.0
    assert opened(bench, square())


@pytest.mark.parametrize(("strength", "proves"), [(0.8, True), (0.0, False)])
def test_what_is_taken_for_bars_is_an_end_only_where_the_photos_show_an_edge(strength: float, proves: bool) -> None:
    """The upright border of a shade looked like bars: half of a column was called whole."""
    bench = scene()
    bench.scene.labels[:, HIGH : HIGH + 60] = BARS
    bench.scene.level.disparity_px[:, HIGH : HIGH + 60] = FACE_PX
    assert opened(bench, square("photo" if strength else "mask", strength)) is not proves


def test_a_stain_is_no_end_where_the_face_goes_on_past_it() -> None:
    bench = scene()
    lose(bench, slice(HIGH, HIGH + 12))
    bench.scene.labels[LOW:HIGH, HIGH + 12 : HIGH + 40] = OWN
    bench.scene.level.disparity_px[LOW:HIGH, HIGH + 12 : HIGH + 40] = FACE_PX
    assert opened(bench, square("photo", 0.9))


def test_the_strip_that_one_photo_alone_shows_doesnt_open_a_side() -> None:
    bench = scene()
    lose(bench, slice(LOW - round(FACE_PX - BEHIND_PX), LOW))
    assert not opened(bench, square())


def piece_beyond(bench: SimpleNamespace, slope: float) -> None:
    """Let the face's surface go on past its right side: 12 px labelled otherwise, then a piece turned by `slope`."""
    across = np.arange(HIGH, HIGH + 60)
    bench.scene.level.disparity_px[LOW:HIGH, HIGH : HIGH + 60] = FACE_PX + slope * (across - HIGH)
    bench.scene.labels[LOW:HIGH, HIGH : HIGH + 12] = 1
    bench.scene.labels[LOW:HIGH, HIGH + 12 : HIGH + 60] = 0
    piece = Piece(x0_px=52.0, x1_px=100.0, slope=slope, offset_px=FACE_PX, circle=None, rms_px=0.1, chain=0)
    bench.scene.pieces, bench.scene.sizes = (piece,), np.array([48 * (HIGH - LOW)])
    bench.samples = samples_of(bench.scene)


def test_a_strip_between_two_pieces_of_one_plane_is_no_end_of_either() -> None:
    bench = scene()
    piece_beyond(bench, 0.0)
    assert opened(bench, square("photo", 0.9))


def test_a_surface_turned_from_the_face_past_such_a_strip_is_its_end() -> None:
    bench = scene()
    piece_beyond(bench, -0.15)
    assert not opened(bench, square("photo", 0.9))


def test_a_surface_that_meets_the_face_is_its_end() -> None:
    bench = scene()
    bench.scene.labels[:, HIGH:] = OWN + 1
    bench.scene.level.disparity_px[:, HIGH:] = FACE_PX - 0.02 * np.arange(SIZE - HIGH)
    assert not opened(bench, square())


def test_the_narrow_top_of_a_high_face_counts() -> None:
    bench = scene()
    bench.scene.level.measured[:LOW] = False
    low, high = LOW - 0.5, LOW + 15.5
    ring = np.array([[low, LOW - 0.5], [high, LOW - 0.5], [high, HIGH - 0.5], [low, HIGH - 0.5]])
    bench.scene.level.disparity_px[:, LOW + 16 :] = BEHIND_PX
    bench.scene.labels[:, LOW + 16 :] = -1
    assert (
        is_open(bench, Outline(rings=(ring,), edges=()), PLANE, OWN, 16.0) is False
    )  # as one ragged ring it is proven
    edges = tuple(
        FaceEdge(line=Line(start=a, stop=b), sigma_px=3.0, source="mask", course="level", neighbour=-1, fit=None)
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)
    )
    assert is_open(bench, Outline(rings=(ring,), edges=edges), PLANE, OWN, 16.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(("measured_px", "proves"), [(0, False), (12, True)])
def test_a_masks_border_is_an_end_only_where_the_face_is_measured_up_to_it(measured_px: int, proves: bool) -> None:
    """A true mask held 35 px beside a column of 25 px where no stereo was: the face came out by a third too large."""
    bench = scene()
    bench.scene.labels[LOW:HIGH, HIGH - 30 : HIGH - measured_px] = -1
    assert opened(bench, square("mask")) is not proves
    assert not opened(bench, square("photo", 0.9))
