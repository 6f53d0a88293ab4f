from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.camera.calibration.dlt import camera_from_points
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.transform import apply, rigid

K = np.array([[1050.0, 0.0, 640.0], [0.0, 1045.0, 470.0], [0.0, 0.0, 1.0]])
CAMERA_FROM_WORLD = rigid([0.1, -0.2, 0.05], [0.3, -0.1, 6.0])
POINTS = np.random.default_rng(2).uniform(-1.5, 1.5, (12, 3))


def pixels(points):  # type: ignore[no-untyped-def]
    seen = apply(CAMERA_FROM_WORLD, points) @ K.T
    return seen[:, :2] / seen[:, 2:]


@pytest.mark.parametrize("count", [6, 12])
def test_six_points_give_the_camera_and_its_pose(count: int) -> None:
    found = camera_from_points(POINTS[:count], pixels(POINTS[:count]))
    assert np.abs(found.K - K).max() < 1e-5
    assert np.abs(found.camera_from_world - CAMERA_FROM_WORLD).max() < 1e-7
    assert found.rms_px < 1e-7


def test_points_far_from_the_origin_lose_nothing() -> None:
    far = np.array([512_340.0, 5_403_210.0, 420.0])
    found = camera_from_points(POINTS + far, pixels(POINTS))
    assert np.abs(found.K - K).max() < 1e-2


def test_points_in_one_plane_are_refused() -> None:
    flat = POINTS * [1.0, 1.0, 0.0]
    with pytest.raises(CalibrationError, match="lie in one plane"):
        camera_from_points(flat, pixels(flat))


def test_five_points_are_refused() -> None:
    with pytest.raises(CalibrationError, match="5 points, at least 6"):
        camera_from_points(POINTS[:5], pixels(POINTS[:5]))


def test_pixels_paired_with_the_wrong_points_show_in_the_misfit_or_are_refused() -> None:
    try:
        assert camera_from_points(POINTS, pixels(POINTS)[::-1]).rms_px > 10.0
    except CalibrationError as error:
        assert "paired" in str(error)
