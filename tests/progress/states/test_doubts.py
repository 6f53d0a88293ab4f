"""What is looked at before it is paid for: walls that have gone, that go on past the design, that have another size."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry import polygon
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ElementProgress
from tests.match.small_site import box, looking, measured, station
from tests.notes import codes, the
from tests.progress.test_surface import BACKDROP, DESIGN, FRONT, GROUND, POSE, WALL, only, see, visit

LATER, LAST = date(2026, 3, 16), date(2026, 3, 30)
STRIP = [box(-2, -2.0, 0, 4.3, 0.05, 4), box(2.9, -2.0, 0, 6, 0.05, 4)]  # hoardings with a gap of 60 cm between them


def test_a_wall_that_has_gone_is_not_certain_and_is_named_until_a_second_visit_says_so_too() -> None:
    report, _ = visit(see([WALL, BACKDROP], 2.8))
    assert only(report).completion.lower > 0.95
    history = remember(EMPTY_HISTORY, report)
    report, _ = visit(see([BACKDROP], name="B1"), history=history, day=LATER)
    gone = only(report)
    assert gone.completion.lower < 0.05 and gone.state != "complete"
    assert the(gone.doubts, Reason.GONE) in gone.notes
    assert gone.as_built_area_m2 is None
    history = remember(history, report)
    report, _ = visit(see([BACKDROP], name="C1"), history=history, day=LAST)
    assert only(report).state == "not started" and not only(report).doubts
    assert history.complete_on == {} and remember(history, report).first_built == {}


def taller(height_m: float) -> ElementProgress:
    """Return a wall designed 2.8 m tall of which a face `height_m` tall was measured."""
    face = measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, 3.0, height_m))
    return only(visit(station("A1", POSE, [box(0, 0, 0, 3.0, 0.25, height_m), BACKDROP, GROUND], [face]))[0])


def test_concrete_that_goes_on_past_the_design_is_named_with_its_area() -> None:
    one = taller(3.8)
    assert one.state == "complete"
    past = the(one.doubts, Reason.PAST_DESIGN)
    assert (
        past.values["area_m2"] == pytest.approx(2.7, abs=0.05) and past.subject.station == "A1"
    )  # the border of 0.10 m is allowed
    assert not taller(2.8).doubts


@pytest.mark.parametrize(("less_m", "named"), [(0.075, True), (0.04, False)])
def test_a_complete_wall_that_was_measured_smaller_than_designed_is_named(less_m: float, named: bool) -> None:
    width_m, height_m = 3.0 - less_m, 2.8 - less_m
    face = measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, width_m, height_m))
    report, _ = visit(station("A1", POSE, [box(0, 0, 0, width_m, 0.25, height_m), BACKDROP, GROUND], [face]))
    one = only(report)
    assert one.state == "complete"
    assert (Reason.OTHER_SIZE in codes(one.doubts)) is named
    if named:
        values = the(one.doubts, Reason.OTHER_SIZE).values
        assert values["design_m2"] == pytest.approx(8.4)
        assert values["area_m2"] == pytest.approx(width_m * height_m, rel=1e-3)


def test_a_face_measured_half_built_is_no_size_of_the_wall_that_was_finished_since() -> None:
    first, _ = visit(see([box(0, 0, 0, 3.0, 0.25, 1.4), BACKDROP], 1.4))
    behind = looking([1.5, 5.0, 1.6], [1.5, 0.0, 1.5])
    hall = box(-30, -12, 0, 60, 0.5, 12)
    later, surfaces = visit(
        station("B1", behind, [WALL, hall, GROUND], []), history=remember(EMPTY_HISTORY, first), day=LATER
    )
    one = only(later)
    assert one.state == "complete" and not one.doubts
    front = surfaces[DESIGN.elements[0].faces[0].face_id]
    assert front.as_built_area_m2 == pytest.approx(4.2, rel=0.01) and not front.whole


def test_a_face_seen_in_part_measures_no_more_than_its_design() -> None:
    face = replace(measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, 3.08, 2.8)), open_edge=True)
    report, _ = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], [face]))
    assert only(report).as_built_area_m2 == pytest.approx(8.4, rel=1e-3)
    whole, _ = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], [replace(face, open_edge=False)]))
    assert only(whole).as_built_area_m2 == pytest.approx(3.08 * 2.8, rel=1e-3)


def test_an_unfinished_wall_that_a_visit_does_not_see_counts_in_its_group_as_when_it_was_last_seen() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    first, _ = visit(see([half, BACKDROP], 1.4))
    hoarding = box(-2, -2.0, 0, 7, 0.05, 4)
    later, _ = visit(see([WALL, hoarding], name="B1"), history=remember(EMPTY_HISTORY, first), day=LATER)
    assert only(later).completion.best is None
    assert only(later).best_when_seen == only(first).completion.best == pytest.approx(0.5, abs=0.05)
    assert later.whole.completion.best == pytest.approx(only(first).completion.best)  # it leapt to 100 %


def test_a_wall_that_a_visit_only_glimpses_counts_in_its_group_as_when_it_was_last_seen() -> None:
    first, _ = visit(see([BACKDROP]))
    later, _ = visit(see([BACKDROP, *STRIP], name="B1"), history=remember(EMPTY_HISTORY, first), day=LATER)
    glimpsed = only(later)
    assert glimpsed.stations == ("B1",) and glimpsed.completion.best is None
    assert glimpsed.best_when_seen == only(first).completion.best == 0.0


def test_a_strip_of_a_half_poured_wall_that_is_seen_again_leaves_its_best_estimate() -> None:
    half = box(0, 0, 0, 3.0, 0.25, 1.4)
    first, _ = visit(see([half, BACKDROP], 1.4))
    history = remember(EMPTY_HISTORY, first)
    again, _ = visit(see([half, BACKDROP, *STRIP], name="B1"), history=history, day=LATER)
    assert only(again).stations == ("B1",) and only(again).completion.coverage < 0.7
    assert only(again).completion.best == pytest.approx(only(first).completion.best, abs=0.02)  # it leapt to 94 %
    assert only(again).completion.upper > 0.9
    third, _ = visit(see([half, BACKDROP, *STRIP], name="C1"), history=remember(history, again), day=LAST)
    assert only(third).completion.best == only(again).completion.best


def test_a_half_poured_wall_that_is_seen_built_to_its_top_where_it_is_seen_is_taken_to_be_complete() -> None:
    first, _ = visit(see([box(0, 0, 0, 3.0, 0.25, 1.4), BACKDROP], 1.4))
    face = measured("B1/1", POSE, FRONT, polygon.box(1.2, 0.0, 3.0, 2.8))
    hoarding = box(-2, -2.0, 0, 3.2, 0.05, 4)
    seen = station("B1", POSE, [WALL, BACKDROP, GROUND, hoarding], [face])
    later, _ = visit(seen, history=remember(EMPTY_HISTORY, first), day=LATER)
    assert only(later).completion.coverage < 0.9
    assert (only(later).state, only(later).completion.best) == ("complete", 1.0)


def test_a_glimpse_of_a_face_that_was_seen_whole_leaves_its_area_and_sigma() -> None:
    first, _ = visit(see([WALL, BACKDROP], 2.8))
    face = replace(measured("B1/1", POSE, FRONT, polygon.box(0.0, 0.0, 1.0, 1.0)), open_edge=True)
    again = station("B1", POSE, [WALL, BACKDROP, GROUND], [face])
    later, _ = visit(again, history=remember(EMPTY_HISTORY, first), day=LATER)
    assert only(later).as_built_area_m2 == only(first).as_built_area_m2
    assert only(later).as_built_sigma_m2 == only(first).as_built_sigma_m2


def test_what_a_later_visit_adds_to_a_part_has_its_own_sigma_beside_the_first_ones() -> None:
    low, high = (
        replace(measured(f"{name}/1", POSE, FRONT, polygon.box(0.0, foot, 3.0, foot + 1.4)), open_edge=True)
        for name, foot in (("A1", 0.0), ("B1", 1.4))
    )
    first, before = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], [low]))
    later, after = visit(
        station("B1", POSE, [WALL, BACKDROP, GROUND], [high]), history=remember(EMPTY_HISTORY, first), day=LATER
    )
    sigma = before["W-0"].as_built_sigma_image_m2
    assert only(later).as_built_area_m2 == pytest.approx(8.4, rel=0.01)
    assert after["W-0"].as_built_sigma_image_m2 == pytest.approx(2.0**0.5 * sigma, rel=0.05)


def test_a_rough_outline_of_an_earlier_visit_doesnt_enlarge_what_a_later_one_measures_whole() -> None:
    rough = replace(measured("A1/1", POSE, FRONT, polygon.box(-0.1, 0.0, 3.1, 2.9)), area_sigma_image_m2=0.3)
    sharp = replace(measured("B1/1", POSE, FRONT, polygon.box(0.0, 0.0, 3.0, 2.8)), area_sigma_image_m2=0.01)
    first, _ = visit(station("A1", POSE, [WALL, BACKDROP, GROUND], [rough]))
    assert only(first).as_built_area_m2 == pytest.approx(3.2 * 2.9)
    again = station("B1", POSE, [WALL, BACKDROP, GROUND], [sharp])
    _, surfaces = visit(again, history=remember(EMPTY_HISTORY, first), day=LATER)
    assert surfaces["W-0"].whole and surfaces["W-0"].as_built_area_m2 == pytest.approx(8.4)


def test_a_face_that_was_wrongly_taken_for_whole_measures_no_more_than_its_design() -> None:
    sharp = replace(measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, 2.5, 2.8)), area_sigma_image_m2=0.01)
    part = replace(measured("A2/1", POSE, FRONT, polygon.box(-0.1, 0.0, 3.1, 2.9)), open_edge=True)
    boxes = [box(0, 0, 0, 2.5, 0.25, 2.8), BACKDROP, GROUND]
    _, surfaces = visit(
        station("A1", POSE, boxes, [sharp]), station("A2", POSE, boxes, [replace(part, area_sigma_image_m2=0.01)])
    )
    assert not surfaces["W-0"].whole and surfaces["W-0"].as_built_area_m2 == pytest.approx(8.4, rel=1e-3)
