"""`asbuilt-bim measure` and its Python face: one pair, no IFC, files that are safe and pictures that show it."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result
from jsonschema import Draft202012Validator

import asbuilt_bim
from asbuilt_bim.camera.rig_formats.reader import write_rig_as
from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.cli import app
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import MaskError, MeasureError, OptionError, RigError, rejected
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rotation_from_vector
from asbuilt_bim.measure import pair as pair_module
from asbuilt_bim.measure.pair import PairMeasurement, dominating
from asbuilt_bim.report.drawings.figures import face_line, figures
from asbuilt_bim.report.faces_csv import faces_csv
from asbuilt_bim.report.result.measure_document import measure_document
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.storage.schemas import schema
from asbuilt_bim.terminal.measure_command import _largest_first
from asbuilt_bim.vision.masks.segment import InstanceSource
from asbuilt_bim.vision.stereo.rig_health import judge
from tests.camera.rig_formats.written import oak_small
from tests.camera.virtual import rig as virtual_rig
from tests.measure.box_world import site, true_area
from tests.measure.test_faces import rig_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the two photos of the small site, its rig, and a clicked wall."""
    path = tmp_path_factory.mktemp("pair")
    pair = site()[1]
    cv2.imwrite(str(path / "left.png"), pair.left)
    cv2.imwrite(str(path / "right.png"), pair.right)
    write_rig(rig_of(pair), path / "rig.yaml")
    polygon = [[440.0, 110.0], [740.0, 110.0], [740.0, 540.0], [440.0, 540.0]]  # round the wall, not on its edges
    away = [[20.0, 20.0], [120.0, 20.0], [120.0, 60.0], [20.0, 60.0]]  # in the sky
    document = {
        "format": "asbuilt-bim/clicks", "version": 1,
        "polygons": [{"class": "wall", "points_px": polygon}, {"class": "column", "points_px": away}],
    }  # fmt: skip
    (path / "clicks.json").write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def found(folder: Path) -> PairMeasurement:
    rig = asbuilt_bim.read_rig(folder / "rig.yaml")
    return asbuilt_bim.measure_pair(folder / "left.png", str(folder / "right.png"), rig, target=False)


def measure(folder: Path, *more: str, out: str = "out") -> Result:
    given = [str(folder / name) for name in ("left.png", "right.png")]
    return CliRunner().invoke(
        app, ["measure", *given, "--rig", str(folder / "rig.yaml"), "--out", str(folder / out), *more]
    )  # fmt: skip


def test_a_pair_is_measured_in_two_lines_of_python_and_nothing_is_printed(found, capsys) -> None:
    assert capsys.readouterr().out == ""
    wall = next(face for face in found.faces if abs(face.width_m - 1.7) < 0.05)
    truth = true_area(site()[0], "wall/0")
    assert wall.area_m2 == pytest.approx(truth, rel=0.03)
    assert found.target is None
    assert found.calibration_known


def test_a_pair_without_a_design_has_in_its_sigmas_what_sides_leave_open_and_names_faces_without_an_end(
    folder: Path, found, monkeypatch
) -> None:
    sure = found.faces[0]
    faces = tuple(replace(sure, area_sigma_open_m2=share * sure.area_m2) for share in (0.3, 0.0, 0.05))
    detail = replace(found.detail, measurement=replace(found.detail.measurement, faces=faces))
    monkeypatch.setattr(pair_module, "measure_in_detail", lambda *_, **__: detail)
    left_out = asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", folder / "rig.yaml", target=False)
    widened = np.hypot(sure.area_sigma_m2, 0.05 * sure.area_m2)
    assert [face.area_sigma_m2 for face in left_out.faces] == pytest.approx([sure.area_sigma_m2, widened])
    assert [face.face_id.rsplit("/", 1)[1] for face in left_out.faces] == ["1", "2"]
    (named,) = [one for one in left_out.rejections if one.code is Reason.FACE_WITHOUT_END]
    assert named.values["sigma_share"] == pytest.approx(0.3, rel=0.05)
    assert "where it ends can't be seen" in str(words_of(named)) and "--masks" in str(words_of(named))
    names = [one.subject.name for one in left_out.rejections if one.subject.kind is SubjectKind.FACE]
    assert len(set(names)) == len(names)


def test_a_rig_made_in_python_that_cannot_be_one_is_refused_before_a_photo_is_read() -> None:
    bent = np.eye(4)
    bent[0, 3], bent[1, 1] = -0.25, 1.02
    with pytest.raises(RigError, match="right_from_left: is no rigid transform"):
        asbuilt_bim.measure_pair("no.jpg", "none.jpg", replace(virtual_rig(), right_from_left=bent))


def test_the_outline_in_the_original_photo_is_the_one_that_files_get(found) -> None:
    face = found.faces[0]
    assert np.abs(found.photo_outline_px(face)[0] - face.outline_px[0]).max() < 1e-6  # this rig has no lens to speak of


def test_without_a_target_a_pair_is_refused_unless_it_is_asked_for(folder: Path) -> None:
    rig = asbuilt_bim.read_rig(folder / "rig.yaml")
    with pytest.raises(MeasureError, match="target"):
        asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", rig)
    done = measure(folder)
    assert done.exit_code == 1
    assert "target" in done.stderr
    assert not (folder / "out").exists()


@pytest.mark.parametrize("diameter_m", [float("nan"), float("inf"), -0.3, 0.0, 300.0])
def test_a_target_of_no_size_is_refused(folder: Path, diameter_m: float) -> None:
    with pytest.raises(MeasureError, match=r"target_diameter_m: .* m, limit 0\.05 to 2 m"):
        asbuilt_bim.measure_pair(
            folder / "left.png", folder / "right.png", folder / "rig.yaml", target_diameter_m=diameter_m
        )


@pytest.mark.parametrize("diameter_m", ["0.3", True, [0.3]])
def test_a_target_diameter_that_is_no_number_is_refused_in_words(folder: Path, diameter_m: object) -> None:
    with pytest.raises(OptionError, match=r"^target_diameter_m: .* is no number; give metres, such as 0\.3"):
        asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", folder / "rig.yaml",
                                 target_diameter_m=diameter_m)  # type: ignore[arg-type]  # fmt: skip


@pytest.mark.parametrize("classes", [{1: "slab"}, {"1": "wall"}, ["wall"], {1: ["wall"]}])
def test_classes_of_masks_that_nobody_knows_are_refused_in_words(folder: Path, classes: object) -> None:
    with pytest.raises(OptionError, match=r"^mask_classes: .* doesn't give wall or column to label numbers; write it"):
        asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", folder / "rig.yaml",
                                 masks=folder / "no.png", mask_classes=classes)  # type: ignore[arg-type]  # fmt: skip


def test_what_dominates_sigma_is_told_and_a_rig_that_does_not_know_is_not_calibration(found) -> None:
    face = found.faces[0]
    big = replace(face, area_sigma_calibration_m2=1.0, area_sigma_image_m2=0.1)
    assert dominating(big, calibration_known=True) == "calibration"
    assert dominating(replace(big, area_sigma_image_m2=2.0), calibration_known=True) == "image"
    assert dominating(big, calibration_known=False) == "calibration (assumed)"


def test_a_knocked_rig_is_refused_and_refined_on_the_pairs_own_photos_where_asked(folder: Path, found) -> None:
    rig = asbuilt_bim.read_rig(str(folder / "rig.yaml"))
    turn = np.eye(4)
    turn[:3, :3] = rotation_from_vector(np.radians([0.0, 0.0, 0.5]))
    knocked = replace(rig, right_from_left=frozen(turn @ rig.right_from_left))
    left, right = folder / "left.png", folder / "right.png"
    with pytest.raises(MeasureError, match="--refine-rig"):
        asbuilt_bim.measure_pair(left, right, knocked, target=False)
    again = asbuilt_bim.measure_pair(left, right, knocked, target=False, refine_rig=True)
    assert again.rejections[0].code is Reason.RIG_REFINED
    areas = [max(face.area_m2 for face in one.faces) for one in (found, again)]
    assert abs(areas[1] / areas[0] - 1.0) < 0.03


@pytest.mark.parametrize(
    ("state", "code", "words"),
    [
        ("undetermined", Reason.RIG_UNDETERMINED, "say too little of how the rig stands"),
        ("doubtful", Reason.RIG_MOVED, "has moved a little"),
    ],
)
def test_measure_says_of_the_rig_what_run_says_and_says_it_before_the_areas(
    folder: Path, monkeypatch: pytest.MonkeyPatch, state: str, code: Reason, words: str
) -> None:
    monkeypatch.setattr(
        "asbuilt_bim.measure.pair.judge", lambda healths, rig: replace(judge(healths, rig), state=state)
    )
    monkeypatch.setenv("COLUMNS", "80")  # wider, the faces stand in a table
    left, right = folder / "left.png", folder / "right.png"
    masks = folder / "clicks.json"  # one wall: the rig is judged before
    found = asbuilt_bim.measure_pair(left, right, folder / "rig.yaml", target=False, masks=masks)
    assert [one.code for one in found.rejections if one.subject.kind is SubjectKind.RIG] == [code]
    monkeypatch.setattr("asbuilt_bim.terminal.measure_command.measure_pair", lambda *_, **__: found)
    done = measure(folder, "--no-target", out=f"rig-{state}")
    assert done.exit_code == 0
    assert words in " ".join(done.output.split())
    assert done.output.index("the rig") < done.output.index("face 1 ")


def test_a_rig_that_a_run_would_refuse_is_refused_by_measure_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "asbuilt_bim.measure.pair.judge", lambda healths, rig: replace(judge(healths, rig), state="knocked")
    )
    left, right, masks = (folder / name for name in ("left.png", "right.png", "clicks.json"))
    with pytest.raises(MeasureError, match="knocked since its calibration"):
        asbuilt_bim.measure_pair(left, right, folder / "rig.yaml", target=False, masks=masks)


def test_every_figure_of_the_paper_is_returned_as_a_picture(found) -> None:
    drawn = {figure.name: figure for figure in figures(found)}
    assert {"overlay", "masks", "depth", "flatness"} <= drawn.keys()
    assert any(name.startswith("wall-") for name in drawn)
    for figure in drawn.values():
        assert figure.image.dtype == np.uint8
        assert figure.image.std() > 5.0
        assert figure._repr_png_().startswith(b"\x89PNG")
    assert b"eXIf" not in drawn["overlay"].png()


def test_a_picture_says_of_a_face_that_it_is_not_the_whole(found) -> None:
    face = replace(found.faces[0], cut_by_frame=False, occluded=False, open_edge=False)
    assert face_line(found, face).endswith(" m²")
    assert face_line(found, replace(face, occluded=True, open_edge=True)).endswith(" m² (hidden and open)")


@pytest.mark.parametrize("corner", [(800, 30), (0, 601), (-200, 0)])
def test_a_polygon_beside_the_photo_is_refused_since_it_was_clicked_on_another_picture(
    folder: Path, tmp_path: Path, corner: tuple[int, int]
) -> None:
    height, width = site()[1].left.shape[:2]
    assert (width, height) == (800, 600)
    clicks = json.loads((folder / "clicks.json").read_text(encoding="utf-8"))
    beside = [[corner[0] + x, corner[1] + y] for x, y in ((0, 0), (90, 0), (90, 90))]
    clicks["polygons"].append({"class": "wall", "points_px": beside})
    (tmp_path / "clicks.json").write_text(json.dumps(clicks), encoding="utf-8")
    photos = folder / "left.png", folder / "right.png"
    with pytest.raises(MaskError, match=r"polygons\[2\] lies beside the photo of 800 x 600 px; masks are of the ORIG"):
        asbuilt_bim.measure_pair(*photos, folder / "rig.yaml", target=False, masks=tmp_path / "clicks.json")


def test_masks_can_be_given_and_one_without_a_surface_is_named(folder: Path) -> None:
    rig = asbuilt_bim.read_rig(folder / "rig.yaml")
    given = asbuilt_bim.measure_pair(
        folder / "left.png", folder / "right.png", rig, target=False, masks=folder / "clicks.json"
    )
    assert {face.label for face in given.faces} == {"wall"}
    best = next(face for face in given.faces if abs(face.width_m - 1.7) < 0.05)
    assert best.area_m2 == pytest.approx(true_area(site()[0], "wall/0"), rel=0.03)
    assert (best.source, best.segmenter) == (InstanceSource.GIVEN, "polygons[0]")
    assert any("column polygons[1]: no face" in str(words_of(one)) for one in given.rejections)


def test_the_command_writes_a_document_that_fits_its_schema_and_reads_as_a_table(folder: Path) -> None:
    done = measure(folder, "--no-target", "--masks", str(folder / "clicks.json"))
    assert done.exit_code == 0, done.stderr
    assert "nothing checks it" in done.output
    assert "recognised by shape alone" not in done.output  # the masks tell it
    assert "no face was measured in this mask" in done.stderr
    out = folder / "out"
    document = json.loads((out / "measure.json").read_text(encoding="utf-8"))
    assert list(Draft202012Validator(schema("measure-1")).iter_errors(document)) == []
    assert document["target"] is None
    assert document["scale"] == "baseline, unchecked"
    assert {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} == {
        "measure.json", *document["files"]
    }  # fmt: skip
    with (out / "faces.csv").open(encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    assert [row["face"] for row in rows] == [face["id"] for face in document["faces"]]
    assert str(folder) not in (out / "measure.json").read_text(encoding="utf-8")  # paths are nobody else's business


def test_faces_csv_calls_who_found_a_face_as_results_do(found: PairMeasurement) -> None:
    rows = csv.DictReader(faces_csv(found).decode("utf-8-sig").splitlines())
    assert [row["source"] for row in rows] == [
        face["source"] for face in measure_document(found, datetime(2026, 3, 2, tzinfo=UTC))["faces"]
    ]
    assert {str(face.source) for face in found.faces} == {"geometry"}


def test_a_pair_in_which_not_one_face_was_measured_ends_with_1_and_its_pictures_say_why(folder: Path) -> None:
    document = json.loads((folder / "clicks.json").read_text(encoding="utf-8"))
    sky = {**document, "polygons": document["polygons"][1:]}
    (folder / "sky.json").write_text(json.dumps(sky), encoding="utf-8")
    done = measure(folder, "--no-target", "--masks", str(folder / "sky.json"), out="sky")
    assert done.exit_code == 1
    assert "error: not one face was measured" in done.stderr
    assert (folder / "sky" / "measure.json").is_file()


def test_an_earlier_measurement_is_replaced_whole_and_strangers_files_stay(folder: Path) -> None:
    first = measure(folder, "--no-target", out="again")
    assert first.exit_code == 0 and "recognised by shape alone" in first.output
    before = set((folder / "again" / "figures").iterdir())
    (folder / "again" / "notes.txt").write_text("mine", encoding="utf-8")
    paper = measure(
        folder, "--no-target", "--masks", str(folder / "clicks.json"), "--method", "paper", "--depth", "stereo",
        out="again",
    )  # fmt: skip
    assert paper.exit_code == 0, paper.stderr
    assert "shadows" in paper.output
    document = json.loads((folder / "again" / "measure.json").read_text(encoding="utf-8"))
    assert list(Draft202012Validator(schema("measure-1")).iter_errors(document)) == []
    assert document["method"] == "paper"
    assert {face["area_sigma_m2"] for face in document["faces"]} == {None}
    left = set((folder / "again" / "figures").iterdir())
    assert left < before | left
    assert {path.relative_to(folder / "again").as_posix() for path in left} <= set(document["files"])
    assert (folder / "again" / "notes.txt").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["measure.json", "overlay.jpg"])
def test_a_file_of_somebody_elses_is_never_overwritten(
    folder: Path, found, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("asbuilt_bim.terminal.measure_command.measure_pair", lambda *_, **__: found)
    place = folder / f"taken-{name}"
    place.mkdir()
    (place / name).write_bytes(b"{}")
    done = measure(folder, "--no-target", out=place.name)
    assert done.exit_code == 1
    assert "choose another --out" in done.stderr
    assert [path.name for path in place.iterdir()] == [name]
    assert (place / name).read_bytes() == b"{}"


def test_the_published_method_without_a_network_says_what_to_do(folder: Path) -> None:
    done = measure(folder, "--no-target", "--method", "paper")
    assert done.exit_code == 1
    assert "--depth stereo" in done.stderr


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (["--depth", "paper"], 1, "method: paper only"),
        (["--mask-class", "x=wall", "--masks", "nowhere.json"], 2, "1=wall"),
        (["--mask-class", "1=wall"], 2, "--masks"),
        (["--inversion", "reciprocal"], 2, "--method paper"),
        (["--depth-network", "bundled"], 2, "--depth fused"),
        (["--method", "best"], 2, "--method"),
        (["--target-diameter", "300"], 2, "--target-diameter"),
        (["--target-diameter", "0.3"], 2, "contradict"),
        (["--masks", "nowhere.json"], 1, "no such file"),
    ],
)
def test_a_wrong_command_line_is_named(folder: Path, more: list[str], code: int, said: str) -> None:
    done = measure(folder, "--no-target", *more)
    assert done.exit_code == code
    assert said in done.stderr


def test_one_photo_given_as_both_is_named_before_anything_is_measured(folder: Path) -> None:
    with pytest.raises(MeasureError, match="is given as the left and as the right photo"):
        asbuilt_bim.measure_pair(folder / "left.png", folder / "left.png", folder / "rig.yaml")


def test_the_terminal_names_the_largest_unmeasured_surfaces_and_counts_the_rest() -> None:
    sizes = [0.2, 3.0, 1.0, 7.0, 0.4]
    faces = [
        rejected(
            Reason.FACE_UNCERTAIN, about(SubjectKind.FACE, f"A/x{k}", "A"), label="wall", area_m2=size, distance_m=4.0,
            limit_share=0.2,
        )
        for k, size in enumerate(sizes)
    ]  # fmt: skip
    other = rejected(Reason.DEPTH_WITHOUT_TARGET, about(SubjectKind.STATION, "A"))
    named, more = _largest_first([*faces, other])
    assert [one.values.get("area_m2") for one in named] == [None, 7.0, 3.0, 1.0]
    assert more == 2


def test_a_photo_that_holds_both_eyes_is_measured_as_its_two_halves(folder: Path, found) -> None:
    both = np.concatenate([cv2.imread(str(folder / f"{side}.png")) for side in ("left", "right")], axis=1)
    cv2.imwrite(str(folder / "both.png"), both)
    again = asbuilt_bim.measure_pair(folder / "both.png", None, folder / "rig.yaml", target=False)
    assert [face.area_m2 for face in again.faces] == [face.area_m2 for face in found.faces]
    assert (again.left_name, again.right_name) == ("both.png", "both.png (right half)")
    usual = ["--rig", str(folder / "rig.yaml"), "--out", str(folder / "sides"), "--no-target"]
    for arguments in (["both.png"], ["left.png", "right.png", "--side-by-side"]):
        names = [word if word.startswith("-") else str(folder / word) for word in arguments]
        refused = CliRunner().invoke(app, ["measure", *names, *usual])
        assert refused.exit_code == 2 and "--side-by-side if it holds both eyes" in refused.output
    done = CliRunner().invoke(app, ["measure", str(folder / "both.png"), "--side-by-side", *usual])
    assert done.exit_code == 0, done.output


def test_a_bought_cameras_file_is_measured_with_and_its_width_is_told_and_counts(folder: Path, found) -> None:
    rig = rig_of(site()[1])
    eeprom = json.loads(oak_small(rig))
    (folder / "oak.json").write_text(json.dumps(eeprom), encoding="utf-8")
    done = CliRunner().invoke(
        app,
        ["measure", str(folder / "left.png"), str(folder / "right.png"), "--rig", str(folder / "oak.json"),
         "--out", str(folder / "bought"), "--no-target"],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    told = " ".join(done.output.split())
    assert "good to 0.05 degrees, 0.7 % of every length and 0.3 px of lens" in told
    rows = json.loads((folder / "bought/measure.json").read_text(encoding="utf-8"))["faces"]
    wide = asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", [folder / "oak.json"], target=False)
    write_rig_as(rig, folder / "other.yml", "opencv")
    other = asbuilt_bim.measure_pair(folder / "left.png", folder / "right.png", folder / "other.yml", target=False)
    assert sorted(row["area_m2"] for row in rows) == pytest.approx(sorted(face.area_m2 for face in wide.faces))
    assert wide.faces
    for face in wide.faces:  # fewer than by the other rig: the wider sigma names the rest as too uncertain
        one = min(other.faces, key=lambda one: abs(one.area_m2 - face.area_m2))
        assert face.area_m2 == pytest.approx(one.area_m2, rel=1e-6)
        assert face.area_sigma_calibration_m2 > 0.014 * face.area_m2
        assert face.area_sigma_calibration_m2 > 1.5 * one.area_sigma_calibration_m2
