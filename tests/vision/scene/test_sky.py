"""Sky is further than anything, so what is taken for it by mistake is called not built."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.scene.sky import find_sky
from asbuilt_bim.vision.stereo.depth import DepthMap

SHAPE = HEIGHT, WIDTH = 240, 320
DARK_EDGE = slice(200, 212)


def pair_of(light: np.ndarray) -> RectifiedPair:
    """Return a pair whose photos show so much light (H, W), in grey, with the grain of a sensor."""
    grain = np.random.default_rng(7).normal(0.0, 0.8, SHAPE)
    photo = np.repeat(np.clip(light + grain, 0, 245).astype(np.uint8)[..., None], 3, axis=-1)
    every = np.ones(SHAPE, dtype=bool)
    camera = RectifiedCamera(
        f_px=300.0, cx_px=160.0, cy_px=120.0, baseline_m=0.2, width_px=WIDTH, height_px=HEIGHT,
        rectified_from_left=frozen(np.eye(3)),
    )  # fmt: skip
    return RectifiedPair(name="A", left=photo, right=photo, valid_left=every, valid_right=every, camera=camera)


def no_depth(pair: RectifiedPair) -> DepthMap:
    """Return the depth of a pair in which nothing could be matched: even surfaces look so."""
    nothing = np.zeros(SHAPE, dtype=bool)
    return DepthMap(
        disparity_px=np.full(SHAPE, np.nan, np.float32), sigma_px=np.full(SHAPE, np.inf, np.float32), valid=nothing,
        f_px=pair.camera.f_px, baseline_m=pair.camera.baseline_m, method="stereo",
    )  # fmt: skip


def above_a_wall(sky: float, wall: float, edge: float) -> np.ndarray:
    """Return the light of a sky over a wall whose head shows as a dark edge."""
    light = np.full(SHAPE, wall)
    light[:120] = sky
    light[120:126] = edge
    return light


def test_grey_sky_that_ends_at_the_head_of_a_wall_is_sky() -> None:
    pair = pair_of(above_a_wall(sky=220.0, wall=90.0, edge=40.0))
    sky = find_sky(pair, no_depth(pair))
    assert sky[5:100, 10:-10].mean() > 0.95
    assert not sky[140:].any()


@pytest.mark.parametrize("dark", [20.0, 60.0])
def test_a_plain_wall_that_a_lamp_lights_from_above_is_no_sky(dark: float) -> None:
    light = np.tile(np.linspace(230.0, dark, HEIGHT)[:, None], (1, WIDTH))
    light[:, DARK_EDGE] = 15.0  # a door frame on it
    pair = pair_of(light)
    assert not find_sky(pair, no_depth(pair)).any()


def test_a_wall_that_goes_over_into_warm_light_is_no_sky() -> None:
    pair = pair_of(np.full(SHAPE, 200.0))
    photo = pair.left.copy()
    photo[..., 0] = np.linspace(205, 120, HEIGHT).astype(np.uint8)[:, None]  # less and less blue
    assert not find_sky(replace(pair, left=photo), no_depth(pair)).any()
