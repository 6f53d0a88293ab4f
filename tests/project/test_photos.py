"""Photos as they come from a camera become stations: by folder, or named in pairs."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from asbuilt_bim.errors import OptionError, PhotoError, ProjectError
from asbuilt_bim.project.model import Project, Station, Visit
from asbuilt_bim.project.photos import left_over, stations_of
from asbuilt_bim.project.read import read_project
from tests.project_folder import plain, write_project


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return read_project(write_project(tmp_path / "site"))


def touched(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_bytes(b"photo")
    return folder


def test_a_folder_of_pairs_is_stations_in_the_order_that_people_count_in(project: Project, tmp_path: Path) -> None:
    names = [f"A{n}_{side}.jpg" for n in (10, 2, 1) for side in ("left", "right")]
    found = stations_of([touched(tmp_path / "today", *names, "notes.txt", ".hidden_left.jpg")], project)
    assert [one.name for one in found] == ["A1", "A2", "A10"]
    assert found[0].right == tmp_path / "today" / "A1_right.jpg"


def test_every_photo_of_a_mixed_folder_is_a_stations_or_is_named(project: Project, tmp_path: Path) -> None:
    pairs = ("G1_left.jpg", "G1_right.jpg", "U3_left.JPG", "U3_right.JPG", "U4_left.jpeg", "U4_right.jpeg",
             "P1_left.png", "P1_right.png", "D1_links.jpg", "D1_rechts.jpg")  # fmt: skip
    folder = touched(
        tmp_path / "card", *pairs, "H1_left.heic", "H1_right.heic", "IMG_4711.jpg", "lonely_left.jpg", "a.txt"
    )
    found = stations_of([folder], project)
    assert [one.name for one in found] == ["D1", "G1", "lonely", "P1", "U3", "U4"]
    assert left_over([folder], found) == ("H1_left.heic", "H1_right.heic", "IMG_4711.jpg")


def test_a_folder_that_holds_one_of_each_camera_is_their_pairs(project: Project, tmp_path: Path) -> None:
    made = [tmp_path / side / name for side in ("cam0", "cam1") for name in ("A10.jpg", "A2.jpg")]
    for file in (*made, tmp_path / "cam0" / "A3.jpg"):
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(b"")
    found = stations_of([tmp_path], project)
    assert [(one.name, one.left.parent.name, one.right.parent.name) for one in found] == [
        ("A2", "cam0", "cam1"), ("A3", "cam0", "cam1"), ("A10", "cam0", "cam1"),
    ]  # fmt: skip


def test_a_photo_without_its_partner_stays_a_station(project: Project, tmp_path: Path) -> None:
    folder = touched(tmp_path / "today", "A1_left.jpg", "A1_right.jpg", "A2_left.jpg")
    found = stations_of([folder], project)
    assert [one.name for one in found] == ["A1", "A2"] and not found[1].right.exists()


def test_photos_named_in_pairs_keep_their_order_and_get_names_that_differ(project: Project, tmp_path: Path) -> None:
    paths = [tmp_path / side / "A.jpg" for side in ("l", "r", "l2", "r2")]
    found = stations_of(paths, project)
    assert [one.name for one in found] == ["A (1)", "A (2)"] and found[1].left == paths[2]


def test_what_is_no_pair_is_refused(project: Project, tmp_path: Path) -> None:
    folder = touched(tmp_path / "today", "a.jpg", "b.jpg")
    for wrong in ([tmp_path / "a.jpg"], [folder, folder], [tmp_path / "a.jpg"] * 2):
        with pytest.raises(OptionError):
            stations_of(wrong, project)
    with pytest.raises(PhotoError, match="nobody can tell which camera"):
        stations_of([folder], project)


def test_a_folder_of_pictures_that_nothing_here_reads_is_told_to_be_converted(project: Project, tmp_path: Path) -> None:
    folder = touched(tmp_path / "phone", "A1_left.HEIC", "A1_right.HEIC")
    with pytest.raises(PhotoError, match=r"but 2 pictures such as A1_left\.HEIC: convert them to JPEG, in full size"):
        stations_of([folder], project)


@pytest.mark.parametrize("beside", [(), ("Screenshot 1.png",)])
def test_a_folder_of_videos_is_told_where_they_belong(project: Project, tmp_path: Path, beside: tuple[str]) -> None:
    folder = touched(tmp_path / "today", "walk left.mov", "walk right.mov", "._walk left.mov", *beside)
    with pytest.raises(PhotoError, match="its videos aren't looked at here: name them under video"):
        stations_of([folder], project)


def test_where_the_project_has_both_eyes_in_one_file_so_have_todays_photos(project: Project, tmp_path: Path) -> None:
    both = Station(name="A", left=tmp_path / "a.jpg", right=tmp_path / "a.jpg")
    wide = replace(project, visits=(Visit(date=date(2026, 3, 2), stations=(both,)),))
    found = stations_of([touched(tmp_path / "today", "x.jpg", "y.jpg")], wide)
    assert [one.name for one in found] == ["x", "y"] and all(one.side_by_side for one in found)


def test_a_project_may_have_no_visit_yet_where_none_is_asked_for(tmp_path: Path) -> None:
    path = write_project(tmp_path / "site", {**plain(), "visits": []})
    assert read_project(path, visited=False).visits == ()


def test_a_project_without_a_visit_needs_nothing_yet_that_places_stations(tmp_path: Path) -> None:
    path = write_project(tmp_path / "site", {**plain(), "markers": {}, "visits": []})
    assert read_project(path, visited=False).survey is None
    with pytest.raises(ProjectError, match="markers: is missing: stations are placed by"):
        read_project(path)


@pytest.mark.parametrize(("there", "missing"), [("G1_left.jpg", "G1_right.jpg"), ("G1_right.jpg", "G1_left.jpg")])
def test_a_photo_alone_in_its_folder_is_a_station_whose_other_photo_is_missing(
    project: Project, tmp_path: Path, there: str, missing: str
) -> None:
    (found,) = stations_of([touched(tmp_path / "today", there)], project)
    assert found.name == "G1" and {found.left.name, found.right.name} == {there, missing}
    with pytest.raises(OptionError, match=f"{there} alone is no pair; name {missing} too"):
        stations_of([tmp_path / "today" / there], project)


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ("todya", r"todya: there is no such folder or file \(today lies there: is it that\?\)"),
        ("today/G1_lefft.jpg", r"there is no such folder or file \(G1_left\.jpg lies there: is it that\?\)"),
        ("elsewhere", "elsewhere: there is no such folder or file; check the path"),
    ],
)
@pytest.mark.parametrize("wide", [False, True], ids=["one eye a file", "both eyes in one"])
def test_a_folder_that_is_not_there_is_told_so_with_the_one_that_is_called_nearly_so(
    project: Project, tmp_path: Path, named: str, says: str, wide: bool
) -> None:
    touched(tmp_path / "today", "G1_left.jpg")
    both = Station(name="A", left=tmp_path / "a.jpg", right=tmp_path / "a.jpg")
    if wide:
        project = replace(project, visits=(Visit(date=date(2026, 3, 2), stations=(both,)),))
    with pytest.raises(OptionError, match=says):
        stations_of([tmp_path / named], project)


def test_photos_named_one_by_one_get_the_name_that_their_folder_would_give_them(
    project: Project, tmp_path: Path
) -> None:
    folder = touched(tmp_path / "today", "G1_left.jpg", "G1_right.jpg")
    (named,) = stations_of([folder / "G1_left.jpg", folder / "G1_right.jpg"], project)
    assert [named] == list(stations_of([folder], project)) and named.name == "G1"


def test_one_photo_of_no_side_is_spoken_of_as_one(project: Project, tmp_path: Path) -> None:
    with pytest.raises(PhotoError, match="nobody can tell the camera of its only photo"):
        stations_of([touched(tmp_path / "today", "IMG_1.jpg")], project)
