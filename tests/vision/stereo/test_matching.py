from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.level import pixel_rays
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.scene.geometric import segment_scene
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.scene.sky import find_sky, without_sky
from asbuilt_bim.vision.scene.vertical import find_vertical
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map, grey
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
    assert abs(np.median(miss)) < 0.02
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
