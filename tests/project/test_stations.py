"""Stations and visits by patterns of file names."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path
from typing import Any, Literal
from unicodedata import normalize

import cv2
import numpy as np
import pytest

from asbuilt_bim.errors import ProjectError
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from tests.project_folder import plain, write_project

BY_NAME = {"left": "v/*_left.jpg", "right": "v/*_right.jpg"}


def project(folder: Path, visits: Any, photos: list[str]) -> Project:
    """Read a project with these visits, in whose folder `v` these photos lie."""
    (folder / "v").mkdir(exist_ok=True)
    for name in photos:
        (folder / "v" / name).write_bytes(b"")
    return read_project(write_project(folder, {**plain(), "visits": visits}))


def names(found: Project) -> list[str]:
    (visit,) = found.visits
    return [station.name for station in visit.stations]


def test_each_pair_is_a_station_named_by_what_the_star_stands_for_in_the_order_people_count_in(tmp_path: Path) -> None:
    photos = [f"{name}_{side}.jpg" for name in ("A10", "A2", "b1") for side in ("left", "right")]
    found = project(tmp_path, [{"date": "2026-03-02", "stations": BY_NAME}], [*photos, "plan.png"])
    assert names(found) == ["A2", "A10", "b1"]
    assert found.visits[0].stations[0].left == tmp_path / "v/A2_left.jpg"
    assert found.visits[0].stations[0].right == tmp_path / "v/A2_right.jpg"


@pytest.mark.parametrize("there", ["A1_left.jpg", "A1_right.jpg"])
def test_a_photo_without_its_partner_stays_a_station_whose_other_photo_is_missing(tmp_path: Path, there: str) -> None:
    photos = [there, "A2_left.jpg", "A2_right.jpg"]
    found = project(tmp_path, [{"date": "2026-03-02", "stations": BY_NAME}], photos)
    assert names(found) == ["A1", "A2"]
    lone = found.visits[0].stations[0]
    assert {lone.left.name, lone.right.name} == {"A1_left.jpg", "A1_right.jpg"}
    assert lone.left.exists() != lone.right.exists()


@pytest.mark.parametrize(("stored", "typed"), [("NFD", "NFC"), ("NFC", "NFD")])
def test_umlauts_of_a_mac_s_file_names_are_those_that_were_typed(
    tmp_path: Path, stored: Literal["NFC", "NFD"], typed: Literal["NFC", "NFD"]
) -> None:
    folder = tmp_path / normalize(stored, "März")
    folder.mkdir()
    for side in ("left", "right"):
        (folder / normalize(stored, f"Süd Tür_{side}.jpg")).touch()
    (tmp_path / normalize(stored, "Entwürfe.ifc")).touch()
    patterns = {side: normalize(typed, f"März/*Tür_{side}.jpg") for side in ("left", "right")}
    near = {normalize("NFC", "Süd"): {"storey": "Ground floor"}}
    contents = plain() | {"ifc": normalize(typed, "Entwürfe.ifc")}
    contents["visits"] = [{"date": "2026-03-02", "stations": patterns, "near_stations": near}]
    found = read_project(write_project(tmp_path, contents))
    assert found.ifc[0].is_file()
    (station,) = found.visits[0].stations
    assert station.name == normalize("NFC", "Süd") and station.near is not None
    assert station.left.is_file() and station.right.is_file()


def test_photos_of_both_eyes_are_stations_too(tmp_path: Path) -> None:
    found = project(tmp_path, [{"date": "2026-03-02", "stations": {"both": "v/walk_*.png"}}], ["walk_07.png"])
    assert names(found) == ["07"]
    assert found.visits[0].stations[0].side_by_side


def test_several_stars_are_one_name_and_what_separates_them_is_left_out(tmp_path: Path) -> None:
    stations = {"left": "v/L*-*.jpg", "right": "v/R*-*.jpg"}
    found = project(tmp_path, [{"date": "2026-03-02", "stations": stations}], ["L_GF-3.jpg", "R_GF-3.jpg"])
    assert names(found) == ["GF_3"]


@pytest.mark.parametrize(
    ("stations", "says"),
    [
        ({"left": "v/A_left.jpg", "right": "v/A_right.jpg"}, r"needs a \* in the file's name"),
        ({"left": "v/*.jpg"}, "needs left and right, or both"),
        ({"left": "v/*-*.jpg", "right": "v/*.jpg"}, r"as many \*"),
        ({"left": "x/*_left.jpg", "right": "x/*_right.jpg"}, "there is no folder"),
        ({"left": "../*_left.jpg", "right": "../*_right.jpg"}, "leads out of the project folder"),
        ({"left": "*/a*_left.jpg", "right": "*/a*_right.jpg"}, r"only the file's name may hold a \*"),
        ({"left": "v/CON*.jpg", "right": "v/CON*.jpeg", "names": "x"}, "unknown key"),
    ],
)
def test_patterns_that_name_no_stations_are_refused_by_name(tmp_path: Path, stations: Any, says: str) -> None:
    with pytest.raises(ProjectError, match=says):
        project(tmp_path, [{"date": "2026-03-02", "stations": stations}], ["A1_left.jpg"])


def test_a_name_that_no_file_system_takes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProjectError, match="Windows keeps for itself"):
        project(tmp_path, [{"date": "2026-03-02", "stations": BY_NAME}], ["nul_left.jpg", "nul_right.jpg"])


def picture(path: Path, day: str) -> None:
    """Write a small JPEG whose EXIF says that it was taken on a day, "" for none."""
    done, data = cv2.imencode(".jpg", np.full((8, 8, 3), 90, np.uint8))
    assert done
    text = day.encode() + b"\0"
    tiff = b"II*\0\x08\0\0\0" + b"\x01\0" + b"\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0" + b"\0\0\0\0"
    tiff += b"\x01\0" + b"\x03\x90\x02\0" + len(text).to_bytes(4, "little") + (44).to_bytes(4, "little") + b"\0\0\0\0"
    exif = b"Exif\0\0" + tiff + text
    segment = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif if day else b""
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(data.tobytes()[:2] + segment + data.tobytes()[2:])


def test_each_day_that_the_photos_tell_is_a_visit(tmp_path: Path) -> None:
    for name, day in (("A1", "2026:03:16 09:00:00"), ("A2", "2026:03:02 23:59:00"), ("A3", "2026:03:02 08:00:00")):
        for side in ("left", "right"):
            picture(tmp_path / f"v/{name}_{side}.jpg", day)
    found = read_project(write_project(tmp_path, {**plain(), "visits": {**BY_NAME, "dates": "exif"}}))
    assert [(visit.date, [one.name for one in visit.stations]) for visit in found.visits] == [
        (date(2026, 3, 2), ["A2", "A3"]),
        (date(2026, 3, 16), ["A1"]),
    ]


def test_photos_that_tell_no_day_are_named_where_days_make_visits(tmp_path: Path) -> None:
    for side in ("left", "right"):
        picture(tmp_path / f"v/A1_{side}.jpg", "2026:03:16 09:00:00")
        picture(tmp_path / f"v/A2_{side}.jpg", "")
    with pytest.raises(ProjectError, match="no photo of A2 says in its EXIF when it was taken"):
        read_project(write_project(tmp_path, {**plain(), "visits": {**BY_NAME, "dates": "exif"}}))


def test_where_days_make_the_visits_rough_places_stand_beside_them_and_nothing_else_need_place_a_station(
    tmp_path: Path,
) -> None:
    for name, day in (("A1", "2026:03:16 09:00:00"), ("A2", "2026:03:02 23:59:00")):
        for side in ("left", "right"):
            picture(tmp_path / f"v/{name}_{side}.jpg", day)
    near = {"near": {"storey": "Ground floor"}, "near_stations": {"A2": {"storey": "First floor"}}}
    unsurveyed = {**plain(), "markers": {"size_m": 0.28}}
    found = read_project(write_project(tmp_path, {**unsurveyed, "visits": {**BY_NAME, "dates": "exif", **near}}))
    places = [station.near for visit in found.visits for station in visit.stations]
    assert [place and place.storey for place in places] == ["First floor", "Ground floor"]
    near["near_stations"] = {"A22": {"storey": "First floor"}}
    with pytest.raises(ProjectError, match=r"visits\.near_stations\.A22: names no station .* did you mean A2\?"):
        read_project(write_project(tmp_path, {**unsurveyed, "visits": {**BY_NAME, "dates": "exif", **near}}))


def test_stations_by_patterns_have_rough_places_by_their_names(tmp_path: Path) -> None:
    photos = [f"{name}_{side}.jpg" for name in ("G1", "U3") for side in ("left", "right")]
    near = {"near": {"storey": "Ground floor"}, "near_stations": {"U3": {"storey": "First floor", "looking": "north"}}}
    found = project(tmp_path, [{"date": "2026-03-02", "stations": BY_NAME, **near}], photos)
    places = {station.name: station.near for station in found.visits[0].stations}
    assert places["G1"] is not None and places["G1"].storey == "Ground floor"
    assert places["U3"] is not None and (places["U3"].storey, places["U3"].looking) == ("First floor", "north")


@pytest.mark.parametrize(("name", "says"), [("U33", "did you mean U3?"), ("roof", "its stations are G1, U3")])
def test_a_rough_place_of_no_station_is_named_with_those_there_are(tmp_path: Path, name: str, says: str) -> None:
    photos = [f"{one}_{side}.jpg" for one in ("G1", "U3") for side in ("left", "right")]
    near = {"near_stations": {name: {"storey": "Ground floor"}}}
    with pytest.raises(ProjectError, match=rf"near_stations\.{name}.*{re.escape(says)}"):
        project(tmp_path, [{"date": "2026-03-02", "stations": BY_NAME, **near}], photos)
