from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.rig import OTHER_PROGRAMS, StereoRig
from asbuilt_bim.camera.rig_formats.factory import FACTORY
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig, read_rig_files, write_rig_as
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import RigError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from tests.camera.rig_formats import written
from tests.camera.test_rig_formats import ROS, largest_gap
from tests.camera.virtual import rig


def of_size(one: StereoRig, width: int, height: int) -> StereoRig:
    """The rig's numbers for photos of another size, its principal points in their middle."""

    def camera(of):  # type: ignore[no-untyped-def]
        K = of.K.copy()
        K[:2, 2] = 0.5 * width + 3.0, 0.5 * height - 5.0
        return replace(of, K=frozen(K), width_px=width, height_px=height)

    return replace(one, left=camera(one.left), right=camera(one.right))


HD = of_size(rig(), 1280, 720)
ZED = Foreign(photo_px=(1280, 720))
FORMS: dict[str, tuple[Callable[[], str], StereoRig, Foreign]] = {
    "mine.conf": (lambda: written.zed_conf(HD), HD, ZED),
    "listing.m": (lambda: written.zed_listing(HD), HD, ZED),
    "eeprom.json": (lambda: written.oak_eeprom(rig("rational")), rig("rational"), Foreign()),
    "middle.json": (lambda: written.oak_eeprom(rig("fisheye"), by_middle=True), rig("fisheye"), Foreign()),
    "small.json": (lambda: written.oak_small(rig("rational")), rig("rational"), Foreign()),
    "listing.txt": (lambda: written.realsense_listing(rig()), rig(), Foreign()),
    "basalt.json": (lambda: written.basalt_json(rig("fisheye")), rig("fisheye"), Foreign()),
    "matlab.json": (lambda: written.matlab_json(rig()), rig(), Foreign()),
    "Calib_Results_stereo.m": (lambda: written.bouguet_m(rig()), rig(), Foreign()),
    "cameras.xml": (lambda: written.metashape_xml(rig()), rig(), Foreign()),
}
WIDE = {"mine.conf", "listing.m", "eeprom.json", "middle.json", "small.json", "listing.txt"}


@pytest.mark.parametrize("name", FORMS)
def test_a_rig_as_makers_and_other_programs_write_it_is_read_back(tmp_path: Path, name: str) -> None:
    text, one, foreign = FORMS[name]
    (tmp_path / name).write_text(text(), encoding="utf-8")
    found = read_rig_files([tmp_path / name], foreign)
    assert largest_gap(one, found.rig) < 1e-9
    assert found.rig.width == (FACTORY if name in WIDE else OTHER_PROGRAMS) and not found.warnings


@pytest.mark.parametrize("lens", ["five", "fisheye"])
def test_a_vins_configuration_finds_the_cameras_that_it_names_beside_it(tmp_path: Path, lens: str) -> None:
    one = rig("fisheye") if lens == "fisheye" else rig()
    if lens == "five":  # VINS has no k3
        one = replace(one, **{
            side: replace(camera, distortion=frozen([*camera.distortion[:4], 0.0]))
            for side, camera in (("left", one.left), ("right", one.right))
        })  # fmt: skip
    for name, text in written.vins_files(one).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert largest_gap(one, read_rig(tmp_path / "config.yaml")) < 1e-9
    three = read_rig(tmp_path / "left.yaml", tmp_path / "right.yaml", third=tmp_path / "config.yaml")
    assert largest_gap(one, three) < 1e-9
    (tmp_path / "right.yaml").unlink()
    with pytest.raises(RigError, match=r"right\.yaml: there is no such file"):
        read_rig(tmp_path / "config.yaml")


def test_an_eeprom_is_scaled_to_the_photos_or_cut_as_the_camera_cuts(tmp_path: Path) -> None:
    one = of_size(rig("rational"), 1280, 800)
    (tmp_path / "oak.json").write_text(written.oak_eeprom(one), encoding="utf-8")
    half = read_rig(tmp_path / "oak.json", None, Foreign(photo_px=(640, 400)))
    point = np.array([0.3, -0.2, 2.0])
    assert half.left.project(point) == pytest.approx(0.5 * one.left.project(point) - 0.25, abs=1e-9)
    cut = read_rig(tmp_path / "oak.json", None, Foreign(photo_px=(1280, 720)))
    assert cut.left.project(point) == pytest.approx(one.left.project(point) - [0.0, 40.0], abs=1e-9)
    with pytest.raises(RigError, match=r"calibrated at 1280x800, and the photos are 1000x800"):
        read_rig(tmp_path / "oak.json", None, Foreign(photo_px=(1000, 800)))


def test_a_double_sphere_becomes_the_fisheye_that_sees_alike(tmp_path: Path) -> None:
    """The published numbers of EuRoC's left camera: a point is projected by the model's own equations."""
    xi, alpha, fx, fy, cx, cy = -0.2409573942, 0.5669968992, 349.756, 348.7245, 365.8944, 249.3300
    document = json.loads(written.basalt_json(of_size(rig("fisheye"), 752, 480)))
    for lens in document["value0"]["intrinsics"]:
        values = {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "xi": xi, "alpha": alpha}
        lens |= {"camera_type": "ds", "intrinsics": values}
    (tmp_path / "ds.json").write_text(json.dumps(document), encoding="utf-8")
    found = read_rig(tmp_path / "ds.json")
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.uniform([-1.2, -0.7], [1.2, 0.7], (200, 2)), np.ones((200, 1))], axis=1)
    d1 = np.linalg.norm(points, axis=1)
    d2 = np.hypot(np.linalg.norm(points[:, :2], axis=1), xi * d1 + points[:, 2])
    bent = points[:, :2] / (alpha * d2 + (1 - alpha) * (xi * d1 + points[:, 2]))[:, None]
    assert np.abs(found.left.project(points) - (bent * [fx, fy] + [cx, cy])).max() < 0.05


def test_of_a_chain_of_cameras_two_are_taken_by_name_or_by_the_photos_size(tmp_path: Path) -> None:
    parts = []
    for number, (size, shift) in enumerate((((1024, 768), 0.0), ((1024, 768), -0.12), ((1280, 960), 0.4))):
        pose = f"\n  T_cn_cnm1: [[1, 0, 0, {shift}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]" if number else ""
        parts.append(
            f"cam{number}:{pose}\n  camera_model: pinhole\n"
            "  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n"
            f"  intrinsics: [800, 800, {size[0] / 2}, {size[1] / 2}]\n  resolution: [{size[0]}, {size[1]}]"
        )
    (tmp_path / "chain.yaml").write_text("\n".join(parts) + "\n", encoding="utf-8")
    with pytest.raises(RigError, match=r"say which two are the rig, left first: rig\.cameras: \[cam0, cam1\]"):
        read_rig(tmp_path / "chain.yaml")
    assert read_rig(tmp_path / "chain.yaml", None, Foreign(photo_px=(1024, 768))).baseline_m == pytest.approx(0.12)
    named = read_rig(tmp_path / "chain.yaml", None, Foreign(cameras=("cam2", "cam0")))
    assert named.baseline_m == pytest.approx(0.28) and named.left.width_px == 1280
    with pytest.raises(RigError, match="name two of these"):
        read_rig(tmp_path / "chain.yaml", None, Foreign(cameras=("cam1", "cam9")))


def test_numbers_of_another_size_of_photo_are_refused_by_code(tmp_path: Path) -> None:
    """As a download of a ZED Mini's: the values of 672x376, called 1280x720."""
    small = of_size(replace(rig(), right_from_left=frozen(rigid([0, 0, 0], [-0.063, 0, 0]))), 672, 376)
    called = replace(
        small,
        left=replace(small.left, width_px=1280, height_px=720),
        right=replace(small.right, width_px=1280, height_px=720),
    )
    write_rig_as(called, tmp_path / "rig.yml", "opencv")
    with pytest.raises(RigError, match="is that of photos of 672x376") as raised:
        read_rig(tmp_path / "rig.yml")
    assert [one.code for one in raised.value.rejections] == [Reason.RIG_SIZE_CONTRADICTED]


def test_a_ros_pair_whose_projections_are_of_no_rectified_pair_is_refused_by_code(tmp_path: Path) -> None:
    left, right = tmp_path / "left.yaml", tmp_path / "right.yaml"
    left.write_text(ROS.format(side="left", shift=0), encoding="utf-8")
    text = ROS.format(side="right", shift=-96).replace(
        "[480, 0, 320, -96, 0, 480, 240", "[479, 0, 320, -96, 0, 479, 244"
    )
    right.write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match=r"rows 4\.0 px apart") as raised:
        read_rig(left, right)
    assert raised.value.rejections[0].code is Reason.RIG_PROJECTIONS_CONTRADICT


def ros_pair(folder: Path, name: str, baseline_m: float) -> list[Path]:
    files = [folder / f"{name}_left.yaml", folder / f"{name}_right.yaml"]
    for file, shift in zip(files, (0.0, -480.0 * baseline_m), strict=True):
        file.write_text(ROS.format(side=file.stem, shift=shift).replace("640", "'640'"), encoding="utf-8")
    return files


def test_two_files_of_one_serial_number_that_differ_by_4_percent_are_named_and_widen(tmp_path: Path) -> None:
    zed = replace(HD, right_from_left=frozen(rigid([0.001, 0.002, 0.0], [-0.120, 0.0, 0.0])))
    conf = tmp_path / "SN3562.conf"
    conf.write_text(written.zed_conf(zed), encoding="utf-8")
    assert not read_rig_files([conf], ZED).warnings
    pair = ros_pair(tmp_path, "SN3562_ros", 0.125)
    found = read_rig_files([conf], ZED)
    assert [one.code for one in found.warnings] == [Reason.RIG_FILES_CONTRADICT]
    assert found.warnings[0].values["file"] == "SN3562_ros_left.yaml + SN3562_ros_right.yaml"
    assert found.rig.width.scale_share == pytest.approx(np.hypot(FACTORY.scale_share, 0.125 / 0.120 - 1.0))
    other = read_rig_files(pair)
    assert {one.code for one in other.warnings} == {Reason.RIG_FILES_CONTRADICT, Reason.RIG_BASELINE_NOT_OF_TYPE} - (
        set() if len(other.warnings) == 2 else {Reason.RIG_FILES_CONTRADICT}
    )


@pytest.mark.parametrize(("baseline_m", "outcome"), [(0.0505, "fine"), (0.0525, "doubt"), (0.0609, "refused")])
def test_eyes_that_stand_as_no_camera_of_the_type_has_them_are_named(
    tmp_path: Path, baseline_m: float, outcome: str
) -> None:
    pair = ros_pair(tmp_path, "d435i", baseline_m)
    if outcome == "refused":
        with pytest.raises(RigError, match=r"60\.9 mm apart, and a RealSense D435 has 50 mm \(\+22%\)"):
            read_rig_files(pair)
        return
    found = read_rig_files(pair)
    assert [one.code for one in found.warnings] == ([Reason.RIG_BASELINE_NOT_OF_TYPE] if outcome == "doubt" else [])
    assert found.rig.width.scale_share == pytest.approx(FACTORY.scale_share if outcome == "fine" else 0.0505, abs=1e-3)


def test_what_a_bought_rig_is_trusted_to_stays_with_it_in_our_own_file(tmp_path: Path) -> None:
    (tmp_path / "oak.json").write_text(written.oak_small(rig("rational")), encoding="utf-8")
    found = read_rig(tmp_path / "oak.json")
    write_rig_as(found, tmp_path / "rig.yaml", "rig")
    assert read_rig(tmp_path / "rig.yaml").width == found.width == FACTORY


def test_pairs_of_metashape_that_do_not_stand_alike_are_no_rig(tmp_path: Path) -> None:
    (tmp_path / "cameras.xml").write_text(written.metashape_xml(rig(), 3, moved_m=0.002), encoding="utf-8")
    with pytest.raises(RigError, match=r"its pairs stand differently, by 0\.80% of the baseline"):
        read_rig(tmp_path / "cameras.xml")
    text = written.metashape_xml(rig()).replace("<transform><scale>0.5</scale></transform>", "")
    (tmp_path / "cameras.xml").write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match="the chunk has no scale"):
        read_rig(tmp_path / "cameras.xml")


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("mine.conf", lambda t: "Redirecting...", "the file is no rig .'Redirecting...'"),
        ("mine.conf", lambda t: t.replace("[STEREO]", "[MONO]"), "a whole file has LEFT_CAM_HD"),
        ("mine.conf", lambda t: t + "[STEREO]\nBaseline=120\n", r"\[STEREO\] stands twice"),
        ("mine.conf", lambda t: t.replace("fx=", "fx=nan;"), "fx is no number"),
        ("mine.conf", lambda t: t.replace("BaseLine=", "Other="), "baseline is missing"),
        ("listing.m", lambda t: t + "ZED.HD.L.fx = 3;\n", "stands twice, with two values"),
        ("listing.m", lambda t: t + written.zed_listing(HD, "ZEDM"), r"say which: rig\.cameras: \[ZED\]"),
        ("eeprom.json", lambda t: t.replace('"toCameraSocket": -1', '"toCameraSocket": 1'), "go round in a circle"),
        ("eeprom.json", lambda t: t.replace('"toCameraSocket": 2', '"toCameraSocket": -1'), "how camera 2 stands"),
        ("eeprom.json", lambda t: t.replace("1280", "1e400"), "eeprom"),
        ("small.json", lambda t: t.replace("[[", "[[9e99, "), "small"),
        ("listing.txt", lambda t: t.replace("Brown Conrady", "Ftheta"), "the distortion 'Ftheta' isn't read"),
        ("listing.txt", lambda t: t.split("Extrinsic")[0], "no extrinsic from Infrared 1"),
        ("basalt.json", lambda t: t.replace("kb4", "magic"), "camera_type 'magic' isn't read"),
        ("basalt.json", lambda t: t.replace('"qw": 0', '"qw": 7'), "quaternion has the length"),
        ("matlab.json", lambda t: t.replace("millimeters", "cubits"), "WorldUnits 'cubits'"),
        ("matlab.json", lambda t: t.replace("millimeters", "meters"), "looks like millimetres"),
        ("Calib_Results_stereo.m", lambda t: t.replace("om = [", "om = [ 1 ; "), "om: another number"),
        ("cameras.xml", lambda t: t.replace('type="frame"', 'type="spherical"'), "'spherical' isn't read"),
        ("cameras.xml", lambda t: "<document>" * 40 + "</document>" * 40, "nested deeper"),
        ("rig.json", lambda t: json.dumps([{"cameras": [{"image_prefix": "a"}]}]), "COLMAP's rig says"),
        ("rig.mat", lambda t: "MATLAB 5.0 MAT-file, Platform: PCWIN64", r"jsonencode\(toStruct\(stereoParams\)\)"),
    ],
)
def test_what_is_damaged_in_a_makers_file_is_named(
    tmp_path: Path, name: str, change: Callable[[str], str], says: str
) -> None:
    text, _, foreign = FORMS.get(name, (lambda: "", rig(), Foreign()))
    file = tmp_path / name
    file.write_text(change(text()), encoding="utf-8")
    with pytest.raises(RigError, match=says):
        read_rig(file, None, foreign)


def test_a_conf_asks_for_the_photos_size_and_knows_both_eyes_in_one_file(tmp_path: Path) -> None:
    conf = tmp_path / "mine.conf"
    conf.write_text(written.zed_conf(HD) + written.zed_conf(HD, "VGA").split("[STEREO]")[0], encoding="utf-8")
    with pytest.raises(RigError, match=r"1280x720, 672x376; give the photos' one: rig\.photo_size_px"):
        read_rig(conf)
    with pytest.raises(RigError, match="hold both eyes side by side"):
        read_rig(conf, None, Foreign(photo_px=(2560, 720)))


def test_a_lens_is_judged_inside_its_own_field(tmp_path: Path) -> None:
    """k1 folds the lens back in the frame's corners, some hundredths of it: these have no direction."""
    K = frozen([[280.0, 0.0, 159.5], [0.0, 280.0, 119.5], [0.0, 0.0, 1.0]])
    for k1, fine in ((-0.37, True), (-1.6, False)):
        small = replace(rig().left, K=K, width_px=320, height_px=240, distortion=frozen([k1, 0.0, 0.0, 0.0, 0.0]))
        one = replace(rig(), left=small, right=small)
        write_rig_as(one, tmp_path / "rig.yaml", "rig")
        if fine:
            lost = np.isnan(small.rays(np.array([[0.0, 0.0], [159.0, 0.0], [0.0, 119.0]]))[:, 0])
            assert lost.tolist() == [True, False, False] and largest_gap(one, read_rig(tmp_path / "rig.yaml")) == 0.0
        else:
            with pytest.raises(RigError, match=r"folds back inside the picture, so \d\d% of it have no direction"):
                read_rig(tmp_path / "rig.yaml")


def test_a_rotation_of_six_digits_is_made_one_in_every_format(tmp_path: Path) -> None:
    def off(turn: np.ndarray) -> float:
        return float(np.abs(turn @ turn.T - np.eye(3)).max())

    rng = np.random.default_rng(1)
    turns = [np.round(rotation_from_vector(rng.uniform(-0.1, 0.1, 3)), 6) for _ in range(100)]
    rounded = rigid(max(turns, key=off), rig().right_from_left[:3, 3])
    assert off(rounded[:3, :3]) > 1e-6
    for form in ("rig", "opencv"):
        write_rig_as(replace(rig(), right_from_left=frozen(rounded)), tmp_path / "rig.yaml", form)  # type: ignore[arg-type]
        turn = read_rig(tmp_path / "rig.yaml").right_from_left[:3, :3]
        assert off(turn) < 1e-14 and np.abs(turn - rounded[:3, :3]).max() < 1e-6
