from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.geometry.arrays import frozen
from tests.camera.virtual import camera

POINTS = np.random.default_rng(0).uniform([-1.8, -1.3, 2.5], [1.8, 1.3, 6.0], (200, 3))


@pytest.mark.parametrize("extra", [(), (0.02, -0.01, 0.004)])
def test_projection_is_opencvs(extra: tuple[float, ...]) -> None:
    one = camera()
    lens = Intrinsics(K=one.K, distortion=frozen([*one.distortion, *extra]), width_px=1280, height_px=960)
    theirs, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), np.array(lens.K), np.array(lens.distortion))
    assert np.abs(lens.project(POINTS) - theirs[:, 0]).max() < 1e-9


def test_rays_undo_projection() -> None:
    rays = camera().rays(camera().project(POINTS))
    assert np.abs(rays - POINTS / POINTS[:, 2:]).max() < 1e-11


def test_rays_of_the_frames_corners_project_back_to_them() -> None:
    corners = np.array([[-0.5, -0.5], [1279.5, -0.5], [1279.5, 959.5], [-0.5, 959.5]])
    assert np.abs(camera().project(camera().rays(corners)) - corners).max() < 1e-6
