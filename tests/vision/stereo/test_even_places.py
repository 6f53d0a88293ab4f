"""In an even place of a photo no depth can jump: what stands off the rest was matched wrongly."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array
from asbuilt_bim.vision.stereo.even_places import jumps_without_edge

SHAPE = HEIGHT, WIDTH = 160, 240
STRAY = (slice(40, 100), slice(60, 90))
JUMP_PX = 1.0


def even_wall(edge_at: int | None = None) -> Float32Array:
    """Return a grey wall with a sensor's grain and a gradient of light, and an upright edge on it where asked."""
    light = np.tile(np.linspace(120.0, 160.0, WIDTH), (HEIGHT, 1))
    if edge_at is not None:
        light[:, edge_at:] -= 60.0
    return (light + np.random.default_rng(3).normal(0.0, 1.0, SHAPE)).astype(np.float32)


def slanted() -> Float32Array:
    """Return the disparity (H, W) of a wall that is looked along: 3 px across the photo."""
    return np.tile(np.linspace(17.0, 20.0, WIDTH), (HEIGHT, 1)).astype(np.float32)


def everywhere() -> BoolArray:
    """Return that every pixel was measured."""
    return np.ones(SHAPE, dtype=bool)


def test_a_patch_behind_a_plain_wall_without_an_edge_round_it_is_dropped_and_nothing_else() -> None:
    disparity = slanted()
    disparity[STRAY] = 2.4
    off = jumps_without_edge(even_wall(), disparity, everywhere(), JUMP_PX)
    assert off[STRAY].all()
    off[STRAY] = False
    assert not off.any()


def test_a_wall_behind_another_one_stays_where_the_photo_has_an_edge_between_them() -> None:
    disparity = slanted()
    disparity[:, 150:] = 9.0
    assert not jumps_without_edge(even_wall(edge_at=150), disparity, everywhere(), JUMP_PX).any()
    assert jumps_without_edge(even_wall(), disparity, everywhere(), JUMP_PX)[:, 160:].all()


def test_an_edge_in_a_dark_photo_is_weak_and_an_edge_all_the_same() -> None:
    disparity = slanted()
    disparity[:, 150:] = 9.0
    dark = (even_wall(edge_at=150) * np.float32(0.06)).astype(np.float32)  # 4 grey levels from side to side
    assert not jumps_without_edge(dark, disparity, everywhere(), JUMP_PX).any()


def test_pieces_of_one_wall_that_lie_on_its_plane_stay_though_nothing_was_measured_between_them() -> None:
    measured = everywhere()
    measured[:, 100:120] = False
    assert not jumps_without_edge(even_wall(), slanted(), measured, JUMP_PX).any()


def test_where_concrete_has_pores_depth_may_jump() -> None:
    disparity = slanted()
    disparity[STRAY] = 2.4
    rough = even_wall() + np.random.default_rng(5).normal(0.0, 6.0, SHAPE).astype(np.float32)
    assert not jumps_without_edge(rough, disparity, everywhere(), JUMP_PX).any()


def test_nothing_measured_gives_nothing() -> None:
    nothing = np.zeros(SHAPE, dtype=bool)
    unknown = np.full(SHAPE, np.nan, dtype=np.float32)
    assert not jumps_without_edge(even_wall(), unknown, nothing, JUMP_PX).any()
