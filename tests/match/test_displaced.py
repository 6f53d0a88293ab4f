"""An element that stands beside its design is found there, and never called not started."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.displaced import Displaced, displaced, moved_design, where_they_stand
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.report.wording.notes import note_words
from tests.match.small_site import Box, box, element, looking, measured, model, placement, shifted, station

POSE = looking([-3.0, -6.0, 1.6], [3.0, 0.0, 1.4])
SHAPES = [box(2 * n, 0, 0, 0.4, 0.4, 3) for n in range(4)]
SITE = [element(f"C{n}", "column", shape) for n, shape in enumerate(SHAPES)]
Moves = Mapping[int, Sequence[float]]


def moved_box(shape: Box, move: Sequence[float]) -> Box:
    return shape[0] + np.asarray(move, float), shape[1] + np.asarray(move, float)


def found(
    moves: Moves,
    *,
    faces: Sequence[int] = (0, 3),
    high_m: float = 3.0,
    before: Mapping[str, FloatArray] | None = None,
    design: Sequence[BimElement] = SITE,
    seen: Sequence[int] = range(4),
) -> dict[str, Displaced]:
    """Return what is found where columns stand by `moves` (by number, metres) beside their design."""
    stands = moved_design(model(SITE), {f"C{n}": np.asarray(move, float) for n, move in moves.items()})
    pieces = []
    for n in seen:
        for index in faces:
            frame = stands.elements[n].faces[index].frame
            assert isinstance(frame, PlaneFrame)
            pieces.append(measured(f"A1/{n}{index}", POSE, frame, polygon.box(0.0, 0.0, 0.4, high_m)))
    boxes = [moved_box(SHAPES[n], moves.get(n, (0.0, 0.0, 0.0))) for n in range(4)]
    placed = placement(station("A1", POSE, boxes, pieces))
    return displaced(match_faces(placed, model(design), MatchOptions()), model(design), before or {})


@pytest.mark.parametrize(
    "move", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (-0.2, 0.15, 0.0), (0.15, 0.0, 0.0), (0.0, -0.5, 0.0)]
)
def test_a_column_beside_its_design_is_found_with_how_far_it_stands_off(move: tuple[float, float, float]) -> None:
    (one,) = found({1: move}).values()
    assert one.element == "C1"
    np.testing.assert_allclose(one.move_m, move, atol=0.01)
    assert one.distance_m == pytest.approx(float(np.linalg.norm(move)), abs=0.01)
    assert one.stations == ("A1",)


@pytest.mark.parametrize("move", [(0.0, 0.0, 0.0), (0.02, -0.02, 0.0), (0.04, 0.0, 0.0)])
def test_what_stands_in_its_place_or_a_few_centimetres_off_is_not_displaced(move: tuple[float, float, float]) -> None:
    assert found({1: move}) == {}


def test_a_small_piece_beside_a_design_is_no_column() -> None:
    assert found({1: (0.3, 0.0, 0.0)}, high_m=0.4) == {}


def test_a_face_of_a_neighbour_in_its_own_place_is_never_taken_for_a_displaced_element() -> None:
    near = [*SITE, element("N", "column", box(2.5, 0, 0, 0.4, 0.4, 3))]  # 0.5 m beside C1, and not built
    assert found({}, design=near) == {}


def test_a_wide_column_moved_along_the_one_side_that_is_seen_is_found() -> None:
    wide = element("W", "column", box(0, 0, 0, 0.55, 0.55, 3))
    frame = wide.faces[0].frame
    assert isinstance(frame, PlaneFrame)
    seen = [measured("A1/0", POSE, frame, polygon.box(0.29, 0.0, 0.84, 2.9))]
    placed = placement(station("A1", POSE, [box(0.29, 0, 0, 0.55, 0.55, 3)], seen))
    (one,) = displaced(match_faces(placed, model([wide]), MatchOptions()), model([wide]), {}).values()
    assert one.distance_m == pytest.approx(0.29, abs=0.07)  # shortest of what explains it, to the border's tolerance


def test_a_face_that_runs_on_past_its_wall_is_no_move_along_it() -> None:
    wall = element("W", "wall", box(0, 0, 0, 4, 0.2, 3))
    frame = wall.faces[0].frame
    assert isinstance(frame, PlaneFrame)
    seen = [measured("A1/0", POSE, frame, polygon.box(0.5, 0.0, 4.6, 3.0))]  # a neighbour that isn't in the design
    placed = placement(station("A1", POSE, [box(0, 0, 0, 4.6, 0.2, 3)], seen))
    assert displaced(match_faces(placed, model([wall]), MatchOptions()), model([wall]), {}) == {}


def test_the_end_of_a_wall_that_a_column_will_cover_is_no_column_that_stands_in_the_wall() -> None:
    wall, column = element("W", "wall", box(0, 0, 0, 4, 0.2, 3)), element("C", "column", box(4, 0, 0, 0.4, 0.2, 3))
    ends = [face for face in wall.faces if isinstance(face.frame, PlaneFrame) and face.frame.normal[0] > 0.9]
    design = model([replace(wall, faces=tuple(face for face in wall.faces if face not in ends)), column])
    pose = looking([9.0, -3.0, 1.6], [4.0, 0.0, 1.4])
    (end,) = ends
    assert isinstance(end.frame, PlaneFrame)
    seen = [measured("A1/0", pose, end.frame, polygon.box(0.0, 0.0, 0.2, 3.0))]
    placed = placement(station("A1", pose, [box(0, 0, 0, 4, 0.2, 3)], seen))
    assert displaced(match_faces(placed, design, MatchOptions()), design, {}) == {}


def test_one_face_over_two_walls_that_stand_moves_neither_along_itself() -> None:
    walls = [element(name, "wall", box(x, 0, 0, 4, 0.2, 3)) for name, x in (("W1", 0), ("W2", 4))]
    frame = walls[0].faces[0].frame
    assert isinstance(frame, PlaneFrame)
    seen = [measured("A1/0", POSE, frame, polygon.box(3.55, 0.0, 4.65, 3.0))]
    placed = placement(station("A1", POSE, [box(0, 0, 0, 8, 0.2, 3)], seen))
    assert displaced(match_faces(placed, model(walls), MatchOptions()), model(walls), {}) == {}


def test_a_column_drawn_within_a_wall_stands_in_its_place_though_the_walls_body_is_there_too() -> None:
    wall, column = element("W", "wall", box(0, 0, 0, 4, 0.2, 3)), element("C", "column", box(1.5, 0, 0, 0.6, 0.2, 3))
    frame = column.faces[0].frame
    assert isinstance(frame, PlaneFrame)
    outline = polygon.box(0.0, 0.0, 0.6, 3.0)
    seen = [measured("A1/0", POSE, frame, outline), measured("A1/1", POSE, shifted(frame, 0.3), outline)]
    placed = placement(station("A1", POSE, [box(0, 0, 0, 4, 0.2, 3), box(1.5, -0.3, 0, 0.6, 0.1, 3)], seen))
    design = model([wall, column])
    assert displaced(match_faces(placed, design, MatchOptions()), design, {}) == {}


def wall_before_its_design(outlines: Sequence[Region], boxes: Sequence[Box]) -> dict[str, Displaced]:
    """Return what is found where outlines are measured 0.12 m before a wall's front, and these boxes stand there."""
    wall = element("W", "wall", box(0, 0, 0, 4, 0.2, 3))
    frame = wall.faces[0].frame
    assert isinstance(frame, PlaneFrame)
    pieces = [measured(f"A1/{n}", POSE, shifted(frame, 0.12), outline) for n, outline in enumerate(outlines)]
    placed = placement(station("A1", POSE, boxes, pieces))
    return displaced(match_faces(placed, model([wall]), MatchOptions()), model([wall]), {})


def test_studs_of_formwork_before_a_wall_are_no_displaced_wall() -> None:
    starts, sheet = (0.5, 1.5, 2.5, 3.5), box(0, -0.02, 0, 4, 0.02, 3)
    outlines = [polygon.box(x, 0.0, x + 0.1, 3.0) for x in starts]
    assert wall_before_its_design(outlines, [sheet, *(box(x, -0.12, 0, 0.1, 0.1, 3) for x in starts)]) == {}


@pytest.mark.parametrize("high_m", [1.0, 3.0])
def test_a_wall_that_stands_where_its_formwork_would_is_found_however_high_it_is_poured(high_m: float) -> None:
    found_there = wall_before_its_design([polygon.box(0.0, 0.0, 4.0, high_m)], [box(0, -0.12, 0, 4, 0.2, high_m)])
    np.testing.assert_allclose(found_there["W"].move_m, (0.0, -0.12, 0.0), atol=0.01)


def test_a_displaced_wall_is_found_though_most_of_it_stands_behind_something() -> None:
    stands, stack = box(0, -0.12, 0, 4, 0.2, 3), box(0, -2.0, 0, 2.5, 0.5, 3)
    assert set(wall_before_its_design([polygon.box(3.0, 0.0, 4.0, 3.0)], [stands, stack])) == {"W"}


def test_elements_that_were_not_measured_follow_most_of_their_storey_that_moved_alike() -> None:
    all_found = found({n: (0.3, 0.0, 0.0) for n in range(4)}, seen=(0, 1, 2))
    assert set(all_found) == {"C0", "C1", "C2", "C3"}
    assert all_found["C3"].area_m2 == 0.0 and all_found["C3"].stations == ()
    some_stand = found({0: (0.3, 0.0, 0.0), 1: (0.0, 0.3, 0.0), 2: (-0.3, 0.0, 0.0)}, seen=(0, 1, 2))
    assert set(some_stand) == {"C0", "C1", "C2"}, "each its own way is no move of the storey"


@pytest.mark.parametrize(("seen_m", "follows"), [((2.0, 7.0), True), ((0.0, 8.0), False)])
def test_a_wall_moves_along_itself_with_its_storey_unless_its_ends_were_seen_in_place(
    seen_m: tuple[float, float], follows: bool
) -> None:
    walls = [element(f"W{n}", "wall", box(0, 2.0 + 2 * n, 0, 8.0, 0.2, 3)) for n in range(4)]
    stands = moved_design(model(SITE), {f"C{n}": np.array([0.3, 0.0, 0.0]) for n in range(4)})
    pieces = [
        measured(f"A1/{one.global_id}{index}", POSE, frame, polygon.box(*along, 3.0))
        for elements, indices, along in (
            (stands.elements, (0, 3), (0.0, 0.0, 0.4)),
            (walls, (0,), (seen_m[0], 0.0, seen_m[1])),
        )
        for one in elements
        for index in indices
        if isinstance(frame := one.faces[index].frame, PlaneFrame)
    ]
    boxes = [moved_box(shape, (0.3, 0.0, 0.0)) for shape in SHAPES]
    placed, design = placement(station("A1", POSE, boxes, pieces)), model([*SITE, *walls])
    moved = displaced(match_faces(placed, design, MatchOptions()), design, {})
    assert {"C0", "C1", "C2", "C3"} <= moved.keys()
    assert ({f"W{n}" for n in range(4)} <= moved.keys()) is follows


def test_what_an_earlier_visit_found_holds_until_the_element_is_seen_again() -> None:
    before = {"C1": np.array([0.3, 0.0, 0.0])}
    assert found({}, seen=(0,), before=before)["C1"].area_m2 == 0.0
    assert found({}, seen=(0, 1), before=before) == {}


def report(moves: Moves, accept: Sequence[str] = (), history: VisitHistory = EMPTY_HISTORY) -> ProgressReport:
    """Return the report of a visit that sees four columns stand by `moves` beside their design."""
    boxes = [moved_box(shape, moves.get(n, (0.0, 0.0, 0.0))) for n, shape in enumerate(SHAPES)]
    built = moved_design(model(SITE), {f"C{n}": np.asarray(move, float) for n, move in moves.items()})
    pieces = [
        measured(f"A1/{n}{index}", POSE, one.faces[index].frame, polygon.box(0.0, 0.0, 0.4, 3.0))
        for n, one in enumerate(built.elements)
        for index in (0, 3)
    ]
    placed = placement(station("A1", POSE, boxes, pieces))
    design, options = model(SITE), ProgressOptions()
    matched = match_faces(placed, design, MatchOptions())
    stands = where_they_stand(matched, design, MatchOptions(), history.moves_m, accept)
    surfaces = classify_surface(stands.matched, stands.design, history, options, stands.not_accepted)
    day, beside = date(2026, 3, 2), stands.displaced
    return summarise(surfaces, stands.matched, stands.design, history, day, options=options, displaced=beside)


def column(of: ProgressReport, name: str) -> ElementProgress:
    return next(one for one in of.elements if one.global_id == name)


def test_a_displaced_column_is_a_state_of_its_own_with_open_bounds_and_is_said_how_far_off() -> None:
    made = report({1: (0.3, 0.0, 0.0)})
    one = column(made, "C1")
    assert one.state == "displaced"
    assert (one.completion.best, one.completion.lower, one.completion.upper) == (None, 0.0, 1.0)
    assert one.doubts[0].code == Reason.DISPLACED
    assert "Built 0.30 m off its design (+0.30 m in x, +0.00 m in y)" in note_words(one.doubts[0])
    assert (made.whole.displaced, made.whole.complete) == (1, 3)


def test_an_accepted_column_is_judged_where_it_stands() -> None:
    one = column(report({1: (0.3, 0.0, 0.0)}, accept=["C1"]), "C1")
    assert (one.state, one.accepted) == ("complete", True)
    assert one.move_m == pytest.approx((0.3, 0.0, 0.0), abs=0.01)
    assert one.as_built_area_m2 == pytest.approx(2.4, abs=0.01)
    assert one.notes[0].code == Reason.DISPLACED_ACCEPTED


def test_the_history_remembers_where_a_displaced_column_stands() -> None:
    history = remember(EMPTY_HISTORY, report({1: (0.3, 0.0, 0.0)}))
    np.testing.assert_allclose(history.moves_m["C1"], (0.3, 0.0, 0.0), atol=0.01)
    assert "C0" not in history.moves_m
