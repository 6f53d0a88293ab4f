"""Two blunt opinions on a mask and the photo between them: the border gets finer, and only the border moves."""

from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.vision.masks.colour_guide import ColourGuide
from asbuilt_bim.vision.masks.refinement import refined_mask

H, W = 480, 640
OFF = 3.0 / 190.0
TRUE = np.zeros((H, W), bool)
TRUE[101:380, 203:420] = True


def photo(contrast: int = 60) -> np.ndarray:
    noise = np.random.default_rng(2).normal(0.0, 4.0, (H, W, 1))
    return np.clip(110 + contrast * TRUE[..., None] + noise, 0, 255).astype(np.uint8).repeat(3, axis=2)


def grown(mask: BoolArray, by_px: int) -> BoolArray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by_px + 1, 2 * by_px + 1), np.uint8)) > 0


def blunt(mask: BoolArray, cell_px: int = 8) -> BoolArray:
    """As a coarse map has it: shifted by half a cell, with round corners."""
    soft = cv2.blur(np.roll(mask, cell_px // 2, axis=(0, 1)).astype(np.float32), (3 * cell_px, 3 * cell_px))
    return np.asarray(soft > 0.5)


def wrong(mask: BoolArray) -> int:
    return int(np.count_nonzero(mask != TRUE))


def test_between_a_fattened_and_a_blunt_mask_the_border_lies_at_the_photos_edge() -> None:
    matched, coarse = grown(TRUE, 4), blunt(TRUE)
    found = refined_mask(matched, coarse, photo())
    assert wrong(found) < 0.35 * min(wrong(matched), wrong(coarse))


def test_without_an_edge_in_the_photo_it_lies_between_both() -> None:
    matched, coarse = grown(TRUE, 4), ~grown(~TRUE, 4)
    assert wrong(refined_mask(matched, coarse, photo(contrast=0))) < 0.5 * min(wrong(matched), wrong(coarse))


def test_what_is_deep_inside_or_outside_of_the_surface_is_not_the_coarse_ones_to_say() -> None:
    half = TRUE.copy()
    half[:, 300:] = False
    np.testing.assert_array_equal(refined_mask(TRUE, half, photo())[130:350, 230:390], True)
    more = TRUE.copy()
    more[:, 420:600] = True
    assert not refined_mask(TRUE, more, photo())[:, 445:].any()


def test_in_a_large_photo_geometry_is_finer_and_stays() -> None:
    large = np.zeros((1200, 4000), bool)
    large[200:900, 1000:2000] = True
    np.testing.assert_array_equal(
        refined_mask(large, np.roll(large, 20, axis=1), np.zeros((1200, 4000, 3), np.uint8)), large
    )


def test_an_empty_mask_stays_empty_and_one_at_the_photos_border_is_allowed() -> None:
    assert not refined_mask(np.zeros_like(TRUE), TRUE, photo()).any()
    cut = TRUE.copy()
    cut[:, :300] = True
    assert refined_mask(cut, cut, photo())[110:370, 0].all()


def test_a_networks_own_mask_is_drawn_to_the_edges_too_and_alike_in_a_photo_twice_as_large() -> None:
    coarse = blunt(TRUE)
    assert wrong(ColourGuide.of(photo(), OFF).drawn(coarse)) < 0.3 * wrong(coarse)
    large, twice = (cv2.resize(one, (2 * W, 2 * H), interpolation=cv2.INTER_LINEAR) for one in (photo(), coarse * 1.0))
    drawn = ColourGuide.of(np.asarray(large, np.uint8), OFF).drawn(twice > 0.5)
    assert wrong(cv2.resize(drawn.view(np.uint8), (W, H)) > 0) < 0.3 * wrong(coarse)
    assert not ColourGuide.of(photo(), OFF).drawn(np.zeros_like(TRUE)).any()


def test_an_edge_between_two_colours_of_one_grey_is_found() -> None:
    grey = np.array([0.114, 0.587, 0.299])  # of blue, green and red
    colours = photo(contrast=0).astype(np.float64)
    colours[TRUE] += 40.0 * np.array([1.0 / grey[0], -1.0 / grey[1], 0.0]) * grey.min() / 0.3
    even = np.clip(colours, 0, 255).astype(np.uint8)
    assert abs(float(cv2.cvtColor(even, cv2.COLOR_BGR2GRAY)[TRUE].mean()) - 110.0) < 2.0
    assert wrong(ColourGuide.of(even, OFF).drawn(blunt(TRUE))) < 0.3 * wrong(blunt(TRUE))


def test_a_photo_of_odd_size_and_a_mask_in_its_corner_are_allowed() -> None:
    odd = np.zeros((77, 93, 3), np.uint8)
    corner = np.zeros((77, 93), bool)
    corner[70:, 85:] = True
    assert ColourGuide.of(odd, OFF).drawn(corner)[76, 92]
