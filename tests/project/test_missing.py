from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.project.check import missing_photos, refuse_missing
from asbuilt_bim.project.read import read_project
from tests.project_folder import plain, write_project


def test_every_missing_file_is_named_at_once_by_its_key(tmp_path: Path) -> None:
    contents = plain()
    contents |= {"ifc": ["a.ifc", "b.ifc"], "schedule": "plan.xml", "history": ["old/result.json"]}
    contents["networks"] = {"segment": "cards/own.yaml"}
    project = read_project(write_project(tmp_path, contents))
    (tmp_path / "a.ifc").touch()
    with pytest.raises(ProjectError) as refused:
        refuse_missing(project)
    told = str(refused.value).splitlines()
    assert told[0].endswith("5 files aren't there; copy them there, or correct the paths:")
    assert [line.strip() for line in told[1:]] == [
        "ifc[1]: b.ifc",
        "markers.survey: markers.csv",
        "schedule: plan.xml",
        "history[0]: old/result.json",
        "networks.segment: cards/own.yaml",
    ]


def test_a_missing_photo_is_its_stations_matter_and_no_files(tmp_path: Path) -> None:
    project = read_project(write_project(tmp_path))
    (tmp_path / "design.ifc").touch()
    (tmp_path / "markers.csv").touch()
    refuse_missing(project)  # none of the photos is there


def test_files_that_are_missing_are_told_with_the_other_mistakes_by_line(tmp_path: Path) -> None:
    contents = plain()
    contents["rig"]["boards"]["left"] = "nowhere/left_*.jpg"
    with pytest.raises(ProjectError) as refused:
        read_project(write_project(tmp_path, contents))
    told = str(refused.value)
    assert "3 mistakes" in told and "rig.boards.left" in told
    assert "line 4: ifc: there is no design.ifc" in told and "markers.survey: there is no markers.csv" in told
    assert "A1_left" not in told


def test_a_misspelt_file_is_told_with_the_one_that_lies_beside_it(tmp_path: Path) -> None:
    contents = plain() | {"ifc": "desgin.ifc"}
    (tmp_path / "design.ifc").touch()
    project = read_project(write_project(tmp_path, contents))
    (tmp_path / "markers.csv").touch()
    with pytest.raises(ProjectError, match=r"copy it there, or correct the path:\n  ifc: desgin.ifc \(design.ifc lies"):
        refuse_missing(project)


def test_photos_that_are_missing_are_told_by_visit_and_station_with_what_lies_there(tmp_path: Path) -> None:
    project = read_project(write_project(tmp_path))
    visit = project.visits[0]
    first = visit.stations[0]
    stations = [station for one in project.visits for station in one.stations]
    for path in (path for station in stations for path in (station.left, station.right)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert missing_photos(project) == ()
    misspelt = first.right.with_stem(f"{first.right.stem}h")
    first.right.rename(misspelt)
    told = f"visit {visit.date.isoformat()}, station {first.name}: there is no {project.relative(first.right)}"
    assert missing_photos(project) == (f"{told} ({misspelt.name} lies there: is it that?)",)
