"""Stereo past bars: a textured backdrop behind a cage, and solid things that must stay."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher
from asbuilt_bim.vision.stereo.occluder_free import occluder_free_disparity

WIDTH, HEIGHT, FAR_PX, NEAR_PX = 640, 320, 12, 40
CAMERA = RectifiedCamera(
    f_px=1000.0, cx_px=319.5, cy_px=159.5, baseline_m=0.25, width_px=WIDTH, height_px=HEIGHT,
    rectified_from_left=np.eye(3),
)  # fmt: skip
ALL = np.ones((HEIGHT, WIDTH), dtype=bool)
NO_SKY = np.zeros((HEIGHT, WIDTH), dtype=bool)
SOLID, CAGE = slice(180, 260), slice(340, 560)
BARS = np.cumsum([CAGE.start, 19, 31, 22, 27, 17, 29, 24, 20])


def texture(seed: int, middle: float) -> FloatArray:
    """Return a pattern (h, wide) of patches of twenty pixels and finer grain, as facades have."""
    rng = np.random.default_rng(seed)
    small = rng.normal(0.0, 1.0, (HEIGHT // 20, WIDTH // 10))
    coarse = cv2.resize(small, (2 * WIDTH, HEIGHT), interpolation=cv2.INTER_NEAREST)
    return np.asarray(middle + 22.0 * coarse + rng.normal(0.0, 4.0, (HEIGHT, 2 * WIDTH)))


def view(shift: bool) -> np.ndarray:
    """Draw one photo: a backdrop, a solid column before it, and a cage of dark bars 5 px wide, some 24 px apart."""
    far, near = (FAR_PX, NEAR_PX) if shift else (0, 0)
    picture = texture(1, 150.0)[:, 100 + far : 100 + far + WIDTH].copy()
    solid = texture(2, 120.0)[:, : SOLID.stop - SOLID.start]
    picture[:, SOLID.start - near : SOLID.stop - near] = solid
    for x in BARS:
        picture[:, x - near : x - near + 5] = 35.0
    for y in range(10, HEIGHT, 60):
        picture[y : y + 3, CAGE.start - near : CAGE.stop - near] = 35.0
    grey = np.clip(picture, 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


@pytest.fixture(scope="module")
def pair() -> RectifiedPair:
    return RectifiedPair(name="T1", left=view(False), right=view(True), valid_left=ALL, valid_right=ALL, camera=CAMERA)


def test_the_backdrop_is_measured_between_bars_where_plain_stereo_finds_bars_or_nothing(pair: RectifiedPair) -> None:
    inside = (slice(40, -40), slice(CAGE.start + 30, CAGE.stop - 30))
    plain, _ = SemiGlobalMatcher().match(pair)
    beyond = occluder_free_disparity(pair, NO_SKY)
    found = np.abs(beyond[inside] - FAR_PX) < 1.5
    assert found.mean() > 0.75
    assert (np.abs(plain[inside] - FAR_PX) < 1.5).mean() < 0.55


def test_what_stands_solid_is_found_where_it_stands(pair: RectifiedPair) -> None:
    beyond = occluder_free_disparity(pair, NO_SKY)
    column = beyond[40:-40, SOLID.start + 10 : SOLID.stop - 10]
    assert (np.abs(column - NEAR_PX) < 1.5).mean() > 0.97
    assert not (column < NEAR_PX - 5.0).any()


def test_sky_is_grown_over_the_bars_before_it_and_not_over_the_column(pair: RectifiedPair) -> None:
    bars = np.all(pair.left == 35, axis=2)
    sky = ~bars
    sky[:, SOLID] = False
    beyond = occluder_free_disparity(pair, sky)
    assert np.all(beyond[20:-20, CAGE] == 0.0)
    assert not np.any(beyond[20:-20, SOLID] == 0.0)


def test_sky_between_bars_is_sky_by_its_colour_where_stereo_smeared_them_and_a_wall_of_another_grey_is_not() -> None:
    rng = np.random.default_rng(4)
    grey = 200.0 + rng.normal(0.0, 1.5, (HEIGHT, WIDTH, 3))
    grey[100:] = 150.0 + rng.normal(0.0, 6.0, (HEIGHT - 100, WIDTH, 3))
    for x in BARS:
        grey[20:100, x : x + 5] = 35.0
    grey[103::5, ::5] = 200.0  # bright grains of its concrete
    photo = np.clip(grey, 0, 255).astype(np.uint8)
    sky = np.zeros((HEIGHT, WIDTH), dtype=bool)
    sky[:100] = True
    sky[15:100, CAGE] = False  # taken for something near, all of it
    pair = RectifiedPair(name="T1", left=photo, right=photo, valid_left=ALL, valid_right=ALL, camera=CAMERA)
    beyond = occluder_free_disparity(pair, sky)
    assert np.mean(beyond[30:80, CAGE] == 0.0) > 0.98
    assert not np.any(beyond[110:] == 0.0)


def test_what_has_the_skys_colour_but_does_not_hang_together_with_it_is_not_sky() -> None:
    photo = np.full((HEIGHT, WIDTH, 3), 90, dtype=np.uint8)
    photo[:60] = photo[150:200] = 200
    sky = np.zeros((HEIGHT, WIDTH), dtype=bool)
    sky[:60] = True
    pair = RectifiedPair(name="T1", left=photo, right=photo, valid_left=ALL, valid_right=ALL, camera=CAMERA)
    beyond = occluder_free_disparity(pair, sky)
    assert np.all(beyond[:55] == 0.0) and not np.any(beyond[150:200] == 0.0)


def test_what_has_no_partner_on_the_right_photo_is_not_measured(pair: RectifiedPair) -> None:
    right = ALL.copy()
    right[:, : WIDTH // 2] = False
    cut = RectifiedPair(name="T1", left=pair.left, right=pair.right, valid_left=ALL, valid_right=right, camera=CAMERA)
    assert np.isnan(occluder_free_disparity(cut, NO_SKY)[:, : WIDTH // 2]).all()
