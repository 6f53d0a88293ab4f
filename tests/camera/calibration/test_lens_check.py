from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.calibrate import rig_of_adjustment
from asbuilt_bim.camera.calibration.checks import check_calibration
from asbuilt_bim.camera.calibration.parameters import pack
from asbuilt_bim.camera.lens import COEFFICIENTS, LensModel
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from tests.camera.virtual import SIZE, rig, views


@pytest.mark.parametrize(
    ("true", "fitted", "left"),
    [("five", "five", False), ("fisheye", "fisheye", False), ("fisheye", "five", True)],
)
def test_a_lens_that_its_model_does_not_hold_is_named_with_the_model_that_does(
    true: LensModel, fitted: LensModel, left: bool
) -> None:
    one = rig(true)
    seen, poses = views(one, 20, 0.05, seed=2)
    shared = pack(one.left, one.right, one.right_from_left)
    if true != fitted:
        cameras = np.split(shared[:-6], 2)
        begun = [np.concatenate([camera[:4], np.zeros(COEFFICIENTS[fitted])]) for camera in cameras]
        shared = np.concatenate([*begun, shared[-6:]])
    done = adjust(frozen(shared), poses, seen)
    checks = check_calibration(seen, done, rig_of_adjustment(done, SIZE, rig_covariance(done), len(seen)))
    assert (checks.lens_left_px > 0.03) is left
    assert (
        "rational" in [one.values["model"] for one in checks.warnings if one.code == Reason.CALIBRATION_LENS]
    ) is left
