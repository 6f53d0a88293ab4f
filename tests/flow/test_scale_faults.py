"""A scale that is known to be off widens every area by what it makes of it; one that is right changes nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.flow.rig_check import WatchedVisit, watch_scale
from asbuilt_bim.flow.visit_report import scale_first
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.stereo.rig_health import judge
from asbuilt_bim.vision.stereo.rig_rejection import rig_doubt
from tests.camera.virtual import rig
from tests.match.small_site import box, element, looking, measured, station
from tests.project_folder import plain, write_project
from tests.register.test_scale import SIZE_M, SURVEY, evidence
from tests.vision.stereo.test_rig_health import calibrated, health

POSE = looking([1.5, -5.0, 1.6], [1.5, 0.0, 1.5])
FRONT = element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.8)).faces[0].frame
assert isinstance(FRONT, PlaneFrame)
AREA_M2 = 3.0 * 2.8


def watched(folder: Path, scale: float, *warnings: Rejection) -> WatchedVisit:
    """Five stations of a rig whose lengths come out `scale` times too large, each with one face."""
    contents = plain()
    contents["markers"]["size_m"] = SIZE_M
    project = read_project(write_project(folder, contents))
    face = measured("A1/1", POSE, FRONT, polygon.box(0.0, 0.0, 3.0, 2.8))
    one = station("A1", POSE, [], [face]).measurement
    stations = tuple(replace(one, station=f"A{n}", scale=evidence(scale, seed=n)) for n in range(5))
    return watch_scale(WatchedVisit(outcomes=stations, warnings=warnings, records=(), notes=()), project, rig(), SURVEY)


def sigmas(found: WatchedVisit) -> list[float]:
    stations = [one for one in found.outcomes if isinstance(one, StationMeasurement)]
    return [face.area_sigma_calibration_m2 for one in stations for face in one.faces]


def test_a_scale_that_is_two_per_cent_off_widens_every_area_by_four(tmp_path: Path) -> None:
    found = watched(tmp_path, 1.02)
    wide = float(np.hypot(0.002 * AREA_M2, 0.04 * AREA_M2))
    assert sigmas(found) == [pytest.approx(wide, rel=0.2)] * 5
    face = next(face for one in found.outcomes if isinstance(one, StationMeasurement) for face in one.faces)
    away_m = abs(float(face.frame.normal @ face.frame.origin_m)) if isinstance(face.frame, PlaneFrame) else 0.0
    assert face.place_covariance[0, 0] ** 0.5 == pytest.approx(np.hypot(0.005, 0.02 * away_m), rel=0.2)
    assert found.warnings[0].code in (Reason.LENGTHS_DOUBTFUL, Reason.LENGTHS_DOUBTFUL_TOGETHER)
    (note,) = found.notes
    assert note.code is Reason.AREAS_WIDENED and note.values["share"] == pytest.approx(0.04, rel=0.2)
    assert "areas may be 4." in note_words(note) or "areas may be 3." in note_words(note)


def test_a_right_scale_widens_nothing(tmp_path: Path) -> None:
    found = watched(tmp_path, 1.0)
    assert sigmas(found) == [pytest.approx(0.002 * AREA_M2)] * 5
    assert not found.warnings and not found.notes


def test_of_a_rig_of_the_wrong_scale_nothing_says_that_it_was_used_all_the_same(tmp_path: Path) -> None:
    verdict = judge([health("A0", calibrated(), calibrated(), 1)], calibrated())
    open_rig = rig_doubt(replace(verdict, state="undetermined"), ("A0",), calibrated())
    assert open_rig is not None and "used all the same" in str(words_of(open_rig))
    assert watched(tmp_path, 1.0, open_rig).warnings == (open_rig,)
    wrong = watched(tmp_path, 0.426, open_rig)
    assert not wrong.warnings and {one.rejections[0].code for one in wrong.outcomes} == {Reason.SCALE_WRONG}


def test_a_doubtful_scale_names_the_boards_square_and_what_known_lengths_ask_of_it(tmp_path: Path) -> None:
    (doubt, *_) = watched(tmp_path, 1.025).warnings
    told = str(words_of(doubt))
    assert "rig.boards.square_m is 0.08 m, and known lengths ask for 0.078" in told


def test_a_wrong_scale_is_told_before_the_shift_that_it_makes_and_no_shift_is_offered_then(tmp_path: Path) -> None:
    move = {"turn_rad": 0.0, "move_x_m": 0.15, "move_y_m": -0.07, "move_z_m": 0.0, "about_x_m": 0.0, "about_y_m": 0.0}
    shift = rejected(Reason.SURVEY_SHIFTED, about(SubjectKind.SURVEY), fits=7, faces=47, fits_unmoved=3, **move)
    (scale,) = watched(tmp_path, 1.025).warnings
    other = rejected(Reason.STATION_CRASHED, about(SubjectKind.STATION, "A1"), detail="x")
    first, second, third = scale_first((shift,), (other, scale), 0.026)
    assert (first, third) == (scale, other)
    assert "accept_survey_shift" not in str(words_of(second)) and "rig's scale first" in str(words_of(second))
    assert scale_first((shift,), (other,), 0.0) == (shift, other)
    assert "accept_survey_shift" in str(words_of(shift))
