from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.adjust import adjust
from asbuilt_bim.camera.calibration.parameters import camera_of, layout_of, pack, right_from_left_of, view_residual
from asbuilt_bim.camera.lens import LENS_MODELS, LensModel
from tests.camera.virtual import SIZE, parameters, rig, views

TRUE = rig()
SHARED = pack(TRUE.left, TRUE.right, TRUE.right_from_left)
RIG_ROWS = layout_of(SHARED).rig_rows[:14]


def test_shared_parameters_are_written_and_read_back() -> None:
    left, right = camera_of(SHARED, 0, SIZE), camera_of(SHARED, 1, SIZE)
    assert np.array_equal(left.K, TRUE.left.K) and np.array_equal(right.distortion, TRUE.right.distortion)
    assert np.abs(right_from_left_of(SHARED) - TRUE.right_from_left).max() < 1e-12
    assert np.abs(SHARED[RIG_ROWS] - parameters(TRUE)).max() < 1e-12


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_jacobians_are_those_of_finite_differences(lens: LensModel) -> None:
    true = rig(lens)
    SHARED = pack(true.left, true.right, true.right_from_left)
    seen, poses = views(true, 1, 0.0, seed=0)
    residual, by_shared, by_pose = view_residual(SHARED, poses[0], seen[0])
    assert np.abs(residual).max() < 1e-9
    for jacobian, of_shared in ((by_shared, True), (by_pose, False)):
        for column in range(jacobian.shape[1]):
            start = SHARED if of_shared else poses[0]
            step = 1e-6 * max(1.0, abs(start[column]))
            ends = []
            for sign in (1.0, -1.0):
                moved = start.copy()
                moved[column] += sign * step
                ends.append(view_residual(moved if of_shared else SHARED, poses[0] if of_shared else moved, seen[0])[0])
            numeric = (ends[0] - ends[1]) / (2 * step)
            assert np.abs(numeric - jacobian[:, column]).max() < 1e-4 * max(1.0, np.abs(numeric).max())


def test_without_noise_the_true_rig_comes_back_from_a_bad_start() -> None:
    seen, poses = views(TRUE, 8, 0.0, seed=0)
    start = SHARED.copy()
    start[[0, 1, 9, 10]] *= 1.02
    start[4:9] = start[13:18] = 0.0
    start[18:] += [0.01, -0.01, 0.01, 0.01, -0.01, 0.01]
    found = adjust(start, poses + 0.01, seen)
    error = np.abs(found.shared[RIG_ROWS] - SHARED[RIG_ROWS])  # what the weak prior of the lens leaves
    assert error[:8].max() < 0.002 and error[8:].max() < 1e-5
    assert found.rms_px < 1e-3


def test_sigma_is_a_promise_over_virtual_calibrations() -> None:
    """Errors over claimed sigmas have a mean square of one; bounds are six sigmas of that mean itself."""
    scores = []
    runs = 24
    for seed in range(runs):
        seen, poses = views(TRUE, 10, 0.15, seed=seed)
        found = adjust(SHARED, poses, seen)
        error = found.shared[RIG_ROWS] - SHARED[RIG_ROWS]
        covariance = found.covariance[np.ix_(RIG_ROWS, RIG_ROWS)]
        scores.append(error @ np.linalg.solve(covariance, error))
    degrees = len(RIG_ROWS)
    assert abs(np.mean(scores) / degrees - 1.0) < 6.0 * np.sqrt(2.0 / (degrees * runs))


def test_more_noise_gives_more_sigma_in_proportion() -> None:
    spread = []
    for noise in (0.1, 0.3):
        seen, poses = views(TRUE, 10, noise, seed=3)
        spread.append(np.sqrt(np.diag(adjust(SHARED, poses, seen).covariance)))
    assert np.allclose(spread[1] / spread[0], 3.0, rtol=0.15)
