"""The second look at a blurred disc: it lies between both ways, and what only one way takes for a circle is none."""

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision import target_refined
from asbuilt_bim.vision.disc import find_discs
from asbuilt_bim.vision.target import TargetOptions, find_target
from asbuilt_bim.vision.target_pairing import Pairing, pairings
from asbuilt_bim.vision.target_refined import refined, second_look, stands
from tests.vision.flat_scene import CAMERA, disc, pair_of

TOLD = TargetOptions(diameter_m=0.30)


def photos(blur_px: float) -> RectifiedPair:
    pair = pair_of([disc((0.3, 0.2, 5.0), yaw_deg=20.0)], ground=150.0)
    light = [(image / 255.0) ** 2.2 for image in (pair.left, pair.right)]
    blurred = [(255.0 * cv2.GaussianBlur(one, None, blur_px) ** (1 / 2.2)).astype(np.uint8) for one in light]
    return RectifiedPair(
        name=pair.name, left=blurred[0], right=blurred[1], camera=pair.camera,
        valid_left=pair.valid_left, valid_right=pair.valid_right,
    )  # fmt: skip


def seen(blur_px: float) -> Pairing:
    pair = photos(blur_px)
    (found,) = pairings(find_discs(pair.left), find_discs(pair.right), CAMERA, TOLD.diameter_m)
    return found


def test_a_sharp_disc_needs_no_second_look() -> None:
    found = seen(0.5)
    assert refined(found, CAMERA) is found and stands(found, CAMERA, TargetOptions(diameter_m=0.2))


def test_a_blurred_discs_circle_is_the_mean_of_both_ways_and_right() -> None:
    found = seen(2.2)
    other = second_look(found, CAMERA)
    assert other is not None and other.disparity_px != found.circle.disparity_px
    both = refined(found, CAMERA).circle
    assert both.disparity_px == pytest.approx(0.5 * (other.disparity_px + found.circle.disparity_px))
    assert CAMERA.f_px * CAMERA.baseline_m / both.disparity_px == pytest.approx(5.0, rel=0.005)
    assert 2.0 * other.radius_m == pytest.approx(0.30, rel=0.03) and stands(found, CAMERA, TOLD)


def test_a_blurred_thing_that_a_second_look_sees_of_another_size_is_no_target(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = photos(2.2)
    assert find_target(pair, TOLD)[0] is not None
    monkeypatch.setattr("asbuilt_bim.vision.target.SURE_ODDS", 99.0)
    assert find_target(pair, TOLD)[0] is not None
    monkeypatch.setattr(target_refined, "size_fits", lambda *_: False)
    assert find_target(pair, TOLD)[0] is None
