from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.calibrate import calibrate_stereo
from asbuilt_bim.camera.photo.read import Photo, read_photo
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.errors import CalibrationError, RigError

RIGS = Path(os.environ.get("ASBUILT_BIM_DATA", "../shared/data")) / "rigs"
pytestmark = pytest.mark.skipif(not RIGS.is_dir(), reason="no real rigs here: set ASBUILT_BIM_DATA")


def photo_pairs(folder: str, pattern: str, every: int = 1) -> list[tuple[Photo, Photo]]:
    lefts = sorted((RIGS / folder).glob(pattern))[::every]
    return [(read_photo(left), read_photo(left.with_name(left.name.replace("left", "right")))) for left in lefts]


def test_a_published_rig_comes_out_with_its_published_baseline() -> None:
    """INDEX.md: OpenCV gives 94.03 mm, f 463 px, rms 0.25 px."""
    board = Board(kind="chessboard", columns=9, rows=6, square_m=0.02423)
    found = calibrate_stereo(photo_pairs("sourishg_24.23mm", "left*.jpg"), board)
    assert found.rig.baseline_m == pytest.approx(0.09403, rel=0.004)
    assert found.rig.left.K[0, 0] == pytest.approx(463.0, rel=0.01)
    assert found.rig.rms_px < 0.3


def test_photos_of_a_quarter_megapixel_still_calibrate() -> None:
    """INDEX.md: OpenCV gives 57.4 mm for squares of 25 mm, whose true size nobody knows."""
    board = Board(kind="chessboard", columns=9, rows=6, square_m=0.025)
    found = calibrate_stereo(photo_pairs("stereopi/pairs", "left*.png", every=2), board)
    assert found.rig.baseline_m == pytest.approx(0.0574, rel=0.01)
    assert np.sqrt(np.diag(found.rig.covariance))[0] < 3.0


def test_published_rigs_of_others_are_read_with_their_published_baselines() -> None:
    """INDEX.md: EuRoC 110.08 mm; a MyntEye with fisheyes, 120.3 mm between its T_BS; a swapped rig in mm."""
    euroc = RIGS.parent / "stereo/euroc"
    found = read_rig(euroc / "LeftCameraParams.yaml", euroc / "RightCameraParams.yaml")
    assert found.baseline_m == pytest.approx(0.11008, abs=1e-5)
    hall = euroc / "machine_hall"
    fisheye = read_rig(hall / "left_sensor_fisheye.yaml", hall / "right_sensor_fisheye.yaml")
    assert fisheye.left.lens == "fisheye" and fisheye.baseline_m == pytest.approx(0.1203, abs=2e-4)
    barry = RIGS / "barry_swapped"
    for unit_m, says in ((1.0, "looks like millimetres"), (0.001, "left and right are swapped")):
        foreign = Foreign(size_px=(640, 512), metres_per_unit=unit_m)
        with pytest.raises(RigError, match=says):
            read_rig(barry / "intrinsics.yml", barry / "extrinsics.yml", foreign)


def test_a_real_rig_with_left_and_right_swapped_is_refused_by_name() -> None:
    board = Board(kind="chessboard", columns=9, rows=6, square_m=0.025)
    with pytest.raises(CalibrationError, match="left and right are swapped"):
        calibrate_stereo(photo_pairs("barry_swapped", "left*.jpg", every=3), board)
