from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.masks.split_by_depth import split_by_depth
from asbuilt_bim.vision.scene.geometric import GeometricOptions, segment_scene
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from tests.measure.box_world import site


def test_a_mask_that_runs_over_the_wall_loses_what_lies_far_behind_and_nothing_of_the_wall() -> None:
    pair = site()[1]
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    wall = next(one for one in segment_scene(pair, scene) if one.label == "wall" and one.mask[300, 570])
    x0, y0, x1, y1 = wall.box_px
    drawn = np.zeros_like(wall.mask)
    drawn[y0 - 25 : y1, x0 - 30 : x1 + 30] = True
    height, width = drawn.shape
    given = Instance(label="wall", score=1.0, mask=drawn, box_px=(0, 0, width, height), source=InstanceSource.GIVEN)
    kept = split_by_depth(given, pair, scene, GeometricOptions())
    assert np.count_nonzero(kept.mask & wall.mask) == np.count_nonzero(wall.mask)
    upright = (scene.labels >= 0) & (scene.labels < len(scene.pieces)) & drawn & ~wall.mask
    behind = upright & (scene.level.disparity_px < 0.6 * np.nanmedian(scene.level.disparity_px[wall.mask]))
    assert np.count_nonzero(behind) > 500
    assert np.count_nonzero(kept.mask & behind) == 0


def test_a_mask_that_stops_short_of_the_walls_edge_gets_the_whole_wall() -> None:
    pair = site()[1]
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    wall = next(one for one in segment_scene(pair, scene) if one.label == "wall" and one.mask[300, 570])
    short = cv2.erode(wall.mask.astype(np.uint8), np.ones((13, 13), np.uint8)) > 0
    given = Instance(label="wall", score=1.0, mask=short, box_px=wall.box_px, source=InstanceSource.GIVEN)
    kept = split_by_depth(given, pair, scene, GeometricOptions())
    assert np.array_equal(kept.mask, wall.mask)


def test_a_mask_that_runs_over_the_ground_ends_at_the_foot() -> None:
    pair = site()[1]
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    wall = next(one for one in segment_scene(pair, scene) if one.label == "wall" and one.mask[300, 570])
    x0, y0, x1, y1 = wall.box_px
    drawn = wall.mask.copy()
    drawn[y1 - 60 : y1 + 40, x0:x1] = True
    given = Instance(label="wall", score=1.0, mask=drawn, box_px=(x0, y0, x1, y1 + 40), source=InstanceSource.GIVEN)
    kept = split_by_depth(given, pair, scene, GeometricOptions())
    ground = scene.labels >= len(scene.pieces)
    assert np.count_nonzero(drawn & ground) > 2000
    assert np.count_nonzero(kept.mask & ground) < 0.1 * np.count_nonzero(drawn & ground)
    assert np.count_nonzero(wall.mask & ~kept.mask) == 0


def test_a_mask_on_a_part_of_a_surface_was_cut_on_purpose_and_stays() -> None:
    pair = site()[1]
    scene = read_scene(pair, depth_map(pair, SemiGlobalMatcher()))
    mask = np.zeros(pair.valid_left.shape, dtype=bool)
    mask[250:350, 540:600] = True
    given = Instance(label="wall", score=1.0, mask=mask, box_px=(540, 250, 600, 350), source=InstanceSource.GIVEN)
    assert split_by_depth(given, pair, scene, GeometricOptions()) is given
