"""Which kind of blur a disc's photos have: a lens's, of light, or a resampler's, of grey levels."""

from dataclasses import replace

import pytest

from asbuilt_bim.vision.target.blur_kind import GREY_LEVELS, answers, off, share_of_levels, spread
from tests.vision.flat_scene import CAMERA
from tests.vision.target.test_refinement import LIGHT, of_both_kinds, seen

TOLD_M = 0.30


@pytest.mark.parametrize(("gamma", "blur_px"), [(LIGHT, 1.6), (LIGHT, 2.2), (GREY_LEVELS, 1.6), (GREY_LEVELS, 2.2)])
def test_grey_levels_that_were_blurred_are_told_from_light_by_size_and_shape(gamma: float, blur_px: float) -> None:
    found = seen(blur_px, gamma)
    kinds = of_both_kinds(found)
    size, shape = answers(found, kinds, CAMERA, TOLD_M)
    share = share_of_levels(found, kinds, CAMERA, TOLD_M)
    if gamma == LIGHT:
        assert size < 0.0 and shape < 0.0 and share < 0.1
    else:
        assert size > 0.0 and shape > 0.0 and share > 0.9
    assert share < share_of_levels(replace(found, gamma=GREY_LEVELS), kinds, CAMERA, TOLD_M)


def test_sizes_of_which_both_are_far_off_say_nothing_of_the_kind() -> None:
    found = seen(2.2)
    assert answers(found, of_both_kinds(found), CAMERA, 0.40)[0] == 0.0


def test_a_size_that_is_left_open_is_expected_further_off() -> None:
    circle = seen(2.2).circle
    open_size = replace(circle, covariance=circle.covariance * 1e5)
    assert off(circle, 0.30) == off(open_size, 0.30) and spread(open_size, 0.30) > 2.0 * spread(circle, 0.30)
