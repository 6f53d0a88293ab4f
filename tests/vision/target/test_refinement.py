"""The second look at a blurred disc: it lies between both ways, and takes the blur for either kind."""

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
from asbuilt_bim.vision.target.refinement import refined, second_circle
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


def of_both_kinds(found: Pairing) -> tuple[SpaceCircle, SpaceCircle]:
    light = second_circle(found, found.circle, CAMERA, LIGHT)
    assert light is not None
    levels = second_circle(found, light, CAMERA, GREY_LEVELS)
    assert levels is not None
    return light, levels


def test_a_sharp_disc_needs_no_second_look() -> None:
    found = seen(0.5)
    assert refined(found, CAMERA, 0.30) is found


def test_a_blurred_discs_circle_is_the_mean_of_both_ways_and_right() -> None:
    found = seen(2.2)
    second = second_circle(found, found.circle, CAMERA, LIGHT)
    assert second is not None and second.disparity_px != found.circle.disparity_px
    both, told = refined(found, CAMERA, None), refined(found, CAMERA, TOLD.diameter_m)
    assert both is not None and told is not None
    mean_px = 0.7 * second.disparity_px + 0.3 * found.circle.disparity_px
    assert both.circle.disparity_px == pytest.approx(mean_px)
    assert told.circle.disparity_px == pytest.approx(mean_px, rel=0.002)
    assert CAMERA.f_px * CAMERA.baseline_m / told.circle.disparity_px == pytest.approx(5.0, rel=0.005)
    assert 2.0 * second.radius_m == pytest.approx(0.30, rel=0.028)


def test_a_disc_whose_grey_levels_were_blurred_has_the_told_size_when_it_is_told() -> None:
    found = seen(2.2, GREY_LEVELS)
    assert 2.0 * of_both_kinds(found)[0].radius_m > 1.02 * 0.30
    untold, told = refined(found, CAMERA, None), refined(found, CAMERA, TOLD.diameter_m)
    assert untold is not None and told is not None
    assert 2.0 * untold.circle.radius_m > 1.01 * 0.30
    assert 2.0 * told.circle.radius_m == pytest.approx(0.30, rel=0.007)


def test_a_disc_that_a_second_look_sees_as_one_kind_only_is_taken_so(monkeypatch: pytest.MonkeyPatch) -> None:
    found = seen(2.2, GREY_LEVELS)
    levels = of_both_kinds(found)[1]
    one = {LIGHT: None, GREY_LEVELS: levels}
    monkeypatch.setattr(target_refined, "second_circle", lambda _found, _circle, _camera, gamma: one[gamma])
    only = refined(found, CAMERA, TOLD.diameter_m)
    assert only is not None
    mean_px = 0.7 * levels.disparity_px + 0.3 * found.circle.disparity_px
    assert only.circle.disparity_px == pytest.approx(mean_px)
    one[GREY_LEVELS] = None  # type: ignore
    assert refined(found, CAMERA, TOLD.diameter_m) is None


def test_a_circle_is_less_sure_where_both_kinds_of_blur_are_likely(monkeypatch: pytest.MonkeyPatch) -> None:
    found = seen(2.2, GREY_LEVELS)
    light, levels = of_both_kinds(found)
    far = {LIGHT: light, GREY_LEVELS: replace(levels, disparity_px=light.disparity_px + 1.0)}
    monkeypatch.setattr(target_refined, "second_circle", lambda _found, _circle, _camera, gamma: far[gamma])
    sigmas = []
    for share in (0.0, 0.5, 1.0):
        monkeypatch.setattr(target_refined, "share_of_levels", lambda *_, share=share: share)
        again = refined(found, CAMERA, TOLD.diameter_m)
        assert again is not None
        sigmas.append(float(np.sqrt(again.circle.covariance[2, 2])))
    assert sigmas[1] > 0.45 and max(sigmas[0], sigmas[2]) < 0.3


@pytest.fixture
def nothing_else_sought(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing is sure, what both photos show already has to do: to seek more takes four seconds."""
    monkeypatch.setattr("asbuilt_bim.vision.target.find.sought", lambda *_: [])


@pytest.mark.usefixtures("nothing_else_sought")
def test_a_blurred_thing_that_no_second_look_sees_is_the_target_only_where_it_is_surely_a_disc(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pair = photos(2.2)
    monkeypatch.setattr("asbuilt_bim.vision.target.find.refined", lambda *_: None)
    assert find_target(pair, TOLD)[0] is not None
    monkeypatch.setattr("asbuilt_bim.vision.target.find.SURE_ODDS", 99.0)
    assert find_target(pair, TOLD)[0] is None


@pytest.mark.usefixtures("nothing_else_sought")
def test_a_blurred_thing_that_isnt_surely_a_disc_has_to_keep_its_size_at_a_second_look(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pair = photos(2.2)
    monkeypatch.setattr("asbuilt_bim.vision.target.find.SURE_ODDS", 99.0)
    for radius_m, is_taken in ((0.15, True), (1.09 * 0.15, False)):
        monkeypatch.setattr(
            "asbuilt_bim.vision.target.find.refined",
            lambda found, *_, radius_m=radius_m: replace(found, circle=replace(found.circle, radius_m=radius_m)),
        )
        assert (find_target(pair, TOLD)[0] is not None) == is_taken
