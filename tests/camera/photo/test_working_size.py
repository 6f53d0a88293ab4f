from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.working_size import at_working_size, working_rig
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid


def rig() -> StereoRig:
    k = frozen([[3300.0, 0.0, 2010.0], [0.0, 3310.0, 1490.0], [0.0, 0.0, 1.0]])
    camera = Intrinsics(K=k, distortion=frozen([-0.2, 0.05, 0.001, 0.0, 0.0]), width_px=4000, height_px=3000)
    covariance = frozen(np.diag(np.arange(1.0, 15.0)))
    return StereoRig(
        left=camera, right=camera, right_from_left=rigid(np.eye(3), [-0.25, 0.0, 0.0]), covariance=covariance
    )  # fmt: skip


def test_a_small_photo_is_measured_as_it_is() -> None:
    given = rig()
    assert working_rig(given, 4000) is given
    image = np.zeros((3000, 4000, 3), dtype=np.uint8)
    assert at_working_size(image, given.left) is image


def test_a_ray_meets_the_same_place_of_the_picture_at_either_size() -> None:
    large, small = rig(), working_rig(rig(), 2048)
    points = np.array([[0.5, -0.3, 4.0], [-1.2, 0.9, 5.0], [0.0, 0.0, 3.0]])
    share_large = (large.left.project(points) + 0.5) / [4000, 3000]
    share_small = (small.left.project(points) + 0.5) / [small.left.width_px, small.left.height_px]
    assert np.abs(share_large - share_small).max() < 1e-12
    assert (small.left.width_px, small.left.height_px) == (2048, 1536)


def test_what_is_counted_in_pixels_is_known_by_fewer_of_them_and_the_pose_as_well_as_before() -> None:
    small = working_rig(rig(), 2000)
    before, after = np.diag(rig().covariance), np.diag(small.covariance)
    for name, a, b in zip(PARAMETERS, before, after, strict=True):
        assert b == pytest.approx(a * (0.25 if name[0] in "fc" else 1.0)), name
    assert small.baseline_m == pytest.approx(0.25)


def test_a_shrunk_photo_shows_a_thing_where_the_shrunk_camera_sees_it() -> None:
    camera = replace(rig().left, distortion=frozen(np.zeros(5)))
    image = np.zeros((3000, 4000), dtype=np.uint8)
    image[1200:1800, 1000:1400] = 255  # its middle at 1199.5, 1499.5
    small = working_rig(replace(rig(), left=camera, right=camera), 1000)
    shrunk = at_working_size(image, small.left)
    rows, columns = np.nonzero(shrunk > 127)
    seen = np.array([columns.mean(), rows.mean()])
    there = small.left.project(camera.rays(np.array([1199.5, 1499.5])))
    assert np.abs(seen - there).max() < 0.05
