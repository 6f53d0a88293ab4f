"""Visits by video: stations of it, made once; what stands in the project file, and what goes wrong by name."""

from __future__ import annotations

import shutil
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.camera.video.recorded import made_on
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import ProjectError, rejected
from asbuilt_bim.flow.measure_visit import with_photos
from asbuilt_bim.flow.video_stations import with_video_stations
from asbuilt_bim.measure.station_photos import RejectedStation
from asbuilt_bim.project.found import find_files
from asbuilt_bim.project.initial import initial_text
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.scale.cache import Cache
from tests.camera.stereo_films import panned, write_film
from tests.project_folder import plain, write_project

BOTH = {"left": "walk_left.avi", "right": "walk_right.avi"}


class Steps:
    """Remembers what it was told."""

    def __init__(self) -> None:
        self.seen: list[tuple[str, int, int, str]] = []

    def __call__(self, step: str, done: int, total: int, what: str = "") -> None:
        self.seen.append((step, done, total, what))


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("walk")
    pairs = panned(60, 6.0)
    write_film(folder / "walk_left.avi", [left for left, _ in pairs])
    write_film(folder / "walk_right.avi", [right for _, right in pairs])
    return folder


def project(films: Path, visit: dict[str, Any]) -> Project:
    for needed in ("design.ifc", "markers.csv"):
        (films / needed).touch()
    return read_project(write_project(films, {**plain(), "visits": [{"date": "2026-03-02", **visit}]}))


def test_a_walk_becomes_stations_once_and_is_found_again(films: Path, tmp_path: Path) -> None:
    found = project(films, {"video": BOTH})
    assert films / "walk_left.avi" in found.sources
    first, second = Steps(), Steps()
    with with_video_stations(found, Cache(folder=tmp_path), first) as one:
        names = [station.name for station in one.visits[0].stations]
        assert names[:2] == ["walk_0001", "walk_0002"]
        before = {station.left: station.left.stat().st_mtime_ns for station in one.visits[0].stations}
    with with_video_stations(found, Cache(folder=tmp_path), second) as two:
        assert {s.left: s.left.stat().st_mtime_ns for s in two.visits[0].stations} == before
    assert first.seen[0][:1] == ("frames 2026-03-02",)
    assert first.seen[-1][1:] == (1, 1, f"{len(names)} stations")


def test_a_visit_has_the_stations_of_several_walks(films: Path, tmp_path: Path) -> None:
    shutil.copy(films / "walk_left.avi", films / "upstairs left.avi")
    shutil.copy(films / "walk_right.avi", films / "upstairs right.avi")
    upstairs = {"left": "upstairs left.avi", "right": "upstairs right.avi"}
    found = project(films, {"video": [BOTH, upstairs], "near_stations": {"upstairs_0001": {"storey": "1F"}}})
    assert {films / name for name in (*BOTH.values(), *upstairs.values())} <= set(found.sources)
    with with_video_stations(found, Cache(folder=tmp_path), Steps()) as one:
        stations = {station.name: station for station in one.visits[0].stations}
    assert {"walk_0001", "upstairs_0001"} <= set(stations)
    assert stations["upstairs_0001"].near is not None and stations["walk_0001"].near is None


def test_without_a_cache_the_frames_go_when_the_run_ends(films: Path) -> None:
    with with_video_stations(project(films, {"video": BOTH}), Cache(folder=None), Steps()) as found:
        left = found.visits[0].stations[0].left
        assert left.is_file()
    assert not left.parent.exists()


def test_a_visit_has_the_stations_that_are_listed_too(films: Path, tmp_path: Path) -> None:
    listed = [{"name": "A1", "left": "v/A1_left.jpg", "right": "v/A1_right.jpg"}]
    with with_video_stations(
        project(films, {"stations": listed, "video": BOTH}), Cache(folder=tmp_path), Steps()
    ) as one:
        assert [station.name for station in one.visits[0].stations][:2] == ["A1", "walk_0001"]
    listed[0]["name"] = "walk_0001"
    found = project(films, {"stations": listed, "video": BOTH})
    wanted = pytest.raises(ProjectError, match=r"'walk_0001' is a station of the video .*and listed")
    with wanted, with_video_stations(found, Cache(folder=tmp_path), Steps()):
        pass


@pytest.mark.parametrize(
    ("made", "said"),
    [(date(2026, 2, 20), date(2026, 2, 20)), (date(2026, 3, 2), date(2026, 3, 2)), (date(2026, 3, 20), None),
     (None, None)],
)  # fmt: skip
def test_frames_say_the_day_of_their_film_unless_it_was_exported_later(
    tmp_path: Path, made: date | None, said: date | None
) -> None:
    pairs = panned(20, 6.0)
    film = write_film(tmp_path / "walk.mp4", [np.hstack(pair) for pair in pairs])
    data = bytearray(film.read_bytes())
    seconds = 0 if made is None else (made - date(1904, 1, 1)).days * 86_400 + 43_200
    at = data.index(b"mvhd") + 8  # behind version and flags
    data[at : at + 4] = seconds.to_bytes(4, "big")
    film.write_bytes(data)
    assert made_on(film) == made
    found = project(tmp_path, {"video": {"both": "walk.mp4"}})
    with with_video_stations(found, Cache(folder=tmp_path / "cache"), Steps()) as one:
        station = one.visits[0].stations[0]
        for photo in (read_photo(station.left), read_photo(station.right)):
            assert photo.exif.taken == said
            assert decode(photo).shape == (240, 320, 3)


def test_a_missing_video_is_named(films: Path, tmp_path: Path) -> None:
    found = project(films, {"video": {**BOTH, "right": "gone.avi"}})
    gone = pytest.raises(ProjectError, match=r"visits\[0\].video.right: gone\.avi")
    with gone, with_video_stations(found, Cache(folder=tmp_path), Steps()):
        pass


def test_stations_of_a_video_have_the_visit_s_rough_place_or_their_own(films: Path, tmp_path: Path) -> None:
    places = {"near": {"storey": "GF"}, "near_stations": {"walk_0002": {"storey": "1F"}}}
    found = project(films, {"video": BOTH, **places})
    with with_video_stations(found, Cache(folder=tmp_path), Steps()) as one:
        first, second, *_ = one.visits[0].stations
    assert first.near is not None and first.near.storey == "GF"
    assert second.near is not None and second.near.storey == "1F"
    places["near_stations"] = {"walk_002": {"storey": "1F"}}
    found = project(films, {"video": BOTH, **places})
    wrong = pytest.raises(ProjectError, match=r"near_stations\.walk_002 .* did you mean walk_0002\?")
    with wrong, with_video_stations(found, Cache(folder=tmp_path), Steps()):
        pass


def test_a_missing_design_is_told_before_the_video_is_looked_through(films: Path, tmp_path: Path) -> None:
    found = project(films, {"video": BOTH})
    (films / "design.ifc").unlink()
    steps, cache = Steps(), Cache(folder=tmp_path)
    with pytest.raises(ProjectError, match=r"design\.ifc"), with_video_stations(found, cache, steps):
        pass
    assert not steps.seen


@pytest.mark.parametrize(
    ("visit", "text"),
    [
        ({}, "a visit has at least one station, or a video"),
        ({"video": {"left": "walk_left.avi"}}, "needs left and right, or both"),
        ({"video": {"left": "walk_left.avi", "right": "walk_left.avi"}}, "is the same file as left"),
        ({"video": {"both": "../walk.avi"}}, "leads out of the project folder"),
        ({"video": [BOTH, {"both": "../walk.avi"}]}, r"video\[1\].both: .* leads out of the project folder"),
        ({"video": []}, "a visit has at least one station, or a video"),
    ],
)
def test_what_is_wrong_with_a_video_in_the_project_file_is_named(films: Path, visit: dict[str, Any], text: str) -> None:
    with pytest.raises(ProjectError, match=text):
        project(films, visit)


def test_a_rig_is_not_calibrated_from_a_video_that_has_no_frames_yet(films: Path) -> None:
    contents = {**plain(), "rig": {"tags": {}}, "visits": [{"date": "2026-03-02", "video": BOTH}]}
    with pytest.raises(ProjectError, match="the frames of a video aren't there yet"):
        read_project(write_project(films, contents))


def test_what_is_planned_before_a_run_needs_no_video(films: Path) -> None:
    path = write_project(films, {**plain(), "visits": [{"date": "2026-03-02", "video": {"both": "tomorrow.mp4"}}]})
    assert read_project(path, visited=False).visits == ()


def test_a_draft_names_the_videos_it_finds(tmp_path: Path) -> None:
    (tmp_path / "2026-03-02").mkdir()
    for name in ("walk_left.mp4", "walk_right.mp4"):
        (tmp_path / "2026-03-02" / name).write_bytes(b"")
    (tmp_path / "hall.mov").write_bytes(b"")
    text = initial_text("Site", find_files(tmp_path))
    assert "  - date: 2026-03-02  # a walk" in text
    assert '    video: {left: "2026-03-02/walk_left.mp4", right: "2026-03-02/walk_right.mp4"}' in text
    assert '#    video: {both: "hall.mov"}' in text


def test_two_visits_of_one_day_are_told_that_one_may_hold_both_videos(films: Path) -> None:
    contents = plain() | {"visits": [{"date": "2026-03-02", "video": {**BOTH}} for _ in range(2)]}
    with pytest.raises(ProjectError, match="is the date of visits\\[0\\] too; a visit may hold several videos"):
        read_project(write_project(films, contents))


def test_who_exchanged_a_video_s_eyes_is_not_sent_to_rename_frames_in_the_cache(films: Path, tmp_path: Path) -> None:
    with with_video_stations(project(films, {"video": BOTH}), Cache(folder=tmp_path), Steps()) as one:
        station = one.visits[0].stations[0]
    about_it = about(SubjectKind.STATION, station.name)
    swapped = rejected(Reason.PHOTOS_SWAPPED, about_it, rows_px=5.8, undone_rows_px=1.3, limit_px=2.0)
    told = with_photos(RejectedStation(station=station.name, rejections=(swapped,)), station, one)
    assert isinstance(told, RejectedStation)
    words = str(words_of(told.rejections[0]))
    assert "_left.png" not in words and "exchange left and right of the photos or of the video" in words
