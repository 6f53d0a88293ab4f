from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import LENS_MODELS, LensModel, reach, straighten
from asbuilt_bim.geometry.arrays import frozen
from tests.camera.virtual import rig

POINTS = np.random.default_rng(0).uniform([-1.8, -1.3, 2.5], [1.8, 1.3, 6.0], (200, 3))


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_projection_is_opencvs(lens: LensModel) -> None:
    one = rig(lens).left
    projector = cv2.fisheye.projectPoints if lens == "fisheye" else cv2.projectPoints
    theirs, _ = projector(POINTS[:, None], np.zeros(3), np.zeros(3), np.array(one.K), np.array(one.distortion))
    assert one.lens == lens
    assert np.abs(one.project(POINTS) - theirs[:, 0]).max() < 1e-9


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_rays_undo_projection(lens: LensModel) -> None:
    one = rig(lens).left
    assert np.abs(one.rays(one.project(POINTS)) - POINTS / POINTS[:, 2:]).max() < 1e-11


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_rays_of_the_whole_frame_project_back_to_it(lens: LensModel) -> None:
    one = rig(lens).left
    x, y = np.meshgrid(np.linspace(-0.5, 1279.5, 41), np.linspace(-0.5, 959.5, 31))
    pixels = np.stack([x, y], axis=-1)
    assert np.abs(one.project(one.rays(pixels)) - pixels).max() < 1e-8


def test_pixels_that_a_lens_cannot_show_have_no_direction() -> None:
    """Barrel distortion that folds back at tan 0.577 (k1 = -1: r - r^3) and bends nothing further out than 0.385."""
    distortion = frozen([-1.0, 0.0, 0.0, 0.0, 0.0])
    assert reach(distortion) == pytest.approx(np.sqrt(1 / 3), abs=0.02)
    bent = np.array([[0.38, 0.0], [0.39, 0.0], [0.0, -0.5]])
    straight = straighten(distortion, bent)
    assert straight[0, 0] - straight[0, 0] ** 3 == pytest.approx(0.38, abs=1e-9)
    assert np.isnan(straight[1:]).all()


def test_a_fisheye_shows_nothing_beyond_88_degrees() -> None:
    one = Intrinsics(K=rig().left.K, distortion=frozen(np.zeros(4)), width_px=1280, height_px=960)
    angles = np.deg2rad([10.0, 87.0, 89.0, 95.0])
    pixels = np.stack([one.K[0, 2] + one.K[0, 0] * angles, np.full(4, one.K[1, 2])], axis=-1)
    rays = one.rays(pixels)
    assert np.allclose(rays[:2, 0], np.tan(angles[:2])) and np.isnan(rays[2:]).all()


def test_a_lens_with_another_number_of_coefficients_is_refused() -> None:
    with pytest.raises(ValueError, match="not 12"):
        Intrinsics(K=rig().left.K, distortion=frozen(np.zeros(12)), width_px=1280, height_px=960)
