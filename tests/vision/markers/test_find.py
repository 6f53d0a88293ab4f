from __future__ import annotations

from dataclasses import replace
from typing import get_args

import cv2
import numpy as np
import pytest

from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.markers.find import FAMILIES, Family, find_markers, markers_and_twice, other_family
from tests.vision.flat_scene import CAMERA, Flat, pair_of, printed

SIDE_M = 0.28


def tag(
    marker_id: int,
    centre: tuple[float, float, float],
    yaw: float = 0.0,
    pitch: float = 0.0,
    family: str = "apriltag_36h11",
) -> Flat:
    dictionary = cv2.aruco.getPredefinedDictionary(FAMILIES[family])
    modules = dictionary.markerSize + 2  # a black border round the code, a white one round that
    sheet = np.full((modules + 2, modules + 2), 255.0)
    sheet[1:-1, 1:-1] = cv2.aruco.generateImageMarker(dictionary, marker_id, modules)
    return printed(centre, sheet, SIDE_M * (modules + 2) / modules, yaw, pitch)


def corners(of: Flat) -> FloatArray:
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * SIDE_M / 2
    return of.centre_m + square[:, :1] * of.u + square[:, 1:] * of.v


TAGS = {7: tag(7, (-0.9, 0.2, 3.5), 20.0), 21: tag(21, (0.4, -0.5, 5.0), -35.0, 10.0), 3: tag(3, (1.5, 0.6, 7.0), 8.0)}


def test_corners_are_found_in_both_photos_in_print_order_to_a_fifth_of_a_pixel() -> None:
    found = find_markers(pair_of(list(TAGS.values())))
    assert [sighting.marker_id for sighting in found] == [3, 7, 21]
    for sighting in found:
        true = corners(TAGS[sighting.marker_id])
        assert sighting.right_px is not None and 0.02 < sighting.sigma_px < 0.2
        assert np.abs(sighting.left_px - CAMERA.project(true)).max() < 0.2
        assert np.abs(sighting.right_px - CAMERA.project(true - [CAMERA.baseline_m, 0, 0])).max() < 0.2


def test_a_marker_in_the_left_photo_only_has_no_right_corners_and_in_the_right_only_is_left_out() -> None:
    (sighting,) = find_markers(pair_of([TAGS[7]], only="left"))
    assert sighting.right_px is None
    assert find_markers(pair_of([TAGS[7]], only="right")) == ()


def test_an_id_that_stands_twice_in_view_is_left_out_and_named() -> None:
    found, twice = markers_and_twice(pair_of([TAGS[7], TAGS[21], tag(7, (0.9, 0.7, 5.0))]), "apriltag_36h11")
    assert [sighting.marker_id for sighting in found] == [21] and twice == (7,)


def test_a_marker_whose_rows_differ_between_the_photos_is_left_out() -> None:
    pair = pair_of([TAGS[7]])
    assert find_markers(replace(pair, right=np.roll(pair.right, 8, axis=0))) == ()


def test_a_marker_that_reaches_out_of_the_photo_is_left_out() -> None:
    pair = pair_of([TAGS[7]])
    valid = pair.valid_left.copy()
    column = int(corners(TAGS[7])[1, 0] / 3.5 * CAMERA.f_px + CAMERA.cx_px)
    valid[:, column - 20 :] = False
    assert find_markers(replace(pair, valid_left=valid)) == ()


def test_where_the_left_photo_shows_no_marker_the_right_one_is_not_searched() -> None:
    pair = replace(pair_of([]), right=np.zeros((0, 0, 3), dtype=np.uint8))
    assert find_markers(pair) == ()


def test_a_turned_marker_keeps_the_order_of_its_print() -> None:
    pair = pair_of([TAGS[21]])
    upside_down = replace(pair, left=pair.left[::-1, ::-1].copy(), right=pair.right[::-1, ::-1].copy())
    (sighting,) = find_markers(replace(upside_down, left=upside_down.right, right=upside_down.left))
    seen = np.array([CAMERA.width_px, CAMERA.height_px]) - 1 - sighting.left_px
    assert np.abs(seen - CAMERA.project(corners(TAGS[21]) - [CAMERA.baseline_m, 0, 0])).max() < 0.2


@pytest.mark.parametrize("family", get_args(Family))
def test_a_marker_of_each_family_that_a_project_may_name_is_read(family: str) -> None:
    (sighting,) = find_markers(pair_of([tag(5, (0.0, 0.0, 3.0), family=family)]), family)
    assert sighting.marker_id == 5


@pytest.mark.parametrize("family", sorted(set(get_args(Family)) - {"apriltag_36h11"}))
def test_markers_of_another_family_than_the_projects_are_recognised(family: str) -> None:
    two = pair_of([tag(5, (-0.4, 0.0, 3.0), family=family), tag(7, (0.4, 0.0, 3.0), family=family)])
    assert find_markers(two, "apriltag_36h11") == ()
    assert other_family(two, "apriltag_36h11") == (family, 2)


def test_one_marker_of_another_family_may_be_clutter_and_says_nothing() -> None:
    assert other_family(pair_of([tag(5, (0.0, 0.0, 3.0), family="apriltag_16h5")]), "apriltag_36h11") is None


def test_an_unknown_family_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SurveyError, match="apriltag_36h11"):
        find_markers(pair_of([]), "apriltag_99")
