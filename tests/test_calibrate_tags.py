"""`calibrate --tags` and a project's `rig.tags`: a rig from photos of tags, and no board at all."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.cli import app
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.flow.rig_source import calibrate, rig_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache
from tests.camera.calibration.test_tag_rig import area_pulls
from tests.camera.tag_pictures import RIG, TAG, photos, placed
from tests.project_folder import plain, write_project

COUNT = 4


def quiet(*_: object, **__: object) -> None:
    return None


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("Marken Süd")
    for pair in photos(placed(COUNT, 6, 1), 1):
        for photo in pair:
            (folder / photo.name).write_bytes(photo.data)
    return folder


@pytest.fixture
def invoke(taken: Path, tmp_path: Path) -> Callable[..., Result]:
    def run(*options: object) -> Result:
        patterns = ["--left", taken / "*_left.jpg", "--right", taken / "*_right.jpg", "--out", tmp_path / "rig.yaml"]
        return CliRunner().invoke(app, ["calibrate", *map(str, patterns), *map(str, options)])

    return run


def test_photos_of_tags_give_a_rig_and_a_page_that_speaks_of_tags(
    invoke: Callable[..., Result], tmp_path: Path
) -> None:
    result = invoke("--tags", TAG.size_m, "--report", tmp_path / "page.html")
    assert result.exit_code == 0, result.output
    assert "sightings of tags" in result.output and "tags of another size would show" in result.output.replace(
        "\n", " "
    )
    assert read_rig(tmp_path / "rig.yaml").baseline_m == pytest.approx(RIG.baseline_m, rel=0.006)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "S01_left.jpg + S01_right.jpg: tag 3" in page and "The tags' own sides" in page
    assert "board" not in page.split("<body>")[1].replace("or a second board", "")  # to check the length with


def test_tags_of_another_family_are_not_found_and_the_pairs_are_named(invoke: Callable[..., Result]) -> None:
    result = invoke("--tags", TAG.size_m, "--family", "aruco_4x4_50")
    said = " ".join(result.stderr.split())
    assert result.exit_code == 1 and "0 sightings of a tag in both photos" in said
    assert "no tag of aruco_4x4_50 was found in both photos" in said and "S00_left.jpg" in said


@pytest.mark.parametrize("wrong", [["--tags", "0.2", "--board", "chessboard,9x6,0.06"], ["--tags", "160"], []])
def test_tags_with_a_board_or_in_millimetres_are_wrong_usage(invoke: Callable[..., Result], wrong: list[str]) -> None:
    assert invoke(*wrong).exit_code == 2


def test_a_project_s_rig_is_made_from_its_visit_s_own_photos_and_a_missing_one_costs_its_pair(
    taken: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "site"
    names = [f"S{number:02d}" for number in range(COUNT + 1)]  # of the last one there are no photos
    stations = [{"name": name, "left": f"v/{name}_left.jpg", "right": f"v/{name}_right.jpg"} for name in names]
    contents = {**plain(), "rig": {"tags": {}}, "visits": [{"date": "2026-03-02", "stations": stations}]}
    contents["markers"]["size_m"] = TAG.size_m
    project = read_project(write_project(folder, contents))
    (folder / "v").mkdir()
    for photo in taken.iterdir():
        (folder / "v" / photo.name).write_bytes(photo.read_bytes())
    found = rig_of(project, Cache(folder=tmp_path / "cache"), quiet)
    assert found.calibration is not None and abs(area_pulls(found.calibration)).max() < 3.5
    assert [one.code for one in found.calibration.left_out] == [Reason.PHOTO_UNUSABLE]
    assert found.rig.camera_serial == "left" and found.rig.camera_serial_right == "right"
    again = calibrate(project, Cache(folder=tmp_path / "cache"), quiet)
    assert (again.rig.left.K == found.rig.left.K).all()


def test_a_visit_without_enough_tags_is_refused_with_what_is_missing(tmp_path: Path) -> None:
    folder = tmp_path / "site"
    contents = {**plain(), "rig": {"tags": {"visit": date(2026, 3, 16)}}}
    project = read_project(write_project(folder, contents))
    with pytest.raises(CalibrationError, match="0 sightings of a tag in both photos, in 0 pairs"):
        calibrate(project, Cache(folder=None), quiet)
