"""Tags in the original photos of a rig that isn't known yet."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.vision.markers.corners import refine_corners
from asbuilt_bim.vision.markers.in_photos import tags_in_pair
from tests.camera.tag_pictures import FAMILY, RIG, picture, placed, sightings

TAGS = placed(1, 5, 4)
TRUE = {one.tag_id: one for one in sightings(TAGS, 0, noise_px=0.0)}


@pytest.fixture(scope="module")
def pair() -> tuple[ByteImage, ByteImage]:
    return picture(TAGS[0], 0, 1), picture(TAGS[0], 1, 2)


def test_tags_are_found_to_a_tenth_of_a_pixel_in_photos_whose_lens_bends_their_sides(
    pair: tuple[ByteImage, ByteImage],
) -> None:
    found = tags_in_pair("A", *pair, FAMILY)
    assert [one.tag_id for one in found] == sorted(TRUE)
    off = np.concatenate(
        [np.r_[one.left_px - TRUE[one.tag_id].left_px, one.right_px - TRUE[one.tag_id].right_px] for one in found]
    )
    assert np.sqrt(np.mean(off * off)) < 0.12 and np.abs(off).max() < 0.6


def test_a_large_tag_s_bowed_sides_meet_where_it_has_its_corners_and_straight_lines_miss_them() -> None:
    near = placed(1, 1, 2, near_m=0.6, far_m=0.7, tilt_deg=5.0)
    image, true = picture(near[0], 0, 3), sightings(near, 0, noise_px=0.0)[0].left_px
    bowed, straight = (refine_corners(image[..., 0], true, 8, bowed=one)[0] for one in (True, False))
    assert np.abs(bowed - true).max() < 0.15 < np.abs(straight - true).max()


def test_an_id_that_stands_there_twice_is_left_out() -> None:
    twice = [(0, TAGS[0][0][1]), (0, TAGS[0][1][1]), *TAGS[0][2:]]
    images = [picture(twice, side, 5 + side) for side in (0, 1)]
    assert [one.tag_id for one in tags_in_pair("A", images[0], images[1], FAMILY)] == [2, 3, 4]


def test_photos_without_tags_and_families_that_are_not_known_are_told_apart(pair: tuple[ByteImage, ByteImage]) -> None:
    empty = np.full((RIG.left.height_px, RIG.left.width_px, 3), 90, dtype=np.uint8)
    assert tags_in_pair("A", empty, pair[1], FAMILY) == []
    with pytest.raises(SurveyError, match="use one of apriltag_36h11"):
        tags_in_pair("A", *pair, "apriltag_99h9")
