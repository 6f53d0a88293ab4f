"""A project file drafted from a folder."""

from __future__ import annotations

import json
import re
import shutil
from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.cli import app
from asbuilt_bim.project.found import find_files
from asbuilt_bim.project.initial import initial_text, missing
from asbuilt_bim.project.read import read_project
from asbuilt_bim.storage.schemas import schema
from tests.camera.board_pictures import CHARUCO, CHESS, pairs
from tests.project.test_stations import picture

SAMPLE = Path(__file__).parents[2] / "sample_models" / "site"


def made(folder: Path, *files: str, text: str = "") -> Path:
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    return folder


def test_the_samples_folder_gives_the_samples_project_once_three_lengths_are_filled_in(tmp_path: Path) -> None:
    site = tmp_path / "site"
    shutil.copytree(SAMPLE, site)
    (site / "project.yaml").unlink()
    found = find_files(site)
    text = initial_text("Block H", found)
    board = "kind: charuco, columns: 9, rows: 7, square_m: 0.034, marker_m: 0.026, dictionary: DICT_5X5_100"
    assert board in text, "columns and rows are what the photos show"
    filled = text.replace(
        board, "kind: charuco, columns: 9, rows: 7, square_m: 0.08, marker_m: 0.06, dictionary: DICT_5X5_100"
    )
    for line in ("rig:", "  boards:", "           left", "target:", "markers:"):
        filled = filled.replace(f"#{line}", line)
    (site / "project.yaml").write_text(filled)
    ours, theirs = read_project(site / "project.yaml"), read_project(SAMPLE / "project.yaml")
    assert [(v.date, sorted(s.name for s in v.stations)) for v in ours.visits] == [
        (v.date, sorted(s.name for s in v.stations)) for v in theirs.visits
    ]
    assert ours.rig.boards == theirs.rig.boards
    assert ours.ifc[0].name == theirs.ifc[0].name and ours.survey.name == theirs.survey.name
    assert len(missing(found)) == 3  # the board, the disc and the markers: only a tape tells them


@pytest.mark.parametrize("files", [(), ("design.ifc", "calibration/left_1.jpg", "calibration/right_1.jpg")])
def test_a_draft_is_yaml_once_the_hashes_before_its_keys_are_taken_away_and_nothing_else(
    tmp_path: Path, files: tuple[str, ...]
) -> None:
    text = initial_text("Site", find_files(made(tmp_path, *files)))
    document = yaml.safe_load(re.sub(r"^#(?=\S|  )", "", text, flags=re.MULTILINE))
    assert {"ifc", "rig", "target", "markers", "visits"} <= document.keys()
    assert document["target"] == {"diameter_m": 0.3} and document["markers"]["sigma_m"] == 0.003


@pytest.mark.parametrize(
    ("names", "left", "right"),
    [
        (("A1_left.jpg", "A1_right.jpg", "A2_left.jpg", "A2_right.jpg"), "*_left.jpg", "*_right.jpg"),
        (("left_1.png", "right_1.png", "left_2.png", "right_2.png"), "left_*.png", "right_*.png"),
        (("G1-Left.JPG", "G1-Right.JPG"), "*-Left.JPG", "*-Right.JPG"),
        (("01_L.jpg", "01_R.jpg"), "*_L.jpg", "*_R.jpg"),
        (("cam0_5.png", "cam1_5.png"), "cam0_*.png", "cam1_*.png"),
    ],
)
def test_pairs_are_known_by_how_people_name_two_cameras(
    tmp_path: Path, names: tuple[str, ...], left: str, right: str
) -> None:
    (photos,) = find_files(made(tmp_path, *(f"2026-03-02/{name}" for name in names))).visits
    assert (photos.left, photos.right) == (f"2026-03-02/{left}", f"2026-03-02/{right}")
    assert photos.pairs == len(names) // 2 and photos.day == date(2026, 3, 2)


def test_photos_whose_camera_nobody_can_tell_are_counted_and_named(tmp_path: Path) -> None:
    found = find_files(made(tmp_path, "v/IMG_1.jpg", "v/IMG_2.jpg"))
    assert found.visits == () and found.photos_alone == ("v/IMG_1.jpg", "v/IMG_2.jpg")
    (told,) = [what for what in missing(found) if "2 photos are in no pair (v/IMG_1.jpg, v/IMG_2.jpg)" in what]
    assert 'left: "one/*.jpg", right: "other/*.jpg"' in told


def test_a_folder_of_photos_of_two_days_is_drafted_as_a_visit_for_each(tmp_path: Path) -> None:
    for name, day in (("A1", "2026:03:02 09:00:00"), ("A2", "2026:03:16 08:00:00"), ("A3", "2026:03:16 08:05:00")):
        for side in ("left", "right"):
            picture(tmp_path / f"photos/{name}_{side}.jpg", day)
    done = CliRunner().invoke(app, ["init", str(made(tmp_path, "design.ifc"))])
    text, told = (tmp_path / "project.yaml").read_text(), "By their EXIF the photos are of 2026-03-02, 2026-03-16"
    assert "2 visits with 3 photo pairs" in done.output and told in " ".join(done.output.split()) and told in text
    for key in ("rig", "target", "markers"):
        text = text.replace(f"#{key}:", f"{key}:")
    text = text.replace("#  near", "  near").replace('survey: "markers.csv", ', "").replace("survey: markers.csv, ", "")
    (tmp_path / "project.yaml").write_text(text)
    project = read_project(tmp_path / "project.yaml")
    assert [(visit.date.day, [one.name for one in visit.stations]) for visit in project.visits] == [
        (2, ["A1"]),
        (16, ["A2", "A3"]),
    ]
    for side in ("left", "right"):
        picture(tmp_path / f"2026-03-20/B1_{side}.jpg", "")
    found = find_files(tmp_path)
    assert any("photos of 2026-03-02, 2026-03-16 by EXIF; move each day's" in what for what in missing(found))
    drafted = yaml.safe_load(initial_text("Site", found))["visits"]
    assert [str(visit["date"]) for visit in drafted] == ["2026-03-20"]


@pytest.mark.parametrize("sides", [("cam0", "cam1"), ("links", "rechts"), ("photos left", "photos right")])
def test_two_folders_one_a_camera_are_pairs_where_a_photo_and_its_partner_have_one_name(
    tmp_path: Path, sides: tuple[str, str]
) -> None:
    made(tmp_path, *(f"2026-03-02/{side}/{name}.jpg" for side in sides for name in ("1", "2")))
    made(tmp_path, f"2026-03-02/{sides[0]}/3.jpg", "calibration/left/1.jpg", "calibration/right/1.jpg")
    found = find_files(tmp_path)
    ((photos,), (boards,)) = found.visits, found.boards
    assert (photos.left, photos.right) == tuple(f"2026-03-02/{side}/*.jpg" for side in sides)
    assert (photos.pairs, photos.day) == (2, date(2026, 3, 2)) and boards.right == "calibration/right/*.jpg"
    assert found.photos_alone == (f"2026-03-02/{sides[0]}/3.jpg",)
    made(tmp_path, "design.ifc")
    (tmp_path / "project.yaml").write_text(initial_text("Site", found).replace("#markers", "markers"))
    listed = yaml.safe_load((tmp_path / "project.yaml").read_text())["visits"]
    assert listed[0]["stations"] == {"left": photos.left, "right": photos.right}


def test_pictures_that_nothing_here_reads_are_named_with_what_to_do_and_not_blamed_for_their_names(
    tmp_path: Path,
) -> None:
    found = find_files(made(tmp_path, *(f"photos/IMG_{n}_{side}.HEIC" for n in (1, 2) for side in ("left", "right"))))
    told = "\n".join(missing(found))
    assert "4 pictures can't be read (photos/IMG_1_left.HEIC, " in told and "convert them to JPEG" in told
    assert "no photo pairs" not in told


def test_boards_are_no_visit_and_results_are_no_photos(tmp_path: Path) -> None:
    made(tmp_path, "calibration/left_1.jpg", "calibration/right_1.jpg", "design.ifc", "out/design.asbuilt.ifc")
    made(tmp_path, "out/current.json", "out/pictures/a_left.jpg", "out/pictures/a_right.jpg")
    found = find_files(tmp_path)
    assert [photos.left for photos in found.boards] == ["calibration/left_*.jpg"]
    assert found.visits == () and found.designs == ("design.ifc",)


def test_a_rig_file_and_a_survey_are_known_by_what_stands_in_them(tmp_path: Path) -> None:
    made(tmp_path, "rigs/mine.yaml", text="format: asbuilt-bim/rig\nversion: 1\n")
    made(tmp_path, "other.yaml", "notes.csv", text="a,b\n")
    made(tmp_path, "tags.csv", text="\ufeffid,corner,x_m,y_m,z_m\n")
    made(tmp_path, "SN21531.conf", text="[LEFT_CAM_2K]\n")
    found = find_files(tmp_path)
    made(tmp_path, "calib.json", text='{\n    "batchName": "",\n    "cameraData": [')
    found = find_files(tmp_path)
    assert found.rigs == ("rigs/mine.yaml",) and found.surveys == ("tags.csv",)
    assert found.factory == (("SN21531.conf",), ("calib.json",))
    assert '  file: "rigs/mine.yaml"\n# or: {file: "SN21531.conf"}' in initial_text("Site", found)


@pytest.mark.parametrize(
    ("left", "right"),
    [("LeftCameraParams.yaml", "RightCameraParams.yaml"), ("cam0/sensor.yaml", "cam1/sensor.yaml"),
     ("cam_left.yaml", "cam_right.yaml")],
)  # fmt: skip
def test_other_programs_rig_files_are_found_one_of_each_camera_or_both_in_one(
    tmp_path: Path, left: str, right: str
) -> None:
    sensor = (
        "sensor_type: camera\ncamera_model: pinhole\nresolution: [752, 480]\nintrinsics: [458.0, 457.0, 367.0, 248.0]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n"
        "T_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, {x}, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, "
        "0.0, 0.0, 0.0, 1.0]\n"
    )
    made(tmp_path, left, text=sensor.format(x="0.0"))
    made(tmp_path, right, text=sensor.format(x="0.11"))
    made(tmp_path, "notes.yaml", text="a: 1\n")
    found = find_files(tmp_path)
    assert found.factory == ((left, right),)
    drafted = yaml.safe_load(initial_text("Site", found))
    assert drafted["rig"] == {"file": left, "file_right": right}


def test_a_bought_camera_s_own_numbers_are_drafted_only_where_no_board_was_photographed(tmp_path: Path) -> None:
    made(tmp_path, "design.ifc", "oak calib.json", text='{"cameraData": []}')
    found = find_files(tmp_path)
    assert 'rig:\n  file: "oak calib.json"\n' in initial_text("Site", found)
    assert any("oak calib.json is of the camera's maker or another program" in one for one in missing(found))
    made(tmp_path, "calibration/left_1.jpg", "calibration/right_1.jpg")
    text = initial_text("Site", find_files(tmp_path))
    assert "\n#rig:\n#  boards:" in text
    assert '# or, less sure, as the camera came: {file: "oak calib.json"}' in text


def test_a_second_survey_is_named_and_not_left_out_without_a_word(tmp_path: Path) -> None:
    found = find_files(made(tmp_path, "markers.csv", "markers 2.csv", text="id,corner,x_m,y_m,z_m\n"))
    assert '# or the survey: "markers.csv"' in initial_text("Site", found)
    assert "2 surveys (markers 2.csv, markers.csv): name under markers the one that counts" in missing(found)


def test_the_command_to_run_next_can_be_pasted_where_the_folder_has_a_blank(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["init", str(made(tmp_path / "My site (2)", "design.ifc"))])
    assert f'asbuilt-bim run "{tmp_path / "My site (2)" / "project.yaml"}" --out' in done.output.replace("\n", "")


def test_a_draft_of_hostile_names_is_still_the_yaml_that_was_meant(tmp_path: Path) -> None:
    name = 'a": [x], "b\\ #{é}'
    made(tmp_path, f"{name}.ifc".replace("\\", "_"))
    found = find_files(tmp_path)
    document = yaml.safe_load(initial_text('Site: "7" # {x}', found))
    assert document["ifc"] == found.designs[0] and document["name"] == 'Site: "7" # {x}'


def test_the_command_writes_once_with_a_schema_beside_it_that_needs_no_network(tmp_path: Path) -> None:
    made(tmp_path, "design.ifc")
    done = CliRunner().invoke(app, ["init", str(tmp_path)])
    assert done.exit_code == 0 and "Still missing:" in done.output and "no survey" in done.output
    text = (tmp_path / "project.yaml").read_text()
    beside = text.splitlines()[0].split("$schema=")[1]
    assert json.loads((tmp_path / beside).read_text()) == schema("project-1")
    again = CliRunner().invoke(app, ["init", str(tmp_path)])
    assert again.exit_code == 1 and "is there already" in again.output
    assert (tmp_path / "project.yaml").read_text() == text
    assert CliRunner().invoke(app, ["init", str(tmp_path / "nowhere")]).exit_code == 1


def test_what_is_left_to_fill_in_is_named_by_run_with_its_line(tmp_path: Path) -> None:
    made(tmp_path, "design.ifc")
    CliRunner().invoke(app, ["init", str(tmp_path)])
    done = CliRunner().invoke(app, ["run", str(tmp_path / "project.yaml"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 1 and "rig: is missing" in done.output
    lines = (tmp_path / "project.yaml").read_text().splitlines()
    for key in ("rig", "visits"):
        line = next(number for number, text in enumerate(lines, start=1) if text.startswith(f"#{key}:"))
        assert f"line {line}: {key}: " in done.output
    assert done.output.count("replace what is an example") == 2


def test_every_number_that_was_not_read_from_the_folder_is_marked_as_an_example(tmp_path: Path) -> None:
    found = find_files(made(tmp_path, "design.ifc", "calibration/left_1.jpg", "calibration/right_1.jpg"))
    lines = initial_text("Site", found).splitlines()
    for key in ("square_m", "columns", "diameter_m", "size_m", "sigma_m"):
        assert any("EXAMPLE" in line and re.search(rf"EXAMPLE.*{key}", line) for line in lines), key
    assert not any("nothing else" in line for line in lines)


@pytest.mark.parametrize(("board", "words"), [(CHESS, "chessboard"), (CHARUCO, "ChArUco board")])
def test_a_draft_says_which_board_its_photos_show(tmp_path: Path, board: Board, words: str) -> None:
    (tmp_path / "calibration").mkdir()
    for number, pair in enumerate(pairs(board, 3), start=1):
        for side, photo in zip(("left", "right"), pair, strict=True):
            (tmp_path / "calibration" / f"{side}_{number}.png").write_bytes(photo.data)
    found = find_files(tmp_path)
    text = initial_text("Site", found)
    assert f"columns: {board.columns}, rows: {board.rows}, square_m" in text
    assert f"{words} of {board.columns} x {board.rows}" in text and words in missing(found)[1]


def test_photos_of_boards_are_known_by_what_they_show_and_a_site_s_are_not(tmp_path: Path) -> None:
    for folder, board in (("fotos", CHESS), ("2026-03-01", CHARUCO)):
        (tmp_path / folder).mkdir()
        for number, pair in enumerate(pairs(board, 3), start=1):
            for side, photo in zip(("left", "right"), pair, strict=True):
                (tmp_path / folder / f"{side}_{number}.png").write_bytes(photo.data)
    (tmp_path / "2026-03-02").mkdir()
    wall = np.full((600, 800, 3), 160, dtype=np.uint8)
    wall[::50], wall[:, ::80] = 90, 90  # joints of tiles are no board
    for name in ("A1_left.png", "A1_right.png", "A2_left.png", "A2_right.png"):
        cv2.imwrite(str(tmp_path / "2026-03-02" / name), wall)
    found = find_files(tmp_path)
    assert [photos.left for photos in found.boards] == ["2026-03-01/left_*.png", "fotos/left_*.png"]
    assert [photos.left for photos in found.visits] == ["2026-03-02/*_left.png"]


@pytest.mark.parametrize("surveyed", [False, True])
def test_a_folder_without_a_survey_is_drafted_with_a_place_to_say_the_storey(tmp_path: Path, surveyed: bool) -> None:
    site = made(tmp_path, "design.ifc", "visits/2026-03-02/A1_left.jpg", "visits/2026-03-02/A1_right.jpg")
    if surveyed:
        (site / "markers.csv").write_text("id,corner,x_m,y_m,z_m\n")
    found = find_files(site)
    assert bool(found.surveys) == surveyed
    assert ("\n#    near: {storey: Ground floor}  # EXAMPLE" in initial_text("site", found)) == (not surveyed)
    assert ("under near" in " ".join(missing(found))) == (not surveyed)


def test_a_draft_says_where_a_second_storey_goes_how_it_is_spelt_and_what_sigma_is(tmp_path: Path) -> None:
    site = made(tmp_path, "design.ifc", "visits/2026-03-02/A1_left.jpg", "visits/2026-03-02/A1_right.jpg")
    text = initial_text("site", find_files(site))
    for told in ("near_stations:", "asbuilt-bim inspect spells it", "Survey and near may both", "sigma_m is what"):
        assert told in text


def test_of_two_rigs_that_lie_there_the_person_is_asked_which_took_the_photos(tmp_path: Path) -> None:
    found = find_files(made(tmp_path, "a.json", "b.json", text='{"cameraData": []}'))
    assert "2 rigs (a.json, b.json): keep under rig the one that took these photos" in missing(found)
    (tmp_path / "b.json").unlink()
    assert not any("keep under rig" in one for one in missing(find_files(tmp_path)))
