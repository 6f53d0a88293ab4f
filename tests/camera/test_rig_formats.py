from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import RigFormat, read_rig, write_rig_as
from asbuilt_bim.errors import OutputError, RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid
from tests.camera.virtual import rig

KALIBR = """
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.2834, 0.0740, 0.00019, 1.76e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.99999, -0.00231, -0.00034, -0.11007]
  - [0.00231, 0.99989, -0.01410, 0.00039]
  - [0.00037, 0.01410, 0.99990, -0.00085]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.2836, 0.0745, -0.0001, -3.5e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
"""
ROS = """image_width: 640
image_height: 480
camera_name: stereo/{side}
camera_matrix:
  rows: 3
  cols: 3
  data: [500., 0, 320, 0, 500, 240, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [-0.1, 0.02, 0.001, 0, 0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [480, 0, 320, {shift}, 0, 480, 240, 0, 0, 0, 1, 0]}}
"""


def largest_gap(one: StereoRig, two: StereoRig) -> float:
    parts = [(one.right_from_left, two.right_from_left)]
    parts += [(a.K, b.K) for a, b in ((one.left, two.left), (one.right, two.right))]
    parts += [(a.distortion, b.distortion) for a, b in ((one.left, two.left), (one.right, two.right))]
    assert (one.left.width_px, one.right.height_px) == (two.left.width_px, two.right.height_px)
    return max(float(np.abs(a - b).max()) for a, b in parts)


@pytest.mark.parametrize("lens", ["five", "rational", "fisheye"])
@pytest.mark.parametrize("form", ["rig", "opencv", "kalibr", "ros"])
def test_a_rig_written_in_any_format_is_read_back(tmp_path: Path, form: RigFormat, lens: LensModel) -> None:
    one = rig(lens)
    if form == "kalibr" and lens != "fisheye":
        with pytest.raises(RigError, match=r"cam0: Kalibr.s radtan lens has k1 k2 p1 p2 only"):
            write_rig_as(one, tmp_path / "out.yaml", form)
        return
    files = write_rig_as(one, tmp_path / "out.yaml", form)
    two = read_rig(files[0], files[1] if len(files) == 2 else None)  # not told what lens: the files say it
    assert (two.left.lens, two.right.lens) == (lens, lens)
    assert largest_gap(one, two) < 1e-12


def test_a_matrix_that_stands_twice_in_an_xml_file_is_refused_and_a_list_is_not(tmp_path: Path) -> None:
    file = tmp_path / "stereo.xml"
    storage = cv2.FileStorage(str(file), cv2.FileStorage_WRITE)
    one = rig()
    storage.write("imageSize", np.array([1280.0, 960.0]))
    storage.write("files", ["a.png", "b.png"])
    for name, value in (("K1", one.left.K), ("D1", one.left.distortion), ("K2", one.right.K),
                        ("D2", one.right.distortion), ("R", one.right_from_left[:3, :3]),
                        ("T", one.right_from_left[:3, 3])):  # fmt: skip
        storage.write(name, value)
    storage.release()
    assert read_rig(file).baseline_m == pytest.approx(one.baseline_m)
    text = file.read_text()
    again = text[text.index("<T ") : text.index("</T>") + 4]
    file.write_text(text.replace("</opencv_storage>", f"{again}</opencv_storage>"))  # as appending writes it
    with pytest.raises(RigError, match="<T> stands twice"):
        read_rig(file)


def test_an_opencv_file_and_a_project_that_contradict_each_other_on_the_lens_are_refused(tmp_path: Path) -> None:
    write_rig_as(rig("five"), tmp_path / "out.yaml", "opencv")
    with pytest.raises(RigError, match=r"distortion_model is 'plumb_bob', and rig\.fisheye says another"):
        read_rig(tmp_path / "out.yaml", None, Foreign(fisheye=True))


def test_a_rig_of_two_photo_sizes_is_not_written_as_opencvs_one(tmp_path: Path) -> None:
    one = rig()
    with pytest.raises(RigError, match="one size of photos"):
        write_rig_as(replace(one, right=replace(one.right, width_px=1296)), tmp_path / "out.yaml", "opencv")


@pytest.mark.parametrize("ending", [".yml", ".xml", ".json"])
def test_opencvs_own_files_are_read_and_ours_by_opencv(tmp_path: Path, ending: str) -> None:
    one = rig()
    file = tmp_path / f"stereo{ending}"
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    for name, matrix in (
        ("M1", one.left.K),
        ("D1", one.left.distortion[None]),
        ("M2", one.right.K),
        ("D2", one.right.distortion[None]),
        ("R", one.right_from_left[:3, :3]),
        ("T", one.right_from_left[:3, 3:] * 1000.0),
    ):
        storage.write(name, np.array(matrix))
    storage.release()
    size = Foreign(size_px=(1280, 960))
    assert largest_gap(one, read_rig(file, foreign=replace(size, metres_per_unit=0.001))) < 1e-12
    with pytest.raises(RigError, match=r"baseline 249\.6 m.*looks like millimetres"):
        read_rig(file, foreign=size)
    with pytest.raises(RigError, match="photo_size_px"):
        read_rig(file)
    write_rig_as(one, tmp_path / "ours.yml", "opencv")
    theirs = cv2.FileStorage(str(tmp_path / "ours.yml"), cv2.FILE_STORAGE_READ)
    assert np.array_equal(theirs.getNode("K2").mat(), one.right.K)
    assert np.array_equal(theirs.getNode("D1").mat(), one.left.distortion[None])


def test_intrinsics_and_extrinsics_in_two_opencv_files_are_read_in_either_order(tmp_path: Path) -> None:
    whole = write_rig_as(rig(), tmp_path / "all.yml", "opencv")[0].read_text(encoding="utf-8")
    cut = whole.index("R: !!")
    (tmp_path / "intrinsics.yml").write_text(whole[:cut], encoding="utf-8")
    (tmp_path / "extrinsics.yml").write_text("%YAML:1.0\n---\n" + whole[cut:], encoding="utf-8")
    for order in (("intrinsics", "extrinsics"), ("extrinsics", "intrinsics")):
        first, second = (tmp_path / f"{name}.yml" for name in order)
        assert largest_gap(rig(), read_rig(first, second)) == 0.0
    with pytest.raises(RigError, match=r"missing.*T \(as T"):
        read_rig(tmp_path / "intrinsics.yml")


def test_a_camchain_of_kalibr_is_read_with_its_rounded_rotation_mended(tmp_path: Path) -> None:
    (tmp_path / "camchain.yaml").write_text(KALIBR, encoding="utf-8")
    found = read_rig(tmp_path / "camchain.yaml")
    assert found.baseline_m == pytest.approx(0.11007, abs=1e-4)
    assert found.left.lens == "five" and found.left.distortion[4] == 0.0 and found.right.K[0, 2] == 379.999
    turn = found.right_from_left[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-12 and turn[2, 1] == pytest.approx(0.01410, abs=1e-4)
    assert not found.covariance.any()


def test_the_baseline_of_a_pair_of_camera_infos_is_the_right_projections(tmp_path: Path) -> None:
    left, right = tmp_path / "left.yaml", tmp_path / "right.yaml"
    left.write_text(ROS.format(side="left", shift=0), encoding="utf-8")
    right.write_text(ROS.format(side="right", shift=-96), encoding="utf-8")
    found = read_rig(left, right)
    assert np.abs(found.right_from_left - rigid(np.eye(3), [-0.2, 0.0, 0.0])).max() < 1e-12
    with pytest.raises(RigError, match=r"left and right are swapped: the right camera stands 0.200 m to the LEFT"):
        read_rig(right, left)
    with pytest.raises(RigError, match="no baseline"):
        read_rig(left, left)
    with pytest.raises(RigError, match="file_right"):
        read_rig(left)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (KALIBR.replace("pinhole", "omni"), r"cam0: the camera model .omni."),
        (KALIBR.replace("radtan", "fov"), r"distortion model .fov. isn.t read"),
        (KALIBR.replace("cam1", "cam2"), r"holds cam0, cam2"),
        (KALIBR.replace("-0.11007", "-110.07"), r"baseline 110\.1 m.*millimetres"),
        (KALIBR.replace("458.654", ".nan"), r"cam0: needs intrinsics"),
        (KALIBR.replace("resolution: [752, 480]", "resolution: wide"), r"resolution \[w, h\]"),
        (KALIBR.replace("[0.00231, 0.99989", "[0.00231, 0.5"), "no rigid transform"),
        ("cam0: 3\ncam1: 4\n", "cam0: holds no camera"),
        ("K1: !!python/object/apply:os.system ['true']\n", "not plain YAML"),
        ("K1: &a [1]\nK2: *a\n", "aliases"),
        ("[" * 100_000, "nested deeper than 12"),
        (
            '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bb">]><opencv_storage><K1>&b;</K1></opencv_storage>',
            "DOCTYPE",
        ),
        ("<opencv_storage><K1>", "not well-formed"),
        ("<opencv_storage><K1><data>1 2 x</data></K1></opencv_storage>", r"K_left \(as K1"),
        ("K1: !!opencv-matrix\n  rows: 100000\n  cols: 100000\n  data: [1.]\n", "missing"),
        ("just text", "the file"),
    ],
)
def test_what_is_no_rig_is_refused_with_what_is_wrong_in_it(tmp_path: Path, text: str, says: str) -> None:
    file = tmp_path / "rig.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match=says) as raised:
        read_rig(file)
    assert str(file) in str(raised.value)


def test_thin_prism_lenses_are_refused_and_zeros_behind_five_are_not(tmp_path: Path) -> None:
    text = write_rig_as(rig(), tmp_path / "a.yml", "opencv")[0].read_text(encoding="utf-8")
    for extra, fine in ((", 0., 0., 0., 0., 0., 0., 0., 0., 0. ]", True), (", 0., 0., 0., 0.1, 0., 0., 0. ]", False)):
        file = tmp_path / "more.yml"
        file.write_text(text.replace("-0.003 ]", f"-0.003{extra}").replace("cols: 5", "cols: 14"), encoding="utf-8")
        if fine:
            assert largest_gap(rig(), read_rig(file)) == 0.0
        else:
            with pytest.raises(RigError, match="thin-prism"):
                read_rig(file)


def test_a_rig_file_too_large_or_not_to_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "big.yaml").write_bytes(b"# " + b"x" * 200_001)
    with pytest.raises(RigError, match=r"big\.yaml: larger than 0.2 MB"):
        read_rig(tmp_path / "big.yaml")
    with pytest.raises(OutputError, match="can't be written"):
        write_rig_as(rig(), tmp_path / "nowhere" / "rig.yaml", "opencv")


def test_a_swapped_rig_is_refused_by_that_name(tmp_path: Path) -> None:
    swapped = replace(rig(), right_from_left=frozen(rigid(np.eye(3), [0.25, 0.0, 0.0])))
    write_rig_as(swapped, tmp_path / "rig.yaml", "rig")
    with pytest.raises(RigError, match="left and right are swapped"):
        read_rig(tmp_path / "rig.yaml")


@pytest.mark.parametrize("kind", ["project", "result", "measure"])
def test_another_file_of_the_programs_in_a_rigs_place_is_named_as_what_it_is(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "project.yaml"
    file.write_text(f"format: asbuilt-bim/{kind}\nversion: 1\n", encoding="utf-8")
    with pytest.raises(RigError, match=f"is no rig but a file of the kind asbuilt-bim/{kind}"):
        read_rig(file)


def test_an_ifc_file_in_a_rigs_place_is_named_as_one(tmp_path: Path) -> None:
    file = tmp_path / "design.ifc"
    file.write_text("ISO-10303-21;\nHEADER;\n", encoding="utf-8")
    with pytest.raises(RigError, match="this is an IFC file"):
        read_rig(file)


def test_a_slip_in_a_rig_file_is_named_by_its_line_also_below_opencvs_first_line(tmp_path: Path) -> None:
    file = tmp_path / "rig.yaml"
    file.write_text("%YAML:1.0\n---\na: 1\n b: 2\n", encoding="utf-8")
    with pytest.raises(RigError, match=r"not plain YAML, line 4 \(b: 2\): mapping values are not allowed here"):
        read_rig(file)
