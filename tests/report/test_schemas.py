import copy
import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.report.result.document import result_document
from asbuilt_bim.storage.schemas import schema, schema_folder
from tests.report.sample_report import sample_report

PROJECT = """
format: asbuilt-bim/project
version: 1
name: Sample site
ifc: design.ifc
rig:
  boards: {kind: charuco, columns: 9, rows: 7, square_m: 0.08, marker_m: 0.06, dictionary: DICT_5X5_100,
           left: "calibration/left_*.jpg", right: "calibration/right_*.jpg"}
target: {diameter_m: 0.30}
markers: {survey: markers.csv, family: apriltag_36h11, size_m: 0.28, sigma_m: 0.002}
visits:
  - date: "2026-03-02"
    stations:
      - {name: A1, left: visits/2026-03-02/A1_left.jpg, right: visits/2026-03-02/A1_right.jpg}
options: {measure: {}}
"""


def faults(name: str, document: object) -> list[str]:
    return [f"{error.json_path} {error.message}" for error in Draft202012Validator(schema(name)).iter_errors(document)]


@pytest.mark.parametrize(
    "name", sorted(path.name[:-5] for path in schema_folder().iterdir() if path.name.endswith(".json"))
)
def test_each_schema_is_a_schema_and_has_its_own_id(name):
    Draft202012Validator.check_schema(schema(name))
    assert schema(name)["$id"].endswith(f"/{name}.json")


def test_a_schema_that_is_not_there_is_named():
    with pytest.raises(FileNotFoundError, match="nothing-9"):
        schema("nothing-9")


def test_the_result_fits_its_whole_schema_number_by_number():
    assert faults("result-1", result_document(sample_report())) == []


def test_the_schema_itself_refuses_a_point_of_three_where_two_are_wanted():
    document = json.loads(json.dumps(result_document(sample_report())))
    document["stations"][0]["faces"][0]["outline_px"][0][0] = [1.0, 2.0, 3.0]
    assert faults("result-1", document)


def test_every_key_of_the_result_schema_is_described():
    def keys(part, where="result"):
        for name, value in part.get("properties", {}).items():
            yield f"{where}.{name}", value
        for name, value in part.get("$defs", {}).items():
            yield from keys(value, name)

    assert [name for name, value in keys(schema("result-1")) if not value.get("description")] == []


def test_the_example_project_fits():
    assert faults("project-1", yaml.safe_load(PROJECT)) == []


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(ifcs="x"),
        lambda d: d["markers"].pop("size_m"),
        lambda d: d.update(version=2),
        lambda d: d.update(visits=[]),
        lambda d: d["visits"][0].update(date="2.3.2026"),
        lambda d: d["rig"].update(file="rig.yaml"),
        lambda d: d.update(rig={}),
        lambda d: d["rig"]["boards"].pop("marker_m"),
        lambda d: d["rig"]["boards"].update(square_m=80),
        lambda d: d["markers"].update(size_m="28 cm"),
        lambda d: d["target"].update(required="no"),
        lambda d: d["options"].update(measur={}),
    ],
)
def test_a_project_that_is_wrong_is_refused(change):
    document = copy.deepcopy(yaml.safe_load(PROJECT))
    change(document)
    assert faults("project-1", document)


def test_a_rig_file_as_it_is_written_fits_and_a_damaged_one_does_not(tmp_path):
    camera = Intrinsics(
        K=frozen([[1050, 0, 640], [0, 1051, 480], [0, 0, 1]]),
        distortion=frozen(np.zeros(5)),
        width_px=1280,
        height_px=960,
    )
    pose = np.eye(4)
    pose[0, 3] = -0.25
    rig = StereoRig(left=camera, right=camera, right_from_left=frozen(pose), covariance=frozen(np.zeros((14, 14))))
    write_rig(rig, tmp_path / "rig.yaml")
    document = yaml.safe_load((tmp_path / "rig.yaml").read_text(encoding="utf-8"))
    assert faults("rig-1", document) == []
    for key in ("left", "right_from_left"):
        assert faults("rig-1", {k: v for k, v in document.items() if k != key})
    assert faults("rig-1", document | {"baseline": 0.25})
    document["left"]["distortion"] = [0.0] * 6
    assert faults("rig-1", document)


def test_real_project_files_of_the_samples_fit():
    folder = Path(__file__).parents[2] / "sample_models"
    found = list(folder.glob("*/project.yaml")) if folder.is_dir() else []
    if not found:
        pytest.skip(f"no sample project in {folder}{os.sep}")
    for path in found:
        document = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)
        assert [f for f in faults("project-1", yaml.safe_load(json.dumps(_typed(document))))] == []


def _typed(value):
    """Turn BaseLoader's texts into numbers, and leave dates as text, as an editor's schema check sees them."""
    if isinstance(value, dict):
        return {key: value_ if key in ("date", "name") else _typed(value_) for key, value_ in value.items()}
    if isinstance(value, list):
        return [_typed(item) for item in value]
    try:
        return json.loads(value)
    except ValueError:
        return value
