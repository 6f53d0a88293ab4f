from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.level import pixel_rays
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.scene.geometric import segment_scene
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.scene.sky import find_sky, without_sky
from asbuilt_bim.vision.scene.vertical import find_vertical
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import (
    SemiGlobalMatcher,
    _roughness,
    carried_px,
    depth_map,
    disparity_sigma,
    grey,
    left_against_right,
)
from asbuilt_bim.vision.stereo.rows_apart import rows_apart_px
from asbuilt_bim.vision.stereo.warp import right_at, warp_right
from tests.measure.box_world import site, true_q


@pytest.fixture(scope="module")
def pair() -> RectifiedPair:
    return site()[1]


@pytest.fixture(scope="module")
def depth(pair: RectifiedPair) -> DepthMap:
    return depth_map(pair, SemiGlobalMatcher())


def test_disparities_on_a_wall_are_right_to_hundredths_and_their_sigma_says_so(
    pair: RectifiedPair, depth: DepthMap
) -> None:
    world, _, level = site()
    camera = pair.camera
    rays = pixel_rays(camera.width_px, camera.height_px, camera.f_px, camera.cx_px, camera.cy_px)
    patch = (slice(220, 420), slice(510, 640))
    miss = (depth.disparity_px - rays @ true_q(world, "wall/0", camera, level))[patch]
    assert depth.valid[patch].mean() > 0.99
    assert abs(np.median(miss)) < 0.03  # the prior's whole pixels pull; planes are refined on the photos
    assert np.std(miss) < 0.12
    assert 0.4 < np.median(np.abs(miss)) / (0.67 * np.median(depth.sigma_px[patch])) < 2.0


def test_the_right_photo_is_read_alike_with_and_without_its_slope(pair: RectifiedPair, depth: DepthMap) -> None:
    right = grey(pair.right)
    disparity = np.nan_to_num(depth.disparity_px)
    assert np.array_equal(right_at(right, disparity), warp_right(right, disparity)[0])


def test_what_lies_at_the_left_border_of_the_frame_is_measured_too(pair: RectifiedPair, depth: DepthMap) -> None:
    # the ground at the lower left corner has a disparity near 80 px: only beyond that can it be seen twice
    assert depth.valid[560, 110:200].mean() > 0.9


def test_padding_of_the_right_photo_is_never_matched(pair: RectifiedPair) -> None:
    valid = np.array(pair.valid_right)
    valid[:, :200] = False
    right = np.array(pair.right)
    right[:, :200] = 0
    disparity, _ = SemiGlobalMatcher().match(replace(pair, right=right, valid_right=valid))
    rows, columns = np.nonzero(np.isfinite(disparity))
    assert np.all(np.round(columns - disparity[rows, columns]) >= 200)


def test_the_sky_is_sky_and_walls_are_not(pair: RectifiedPair, depth: DepthMap) -> None:
    sky = find_sky(pair, depth)
    assert sky[5:80, 40:180].mean() > 0.97
    assert sky[5:80, 450:780].mean() > 0.97
    assert sky[230:].sum() < 0.005 * sky.sum()
    assert not sky[180:400, 500:640].any()


def test_sky_under_a_guard_rail_is_sky_and_a_pale_board_there_is_not(pair: RectifiedPair, depth: DepthMap) -> None:
    left = pair.left.copy()
    left[30:40] = (60, 90, 120)
    railed = find_sky(replace(pair, left=left), depth)
    assert railed[50:75, 460:770].mean() > 0.9
    assert not railed[31:39].any()
    pale = left[60, 600].astype(int) + 12  # of the sky's own light, but of another tone
    left[45:80, 440:790] = (pale[1], pale[1], pale[1])
    assert not find_sky(replace(pair, left=left), depth)[45:80, 450:780].any()


def test_sky_between_bars_is_sky_whatever_stereo_makes_of_it_and_a_pale_board_between_them_is_not(
    pair: RectifiedPair, depth: DepthMap
) -> None:
    left = pair.left.copy()
    for x in range(460, 780, 24):
        left[20:78, x : x + 3] = (40, 50, 70)
    left[20:24, 440:790] = (40, 50, 70)  # a rail: what is below it hangs together with the top no more
    disparity = np.where(np.isfinite(depth.disparity_px), depth.disparity_px, 0.0).astype(np.float32)
    disparity[20:78, 450:785] = 30.0  # the bars', carried over the gaps
    valid = depth.valid.copy()
    valid[20:78, 450:785] = True
    smeared = replace(depth, disparity_px=disparity, valid=valid)
    gaps = np.ones((40, 240), dtype=bool)
    for x in range(0, 240, 24):
        gaps[:, max(0, x - 2) : x + 5] = False
    assert find_sky(replace(pair, left=left), smeared)[30:70, 508:748][gaps].mean() > 0.8
    pale = left[60, 472].astype(int) + 12
    board = np.where((left[28:74, 440:790] == (40, 50, 70)).all(axis=-1, keepdims=True), left[28:74, 440:790], pale[1])
    left[28:74, 440:790] = board
    assert not find_sky(replace(pair, left=left), smeared)[32:70, 508:748].any()


def test_a_smooth_grey_wall_up_to_the_frame_is_no_sky(pair: RectifiedPair, depth: DepthMap) -> None:
    left = np.array(pair.left)
    left[:200] = (150, 165, 185)  # plaster, warmer than neutral
    assert not find_sky(replace(pair, left=left), depth)[:150].any()


def test_the_vertical_comes_from_upright_edges(pair: RectifiedPair) -> None:
    level = site()[2]
    vertical = find_vertical(pair)
    assert vertical is not None
    true_up = level.T @ np.array([0.0, -1.0, 0.0])
    miss = float(np.arccos(min(1.0, float(vertical.up @ true_up))))
    assert miss < np.radians(1.0)
    assert miss < 4.0 * vertical.sigma_rad


def test_no_edges_no_vertical(pair: RectifiedPair) -> None:
    assert find_vertical(replace(pair, left=np.full_like(pair.left, 128))) is None


def test_walls_and_columns_are_found_and_named(pair: RectifiedPair, depth: DepthMap) -> None:
    found = segment_scene(pair, read_scene(pair, depth))
    at = {"column": (300, 265), "round": (300, 405), "wall": (300, 570)}
    for what, (row, column) in at.items():
        mine = [instance for instance in found if instance.mask[row, column]]
        assert len(mine) == 1, what
        assert mine[0].label == ("wall" if what == "wall" else "column"), what
        assert mine[0].score > 0.5
    whole_column = next(instance for instance in found if instance.mask[300, 265])
    assert whole_column.mask[300, 218]  # its narrow side belongs to it


def test_the_ground_is_a_floor_and_no_instance(pair: RectifiedPair, depth: DepthMap) -> None:
    scene = read_scene(pair, depth)
    assert scene.labels[560, 400] == len(scene.pieces)
    assert not any(instance.mask[560, 400] for instance in segment_scene(pair, read_scene(pair, depth)))


def test_sky_goes_from_a_rough_mask_and_a_mask_of_sky_alone_stays_to_be_named(
    pair: RectifiedPair, depth: DepthMap
) -> None:
    sky = find_sky(pair, depth)
    rough = np.zeros(sky.shape, bool)
    rough[40:200, 500:640] = True
    whole = Instance(label="wall", score=1.0, mask=rough, box_px=(500, 40, 640, 200), source=InstanceSource.GIVEN)
    assert not (without_sky(whole, sky).mask & sky).any()
    assert np.array_equal(without_sky(whole, sky).mask, rough & ~sky)
    alone = replace(whole, mask=sky)
    assert without_sky(alone, sky) is alone


def smooth_pair(noise_grey: float) -> RectifiedPair:
    """Return a wall at a disparity of 20 px, textured but for an even patch in its middle that only noise lies on."""
    draw = np.random.default_rng(4)
    wall = draw.normal(120.0, 25.0, (200, 420))
    wall[80:120, 210:270] = 120.0
    left, right = (wall[:, at : at + 360] + draw.normal(0.0, noise_grey, (200, 360)) for at in (0, 20))
    photos = [np.repeat(np.clip(one, 0, 255).astype(np.uint8)[..., None], 3, axis=2) for one in (left, right)]
    everywhere = np.ones((200, 360), dtype=bool)
    camera = RectifiedCamera(
        f_px=400.0, cx_px=180.0, cy_px=100.0, baseline_m=0.2, width_px=360, height_px=200,
        rectified_from_left=np.eye(3),
    )  # fmt: skip
    return RectifiedPair(
        name="even", left=photos[0], right=photos[1], valid_left=everywhere, valid_right=everywhere, camera=camera
    )


def test_an_even_patch_of_a_wall_keeps_the_depth_that_matching_carried_there() -> None:
    disparity, sigma = SemiGlobalMatcher().match(smooth_pair(2.0))
    patch, textured = (slice(85, 115), slice(215, 265)), (slice(150, 190), slice(60, 340))
    assert np.isfinite(disparity[patch]).mean() > 0.6
    assert abs(float(np.nanmedian(disparity[patch])) - 20.0) < 0.5
    assert np.median(sigma[patch]) > np.median(sigma[textured])


def test_a_pixel_beside_a_jump_in_depth_is_less_sure_than_one_on_a_wall() -> None:
    disparity = np.full((60, 80), 20.0, dtype=np.float32)
    disparity[:, 40:] = 30.0
    disparity += np.arange(60, dtype=np.float32)[:, None] * 0.1  # a slope is no roughness
    rough = _roughness(disparity, np.ones(disparity.shape, dtype=bool))
    assert rough[10:50, 10:34].max() < 0.01
    assert rough[10:50, 39:41].min() > 2.0


def test_what_is_carried_far_over_an_even_place_is_less_sure() -> None:
    posterior = np.full((100, 300), 0.25, dtype=np.float32)
    posterior[:, :20] = 0.05
    assert carried_px(posterior, 0.25)[50, 10] == 0.0
    assert carried_px(posterior, 0.25)[50, 219] == pytest.approx(200.0, rel=0.02)


@pytest.mark.parametrize("apart_px", [0.0, 0.4, -0.7])
def test_rows_that_lie_apart_are_measured_on_the_photos(apart_px: float) -> None:
    draw = np.random.default_rng(5)
    scene = cv2.GaussianBlur(draw.normal(120.0, 60.0, (240, 400)), (0, 0), 2.0).astype(np.float32)
    shift = np.array([[1.0, 0.0, -20.0], [0.0, 1.0, apart_px]])
    right = np.asarray(cv2.warpAffine(scene, shift, (400, 240), flags=cv2.INTER_CUBIC), dtype=np.float32)
    known = np.zeros(scene.shape, dtype=bool)
    known[4:-4, 24:] = True
    found = rows_apart_px(scene, right, np.full(scene.shape, 20.0, dtype=np.float32), known)
    assert found == pytest.approx(abs(apart_px), abs=0.06)


def test_rows_are_no_further_apart_for_one_part_that_was_matched_falsely() -> None:
    draw = np.random.default_rng(6)
    scene = cv2.GaussianBlur(draw.normal(120.0, 60.0, (240, 400)), (0, 0), 2.0).astype(np.float32)
    right = np.roll(scene, -20, axis=1)
    right[:60, 80:130] = np.roll(right[:60, 80:130], 4, axis=0)
    known = np.zeros(scene.shape, dtype=bool)
    known[4:-4, 24:] = True
    assert rows_apart_px(scene, right, np.full(scene.shape, 20.0, dtype=np.float32), known) < 0.06


def test_a_networks_sigma_grows_with_what_left_and_right_say_differently(pair: RectifiedPair, depth: DepthMap) -> None:
    """The matcher's own answer as a network's, with noise of a known size put on both sides' answers."""
    patch = (slice(220, 420), slice(510, 640))
    truth = np.where(depth.valid, depth.disparity_px, np.float32(np.nan))
    columns = np.arange(truth.shape[1])
    of_right = np.full_like(truth, np.nan)
    for row in range(truth.shape[0]):
        known = np.isfinite(truth[row])
        at = columns[known] - truth[row, known]
        order = np.argsort(at)
        of_right[row] = np.interp(columns, at[order], truth[row, known][order]) if known.any() else np.nan
    assert np.nanmedian(np.abs(left_against_right(truth, of_right))) < 0.02
    rng, sigmas = np.random.default_rng(2), []
    for noise_px in (0.0, 0.3):
        said = [one + rng.normal(0.0, noise_px, one.shape).astype(np.float32) for one in (truth, of_right)]
        disparity, sigma = disparity_sigma(pair, *said)
        known = np.isfinite(disparity[patch])
        miss = np.abs(disparity - truth)[patch][known]
        sigmas.append(float(np.median(sigma[patch][known])))
        assert known.mean() > 0.8 and np.mean(miss < 2.0 * sigma[patch][known]) > 0.9
    assert sigmas[1] > 2.0 * sigmas[0]
    lost, none = disparity_sigma(pair, truth, of_right + 5.0)
    assert not np.isfinite(lost[patch]).any() and np.isinf(none[patch]).all()
