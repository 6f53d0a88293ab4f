from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.states.likelihood import MOST_NATS
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.register.pose import PlacedStation
from asbuilt_bim.report.wording.notes import note_words
from tests.match.small_site import (
    Box,
    box,
    element,
    looking,
    measured,
    model,
    placement,
    round_column,
    shifted,
    station,
)
from tests.notes import codes, the

DAY = date(2026, 3, 2)
POSE = looking([1.5, -5.0, 1.6], [1.5, 0.0, 1.5])
WALL = box(0, 0, 0, 3.0, 0.25, 2.8)
DESIGN = model([element("W", "wall", WALL)])
GROUND = box(-30, -30, -0.3, 60, 90, 0.3)
BACKDROP = box(-30, 12, 0, 60, 0.5, 12)
FRONT = DESIGN.elements[0].faces[0].frame
assert isinstance(FRONT, PlaneFrame)


def visit(
    *stations: PlacedStation, history: VisitHistory = EMPTY_HISTORY, day: date = DAY, design: object = DESIGN
) -> tuple[ProgressReport, dict[str, SurfaceState]]:
    matched = match_faces(placement(*stations), design, MatchOptions())  # type: ignore[arg-type]
    surfaces = classify_surface(matched, design, history, ProgressOptions())  # type: ignore[arg-type]
    report = summarise(surfaces, matched, design, history, day)  # type: ignore[arg-type]
    return report, {surface.face_id: surface for surface in surfaces}


def see(boxes: Sequence[Box], height_m: float = 0.0, name: str = "A1", pose: FloatArray = POSE) -> PlacedStation:
    """Return a station before the wall; the segmenter found it up to a height."""
    faces = [measured(f"{name}/1", pose, FRONT, polygon.box(0.0, 0.0, 3.0, height_m))] if height_m else []
    return station(name, pose, [*boxes, GROUND], faces)


def only(report: ProgressReport) -> ElementProgress:
    (one,) = report.elements
    return one


def test_a_built_wall_is_complete() -> None:
    report, surfaces = visit(see([WALL, BACKDROP], 2.8))
    one = only(report)
    assert one.state == "complete"
    assert one.completion.best == 1.0 and one.completion.lower > 0.95
    assert surfaces["W-0"].built_area_m2 == pytest.approx(8.4, rel=0.02)
    assert surfaces["W-2"].unknown_area_m2 == pytest.approx(8.4)  # its back was not seen
    assert one.as_built_area_m2 == pytest.approx(8.4)


def test_the_polygons_have_the_areas_that_stand_beside_them_also_where_a_contact_leaves_odd_strips() -> None:
    strips = polygon.union([polygon.box(0.0, 0.0, 1.07, 2.8), polygon.box(2.0, 0.0, 3.0, 2.8)])
    design = model([element("W", "wall", WALL, {0: strips})])
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    _, surfaces = visit(see([half, BACKDROP], 1.4), design=design)
    front = surfaces["W-0"]
    assert front.built_area_m2 == pytest.approx(2.07 * 1.4, rel=0.04) and front.open_area_m2 > 2.0
    assert polygon.area(front.built_uv_m) == pytest.approx(front.built_area_m2, abs=1e-4)
    assert polygon.area(front.open_uv_m) == pytest.approx(front.open_area_m2, abs=1e-4)
    assert polygon.area(front.unknown_uv_m) == pytest.approx(front.unknown_area_m2, abs=1e-3)


def test_an_absent_wall_is_not_started_where_the_backdrop_or_the_sky_is_seen_through_it() -> None:
    for backdrop in (BACKDROP, box(50, 50, 0, 1, 1, 1)):
        report, surfaces = visit(see([backdrop]))
        assert only(report).state == "not started"
        assert surfaces["W-0"].open_area_m2 > 0.85 * 8.4
        assert surfaces["W-0"].built_area_m2 == 0.0


def test_a_wall_poured_to_half_is_part_and_its_completion_true() -> None:
    height = 2.8 * 6 / 11  # six of its eleven rows of cells
    one = only(visit(see([box(0, 0, 0, 3.0, 0.25, height), BACKDROP], height))[0])
    assert one.state == "part"
    assert one.completion.best == pytest.approx(6 / 11, abs=0.01)
    assert one.completion.lower - 1e-9 <= 6 / 11 <= one.completion.upper + 1e-9


@pytest.mark.parametrize("built", [True, False])
def test_a_column_that_no_station_sees_is_unknown_however_many_look_at_it(built: bool) -> None:
    shape = box(1.3, 0, 0, 0.4, 0.4, 2.8)
    design = model([element("C", "column", shape)])
    hoarding, blind = box(-2, -2.0, 0, 7, 0.05, 4), np.ones((480, 640))
    stands = [shape] if built else []
    hidden = [see([*stands, BACKDROP, hoarding], name=f"A{number}") for number in range(8)]
    unmeasured = [station(f"B{number}", POSE, [*stands, BACKDROP, GROUND], [], blind) for number in range(8)]
    one = only(visit(*hidden, *unmeasured, design=design)[0])
    assert (one.state, one.completion.best, one.completion.coverage) == ("unknown", None, 0.0)
    assert (one.completion.lower, one.completion.upper) == (0.0, 1.0)


def test_a_hidden_wall_is_unknown_and_never_nought_percent() -> None:
    hoarding = box(-2, -2.0, 0, 7, 0.05, 4)
    report, surfaces = visit(see([WALL, hoarding]))
    one = only(report)
    assert one.state == "unknown" and one.completion.best is None
    assert (one.completion.lower, one.completion.upper) == (0.0, 1.0)
    assert surfaces["W-0"].built_area_m2 == surfaces["W-0"].open_area_m2 == 0.0
    assert Reason.PARTLY_HIDDEN in codes(one.notes)


def test_poles_before_a_wall_hide_no_more_of_it_than_they_cover() -> None:
    poles = [box(0.25 + 0.35 * number, -1.5, 0, 0.06, 0.06, 4) for number in range(8)]
    _, surfaces = visit(see([WALL, BACKDROP, *poles]))
    assert surfaces["W-0"].built_area_m2 > 0.55 * 8.4
    report, surfaces = visit(see([BACKDROP, *poles]))
    assert surfaces["W-0"].built_area_m2 == 0.0 and surfaces["W-0"].open_area_m2 > 0.55 * 8.4
    assert only(report).state == "not started"


def test_what_nobody_measured_is_unknown() -> None:
    blind = station("A1", POSE, [WALL, GROUND], unmeasured=np.ones((480, 640)))
    assert only(visit(blind)[0]).state == "unknown"


def test_formwork_ten_centimetres_before_an_absent_wall_is_not_built() -> None:
    panel = box(0, -0.14, 0, 3.0, 0.03, 2.8)
    face = measured("A1/1", POSE, shifted(FRONT, 0.14), polygon.box(0.0, 0.0, 3.0, 2.8))
    report, surfaces = visit(station("A1", POSE, [panel, BACKDROP, GROUND], [face]))
    assert surfaces["W-0"].built_area_m2 == 0.0
    assert only(report).as_built_area_m2 is None


def test_a_neighbour_twelve_centimetres_behind_is_not_built_from_afar_once_its_plane_is_measured() -> None:
    afar = looking([1.5, -8.0, 1.6], [1.5, 0.0, 1.5])
    neighbour = box(0, 0.12, 0, 3.0, 0.25, 2.8)
    face = measured("A1/1", afar, shifted(FRONT, -0.12), polygon.box(0.0, 0.0, 3.0, 2.8))
    _, by_depth = visit(station("A1", afar, [neighbour, BACKDROP, GROUND]))
    assert by_depth["W-0"].built_area_m2 > 4.0  # so far off, depth can't tell
    _, surfaces = visit(station("A1", afar, [neighbour, BACKDROP, GROUND], [face]))
    assert surfaces["W-0"].built_area_m2 < 0.2
    note = the(surfaces["W-0"].notes, Reason.STANDS_OFF)
    assert note.subject == about(SubjectKind.FACE, "A1/1", "A1")
    assert note_words(note) == "A surface in photo A1 stands 12 cm behind the design and was not counted"


def test_depth_alone_says_built_only_on_a_patch_too_large_for_clutter() -> None:
    stub = box(0.5, 0, 0, 0.5, 0.25, 0.6)  # 0.3 m2 where the wall should be, found by no segmenter
    _, surfaces = visit(see([stub, BACKDROP]))
    assert surfaces["W-0"].built_area_m2 == 0.0
    _, surfaces = visit(see([WALL, BACKDROP]))
    assert surfaces["W-0"].built_area_m2 > 7.0


def test_timber_where_the_wall_should_be_is_not_concrete() -> None:
    timber = np.full((480, 640, 3), (70, 120, 180), np.uint8)  # BGR: light brown
    grey = np.full((480, 640, 3), 128, np.uint8)
    _, surfaces = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], picture=timber))
    assert surfaces["W-0"].built_area_m2 == 0.0
    _, surfaces = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], picture=grey))
    assert surfaces["W-0"].built_area_m2 > 7.0


def test_concrete_in_deep_shade_and_warm_light_is_concrete_and_timber_there_is_not() -> None:
    shaded, timber = np.full((480, 640, 3), (38, 42, 48), np.uint8), np.full((480, 640, 3), (20, 34, 50), np.uint8)
    _, surfaces = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], picture=shaded))
    assert surfaces["W-0"].built_area_m2 > 7.0
    _, surfaces = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], picture=timber))
    assert surfaces["W-0"].built_area_m2 == 0.0


def test_the_same_surface_seen_by_two_stations_counts_once() -> None:
    other = looking([0.5, -5.5, 1.6], [1.5, 0.0, 1.5])
    _, surfaces = visit(see([WALL], 2.8), see([WALL], 2.8, "A2", other))
    state = surfaces["W-0"]
    assert state.as_built_area_m2 == pytest.approx(8.4, rel=0.01)
    assert state.as_built_sigma_image_m2 == pytest.approx(0.084 / np.sqrt(2), rel=0.01)  # independent: they average
    assert state.as_built_sigma_calibration_m2 == pytest.approx(0.0168, rel=0.01)  # common: it stays
    assert set(state.stations) == {"A1", "A2"}


def test_two_halves_seen_by_two_stations_join_to_one_area() -> None:
    halves = []
    for name, u0, u1 in (("A1", 0.0, 1.8), ("A2", 1.2, 3.0)):
        face = measured(f"{name}/1", POSE, FRONT, polygon.box(u0, 0.0, u1, 2.8))
        halves.append(station(name, POSE, [WALL, GROUND], [_cut(face)]))
    _, surfaces = visit(*halves)
    assert surfaces["W-0"].as_built_area_m2 == pytest.approx(8.4, rel=1e-3)


def outlined(*spans: tuple[float, float], name: str = "A1", boxes: Sequence[Box] = (WALL, GROUND)) -> PlacedStation:
    """Return a station whose segmenter found the wall between these places along it, each piece whole by its looks."""
    faces = [measured(f"{name}/{i}", POSE, FRONT, polygon.box(u0, 0.0, u1, 2.8)) for i, (u0, u1) in enumerate(spans, 1)]
    return station(name, POSE, boxes, faces)


def test_a_face_past_whose_outline_the_concrete_goes_on_is_not_called_whole() -> None:
    report, surfaces = visit(outlined((0.0, 1.8)))
    (face,) = report.stations[0].faces
    assert not face.whole and surfaces["W-0"].parts == ("A1/1",)
    assert the(only(report).notes, Reason.PAST_OUTLINE).subject == about(SubjectKind.FACE, "A1/1", "A1")
    report, _ = visit(outlined((0.0, 3.0)))
    assert report.stations[0].faces[0].whole


def test_two_outlines_either_side_of_a_pole_are_parts_of_one_wall_and_add_up() -> None:
    report, surfaces = visit(outlined((0.0, 1.8), (1.8, 3.0)))
    assert [face.whole for face in report.stations[0].faces] == [False, False]
    assert surfaces["W-0"].as_built_area_m2 == pytest.approx(8.4, rel=1e-3)


def test_what_another_station_saw_built_shows_that_an_outline_ended_too_early() -> None:
    _, surfaces = visit(outlined((0.0, 2.0), boxes=[GROUND, box(0, 0, 0, 2.0, 0.25, 2.8)]), see([WALL], 2.8, "A2"))
    assert surfaces["W-0"].parts == ("A1/1",)
    assert surfaces["W-0"].as_built_area_m2 == pytest.approx(8.4, rel=1e-2)


def test_a_wall_under_its_pour_line_is_whole_though_starter_bars_stand_over_it() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    bars = [box(0.1 + 0.2 * i, 0.05, 1.4, 0.02, 0.02, 0.8) for i in range(15)]
    report, _ = visit(see([half, *bars, BACKDROP], 1.4))
    assert report.stations[0].faces[0].whole


def test_whole_measurements_three_sigma_apart_are_flagged() -> None:
    one, other = see([WALL], 2.8), see([WALL], 2.6, "A2")
    _, surfaces = visit(one, other)
    assert Reason.AREAS_APART in codes(surfaces["W-0"].notes)


def test_stations_that_contradict_each_other_are_flagged() -> None:
    there, gone = see([WALL, BACKDROP], 2.8), see([BACKDROP], name="A2")
    _, surfaces = visit(there, gone)
    assert surfaces["W-0"].conflict_area_m2 > 5.0


def test_a_column_seen_corner_on_is_complete_from_two_sides() -> None:
    shape = box(0, 0, 0, 0.5, 0.5, 2.8)
    design = model([element("C", "column", shape)])
    pose = looking([-3.5, -3.5, 1.6], [0.25, 0.25, 1.4])
    faces = []
    for index in (0, 3):
        frame = design.elements[0].faces[index].frame
        faces.append(measured(f"A1/{index}", pose, frame, polygon.box(0.0, 0.0, 0.5, 2.8), label="column"))
    report, surfaces = visit(station("A1", pose, [shape, BACKDROP, GROUND], faces), design=design)
    assert only(report).state == "complete"
    assert only(report).as_built_area_m2 == pytest.approx(2.8)
    assert surfaces["C-1"].built_area_m2 == 0.0


def test_a_round_column_is_complete_though_no_station_sees_half_of_its_lateral_surface() -> None:
    column = round_column("C", 1.5, 0.0, 0.3, 2.8)
    frame = column.faces[0].frame
    arc = polygon.box(-0.5 * np.pi * 0.3 - 0.35, 0.0, -0.5 * np.pi * 0.3 + 0.35, 2.8)  # the side of -y
    face = measured("A1/1", POSE, frame, arc, label="column")
    # Twelve thin boxes stand for the lateral surface, each touching it from inside.
    slices = [box(1.5 - w, -d, 0, 2 * w, 2 * d, 2.8) for w, d in ((0.3 * np.cos(a), 0.3 * np.sin(a)) for a in SLICES)]
    report, _ = visit(station("A1", POSE, [*slices, BACKDROP, GROUND], [face]), design=model([column]))
    assert only(report).state == "complete"
    assert only(report).as_built_area_m2 == pytest.approx(1.96)


def test_starter_bars_over_a_pour_line_are_seen_through() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    bars = [box(0.1 + 0.2 * i, 0.05, 1.4, 0.02, 0.02, 0.8) for i in range(15)]
    one = only(visit(see([half, *bars, BACKDROP], 1.4))[0])
    assert one.completion.best == pytest.approx(0.5, abs=0.06)
    assert one.completion.coverage > 0.9


def test_a_cage_whose_gaps_depth_smears_shut_is_open_where_the_second_look_sees_past_its_bars() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    face = measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, 3.0, 2.8))  # the outline runs up into the cage, too
    smeared = station("A1", POSE, [WALL, BACKDROP, GROUND], [face])
    assert only(visit(smeared)[0]).state == "complete"
    looked_past = station("A1", POSE, [WALL, BACKDROP, GROUND], [face], beyond=[half, BACKDROP, GROUND])
    one = only(visit(looked_past)[0])
    assert one.state == "part"
    assert one.completion.best == pytest.approx(0.5, abs=0.06)
    nothing = station("A1", POSE, [WALL, BACKDROP, GROUND], [face], beyond=[BACKDROP])
    assert only(visit(nothing)[0]).state == "not started"


def test_a_small_face_behind_the_design_by_the_cover_of_its_steel_is_starter_bars() -> None:
    cage = box(0.5, 0.05, 0, 0.4, 0.15, 0.6)
    face = measured("A1/1", POSE, shifted(FRONT, -0.05), polygon.box(0.5, 0.0, 0.9, 0.6))
    report, surfaces = visit(station("A1", POSE, [cage, BACKDROP, GROUND], [face]))
    assert surfaces["W-0"].built_area_m2 == 0.0
    assert the(only(report).notes, Reason.STARTER_BARS).values["area_m2"] == pytest.approx(0.24, rel=1e-3)


def test_an_outline_that_runs_over_a_gap_in_depth_is_not_built_there() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    _, surfaces = visit(see([half, BACKDROP], 1.9))  # the segmenter's outline overshoots by half a metre
    assert surfaces["W-0"].built_area_m2 == pytest.approx(3.0 * 1.4, rel=0.05)


def test_what_was_seen_built_stays_built_and_what_was_seen_open_becomes_unknown() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    first, _ = visit(see([half, BACKDROP], 1.4))
    history = remember(EMPTY_HISTORY, first)
    hoarding = box(-2, -2.0, 0, 7, 0.05, 4)
    later, _ = visit(see([WALL, hoarding]), history=history, day=date(2026, 3, 16))
    one = only(later)
    assert one.cells_built == only(first).cells_built
    assert one.cells_open == 0.0
    assert one.as_built_area_m2 == pytest.approx(only(first).as_built_area_m2)
    assert (one.last_seen, later.earlier_visits) == (DAY, (DAY,))
    assert one.state == "unknown"  # its top was open once, and may have been poured since
    assert one.completion.best is None  # it would be all of what is left: 100 %
    assert only(first).completion.best == pytest.approx(0.5, abs=0.05) and one.completion.lower > 0.4


def test_what_was_seen_built_on_one_side_and_open_on_the_other_is_not_built_when_nobody_sees_it_again() -> None:
    behind = looking([1.5, 5.25, 1.6], [1.5, 0.25, 1.5])
    shed = box(-30, -12, 0, 60, 0.5, 12)
    first, _ = visit(see([WALL, BACKDROP]), see([shed], name="A2", pose=behind))
    assert only(first).cells_conflict > 100.0
    later, _ = visit(see([box(-2, -2.0, 0, 7, 0.05, 4)]), history=remember(EMPTY_HISTORY, first), day=date(2026, 3, 16))
    assert only(later).cells_built <= only(first).cells_built


def test_what_hung_in_the_air_is_not_seen_begun_by_a_later_visit_that_sees_nothing() -> None:
    in_the_air, hoarding = box(0, 0, 1.7, 3.0, 0.25, 0.9), box(-2, -2.0, 0, 7, 0.05, 4)
    first, surfaces = visit(see([in_the_air, BACKDROP]))
    assert surfaces["W-0"].built_area_m2 > 1.0 and only(first).cells_built == 0.0
    later, _ = visit(see([hoarding]), history=remember(EMPTY_HISTORY, first), day=date(2026, 3, 16))
    assert only(later).cells_built == 0.0 and only(later).first_built is None


def test_history_reaches_a_face_of_the_revised_model_in_the_same_place() -> None:
    first, _ = visit(see([WALL, BACKDROP], 2.8))
    history = remember(EMPTY_HISTORY, first)
    longer = model([element("W", "wall", box(-0.5, 0, 0, 4.0, 0.25, 2.8))])
    face = longer.elements[0].faces[0]
    renamed = replace(face, face_id="W-new")
    earlier = history.earlier("W", renamed, ProgressOptions())
    assert earlier is not None
    assert polygon.area(earlier.built_uv_m) == pytest.approx(8.4, rel=0.02)
    assert polygon.bounds(earlier.built_uv_m)[0] == pytest.approx(0.5, abs=0.05)


def test_a_pose_two_centimetres_off_still_says_built_and_open_rightly() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    true = see([half, BACKDROP], 1.4)
    off = POSE.copy()
    off[:3, 3] += [0.012, -0.015, 0.008]
    wrong = replace(true, pose=replace(true.pose, world_from_left=off, covariance=np.diag([1e-6] * 3 + [2e-4] * 3)))
    assert only(visit(wrong)[0]).completion.best == pytest.approx(0.5, abs=0.06)


SLICES = np.radians(np.arange(4.0, 90.0, 7.0))


def _cut(face: MeasuredFace) -> MeasuredFace:
    return replace(face, cut_by_frame=True)


def test_rows_are_what_this_visit_shows_and_no_clearer_than_stations_ever_are() -> None:
    first, seen = visit(*(see([WALL, BACKDROP], 2.8, name=f"A{number}") for number in range(3)))
    rows = seen["W-0"].row_log_odds
    assert rows is not None and (rows == MOST_NATS).all()
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    _, later = visit(see([half, BACKDROP], 1.4), history=remember(EMPTY_HISTORY, first), day=date(2026, 4, 1))
    rows = later["W-0"].row_log_odds
    assert rows is not None and (rows[:, :25] > 0.0).all() and (rows[:, 29:] < 0.0).all()
