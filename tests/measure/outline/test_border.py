"""What a side of an outline shows: what lies past it, the frame, a floor, the edge, what both sides look like."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.level import Floor
from asbuilt_bim.measure.outline.border import (
    FAR_PX,
    FEATURES,
    Shown,
    border_sides,
    flat_surface,
    round_sides,
    shown_by,
    stood_on,
)
from asbuilt_bim.measure.outline.edges import EdgeFit, Line
from asbuilt_bim.measure.outline.fit import FaceEdge, Outline

SIZE, LOW, HIGH = 240, 80, 160
FACE_PX, BEHIND_PX = 30.0, 8.0
PLANE = np.array([0.0, 0.0, FACE_PX])
BARS, PIECE = 9, 3
_, RIGHT, FOOT, LEFT = range(4)
STEP = FAR_PX[1] - FAR_PX[0]


def bench() -> SimpleNamespace:
    """Return a workbench with a square face of 80 px before a measured background."""
    disparity = np.full((SIZE, SIZE), BEHIND_PX)
    disparity[LOW:HIGH, LOW:HIGH] = FACE_PX
    level = SimpleNamespace(
        disparity_px=disparity, sigma_px=np.full((SIZE, SIZE), 0.1), measured=np.ones((SIZE, SIZE), dtype=bool)
    )
    flat = np.full((SIZE, SIZE), 4.0, np.float32)
    return SimpleNamespace(
        pair=SimpleNamespace(camera=SimpleNamespace(f_px=1000.0, cx_px=120.0, cy_px=120.0)),
        scene=SimpleNamespace(level=level, labels=np.full((SIZE, SIZE), -1, np.int16), floors=(), bars_label=BARS),
        frame=np.zeros((SIZE, SIZE), dtype=bool),
        sky=np.zeros((SIZE, SIZE), dtype=bool),
        grey_levels=(np.full((SIZE, SIZE), 90.0, np.float32),) * 2,
        slopes=SimpleNamespace(left_x=flat, left_y=np.zeros_like(flat), valid_right=np.ones_like(flat)),
    )


def outline(strength: float = 0.0) -> Outline:
    """Return the face's outline; both photos show its right side with a strength."""
    ring = np.array([[LOW, LOW], [HIGH, LOW], [HIGH, HIGH], [LOW, HIGH]]) - 0.5
    edges = []
    for number, (start, stop) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
        line = Line(start=start, stop=stop)
        fit = EdgeFit(
            line=line,
            sigma_px=0.2,
            ambiguity_px=0.0,
            strength=strength,
        )
        mine = number == RIGHT and strength > 0.0
        edges.append(
            FaceEdge(
                line=line, sigma_px=0.2 if mine else 3.0, source="photo" if mine else "mask",
                course="upright" if number % 2 else "level", neighbour=-1, fit=fit if mine else None,
            )
        )  # fmt: skip
    return Outline(rings=(ring,), edges=tuple(edges))


def shown(on: SimpleNamespace, number: int = RIGHT, strength: float = 0.0) -> Shown:
    """Return what one side of the face shows."""
    (side,) = [one for one in border_sides(outline(strength)) if one.number == number]
    return shown_by(on, side, flat_surface(PLANE, PIECE))  # type: ignore[arg-type]


def feature(name: str, on: SimpleNamespace, number: int = RIGHT, strength: float = 0.0) -> float:
    """Return one feature of one side."""
    return round(float(shown(on, number, strength).features[FEATURES.index(name)]), 9)


def put(on: SimpleNamespace, columns: slice, disparity_px: float) -> None:
    """Measure something in some columns; NaN: nothing."""
    on.scene.level.disparity_px[:, columns] = disparity_px
    on.scene.level.measured[:, columns] = np.isfinite(disparity_px)


@pytest.mark.parametrize("number", range(4))
def test_a_background_lies_behind_every_side(number: int) -> None:
    assert feature("behind", bench(), number) == 1.0
    assert (shown(bench(), number).open_px, shown(bench(), number).far_px) == pytest.approx((3.0, 3.0))


def test_the_strip_that_one_photo_alone_shows_hides_no_background() -> None:
    on = bench()
    put(on, slice(LOW - round(FACE_PX - BEHIND_PX), LOW), np.nan)
    assert feature("behind", on, LEFT) == 1.0


def test_a_thing_before_the_face_is_before_it_and_no_surface_that_meets_it() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX + 20.0)
    assert feature("before", on) == 1.0
    assert feature("meets", on) == 0.0


def test_a_sky_lies_behind_whatever_the_matcher_carried_over_it() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX + 3.0)
    on.sky[:, HIGH:] = True
    assert feature("behind", on) == 1.0


def test_a_surface_that_rises_from_the_edge_meets_the_face() -> None:
    on = bench()
    for column in range(HIGH, HIGH + 60):
        put(on, slice(column, column + 1), FACE_PX + 0.3 * (column - HIGH))
    assert feature("meets", on) == 1.0
    assert feature("before", on) == 0.0


@pytest.mark.parametrize("label", [-1, 3])
def test_a_strip_at_the_frame_that_is_a_piece_of_its_own_is_still_the_face_going_on(label: int) -> None:
    """A strip of 20 px at the photo's border became a second piece: the face that it belongs to was called whole."""
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX + 0.4)
    on.scene.labels[:, HIGH:] = label
    assert feature("goes on", on) == 1.0
    assert shown(on).open_px == pytest.approx(39.0)
    assert SIZE - HIGH <= shown(on).far_px <= SIZE - HIGH + STEP


def test_a_face_that_shows_again_past_pixels_that_scatter_goes_on() -> None:
    """A column's foot ended 60 px too high, at a row that dense depth had lost: it was called whole."""
    on = bench()
    put(on, slice(HIGH, HIGH + 8), FACE_PX - 2.5)
    put(on, slice(HIGH + 8, SIZE), FACE_PX)
    assert feature("goes on", on) == 0.0  # another wall behind may cross its plane
    on.scene.labels[:, HIGH + 8 :] = PIECE
    assert feature("goes on", on) == 1.0


def test_the_matchers_window_past_an_end_is_not_the_face_going_on() -> None:
    on = bench()
    put(on, slice(HIGH, HIGH + 10), FACE_PX)
    assert feature("goes on", on) == 0.0
    assert feature("behind", on) == 1.0


def test_where_nothing_is_measured_nothing_is_known_of_what_lies_there() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), np.nan)
    shares = [feature(name, on) for name in ("behind", "before", "meets", "goes on")]
    assert shares == [0.0] * 4
    assert shown(on).open_px == pytest.approx(39.0)
    assert SIZE - HIGH <= shown(on).far_px <= SIZE - HIGH + STEP


def test_a_side_that_nothing_near_ends_is_open_up_to_the_next_body_that_is_seen() -> None:
    """Walls were cut between two pieces of one plane, each time elsewhere, by up to 100 px: their sigma knew of 39."""
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX)
    put(on, slice(HIGH + 52, SIZE), BEHIND_PX)
    assert feature("goes on", on) == 1.0
    assert shown(on).open_px == pytest.approx(39.0)
    assert 51.9 < shown(on).far_px <= 52.0 + STEP


@pytest.mark.parametrize("of_right", [False, True])
def test_a_side_where_a_photo_ends_lies_past_the_frame(of_right: bool) -> None:
    on = bench()
    if of_right:
        on.slopes.valid_right[:, HIGH - round(FACE_PX) :] = 0.0
    else:
        on.frame[:, HIGH - 4 :] = True
    assert feature("past the frame", on) == 1.0
    assert feature("past the frame", on, LEFT) == 0.0


def test_no_edge_counts_along_the_frame() -> None:
    on = bench()
    assert feature("edge", on, strength=0.8) == pytest.approx(0.8)
    on.frame[:, HIGH - 4 :] = True
    assert feature("edge", on, strength=0.8) == 0.0


@pytest.mark.parametrize(("meets_at", "stands"), [(HIGH, 1.0), (HIGH + 12, 0.0)])
def test_a_foot_stands_on_a_floor_that_meets_it_and_not_on_a_heap_before_it(meets_at: int, stands: float) -> None:
    on = bench()
    slope = 0.2
    for row in range(HIGH, SIZE):
        on.scene.level.disparity_px[row] = FACE_PX + slope * (row - meets_at)
    # q of d = slope y + base, with y in pixels from the principal point's row
    q = np.array([0.0, slope * 1000.0, FACE_PX + slope * (120.0 - meets_at)])
    on.scene.floors = (Floor(q_px=q, below_m=1.6),)
    assert feature("stands", on, FOOT) == stands


@pytest.mark.parametrize(
    ("below_m", "kept"),
    [
        ((1.9, 1.5), (1.9,)),  # a deck over the ground
        ((1.5, 1.9), (1.5, 1.9)),  # a raft that the station stands on, and the ground beside it
        ((1.6, 4.6), (1.6, 4.6)),  # a slab, and the ground a storey lower
        ((4.6, 1.6, 1.2), (4.6, 1.6)),  # the same with a heap on the slab
        ((1.6, -1.2), (1.6, -1.2)),  # a slab overhead
        ((), ()),
    ],
)
def test_a_face_stands_on_the_largest_floor_or_the_lowest_of_a_storey(
    below_m: tuple[float, ...], kept: tuple[float, ...]
) -> None:
    floors = [Floor(q_px=np.zeros(3), below_m=one) for one in below_m]
    assert tuple(one.below_m for one in stood_on(floors)) == kept


def test_a_round_columns_ring_has_two_silhouettes_a_top_and_a_foot() -> None:
    across = np.linspace(LOW, HIGH, 24)
    bend = 4.0 * np.sin(np.pi * (across - LOW) / (HIGH - LOW))
    ring = np.concatenate([
        np.stack([across, LOW + bend], axis=1), np.stack([across[::-1], HIGH + bend[::-1]], axis=1)
    ])  # fmt: skip
    sides = round_sides(ring, True, 0.3)
    middles = sorted(tuple(np.round(side.points.mean(axis=0))) for side in sides)
    assert middles == [(80.0, 120.0), (120.0, 83.0), (120.0, 163.0), (160.0, 120.0)]
    assert sum(side.length_px for side in sides) == pytest.approx(4 * (HIGH - LOW), rel=0.02)


def test_sides_carry_the_number_of_their_edge() -> None:
    assert sorted(side.number for side in border_sides(outline())) == [0, 1, 2, 3]
    ragged = replace(outline(), edges=())
    assert [side.number for side in border_sides(ragged)] == [-1]
