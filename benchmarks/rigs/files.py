"""Every calibration file of the data folder: the good ones read, each bad or foreign one refused by name.

python benchmarks/rigs/files.py --check --json figures.json      some seconds
python benchmarks/rigs/files.py --quick                          the same

The files are other people's and not part of the project: ASBUILT_BIM_DATA names their folder (default ../shared/data).
What is expected of each stands here: its baseline as its folder's index states it, or words of the refusal.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig_files
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import AsBuiltError
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told

NEAR = 0.003
"""Of a baseline: the index states them to a tenth of a millimetre."""
HD, VGA = (1280, 720), (672, 376)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Files of one rig, and what is expected: a baseline in mm with doubts, or `says`, words of its refusal."""

    files: tuple[str, ...]
    baseline_mm: float = 0.0
    says: str = ""
    code: Reason | None = None
    foreign: Foreign = field(default_factory=Foreign)


def good(baseline_mm: float, *files: str, photo_px: tuple[int, int] | None = None, cameras: tuple[str, ...] = (),
         code: Reason | None = None) -> Case:  # fmt: skip
    """Return files that are read; `code`: with this doubt."""
    foreign = Foreign(photo_px=photo_px, cameras=cameras)
    return Case(files=files, baseline_mm=baseline_mm, foreign=foreign, code=code)


def bad(says: str, *files: str, code: Reason | None = None, foreign: Foreign | None = None) -> Case:
    """Return files that are refused with these words."""
    return Case(files=files, says=says, code=code, foreign=foreign or Foreign(photo_px=HD))


ZED, OAK, KALIBR = "rigs/calibrations/zed/", "rigs/calibrations/oak/", "rigs/calibrations/kalibr/"
INTEL, I3DR, BASALT = "rigs/calibrations/realsense/", "rigs/calibrations/i3dr/", "rigs/calibrations/basalt/"
EUROC, CORRIDOR = "stereo/euroc/", "stereo/zed_corridor/"
BUMBLEBEE = KALIBR + "bumblebee_camchain-bb2_bb3_pancam.yaml"
SEVERAL = "say which two are the rig"
CASES = (
    *(good(119.896, ZED + "SN28281527.conf", photo_px=size) for size in ((2208, 1242), (1920, 1080), HD, VGA)),
    *(good(120.127, ZED + "SN5867575.conf", photo_px=size) for size in ((2208, 1242), (1920, 1080), HD, VGA)),
    *(
        good(120.0, ZED + "SN3562.conf", photo_px=size, code=Reason.RIG_FILES_CONTRADICT)
        for size in ((2208, 1242), (1920, 1080), HD, VGA)
    ),
    good(
        125.0, ZED + "SN3562_ros_left.yaml", ZED + "SN3562_ros_right.yaml", code=Reason.RIG_BASELINE_NOT_OF_TYPE
    ),
    *(good(119.997, CORRIDOR + "SN21531_from_m.conf", photo_px=size) for size in ((1920, 1080), HD)),
    good(119.997, CORRIDOR + "ZED_Calibration_File.m", photo_px=HD, cameras=("ZED",)),
    good(63.0, CORRIDOR + "ZED_Calibration_File.m", photo_px=HD, cameras=("ZEDM",)),
    good(75.2, OAK + "oak_d_lite_calib.json"),
    good(73.8, "stereo/oak_terrace/calib.json"),
    good(76.0, KALIBR + "oak_camchain-pinhole-drone01.yaml"),
    good(119.3, BUMBLEBEE, cameras=("cam0", "cam1")),
    good(119.3, BUMBLEBEE, photo_px=(1024, 768)),
    good(119.8, BUMBLEBEE, cameras=("cam2", "cam3")),
    good(239.7, BUMBLEBEE, cameras=("cam2", "cam4")),
    good(55.6, BASALT + "oak_kb4_calibration.json"),
    good(110.2, BASALT + "euroc_ds_calib.json"),
    good(64.1, INTEL + "t265_left.yaml", INTEL + "t265_right.yaml"),
    good(88.3, I3DR + "left.yaml", I3DR + "right.yaml"),
    good(
        88.3, I3DR + "left_calibration.xml", I3DR + "right_calibration.xml", I3DR + "stereo_calibration.xml",
        photo_px=(1920, 1200),
    ),
    good(110.08, EUROC + "LeftCameraParams.yaml", EUROC + "RightCameraParams.yaml"),
    good(110.08, EUROC + "machine_hall/sensorLeft.yaml", EUROC + "machine_hall/sensorRight.yaml"),
    good(120.3, EUROC + "machine_hall/left_sensor_fisheye.yaml", EUROC + "machine_hall/right_sensor_fisheye.yaml"),
    good(193.0, "stereo/middlebury_motorcycle/calib.txt"),
    good(221.8, "stereo/middlebury_octagon/calib.txt"),
    good(59.55, "stereo/eth3d_playground/calib.txt"),
    bad("failed download", ZED + "bad/SN32959545.conf"),
    bad(
        "aren't of one rectified pair", ZED + "bad/camera_info_left.yaml", ZED + "bad/camera_info_right.yaml",
        code=Reason.RIG_PROJECTIONS_CONTRADICT,
    ),
    *(
        bad("looks like millimetres", ZED + f"SN5867575_{size}_camera_info_left.yaml",
            ZED + f"SN5867575_{size}_camera_info_right.yaml")
        for size in ("FHD", "HD")
    ),  # their script wrote 167.6 and 83.8 mm for the 120.1 mm of the same camera's .conf
    bad(
        "a RealSense D435 has 50 mm", INTEL + "d435i_vins_left.yaml", INTEL + "d435i_vins_right.yaml",
        INTEL + "d435i_vins_config.yaml", code=Reason.RIG_BASELINE_NOT_OF_TYPE,
    ),
    bad("left.yaml: there is no such file", INTEL + "d435i_vins_config.yaml"),
    bad("give the photos' one: rig.photo_size_px", ZED + "SN5867575.conf", foreign=Foreign()),
    bad("hold both eyes side by side", ZED + "SN5867575.conf", foreign=Foreign(photo_px=(2560, 720))),
    bad(SEVERAL, BUMBLEBEE, foreign=Foreign()),
    bad("say which: rig.cameras: [ZED]", CORRIDOR + "ZED_Calibration_File.m"),
    bad("export its cameras", "rigs/calibrations/colmap/rig_config2.json"),
    bad("left and right are swapped", "rigs/barry_swapped/intrinsics.yml", "rigs/barry_swapped/extrinsics.yml",
        foreign=Foreign(size_px=(640, 512), metres_per_unit=0.001)),
    bad("looks like millimetres", "rigs/barry_swapped/intrinsics.yml", "rigs/barry_swapped/extrinsics.yml",
        foreign=Foreign(size_px=(640, 512))),
    bad("jsonencode(toStruct(stereoParams))", "rigs/cheetah_22.15mm/stereo12-12Params.mat"),
    bad("jsonencode(toStruct(stereoParams))", CORRIDOR + "Custom_Calibration_ZED_SN21531_HD_720.mat"),
    bad("numpy array", "rigs/stereopi/calib_result/rot_mat.npy"),
    bad("this is one camera", I3DR + "left_calibration.xml"),
    bad("this is one camera", I3DR + "left.yaml"),
    bad("no rig", "stereo/herz_jesus/K.txt"),
    bad("no rig", "stereo/herz_jesus/0006.jpg.camera", "stereo/herz_jesus/0007.jpg.camera"),
    bad("no rig", "photos/surveyed_wall/cameras.txt"),
    bad("no rig", "rigs/stereopi/3dmap_set.txt"),
    bad("no rig", "photos/tags_test/test_info.yaml"),
    bad("no rig", "photos/site_parking/IMG_8834.xmp"),
    bad("not plain YAML", "photos/tags_room/calib.txt"),
)  # fmt: skip


def judged(case: Case) -> tuple[bool, str]:
    """Read a case's files; say whether that came as expected, and what came."""
    try:
        found = read_rig_files([DATA / name for name in case.files], case.foreign)
    except AsBuiltError as refusal:
        codes = {one.code for one in getattr(refusal, "rejections", ())}
        as_wanted = bool(case.says) and case.says in str(refusal) and (case.code is None or case.code in codes)
        return as_wanted, " ".join(str(refusal).replace(str(DATA), "").split())[:110]
    rig, codes = found.rig, {one.code for one in found.warnings}
    near = abs(1000.0 * rig.baseline_m / case.baseline_mm - 1.0) <= NEAR if case.baseline_mm else False
    doubt = f", {', '.join(sorted(codes))}" if codes else ""
    width = "as factories are" if found.is_factory else "as other programs'"
    came = (
        f"{1000.0 * rig.baseline_m:.1f} mm, {rig.left.width_px}x{rig.left.height_px}, {rig.left.lens}, {width}{doubt}"
    )
    return near and codes == ({case.code} if case.code else set()), came


def main() -> int:
    """Read what is there and print the table, file by file."""
    args = options(__doc__ or "").parse_args()
    if absent(DATA / "rigs"):
        return 0
    rows: list[Line] = []
    right: dict[bool, list[bool]] = {True: [], False: []}
    for case in CASES:
        if not all((DATA / name).exists() for name in case.files):
            rows.append(told(f"absent: {case.files[0]}", "", 0))
            continue
        fine, came = judged(case)
        right[not case.says].append(fine)
        rows.append(told(f"{'' if fine else 'WRONG '}{' + '.join(Path(name).name for name in case.files)}", came, 1))
    lines = [
        line(what, f"{sum(ones)} of {len(ones)}", "all", len(ones), all(ones), least_n=20)
        for what, ones in (
            ("good files (and sizes in them) read, with the index's baseline", right[True]),
            ("bad, foreign or unclear ones refused by name", right[False]),
        )
    ]
    return report("Calibration files as people have them", [*lines, *rows], args)


if __name__ == "__main__":
    sys.exit(main())
