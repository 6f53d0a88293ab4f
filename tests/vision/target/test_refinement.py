"""The second look at a blurred disc: it lies between both ways, and what only one way takes for a circle is none."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision.target import refinement as target_refined
from asbuilt_bim.vision.target.circle import SpaceCircle
from asbuilt_bim.vision.target.disc import find_discs
from asbuilt_bim.vision.target.find import TargetOptions, find_target
from asbuilt_bim.vision.target.odds import log_odds
from asbuilt_bim.vision.target.pairing import Pairing, pairings
from asbuilt_bim.vision.target.refinement import looked_at_again, refined, stands
from tests.vision.flat_scene import CAMERA, disc, pair_of

TOLD = TargetOptions(diameter_m=0.30)
LIGHT, GREY_LEVELS = 2.2, 1.0


def photos(blur_px: float, gamma: float = LIGHT) -> RectifiedPair:
    """Return a dark disc before a bright wall; `gamma` tells what was blurred."""
    pair = pair_of([disc((0.3, 0.2, 5.0), yaw_deg=20.0, bgr=(15, 12, 90))], ground=200.0)
    light = [(image / 255.0) ** gamma for image in (pair.left, pair.right)]
    blurred = [(255.0 * cv2.GaussianBlur(one, None, blur_px) ** (1 / gamma)).astype(np.uint8) for one in light]
    return replace(pair, left=blurred[0], right=blurred[1])


def seen(blur_px: float, gamma: float = LIGHT) -> Pairing:
    pair = photos(blur_px, gamma)
    return max(
        pairings(find_discs(pair.left), find_discs(pair.right), CAMERA, TOLD.diameter_m),
        key=lambda p: log_odds(p, TOLD.diameter_m),
    )


def second(found: Pairing) -> SpaceCircle:
    circle = looked_at_again(found, CAMERA, None).second
    assert circle is not None
    return circle


def test_a_sharp_disc_needs_no_second_look() -> None:
    found = seen(0.5)
    assert looked_at_again(found, CAMERA, 0.30) is found and refined(found, CAMERA, 0.30) is found
    assert stands(found, TargetOptions(diameter_m=0.2))


def test_a_blurred_discs_circle_is_the_mean_of_both_ways_and_right() -> None:
    found = looked_at_again(seen(2.2), CAMERA, TOLD.diameter_m)
    assert found.second is not None and found.second.disparity_px != found.circle.disparity_px
    both = refined(found, CAMERA, None).circle
    mean_px = 0.7 * found.second.disparity_px + 0.3 * found.circle.disparity_px
    assert both.disparity_px == pytest.approx(mean_px)
    told = refined(found, CAMERA, TOLD.diameter_m).circle
    assert told.disparity_px == pytest.approx(mean_px, rel=0.002)
    assert CAMERA.f_px * CAMERA.baseline_m / told.disparity_px == pytest.approx(5.0, rel=0.005)
    assert 2.0 * found.second.radius_m == pytest.approx(0.30, rel=0.028) and stands(found, TOLD)


def test_what_was_looked_at_twice_is_not_looked_at_again() -> None:
    found = looked_at_again(seen(2.2), CAMERA, TOLD.diameter_m)
    assert looked_at_again(found, CAMERA, TOLD.diameter_m) is found


def test_a_disc_whose_grey_levels_were_blurred_has_the_told_size_when_it_is_told() -> None:
    found = looked_at_again(seen(2.2, GREY_LEVELS), CAMERA, TOLD.diameter_m)
    assert found.second is not None and 2.0 * found.second.radius_m > 1.02 * 0.30
    assert 2.0 * refined(found, CAMERA, None).circle.radius_m > 1.01 * 0.30
    assert 2.0 * refined(found, CAMERA, TOLD.diameter_m).circle.radius_m == pytest.approx(0.30, rel=0.007)
    assert stands(found, TOLD)


def test_a_disc_that_is_seen_only_where_grey_levels_were_blurred_is_taken_so() -> None:
    found = looked_at_again(seen(2.2, GREY_LEVELS), CAMERA, TOLD.diameter_m)
    only = replace(found, second=None)
    assert found.levels is not None and stands(only, TOLD)
    mean_px = 0.5 * (found.levels.disparity_px + found.circle.disparity_px)
    assert refined(only, CAMERA, TOLD.diameter_m).circle.disparity_px == pytest.approx(mean_px)


def test_a_circle_is_less_sure_where_both_kinds_of_blur_are_likely(monkeypatch: pytest.MonkeyPatch) -> None:
    found = looked_at_again(seen(2.2, GREY_LEVELS), CAMERA, TOLD.diameter_m)
    assert found.second is not None and found.levels is not None
    far = replace(found, levels=replace(found.levels, disparity_px=found.second.disparity_px + 1.0))
    sigmas = []
    for share in (0.0, 0.5, 1.0):
        monkeypatch.setattr(target_refined, "share_of_levels", lambda *_, share=share: share)
        sigmas.append(float(np.sqrt(refined(far, CAMERA, TOLD.diameter_m).circle.covariance[2, 2])))
    assert sigmas[1] > 0.45 and max(sigmas[0], sigmas[2]) < 0.3


def test_a_blurred_thing_that_a_second_look_sees_of_another_size_is_no_target(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = photos(2.2)
    monkeypatch.setattr("asbuilt_bim.vision.target.find.SURE_ODDS", 99.0)
    assert find_target(pair, TOLD)[0] is not None
    monkeypatch.setattr(target_refined, "SURE_ODDS", 99.0)
    assert find_target(pair, TOLD)[0] is not None
    monkeypatch.setattr("asbuilt_bim.vision.target.blur_kind.SIZE_SPREAD", 1e-5)
    assert find_target(pair, TOLD)[0] is None


def test_the_size_of_a_second_look_counts_by_how_sure_it_is_unless_the_thing_is_surely_a_disc() -> None:
    found = seen(2.2)
    off = replace(found, second=replace(second(found), radius_m=1.045 * 0.15))
    assert stands(off, TOLD)
    pale = {side: replace(getattr(off, side), redness=0.1) for side in ("left", "right")}
    poor = replace(off, circle=replace(off.circle, rms_px=2.0), **pale)
    assert not stands(poor, TOLD)
    assert off.second is not None
    size_open = replace(off.second, covariance=np.diag([0.1, 0.1, 0.1, 0.04**2]))
    assert stands(replace(poor, second=size_open), TOLD)
    assert not stands(replace(poor, second=replace(size_open, radius_m=1.09 * 0.15)), TOLD)
