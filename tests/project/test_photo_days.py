from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

from asbuilt_bim.codes import Reason
from asbuilt_bim.project.check import a_day_off, of_other_day, of_other_days, other_days, to_come
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from tests.project_folder import write_project


def _project(folder: Path) -> Project:
    return read_project(write_project(folder))


def test_photos_of_another_day_are_warned_of_once_with_their_days(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    (warning,) = other_days(visit, {"A1": date(2026, 2, 16), "A2": date(2026, 3, 3)})
    assert (warning.code, warning.subject.name) == (Reason.PHOTOS_OF_OTHER_DAY, "2026-03-02")
    assert warning.values == {"stations": ("A1",), "days": ("2026-02-16",), "count": 2, "clock_wrong": False}
    assert "1 of 2 stations" in str(words_of(warning)) and "station A1 2026-02-16" in str(words_of(warning))


def test_the_visits_own_day_and_its_neighbours_are_no_other_day(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    assert other_days(visit, {"A1": date(2026, 3, 1), "A2": date(2026, 3, 2)}) == ()
    assert other_days(visit, {}) == ()


def test_photos_that_all_say_the_day_beside_the_visits_count_and_that_is_told(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    (note,) = a_day_off(visit, {"A1": date(2026, 3, 1), "A2": date(2026, 3, 1)})
    assert "visit of 2026-03-02 say 2026-03-01" in note_words(note) and "They count" in note_words(note)
    for days in ((1, 2), (2, 2), (1, 3), (5, 5)):
        assert a_day_off(visit, {f"A{k}": date(2026, 3, day) for k, day in enumerate(days)}) == ()
    assert a_day_off(visit, {}) == () == a_day_off(replace(visit, camera_clock_wrong=True), {"A1": date(2026, 3, 1)})


def test_a_station_of_another_day_decides_nothing_beside_one_of_the_right_day(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    assert of_other_days(visit, {"A1": date(2026, 2, 16), "A2": date(2026, 3, 2)}) == ("A1",)


def test_where_no_photo_is_of_the_visits_day_no_station_decides_anything(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    assert of_other_days(visit, {"A1": date(2026, 2, 16)}) == ("A1", "A2")
    assert of_other_days(visit, {}) == () and of_other_days(visit, {"A1": date(2026, 3, 3)}) == ()


def test_where_the_cameras_clock_is_said_to_be_wrong_its_photos_count_with_a_warning(tmp_path: Path) -> None:
    visit = replace(_project(tmp_path).visits[0], camera_clock_wrong=True)
    days = {"A1": date(2000, 1, 1), "A2": date(2000, 1, 1)}
    assert of_other_days(visit, days) == ()
    assert "they count all the same" in str(words_of(other_days(visit, days)[0]))


def test_a_station_says_whether_its_own_photos_or_those_beside_it_are_of_another_day(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    own, beside = (str(words_of(of_other_day(name, visit, {"A1": date(2026, 2, 16)}))) for name in ("A1", "A2"))
    assert "its photos are of 2026-02-16" in own and "don't say their day" in beside


def test_a_visit_whose_day_is_yet_to_come_is_told_and_the_next_day_may_have_begun_somewhere() -> None:
    (note,) = to_come(date(2062, 3, 16), date(2026, 3, 17))
    assert note.values == {"visit": "2062-03-16", "today": "2026-03-17"}
    assert to_come(date(2026, 3, 18), date(2026, 3, 17)) == () == to_come(date(2026, 3, 2), date(2026, 3, 17))
