import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.surface import knows_anything
from asbuilt_bim.report.result.document import MINOR, read_result, result_document, write_result
from asbuilt_bim.report.result.schema import result_schema
from asbuilt_bim.storage.schemas import schema
from tests.report.sample_report import sample_report


def same(a: object, b: object, tolerance: float = 1e-6) -> bool:
    """Compare two results field by field, since dataclasses with arrays have no ==."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.shape == b.shape and bool(np.allclose(a, b, rtol=0, atol=tolerance))
    if is_dataclass(a):
        steps = {f.name: 0.0051 if f.name.endswith("_px") else tolerance for f in fields(a)}
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n), t) for n, t in steps.items())
    if isinstance(a, tuple):
        return (
            isinstance(b, tuple) and len(a) == len(b) and all(same(x, y, tolerance) for x, y in zip(a, b, strict=True))
        )
    if isinstance(a, float):
        return isinstance(b, float) and abs(a - b) < 1e-6
    return a == b and type(a) is type(b)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_result(sample_report(), tmp_path / "result.json")
    return tmp_path / "result.json"


def damage(path: Path, change) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")


def from_one_corner(report: ProgressReport) -> ProgressReport:
    """Return a report in which what is unknown of unseen faces begins at the corner where what is exposed does."""
    faces = (
        face if knows_anything(face.surface) else
        replace(face, surface=replace(face.surface, unknown_uv_m=face.exposed_uv_m))
        for face in report.faces
    )  # fmt: skip
    return replace(report, faces=tuple(faces))


def test_a_result_is_read_as_it_was_written(path):
    assert same(from_one_corner(sample_report()), from_one_corner(read_result(path)))


def test_writing_what_was_read_gives_the_same_bytes(path, tmp_path):
    write_result(read_result(path), tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_arrays_are_read_only_after_reading(path):
    outline = read_result(path).stations[0].faces[0].outline_px[0]
    with pytest.raises(ValueError, match="read-only"):
        outline[0, 0] = 1.0


def test_pixels_have_two_decimals_and_metres_six(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["stations"][0]["target_left_px"] == [905.22, 640.77]
    ring = document["faces"][0]["exposed_uv_m"][0][0]
    assert all(round(value, 6) == value for point in ring for value in point)


def test_the_committed_schema_is_the_one_of_the_dataclasses():
    assert schema("result-1") == result_schema(), (
        "run: python -m asbuilt_bim.report.result.schema schemas/result-1.json"
    )


def test_a_number_that_is_not_finite_is_never_written(tmp_path):
    report = sample_report()
    broken = replace(report, whole=replace(report.whole, design_area_m2=float("nan")))
    with pytest.raises(ResultError, match=r"result\.whole\.design_area_m2: nan"):
        write_result(broken, tmp_path / "r.json")
    assert not (tmp_path / "r.json").exists()


def test_a_share_above_one_is_never_written():
    report = sample_report()
    completion = replace(report.whole.completion, upper=1.2)
    with pytest.raises(ResultError, match=r"whole\.completion\.upper"):
        result_document(replace(report, whole=replace(report.whole, completion=completion)))


def test_rounding_noise_above_one_is_written_as_one():
    report = sample_report()
    completion = replace(report.whole.completion, upper=1.0 + 1e-15)
    document = result_document(replace(report, whole=replace(report.whole, completion=completion)))
    assert document["whole"]["completion"]["upper"] == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("elements"), '"elements" is a required property'),
        (lambda d: d["elements"][3].pop("state"), r"elements\[3\]"),
        (lambda d: d["elements"][2].update(state="nearly"), r"elements\[2\]\.state"),
        (lambda d: d["elements"][2].update(stat="part"), "'stat' was unexpected"),
        (lambda d: d["elements"][2]["completion"].update(best=1.5), r"elements\[2\]\.completion\.best"),
        (lambda d: d.update(visit_date="16.3.2026"), "visit_date"),
        (lambda d: d.update(visit_date=20260316), "visit_date"),
        (
            lambda d: d["stations"][0].update(world_from_left=[[1, 0], [0, 1]]),
            "world_from_left: .* is not valid",
        ),
        (lambda d: d["stations"][0].update(world_from_left=[[1, 2], [3]]), "world_from_left"),
        (lambda d: d["stations"][0]["faces"][0].update(outline_px=[["a", "b"]]), "outline_px"),
        (lambda d: d["faces"][0]["surface"].update(open_uv_m=7), r"faces\[0\]\.surface\.open_uv_m"),
    ],
)
def test_a_damaged_result_is_refused_with_its_place(path, change, message):
    damage(path, change)
    with pytest.raises(ResultError, match=message) as caught:
        read_result(path)
    assert str(path) in str(caught.value)


def test_a_truncated_result_is_refused(path):
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(ResultError, match="damaged"):
        read_result(path)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "other"}', "nonsense", "\x00\xff", "[" * 100_000])
def test_what_is_no_result_is_refused(tmp_path, text):
    path = tmp_path / "r.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ResultError, match=r"r\.json"):
        read_result(path)


def test_nan_in_a_file_is_refused(path):
    path.write_text(
        path.read_text(encoding="utf-8").replace('"baseline_m":0.2503', '"baseline_m":NaN'), encoding="utf-8"
    )
    with pytest.raises(ResultError, match="NaN"):
        read_result(path)


def test_a_key_given_twice_is_refused(path):
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"project_name":', '"project_name":"x","project_name":', 1), encoding="utf-8")
    with pytest.raises(ResultError, match='the key "project_name" stands twice'):
        read_result(path)


def test_keys_of_a_newer_minor_version_are_passed_over(path):
    damage(path, lambda d: (d.update(minor=MINOR + 1, weather="rain"), d["elements"][0].update(colour="grey")))
    assert read_result(path).elements[0].name == "C-01"


def test_a_newer_major_version_is_refused_with_a_remedy(path):
    damage(path, lambda d: d.update(version=2))
    with pytest.raises(ResultError, match=r"version 2.*update asbuilt-bim"):
        read_result(path)


def test_a_missing_file_is_a_result_error(tmp_path):
    with pytest.raises(ResultError, match="No such file"):
        read_result(tmp_path / "none.json")


def test_a_folder_that_is_not_there_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match="No such file"):
        write_result(sample_report(), tmp_path / "no" / "r.json")


def test_a_file_beyond_the_bound_is_refused_unread(path, monkeypatch):
    monkeypatch.setattr("asbuilt_bim.report.result.document.MAX_BYTES", 1000)
    with pytest.raises(ResultError, match="exceeds"):
        read_result(path)


def test_what_was_changed_after_it_was_written_is_held_against_the_schema_again(tmp_path):
    write_result(sample_report(), tmp_path / "r.json")
    damage(tmp_path / "r.json", lambda d: d["elements"][2].update(state="nearly"))
    with pytest.raises(ResultError, match=r"elements\[2\]\.state"):
        read_result(tmp_path / "r.json")


def test_what_is_not_fit_is_refused_and_not_written(tmp_path):
    report = sample_report()
    completion = replace(report.whole.completion, upper=1.2)
    with pytest.raises(ResultError, match=r"whole\.completion\.upper"):
        write_result(replace(report, whole=replace(report.whole, completion=completion)), tmp_path / "r.json")
    assert not (tmp_path / "r.json").exists()
