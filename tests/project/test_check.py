from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.project.check import same_photos
from asbuilt_bim.project.read import Project, read_project
from asbuilt_bim.report.wording.reasons import words_of
from tests.project_folder import plain, write_project

NAMES = ("A1_left", "A1_right", "A2_left", "A2_right", "B1_left", "B1_right")


def _project(folder: Path, **contents: bytes) -> Project:
    project = read_project(write_project(folder))
    (folder / "v").mkdir()
    for name in NAMES:
        (folder / f"v/{name}.jpg").write_bytes(contents.get(name, name.encode().ljust(10)))
    return project


def test_photos_of_equal_length_that_differ_are_every_stations_own(tmp_path: Path) -> None:
    project = _project(tmp_path)
    assert [same_photos(project, visit) for visit in project.visits] == [{}, {}]


def test_a_pair_copied_to_a_second_station_is_left_out_there_and_counts_at_the_first(tmp_path: Path) -> None:
    project = _project(tmp_path, A2_left=b"A1_left   ", A2_right=b"A1_right  ")
    found = same_photos(project, project.visits[0])
    assert set(found) == {"A2"}
    told = str(words_of(found["A2"]))
    assert "its photos are those of station A1 again (v/A2_left.jpg is v/A1_left.jpg, " in told


def test_last_visits_photos_are_not_this_visits(tmp_path: Path) -> None:
    project = _project(tmp_path, B1_left=b"A2_left   ", B1_right=b"A2_right  ")
    assert same_photos(project, project.visits[0]) == {}
    assert "station A2 of visit 2026-03-02" in str(words_of(same_photos(project, project.visits[1])["B1"]))


def test_exchanged_and_mixed_photos_are_left_to_those_who_measure_them(tmp_path: Path) -> None:
    project = _project(tmp_path, A2_left=b"A1_right  ", A2_right=b"A1_left   ", B1_left=b"A1_left   ")
    assert [same_photos(project, visit) for visit in project.visits] == [{}, {}]


def test_missing_and_empty_photos_are_no_ones_twins(tmp_path: Path) -> None:
    project = _project(tmp_path, A1_left=b"", A1_right=b"", A2_left=b"", A2_right=b"")
    for side in ("left", "right"):
        (tmp_path / f"v/B1_{side}.jpg").unlink()
    assert [same_photos(project, visit) for visit in project.visits] == [{}, {}]


def test_a_photo_named_under_two_stations_is_a_mistake_in_the_project_file(tmp_path: Path) -> None:
    contents = plain()
    contents["visits"][1]["stations"][1] |= {"left": "v/A1_left.jpg", "right": "v/A1_right.jpg"}
    with pytest.raises(ProjectError) as refused:
        read_project(write_project(tmp_path, contents))
    assert "visits[1].stations[1].right: is a photo of visits[1].stations[0] too" in str(refused.value)
    assert "visits[1].stations[1].left: is a photo of visits[1].stations[0] too" in str(refused.value)
