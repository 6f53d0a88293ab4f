"""What a calibration leaves open of the rays, in the numbers that areas depend on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment, adjust
from asbuilt_bim.camera.calibration.calibrate import pinhole_covariance
from asbuilt_bim.camera.calibration.parameters import pack
from asbuilt_bim.camera.lens import bend
from tests.camera.virtual import SIZE, rig, views


def adjusted_rig() -> Adjustment:
    truth = rig()
    seen, poses = views(truth, 12, 0.1, 3)
    shared = pack(truth.left, truth.right, truth.right_from_left)
    vectors = poses if poses.ndim == 2 else poses.reshape(len(seen), 6)
    return adjust(shared, vectors, seen)


def pixel_variance(covariance: np.ndarray, by: np.ndarray) -> float:
    return float(np.einsum("ik,kl,il->", by, covariance, by))


def test_folded_numbers_stretch_the_picture_as_all_numbers_together_do() -> None:
    """The width in the left photo of something that fills half the frame: how far the calibration's error moves it."""
    done = adjusted_rig()

    def width(numbers: np.ndarray) -> np.ndarray:
        ends = bend(numbers[4:9], np.array([[-0.3, 0.1], [0.3, 0.1]])) * numbers[:2] + numbers[2:4]
        return ends[1] - ends[0]

    steps = np.where(np.arange(9) < 4, 1e-3, 1e-6)
    start = done.shared[:9]
    by = np.stack([(width(start + step) - width(start)) / step.sum() for step in np.diag(steps)], axis=1)
    true = pixel_variance(done.covariance[:9, :9], by)
    folded = pixel_variance(pinhole_covariance(done, SIZE)[:4, :4], by[:, :4])
    assert abs(np.log(folded / true)) < 0.4


def test_a_barrel_counts_as_the_focal_length_that_it_looks_like() -> None:
    done = adjusted_rig()
    barrel = np.zeros_like(done.covariance)
    barrel[4, 4] = 0.01**2  # k1 of the left camera alone
    folded = pinhole_covariance(replace(done, covariance=barrel), SIZE)
    reach = float(np.hypot(*SIZE)) / 2 / done.shared[0]
    assert 0.1 * reach**2 < np.sqrt(folded[0, 0]) / done.shared[0] / 0.01 < reach**2  # between none and the corner's
    assert np.all(folded[4:] == 0.0)


def test_the_relative_pose_has_no_lens_to_fold() -> None:
    done = adjusted_rig()
    folded = pinhole_covariance(done, SIZE)
    assert np.allclose(folded, folded.T) and np.allclose(folded[8:, 8:], done.rig_covariance[8:, 8:])


def test_with_lenses_that_are_known_nothing_is_folded() -> None:
    done = adjusted_rig()
    lens = np.setdiff1d(np.arange(len(done.shared)), [0, 1, 2, 3, 9, 10, 11, 12, *range(18, 24)])
    known = done.covariance.copy()
    known[lens], known[:, lens] = 0.0, 0.0
    still = replace(done, covariance=known)
    assert np.allclose(pinhole_covariance(still, SIZE), still.rig_covariance)
