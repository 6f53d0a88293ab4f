from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.area_effect import area_effect
from asbuilt_bim.camera.calibration.board_sigma import rig_covariance
from asbuilt_bim.camera.calibration.parameters import camera_of, pack, right_from_left_of
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import apply
from tests.camera.virtual import SIZE, rig, views

TRUE = rig()
SQUARE = np.array(
    [[-0.375, -0.5, 5.0], [0.625, -0.5, 5.0], [0.625, 0.5, 5.0], [-0.375, 0.5, 5.0]]
)  # 1 m, between the eyes


def test_what_a_calibration_does_to_an_area_is_what_the_formulas_say() -> None:
    """2 db / b for the baseline, and 2 Z dyaw / b for yaw: area goes with Z squared."""
    level = np.block([[np.eye(3), np.array([[-0.25], [0.0], [0.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])
    one = replace(TRUE, right_from_left=frozen(level))
    assert area_effect(one) is None
    for row, sigma, expected in ((11, 0.001, 2 * 0.001 / 0.25), (9, 1e-4, 2 * 5.0 * 1e-4 / 0.25)):
        covariance = np.zeros((14, 14))
        covariance[row, row] = sigma**2
        found = area_effect(replace(one, covariance=frozen(covariance)))
        assert found is not None and found.sigma == pytest.approx(expected, rel=0.02)


def test_the_sigma_of_an_area_is_kept_over_virtual_calibrations() -> None:
    """Each calibration measures the same true pixels of a square metre at 5 m; six sigmas of the mean square itself."""
    left_px, right_px = TRUE.left.project(SQUARE), TRUE.right.project(apply(TRUE.right_from_left, SQUARE))
    shared = pack(TRUE.left, TRUE.right, TRUE.right_from_left)
    pulls = []
    for seed in range(30):
        found = adjust(shared, *reversed(views(TRUE, 10, 0.15, seed=seed)))
        left, right = (camera_of(found.shared, side, SIZE) for side in (0, 1))
        pose = right_from_left_of(found.shared)
        a, b, c, d = triangulate(left, right, pose, left_px, right_px)
        area = 0.5 * float(np.linalg.norm(np.cross(c - a, d - b)))
        made = replace(TRUE, left=left, right=right, right_from_left=pose, covariance=rig_covariance(found))
        effect = area_effect(made)
        assert effect is not None
        pulls.append((area - 1.0) / effect.sigma)
    assert abs(np.mean(np.square(pulls)) - 1.0) < 6.0 * np.sqrt(2.0 / len(pulls))
