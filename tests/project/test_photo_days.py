from __future__ import annotations

from datetime import date
from pathlib import Path

from asbuilt_bim.project.photo_days import other_days
from asbuilt_bim.project.read import Project, read_project
from tests.project_folder import write_project


def _project(folder: Path) -> Project:
    return read_project(write_project(folder))


def test_photos_of_another_day_are_warned_of_once_with_their_days(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    (warning,) = other_days(visit, {"A1": date(2026, 2, 16), "A2": date(2026, 3, 3)})
    assert "1 of 2 stations" in warning.reason and "station A1 2026-02-16" in warning.reason
    assert "the visit's, 2026-03-02" in warning.reason and "A2" not in warning.reason


def test_the_visits_own_day_and_its_neighbours_are_no_other_day(tmp_path: Path) -> None:
    visit = _project(tmp_path).visits[0]
    assert other_days(visit, {"A1": date(2026, 3, 1), "A2": date(2026, 3, 2)}) == ()
    assert other_days(visit, {}) == ()
