from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, vector_from_rotation
from asbuilt_bim.register.solve import COMMON_SHARE, Sighted, moved, pose_jacobian, project_both, solve_pose

FAR_OFF = np.array([3_512_345.0, 5_412_876.0, 431.0])


def camera() -> RectifiedCamera:
    return RectifiedCamera(
        f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
        rectified_from_left=frozen(rotation_from_vector([0.003, -0.008, 0.002])),
    )  # fmt: skip


def looking_north() -> np.ndarray:
    """Left camera 1.6 m up, x east, z north: y down is -world z."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return rigid(rotation_from_vector([0.02, -0.03, 0.3]) @ turn, FAR_OFF + np.array([0.0, 0.0, 1.6]))


def marker_corners(pose: np.ndarray, x: float, y: float, z: float, size: float = 0.28) -> np.ndarray:
    """Corners of an upright print that faces the camera, its middle at (x, y, z) in camera axes."""
    half = size / 2
    local = np.array(
        [[x - half, y - half, z], [x + half, y - half, z], [x + half, y + half, z], [x - half, y + half, z]]
    )
    return local @ pose[:3, :3].T + pose[:3, 3]


def sighted(name: str, pose: np.ndarray, corners: np.ndarray, rng: np.random.Generator, px: float, m: float) -> Sighted:
    pixels, _ = project_both(camera(), pose, corners)
    pixels = pixels + rng.normal(0.0, px, pixels.shape)
    survey = rng.normal(0.0, m * np.sqrt(1 - COMMON_SHARE), (4, 3)) + rng.normal(0.0, m * np.sqrt(COMMON_SHARE), 3)
    return Sighted(
        name=name, world_m=corners + survey, left_px=pixels[:, :2], right_px=pixels[:, 2:], sigma_px=px, sigma_m=m
    )


PLACES = ((-1.2, -0.3, 5.0), (0.9, 0.2, 4.2), (0.2, -0.6, 6.5))


def small_motion(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    return np.concatenate([vector_from_rotation(true[:3, :3] @ found[:3, :3].T), true[:3, 3] - found[:3, 3]])


def test_pose_jacobian_agrees_with_finite_differences() -> None:
    pose = looking_north()
    corners = marker_corners(pose, *PLACES[0])
    _, by_point = project_both(camera(), pose, corners)
    jacobian = pose_jacobian(pose, corners, by_point)
    for axis in range(6):
        step = np.zeros(6)
        step[axis] = 1e-5
        there, _ = project_both(camera(), moved(pose, step), corners)
        back, _ = project_both(camera(), moved(pose, -step), corners)
        np.testing.assert_allclose((there - back) / 2e-5, jacobian[:, :, axis], rtol=1e-4, atol=2e-2)


@pytest.mark.parametrize("both", [True, False])
def test_pose_far_from_the_origin_is_found_exactly_without_noise(both: bool) -> None:
    pose = looking_north()
    rng = np.random.default_rng(0)
    seen = [sighted(str(i), pose, marker_corners(pose, *place), rng, 1e-6, 1e-9) for i, place in enumerate(PLACES)]
    if not both:
        seen = [
            Sighted(name=s.name, world_m=s.world_m, left_px=s.left_px, right_px=None, sigma_px=0.1, sigma_m=1e-4)
            for s in seen
        ]
    solution = solve_pose(camera(), seen)
    assert solution is not None
    assert np.abs(small_motion(solution.world_from_left, pose)).max() < 1e-6


def test_claimed_covariance_holds_in_a_monte_carlo() -> None:
    pose = looking_north()
    rng = np.random.default_rng(5)
    corners = [marker_corners(pose, *place) for place in PLACES]
    squares = []
    for _ in range(300):
        seen = [sighted(str(i), pose, one, rng, 0.3, 0.002) for i, one in enumerate(corners)]
        solution = solve_pose(camera(), seen)
        assert solution is not None
        error = small_motion(solution.world_from_left, pose)
        covariance = solution.covariance / max(solution.variance_factor, 1.0)  # the claim before it is widened
        squares.append(error @ np.linalg.solve(covariance, error))
    # The squared length in sigmas of a 6-vector is chi-squared with mean 6 and deviation 3.46.
    assert abs(np.mean(squares) - 6.0) < 4 * 3.46 / np.sqrt(300)


def test_covariance_is_wider_where_the_survey_is_worse() -> None:
    pose = looking_north()
    rng = np.random.default_rng(1)
    corners = [marker_corners(pose, *place) for place in PLACES]
    traces = []
    for sigma_m in (0.001, 0.01):
        solution = solve_pose(camera(), [sighted(str(i), pose, c, rng, 0.3, sigma_m) for i, c in enumerate(corners)])
        assert solution is not None
        traces.append(np.trace(solution.covariance))
    assert traces[1] > 4 * traces[0]
