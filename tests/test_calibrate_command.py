from __future__ import annotations

import errno
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from asbuilt_bim.camera.calibration.control_file import COLUMNS
from asbuilt_bim.camera.rig_formats.factory import FACTORY
from asbuilt_bim.camera.rig_formats.reader import read_rig, write_rig_as
from asbuilt_bim.cli import app
from asbuilt_bim.errors import ProjectError, RigError
from asbuilt_bim.flow.rig_source import calibrate, rig_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache
from tests.camera.board_pictures import CHESS, pairs
from tests.camera.calibration.test_control_rig import control
from tests.camera.rig_formats.written import zed_conf
from tests.camera.virtual import rig
from tests.project_folder import plain, write_project

BOARD = "charuco,9x7,0.08,0.06,DICT_5X5_100"
LARGER = "charuco,9x7,0.083,0.062,DICT_5X5_100"
SAMPLE = Path(__file__).parents[1] / "sample_models/site/calibration"


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("Brett Süd")
    for number in range(1, 9):
        for side in ("left", "right"):
            shutil.copy(SAMPLE / f"{side}_{number:02d}.jpg", folder)
    return folder


def invoke(photos: Path, *arguments: object, board: str = BOARD) -> Result:
    patterns = ["--left", photos / "left_*.jpg", "--right", photos / "right_*.jpg", "--board", board]
    return CliRunner().invoke(app, ["calibrate", *map(str, patterns), *map(str, arguments)])


def test_boards_in_a_folder_give_a_rig_a_page_and_a_known_length(photos: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "rig.yaml", tmp_path / "calibration.html"
    for side in ("left", "right"):  # the same print taken once more
        shutil.copy(photos / f"{side}_01.jpg", tmp_path / f"check_{side}.jpg")
    second = ["--check-board", BOARD, "--check-left", tmp_path / "check_left.jpg"]
    second += ["--check-right", tmp_path / "check_right.jpg"]
    result = invoke(photos, "--out", out, "--report", page, *second)
    assert result.exit_code == 0, result.output
    assert read_rig(out).baseline_m == pytest.approx(0.25, rel=0.003)
    assert "no known length was checked" not in result.output
    assert "Known length: the check board" in result.output and "an area at 5 m" in result.output
    assert str(photos) not in page.read_text(encoding="utf-8").split("Known lengths")[0]
    assert "left_08.jpg" in page.read_text(encoding="utf-8")


def test_a_rig_whose_scale_is_off_is_refused_and_not_written(photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "rig.yaml"
    second = ["--check-board", BOARD, "--check-left", photos / "left_01.jpg", "--check-right", photos / "right_01.jpg"]
    result = invoke(photos, "--out", out, *second, board=LARGER)
    assert result.exit_code == 1 and "the rig's scale is off" in result.stderr.replace("\n", " ")
    assert not out.exists()


def test_a_pair_and_squares_of_the_calibrations_own_prove_no_scale_and_are_refused(
    photos: Path, tmp_path: Path
) -> None:
    out = tmp_path / "rig.yaml"
    own = ["--check-board", BOARD, "--check-left", photos / "left_01.jpg", "--check-right", photos / "right_01.jpg"]
    result = invoke(photos, "--out", out, *own)
    assert result.exit_code == 1 and "it fits whatever they are" in result.stderr.replace("\n", " ")
    assert not out.exists()


def test_a_rig_that_is_not_to_measure_with_leaves_the_one_that_was_there_and_says_what_is_missing_last(
    tmp_path: Path,
) -> None:
    for pair in pairs(CHESS, 8):  # near the middle of the frame alone
        for photo in pair:
            (tmp_path / photo.name).write_bytes(photo.data)
    out, page = tmp_path / "rig.yaml", tmp_path / "page.html"
    out.write_text("the rig of last month", encoding="utf-8")
    result = invoke(tmp_path, "--out", out, "--report", page, "--replace", board="chessboard,9x6,0.06")
    assert result.exit_code == 1 and out.read_text(encoding="utf-8") == "the rig of last month"
    assert "Don't measure with this rig" in page.read_text(encoding="utf-8").replace("&#39;", "'")
    last = " ".join(result.stderr.split())
    assert "no rig is written. Don't measure with this rig." in last and "at its worst place (limit 3 %)" in last
    assert "Take more pairs: the board " in last and "stand 200 mm apart, measure the board's squares again" in last
    assert "name it in the project file" not in result.output


def test_a_rig_that_is_there_is_only_written_over_when_asked_to(photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "rig.yaml"
    out.write_text("the rig of last month", encoding="utf-8")
    refused = invoke(photos, "--out", out)
    assert refused.exit_code == 1 and "a rig is there already" in refused.stderr.replace("\n", " ")
    assert out.read_text(encoding="utf-8") == "the rig of last month"
    assert invoke(photos, "--out", out, "--replace").exit_code == 0
    assert read_rig(out).baseline_m == pytest.approx(0.25, rel=0.003)


def test_a_rig_for_ros_is_two_files_and_they_are_named(photos: Path, tmp_path: Path) -> None:
    result = invoke(photos, "--out", tmp_path / "rig.yaml", "--format", "ros")
    assert result.exit_code == 0, result.output
    assert "no known length was checked" in result.output  # whoever asks for no page hears of it, too
    found = read_rig(tmp_path / "rig_left.yaml", tmp_path / "rig_right.yaml")
    assert found.baseline_m == pytest.approx(0.25, rel=0.003) and "file_right: rig_right.yaml" in result.output


@pytest.mark.parametrize(
    "wrong",
    [
        ["--check-length", "1.2"],
        ["--check-points", "1,1 2,2 3,3 4,4"],
        ["--check-board", BOARD],
        ["project.yaml"],
        ["--format", "matlab"],
        ["--check-length", "-1", "--check-points", "1,1"],
    ],
)
def test_options_that_do_not_go_together_are_wrong_usage(photos: Path, tmp_path: Path, wrong: list[str]) -> None:
    assert invoke(photos, "--out", tmp_path / "rig.yaml", *wrong).exit_code == 2


def test_what_cannot_be_read_from_the_command_line_is_named(photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "rig.yaml"
    points = invoke(photos, "--out", out, "--check-length", "1.2", "--check-points", "1,1 2,2")
    assert points.exit_code == 2 and 'expected "xl,yl xr,yr' in points.stderr.replace("\n", " ")
    board = invoke(photos, "--out", out, board="chessboard,9x6")
    assert board.exit_code == 1 and "expected chessboard,COLUMNSxROWS,SQUARE_M" in board.stderr.replace("\n", " ")
    same = invoke(photos, "--out", out, "--report", out)
    assert same.exit_code == 1 and "can't be one file" in same.stderr.replace("\n", " ")
    over = invoke(photos, "--out", photos / "left_01.jpg", "--replace")
    assert over.exit_code == 1 and "is read for this calibration" in over.stderr.replace("\n", " ")
    nothing = CliRunner().invoke(
        app, ["calibrate", "--left", "none_*.jpg", "--right", "no_*.jpg", "--board", BOARD, "--out", str(out)]
    )
    assert nothing.exit_code == 1 and "no file fits it" in nothing.stderr.replace("\n", " ")
    assert not out.exists()


def points_file(folder: Path) -> Path:
    points = control(40, 0.2)
    file = folder / "points.csv"
    rows = [
        ",".join([name, *(f"{value:.6f}" for value in row)])
        for name, row in zip(points.names, np.hstack([points.points_m, points.left_px, points.right_px]), strict=True)
    ]
    file.write_text("\n".join([",".join(COLUMNS), *rows]), encoding="utf-8")
    return file


def test_control_points_give_a_rig_to_a_camera_that_sees_no_board(tmp_path: Path) -> None:
    out, page = tmp_path / "rig.yaml", tmp_path / "page.html"
    given = ["--control-points", points_file(tmp_path), "--photo-size", "1280x960", "--out", out, "--report", page]
    result = CliRunner().invoke(app, ["calibrate", *map(str, given)])
    assert result.exit_code == 0, result.output
    assert read_rig(out).baseline_m == pytest.approx(rig().baseline_m, rel=0.02)
    assert "of 40 and 40 points" in page.read_text(encoding="utf-8") and "40 and 40 control points" in result.output
    for size in ("1280", "0x960", "wide"):
        again = CliRunner().invoke(app, ["calibrate", *map(str, given[:3]), size, "--out", str(out)])
        assert again.exit_code == 2 and "no size in pixels" in again.stderr


def test_a_project_may_name_control_points_as_its_rig(tmp_path: Path) -> None:
    named = {"control_points": {"file": "points.csv", "photo_size_px": [1280, 960]}}
    project = write_project(tmp_path / "site", {**plain(), "rig": named})
    points_file(project.parent)
    made = calibrate(read_project(project), Cache(folder=None), lambda *_, **__: None)
    assert made.rig.baseline_m == pytest.approx(rig().baseline_m, rel=0.02)
    assert project.parent / "points.csv" in read_project(project).sources


def test_a_project_may_name_the_two_files_of_another_program_as_its_rig(tmp_path: Path) -> None:
    named = {"file": "rig_left.yaml", "file_right": "rig_right.yaml"}
    project = read_project(write_project(tmp_path / "site", {**plain(), "rig": named}))
    write_rig_as(rig(), tmp_path / "site" / "rig.yaml", "ros")
    found = rig_of(project, Cache(folder=None), lambda *_, **__: None)
    assert found.calibration is None and found.rig.baseline_m == pytest.approx(rig().baseline_m, rel=1e-9)
    assert tmp_path / "site" / "rig_right.yaml" in project.sources


def test_a_page_goes_over_no_file_unasked_and_a_place_for_none_is_refused_before_the_rig_is_written(
    photos: Path, tmp_path: Path
) -> None:
    out, thesis = tmp_path / "rig.yaml", tmp_path / "thesis.docx"
    thesis.write_text("three years", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    for page, says in (
        (thesis, "a page or another file is there already; name another, or --replace"),
        (tmp_path / "folder", "is a folder; name a file"),
        (tmp_path / "nodir" / "x.html", "there is no folder"),
    ):
        refused = invoke(photos, "--out", out, "--report", page)
        assert refused.exit_code == 1 and says in refused.stderr.replace("\n", " ")
        assert not out.exists()
    assert thesis.read_text(encoding="utf-8") == "three years"
    assert invoke(photos, "--out", out, "--report", thesis, "--replace").exit_code == 0


def test_a_full_disk_leaves_the_rig_that_was_there_and_nothing_beside_it(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "rig.yaml"
    out.write_text("the rig of last month", encoding="utf-8")

    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("asbuilt_bim.storage.atomic_write.os.fsync", full)
    result = invoke(photos, "--out", out, "--report", tmp_path / "page.html", "--replace")
    assert result.exit_code == 1 and "No space left" in result.stderr
    assert out.read_text(encoding="utf-8") == "the rig of last month" and list(tmp_path.iterdir()) == [out]


def test_boards_that_hold_both_eyes_in_one_photo_give_the_same_rig(photos: Path, tmp_path: Path) -> None:
    apart = invoke(photos, "--out", tmp_path / "apart.yaml")
    (tmp_path / "both").mkdir()
    for left in sorted(photos.glob("left_*.jpg")):
        eyes = [cv2.imread(str(left.with_name(left.name.replace("left", side)))) for side in ("left", "right")]
        cv2.imwrite(str(tmp_path / "both" / f"{left.stem}.png"), np.concatenate(eyes, axis=1))
    arguments = ["calibrate", "--both", tmp_path / "both/*.png", "--board", BOARD, "--out", tmp_path / "both.yaml"]
    check = ["--check-board", LARGER, "--check-both", tmp_path / "both/left_01.png"]
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert apart.exit_code == 0 and done.exit_code == 0, done.output
    assert read_rig(tmp_path / "both.yaml").baseline_m == read_rig(tmp_path / "apart.yaml").baseline_m
    arguments[-1] = tmp_path / "checked.yaml"
    refused = CliRunner().invoke(app, [*map(str, (*arguments, *check))])
    assert refused.exit_code == 1 and "scale is off" in refused.output and not (tmp_path / "checked.yaml").exists()
    twice = CliRunner().invoke(app, [*map(str, arguments), "--left", "a*.jpg"])
    assert twice.exit_code == 2 and "(or --both)" in twice.output


def test_a_project_names_photos_of_both_eyes_once(tmp_path: Path) -> None:
    document = plain()
    boards = document["rig"]["boards"]
    del boards["left"], boards["right"]
    boards["both"] = "calibration/left_*.jpg"
    document["visits"] = [{"date": "2026-03-02", "stations": [{"name": "A1", "both": "v/A1.png"}]}]
    project = read_project(write_project(tmp_path / "site", document))
    assert project.visits[0].stations[0].side_by_side and len(project.rig.pairs) == 3
    assert all(left == right for left, right in project.rig.pairs)
    document["visits"][0]["stations"][0]["left"] = "v/A1_left.png"
    with pytest.raises(ProjectError, match="needs left and right, or both"):
        read_project(write_project(tmp_path / "other", document))


def test_a_projects_rig_of_several_resolutions_takes_that_of_its_photos(tmp_path: Path) -> None:
    document = {**plain(), "rig": {"file": "eyes.conf"}}
    document["visits"] = [{"date": "2026-03-02", "stations": [{"name": "A1", "both": "v/A1.png"}]}]
    path = write_project(tmp_path / "site", document)
    hd, vga = zed_conf(rig()), zed_conf(rig(), "VGA").split("[STEREO]")[0]
    (path.parent / "eyes.conf").write_text(hd + vga, encoding="utf-8")
    with pytest.raises(RigError, match=r"rig\.photo_size_px"):
        rig_of(read_project(path), Cache(folder=None), lambda *_, **__: None)
    (path.parent / "v").mkdir()
    cv2.imwrite(str(path.parent / "v/A1.png"), np.full((720, 2560, 3), 90, dtype=np.uint8))
    found = rig_of(read_project(path), Cache(folder=None), lambda *_, **__: None)
    assert found.rig.left.width_px == 1280 and found.rig.width == FACTORY
