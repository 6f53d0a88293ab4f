"""A survey that lies beside the design decides nothing, unless a person has accepted the shift that is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.survey_trust import HeldAgainstDesign, Shift, hold_against_design
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import FAR, measured, placement, station
from tests.match.test_survey_search import COLUMNS, POSE, STOREY_M, WALLS, design

SITE = design(COLUMNS + WALLS)
AXIS_M = np.array([6.0, 4.0])


def held(
    move: Sequence[float],
    accepted: Shift | None = None,
    turn_deg: float = 0.0,
    method: Literal["markers", "given"] = "markers",
    site: BimModel = SITE,
) -> HeldAgainstDesign:
    """Measure the site's lowest storey turned and moved, in a survey turned and moved as much, and hold it to it."""
    axis = FAR + np.append(AXIS_M, 0.0)
    turn = rigid(rotation_from_vector(np.array([0.0, 0.0, np.radians(turn_deg)])), np.zeros(3))
    carried = rigid(np.eye(3), axis + np.asarray(move, float)) @ turn @ rigid(np.eye(3), -axis)
    pose = carried @ POSE
    seen = []
    for one in (one for one in site.elements if one.global_id.startswith("0")):
        for index in range(4):
            frame = one.faces[index].frame
            assert isinstance(frame, PlaneFrame)
            width = float(np.ptp(one.faces[index].rings_uv_m[0][0][:, 0]))
            region = polygon.box(0.0, 0.0, width, 2.9)
            seen.append(measured(f"A1/{one.global_id}{index}", pose, frame.moved(carried), region))
    stood = station("A1", pose, [], seen)
    stood = replace(stood, pose=replace(stood.pose, method=method))
    return hold_against_design(placement(stood), site, MatchOptions(), accepted)


def shift(*move: float, turn_deg: float = 0.0) -> Shift:
    about_m = frozen(FAR[:2] + AXIS_M)
    return Shift(move_m=frozen(move), turn_rad=float(np.radians(turn_deg)), about_m=about_m)


def test_a_survey_that_lies_beside_the_design_has_no_station_that_counts() -> None:
    found = held((0.2, 0.0, 0.0))
    assert found.matched.stations == () and found.matched.matches == ()
    assert [one.code for one in found.rejections] == [Reason.SURVEY_SHIFTED, Reason.STATION_SURVEY_REFUSED]
    assert found.rejections[0].subject.kind is SubjectKind.SURVEY, "the cause comes before the stations"
    assert "accept_survey_shift with move_m: [0.200, 0.000, 0.000]" in words_of(found.rejections[0]).remedy
    assert len(found.matched.unobserved) == sum(len(one.faces) for one in SITE.elements)


def test_where_no_survey_places_a_visit_the_places_that_are_given_are_wrong_and_no_shift_is_offered() -> None:
    words = words_of(held((0.2, 0.0, 0.0), method="given").rejections[0])
    assert words.what == "the places that are given" and "poses" in words.remedy
    assert "accept_survey_shift" not in words.remedy


def test_a_survey_that_lies_on_the_design_keeps_its_stations() -> None:
    found = held((0.0, 0.0, 0.0))
    assert len(found.matched.stations) == 1 and not found.rejections and not found.notes


def test_an_accepted_shift_is_taken_off_the_stations_and_told() -> None:
    found = held((0.2, -0.1, 0.0), shift(0.2, -0.09, 0.0))
    assert not found.rejections and [note.code for note in found.notes] == [Reason.SHIFT_ACCEPTED]
    assert "+0.20 m in x, -0.09 m in y" in note_words(found.notes[0])
    (placed,) = found.matched.stations
    assert placed.pose.world_from_left[:3, 3] == pytest.approx(POSE[:3, 3], abs=0.011)
    assert len({one.element for one in found.matched.matches}) >= len(SITE.elements) - 1  # one is out of view


def test_an_accepted_turn_is_taken_off_about_its_axis() -> None:
    found = held((0.3, 0.0, 0.0), shift(0.3, 0.0, 0.0, turn_deg=2.0), turn_deg=2.0)
    assert [note.code for note in found.notes] == [Reason.SHIFT_ACCEPTED]
    (placed,) = found.matched.stations
    assert placed.pose.world_from_left == pytest.approx(POSE, abs=1e-6)


@pytest.mark.parametrize("accepted", [shift(-0.2, 0.0, 0.0), shift(0.35, 0.0, 0.0), shift(0.2, 0.0, 0.0, turn_deg=5.0)])
def test_another_shift_than_the_accepted_one_is_refused_with_both(accepted: Shift) -> None:
    found = held((0.2, 0.0, 0.0), accepted)
    said = [one.code for one in found.rejections]
    assert said[:2] == [Reason.SURVEY_SHIFTED, Reason.SHIFT_OTHER_THAN_ACCEPTED] and not found.matched.stations


@pytest.mark.parametrize("rise_m", [1.2, 1.2 - STOREY_M])
def test_where_photos_fit_two_storeys_alike_the_one_that_a_person_accepts_counts(rise_m: float) -> None:
    found = held((0.0, 0.0, 1.2), shift(0.0, 0.0, rise_m), site=design(COLUMNS + WALLS, COLUMNS + WALLS))
    assert [note.code for note in found.notes] == [Reason.SHIFT_ACCEPTED] and not found.rejections


def test_an_accepted_shift_that_is_not_there_moves_nothing_and_is_told() -> None:
    found = held((0.0, 0.0, 0.0), shift(0.2, 0.0, 0.0))
    assert [note.code for note in found.notes] == [Reason.SHIFT_NOT_NEEDED] and not found.rejections
    assert found.matched.stations[0].pose.world_from_left == pytest.approx(POSE)
