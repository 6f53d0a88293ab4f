"""Where pixels point to when one of a rig's numbers moves: by slopes, against the moved rig itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import COEFFICIENTS, LENS_MODELS, LensModel
from asbuilt_bim.camera.rig_numbers import in_pixels, rig_numbers, seen_points
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import apply
from tests.camera.virtual import rig

POINTS = np.array([[0.1, -0.2, 4.0], [-0.9, 0.8, 5.0], [1.1, 0.6, 3.0]])


def moved(camera: Intrinsics, number: int, step: float) -> Intrinsics:
    if number < 4:
        K = np.array(camera.K)
        K[(0, 1, 0, 1)[number], (0, 1, 2, 2)[number]] += step
        return replace(camera, K=frozen(K))
    distortion = np.array(camera.distortion)
    distortion[number - 4] += step
    return replace(camera, distortion=frozen(distortion))


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_slopes_are_what_each_number_does_to_the_rays_of_fixed_pixels(lens: LensModel) -> None:
    count = 14 + 2 * COEFFICIENTS[lens]
    one = replace(rig(lens), covariance=frozen(np.zeros((count, count))))
    in_right = apply(one.right_from_left, POINTS)
    seen = seen_points(one, POINTS[:, :2] / POINTS[:, 2:], in_right[:, :2] / in_right[:, 2:])
    assert len(rig_numbers(one)) == count and in_pixels(one).sum() == 8
    for side, (camera, points) in enumerate(((one.left, POINTS), (one.right, in_right))):
        pixels = camera.project(points)
        for number in range(4 + COEFFICIENTS[lens]):
            step = 1e-3 if number < 4 else 1e-6
            rays = [moved(camera, number, sign * step).rays(pixels)[:, :2] for sign in (1.0, -1.0)]
            true = (rays[0] - rays[1]) / (2.0 * step)
            at = 4 * side + number if number < 4 else 14 + side * COEFFICIENTS[lens] + number - 4
            slopes = (seen.left_slopes, seen.right_slopes)[side]
            assert np.allclose(slopes[:, :, at], true, rtol=2e-3, atol=1e-7), (side, number)
            other = (seen.right_slopes, seen.left_slopes)[side]
            assert not other[:, :, at].any()


def test_a_change_of_the_pose_turns_the_right_camera_and_leaves_the_rays() -> None:
    one = rig()
    seen = seen_points(one, POINTS[:, :2] / POINTS[:, 2:], POINTS[:, :2] / POINTS[:, 2:])
    change = np.zeros(14)
    change[9], change[11] = 1e-3, 2e-3
    left, right, pose = seen.rays(change)
    assert np.array_equal(left[:, :2], seen.left) and np.array_equal(right[:, :2], seen.right)
    assert pose[0, 3] == pytest.approx(one.right_from_left[0, 3] + 2e-3)
    assert (pose[:3, :3] @ one.right_from_left[:3, :3].T)[0, 2] == pytest.approx(1e-3, rel=1e-3)
