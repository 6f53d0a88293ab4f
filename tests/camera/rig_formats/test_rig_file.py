from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.camera.rig_formats.rig_file import checked_rig, rig_problems, rig_text, write_rig
from asbuilt_bim.camera.rig_formats.text import read_document
from asbuilt_bim.errors import OutputError, RigError
from asbuilt_bim.geometry.arrays import frozen
from tests.camera.virtual import rig


def full_rig():  # type: ignore[no-untyped-def]
    root = np.random.default_rng(0).normal(size=(14, 14)) * 1e-4
    return replace(rig(), covariance=frozen(root @ root.T), rms_px=0.123456789012345, views_used=17)


def test_a_rig_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    one = full_rig()
    write_rig(one, tmp_path / "rig.yaml")
    two = read_rig(tmp_path / "rig.yaml")
    for name in ("right_from_left", "covariance"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    for a, b in ((one.left, two.left), (one.right, two.right)):
        assert np.array_equal(a.K, b.K) and np.array_equal(a.distortion, b.distortion)
        assert (a.width_px, a.height_px) == (b.width_px, b.height_px)
    for name in ("rms_px", "views_used", "camera_model", "camera_serial", "camera_serial_right", "focal_length_mm"):
        assert getattr(one, name) == getattr(two, name)
    write_rig(two, tmp_path / "again.yaml")
    assert (tmp_path / "again.yaml").read_bytes() == (tmp_path / "rig.yaml").read_bytes()


def test_the_covariance_of_the_lenses_is_read_back_and_one_of_neither_size_is_refused(tmp_path: Path) -> None:
    root = np.random.default_rng(1).normal(size=(24, 24)) * 1e-4
    one = replace(rig(), covariance=frozen(root @ root.T))
    write_rig(one, tmp_path / "rig.yaml")
    two = read_rig(tmp_path / "rig.yaml")
    assert two.knows_lenses and np.array_equal(one.covariance, two.covariance)
    wide = np.diag([0.0] * 23 + [400.0])
    assert "row 23 (k3_right)" in rig_problems(replace(rig(), covariance=frozen(wide)))[0]
    other = replace(rig(), covariance=frozen(root[:20] @ root[:20].T))
    with pytest.raises(RigError, match="must be 14 x 14, or with these lenses 24 x 24 numbers"):
        checked_rig(other)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: text.replace("version: 1", "version: 2"), "version"),
        (lambda text: text + "colour: red\n", "colour"),
        (lambda text: text.replace("  width_px: 1280", "  width_px: wide"), r"left\.width_px"),
        (lambda text: text.replace("rms_px", "rms"), "rms"),
        (lambda text: text + "x: !!python/object/apply:os.system ['true']\n", "not plain YAML"),
        (lambda text: text + "x: &a [1]\ny: *a\n", "aliases"),
        (lambda text: "", "the file"),
        (
            lambda text: text.replace("lens: five", "lens: fisheye", 1),
            r"left\.distortion: 5 numbers, 4 ",
        ),
        (lambda text: text.replace("-0.11,", "-1.9,"), r"left\.distortion: the lens folds back inside the picture"),
    ],
)
def test_a_damaged_rig_file_is_refused_by_its_key(tmp_path: Path, change, says: str) -> None:  # type: ignore[no-untyped-def]
    file = tmp_path / "rig.yaml"
    write_rig(full_rig(), file)
    file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(RigError, match=says) as raised:
        read_rig(file)
    assert str(file) in str(raised.value)


@pytest.mark.parametrize("lens", ["rational", "fisheye"])
def test_rigs_with_other_lenses_are_read_back(tmp_path: Path, lens: LensModel) -> None:
    one = rig(lens)
    write_rig(one, tmp_path / "rig.yaml")
    two = read_rig(tmp_path / "rig.yaml")
    assert two.left.lens == lens and np.array_equal(one.right.distortion, two.right.distortion)


def test_four_coefficients_without_their_model_are_refused_for_two_kinds_have_four(tmp_path: Path) -> None:
    write_rig(rig("fisheye"), tmp_path / "rig.yaml")
    text = (tmp_path / "rig.yaml").read_text(encoding="utf-8").replace("  lens: fisheye\n", "")
    (tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match=r"left\.lens: is missing(.|\n)*right\.lens"):
        read_rig(tmp_path / "rig.yaml")


def test_a_rig_that_cannot_be_is_refused_with_every_reason(tmp_path: Path) -> None:
    one = full_rig()
    odd = one.right_from_left.copy()
    odd[:3, 3] *= 1000.0
    odd[0, 0] = 0.5
    write_rig(replace(one, right_from_left=odd), tmp_path / "rig.yaml")
    with pytest.raises(RigError) as raised:
        read_rig(tmp_path / "rig.yaml")
    assert "baseline 249.6 m" in str(raised.value) and "no rigid transform" in str(raised.value)


def test_a_missing_rig_file_and_a_folder_that_is_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(RigError, match=r"none\.yaml"):
        read_rig(tmp_path / "none.yaml")
    with pytest.raises(OutputError, match="can't be written"):
        write_rig(rig(), tmp_path / "nowhere" / "rig.yaml")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda c: c * 1e8, r"row 8 \(rx\) says ±.* rad, limit 1 rad: .*calibrate again"),
        (lambda c: c + np.eye(14, k=5) * 1e-6, r"isn't symmetric: row \d+, column \d+ holds"),
        (
            lambda c: c + (np.eye(14, k=1) + np.eye(14, k=-1)) * 1e-6,
            "a combination of its rows has a negative variance",
        ),
        (lambda c: c * np.where(np.arange(14) == 3, -1.0, 1.0), "variances must be finite and not negative"),
    ],
)
def test_a_covariance_that_cannot_be_is_refused_and_not_left_out_of_the_sigmas(change, says: str) -> None:  # type: ignore[no-untyped-def]
    one = full_rig()
    assert not rig_problems(one)
    (problem,) = rig_problems(replace(one, covariance=frozen(change(np.array(one.covariance)))))
    assert problem.startswith("covariance: ")
    assert re.search(says, problem)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rms_px: 0.123456789012345", "rms_px: .nan", "rms_px: nan is no number of a rig"),
        ("focal_length_mm: 8.0", "focal_length_mm: .inf", "focal_length_mm: inf is no number of a rig"),
        ("views_used: 17", f"views_used: {10**400}", r"views_used: 10000000000000000000\.\.\. is no number"),
        ("  K:\n", "  K: []\n  K:\n", r"line \d+: the key 'K' stands twice \(first in line \d+\)"),
        ("views_used: 17", "views_used: 17\nx: !!bool maybe", r"line \d+: maybe is no true or false"),
        ("covariance:", "covariance: [[1.0e+300]]\nother:", r"covariance\[0\]\[0\]: 1e\+300 is no number of a rig"),
    ],
)
def test_numbers_that_no_rig_holds_and_keys_given_twice_are_refused(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    write_rig(full_rig(), tmp_path / "rig.yaml")
    text = (tmp_path / "rig.yaml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "rig.yaml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RigError, match=says):
        read_rig(tmp_path / "rig.yaml")


@pytest.mark.parametrize(
    ("place", "says"),
    [
        ([0.0, -0.25, 0.0], r"stands 0\.250 m below and 0\.000 m b\w+ the left one"),
        ([0.0, 0.0, -0.25], r"0\.250 m before the left one"),
        ([0.25, 0.0, 0.0], "swapped"),
        ([-25.0, 0.0, 0.0], "looks like millimetres or centimetres"),
        ([-2500.0, 0.0, 0.0], "looks like millimetres$"),
    ],
)
def test_a_right_camera_that_does_not_stand_to_the_right_is_refused_as_what_it_is(
    place: list[float], says: str
) -> None:
    pose = np.eye(4)
    pose[:3, 3] = place
    (problem,) = rig_problems(replace(full_rig(), right_from_left=frozen(pose)))
    assert re.search(says, problem)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"right_from_left": np.diag([1.02, 1.02, 1.02, 1.0])}, "right_from_left"),
        ({"right_from_left": np.full((4, 4), np.nan)}, r"right_from_left\[0\]\[0\]: nan is no number of a rig"),
        ({"right_from_left": rig().right_from_left[:3]}, "right_from_left: .* has less than 4 items"),
        ({"covariance": np.full((14, 14), np.nan)}, r"covariance\[0\]\[0\]: nan"),
        ({"covariance": np.eye(3)}, "covariance: .* has less than 14 items"),
        ({"covariance": -1e-9 * np.eye(14)}, "covariance: variances must be finite and not negative"),
        ({"left": replace(rig().left, K=rig().left.K.ravel())}, r"left\.K"),
        ({"left": replace(rig().left, K=rig().left.K + np.eye(3, k=1))}, r"left\.K: must be \[\[fx, 0, cx\]"),
        ({"left": replace(rig().left, width_px=1280.5)}, "no arrays of numbers and sizes"),
        ({"left": None}, "no arrays of numbers and sizes"),
    ],
)
def test_a_rig_made_in_python_is_refused_where_its_file_would_be(change: dict[str, object], says: str) -> None:
    with pytest.raises(RigError, match=says):
        checked_rig(replace(full_rig(), **change))


@pytest.mark.parametrize("focal", [0.0, -0.0, 1e-320, -1000.0])
def test_a_focal_length_that_none_is_is_refused_without_a_warning_of_numpys(focal: float) -> None:
    bad = np.array(rig().left.K)
    bad[1, 1] = focal
    with pytest.raises(RigError, match=r"left\.K: focal lengths .* don't fit a picture"):
        checked_rig(replace(full_rig(), left=replace(rig().left, K=bad)))


def test_a_rig_made_of_lists_and_numpys_numbers_is_the_same_rig() -> None:
    one = full_rig()
    left = replace(one.left, K=one.left.K.tolist(), width_px=np.int64(one.left.width_px))
    two = checked_rig(replace(one, left=left, right_from_left=one.right_from_left.tolist()))
    assert rig_text(two) == rig_text(one)
    assert two.left.K.dtype == np.float64 and not two.left.K.flags.writeable


def test_a_lens_in_opencvs_shape_is_told_to_be_flat() -> None:
    with pytest.raises(ValueError, match=r"shape \(1, 5\).*ravel"):
        replace(rig().left, distortion=np.zeros((1, 5)))


def test_numbers_that_a_program_wrote_need_not_be_plain(tmp_path: Path) -> None:
    (tmp_path / "rig.yaml").write_text("serial: 0012345\ntime: 12:30:00\nrows: 3\n", encoding="utf-8")
    assert read_document(tmp_path / "rig.yaml") == {"serial": 0o12345, "time": 45000, "rows": 3}
