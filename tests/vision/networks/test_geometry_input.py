"""The geometry channels: planes in closed form, edges, holes, and what they cost."""

from __future__ import annotations

import time

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import Float32Array
from asbuilt_bim.vision.networks.geometry_input import geometry_channels

W, H, F = 384, 288, 310.0
CX, CY = (W - 1) / 2, (H - 1) / 2
UP = np.array([0.0, -1.0, 0.0])
RAYS = np.stack(
    np.broadcast_arrays((np.arange(W) - CX) / F, ((np.arange(H) - CY) / F)[:, None], np.ones((H, W))), axis=-1
)


def inverse_of(normal: NDArray[np.float64], offset_m: float) -> Float32Array:
    """Return 1/Z of the plane normal . X = offset, 0 where it lies behind the camera or beyond 100 m."""
    inverse = RAYS @ normal / offset_m
    return np.where(inverse > 0.01, inverse, 0.0).astype(np.float32)


def channels_of(inverse: Float32Array, up: NDArray[np.float64] = UP) -> Float32Array:
    return geometry_channels(inverse, fx_px=F, fy_px=F, cx_px=CX, cy_px=CY, up=up)


def facing(normal: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    level = RAYS - (RAYS @ up)[..., None] * up
    return np.asarray(np.abs(level @ normal) / np.linalg.norm(level, axis=-1))


@pytest.mark.parametrize("tilt_deg", [0.0, 7.0])
@pytest.mark.parametrize("turn_deg", [-50.0, 10.0])
def test_an_upright_plane_has_the_nearness_slope_facing_and_height_of_its_formula(
    tilt_deg: float, turn_deg: float
) -> None:
    tilt, turn = np.radians([tilt_deg, turn_deg])
    up = np.array([np.sin(tilt), -np.cos(tilt), 0.0])
    normal = np.array([np.cos(tilt) * np.sin(turn), np.sin(tilt) * np.sin(turn), -np.cos(turn)])
    inverse = inverse_of(normal, -4.0)
    known = inverse > 0
    nearness, slope, frontal, height, there = channels_of(inverse, up)
    assert np.array_equal(there > 0, known)
    assert np.allclose(nearness, np.minimum(2.0 * inverse, 2.0))
    inner = cv2.erode(known.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert slope[inner].max() < 5e-3  # 0.3 degrees
    assert np.abs(frontal - facing(normal, up))[inner].max() < 5e-3
    true = np.clip((RAYS @ up)[known] / inverse[known] / 4.0, -1.5, 1.5)
    assert np.allclose(height[known], true, atol=1e-5)


def test_a_level_floor_is_level_and_lies_below_the_camera() -> None:
    inverse = inverse_of(np.array([0.0, 1.0, 0.0]), 1.6)
    _, slope, frontal, height, there = channels_of(inverse)
    inner = cv2.erode((there > 0).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert slope[inner].min() > 0.999
    assert frontal[inner].max() < 5e-3
    assert np.allclose(height[inner], -0.4, atol=1e-5)


def test_up_to_an_edge_each_surface_keeps_its_own_normal() -> None:
    wall, floor = inverse_of(np.array([0.0, 0.0, -1.0]), -5.0), inverse_of(np.array([0.0, 1.0, 0.0]), 1.6)
    inverse = np.maximum(wall, floor)
    slope = channels_of(inverse)[1]
    edge = int(np.argmax(floor[:, 0] > wall[:, 0]))
    assert slope[20 : edge - 1].max() < 0.15  # 9 degrees; across the edge it would be 45
    assert slope[edge + 1 : H - 5].min() > 0.95


def test_with_noise_of_half_a_per_cent_a_wall_stays_upright_in_the_main() -> None:
    inverse = inverse_of(np.array([0.3, 0.0, -np.sqrt(0.91)]), -6.0)
    noisy = inverse * (1 + 0.005 * np.random.default_rng(1).standard_normal(inverse.shape).astype(np.float32))
    slope = channels_of(noisy.astype(np.float32))[1]
    assert np.quantile(slope[inverse > 0], 0.9) < 0.2  # 12 degrees


def test_holes_are_0_in_every_channel_and_leave_the_rest_as_it_was() -> None:
    inverse = inverse_of(np.array([0.4, 0.0, -np.sqrt(0.84)]), -4.0)
    holed = inverse.copy()
    holed[100:140, 60:200] = 0.0
    holed[141:143, 300:303] = np.nan
    whole, with_holes = channels_of(inverse), channels_of(holed)
    hole = (holed == 0.0) | np.isnan(holed)
    assert not with_holes[:, hole].any()
    assert np.abs(with_holes - whole)[:, ~hole].max() < 5e-3


def test_nothing_measured_gives_nothing_and_a_lone_pixel_no_normal() -> None:
    inverse = np.zeros((H, W), dtype=np.float32)
    assert not channels_of(inverse).any()
    inverse[50, 60] = 0.5
    assert channels_of(inverse)[:, 50, 60] == pytest.approx([1.0, 0.0, 0.0, (CY - 50) / F / 0.5 / 4.0, 1.0])


def test_the_channels_cost_little() -> None:
    inverse = inverse_of(np.array([0.4, 0.0, -np.sqrt(0.84)]), -4.0)
    inverse *= 1 + 0.005 * np.random.default_rng(1).standard_normal(inverse.shape).astype(np.float32)
    spent = []
    for _ in range(5):
        start = time.process_time()
        channels_of(inverse)
        spent.append(time.process_time() - start)
    assert min(spent) < 0.025  # 5 ms on a free processor
