"""The page of a check: names out of files are text, and each grade has its words."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.measure.sigma.rig_scale import ScaleEvidence
from asbuilt_bim.measure.station import RejectedStation
from asbuilt_bim.progress.visits.checked import CheckedStation, CheckedVisit, Looked, checked_station
from asbuilt_bim.report.page.check import MADE_BY, check_page
from asbuilt_bim.report.wording.of_page.check_words import aspect_words, grade_words, remedy_words, verdict_words
from asbuilt_bim.report.wording.reasons import words_of

EVIL = "<script>alert(1)</script>"


def graded(outcome: RejectedStation, *of_file: Reason) -> CheckedStation:
    return checked_station(Looked(outcome=outcome, seen=outcome, of_file=of_file), outcome.rejections)


def refused(name: str) -> CheckedVisit:
    reason = rejected(Reason.TARGET_ABSENT, about(SubjectKind.TARGET, station=name))
    outcome = RejectedStation(station=name, rejections=(reason,))
    return CheckedVisit(
        day=date(2026, 3, 2), stations=(checked_station(Looked(outcome=outcome, seen=outcome), (reason,)),)
    )


def test_a_stations_name_is_text_whatever_it_holds() -> None:
    page = check_page(refused(EVIL), EVIL)
    assert b"<script" not in page and b"&lt;script&gt;" in page
    assert MADE_BY in page[:2048]


def test_what_comes_after_a_failed_step_was_not_looked_at() -> None:
    grades = {one.aspect: one.grade for one in refused("A1").stations[0].aspects}
    assert grades["disc"] == "not" and grades["tags"] == grades["place"] == "unchecked"


def test_the_verdict_says_what_to_take_again() -> None:
    assert "Not one station" in verdict_words(refused("A1"))


def evidence() -> ScaleEvidence:
    """Return what a station showed that was left out: a disc, and two tags."""
    none = np.zeros(2)
    return ScaleEvidence(target_diameter_m=0.301, marker_ids=(4, 7), marker_corners_m=np.zeros((2, 4, 3)),
                         marker_sigma=none, marker_depth_m=none)  # fmt: skip


NOT_IT = rejected(
    Reason.DISC_NOT_TARGET, about(SubjectKind.DISC, "x 1, y 2 px", "A1"),
    diameter_m=0.301, target_m=0.25, tolerance_share=0.06,
)  # fmt: skip
SCALE = rejected(
    Reason.SCALE_WRONG, about(SubjectKind.STATION, "A1"), ratio=0.426, sigma=0.01, limit_share=0.03,
    kinds=("target's diameter", "markers' size"), ratios=(0.426, 0.425), sigmas=(0.01, 0.01),
    baseline_m=0.2, asked_baseline_m=0.47, square_m=0.034, asked_square_m=0.0798,
)  # fmt: skip


@pytest.mark.parametrize(("reason", "column"), [(NOT_IT, "disc"), (SCALE, "rig")])
def test_a_wrong_number_of_the_file_marks_its_column_and_the_others_keep_what_was_seen(
    reason: Rejection, column: str
) -> None:
    station = graded(RejectedStation(station="A1", rejections=(reason,), scale=evidence()), reason.code)
    grades = {one.aspect: grade_words(one) for one in station.aspects}
    words = {one.aspect: aspect_words(one) for one in station.aspects}
    assert grades[column] == "wrong in the project file" and grades["tags"] == "ok" and words["tags"] == "4, 7"
    assert column == "disc" or grades["disc"] == "ok"
    visit = CheckedVisit(day=date(2026, 3, 2), stations=(station,))
    verdict = verdict_words(visit)
    assert verdict == ("Not one station would count. Your photos are fine: correct the project file and check again.")
    assert remedy_words(station).startswith("The photos are fine.")


def test_a_red_thing_that_is_not_the_target_costs_its_station_and_is_said_to() -> None:
    station = graded(RejectedStation(station="A1", rejections=(NOT_IT,), scale=evidence()))
    grades = {one.aspect: grade_words(one) for one in station.aspects}
    assert grades["disc"] == "not ok" and grades["tags"] == "ok"
    verdict = verdict_words(CheckedVisit(day=date(2026, 3, 2), stations=(station,)))
    assert "Don't leave yet" in verdict and "fine" not in verdict


def test_a_wrong_scale_says_first_which_number_is_wrong_and_reads_right_for_too_small() -> None:
    words = words_of(SCALE)
    assert words.reason.startswith(
        "the rig's scale is wrong: measure the board's squares: rig.boards.square_m is 0.034 m, and known lengths ask "
        "for 0.0798 m; known lengths come out 0.426 times as long as they are: target's diameter -57.4 %"
    )
    assert words.remedy == "correct that number; no new photos are needed"


@pytest.mark.parametrize(("ratio", "unit"), [(0.3052, "feet"), (0.0254, "inches"), (0.98, "")])
def test_lengths_given_in_another_unit_are_told_by_it_where_the_rig_is_right(ratio: float, unit: str) -> None:
    lengths = rejected(
        Reason.LENGTHS_DOUBTFUL, about(SubjectKind.RIG), ratio=ratio, sigma=0.01, wrong=("markers' distances",),
        kinds=("target's diameter", "markers' distances"), ratios=(1.004, ratio), sigmas=(0.01, 0.001),
        limit_shares=(0.026, 0.015),
    )  # fmt: skip
    words = words_of(lengths)
    assert (f"%), as numbers in {unit} do; others don't: target's diameter +0.4 %" in words.reason) == bool(unit)
    assert ("as numbers in" in words.reason) == bool(unit) and "(markers.survey)" in words.remedy
