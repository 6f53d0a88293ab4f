from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.photo.overlap import PairMatches
from asbuilt_bim.camera.photo.swapped import swapped_rejection
from asbuilt_bim.camera.rectify import RectifiedCamera, turns
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid
from asbuilt_bim.report.wording.reasons import words_of
from tests.camera.virtual import rig


def seen(by: StereoRig, count: int = 200, *, nearer_below: bool = True) -> tuple[FloatArray, FloatArray]:
    """A site's points in pixels of the original left and right photo: the ground nearer than what stands on it."""
    draw = np.random.default_rng(3)
    points = draw.uniform([-2.0, -1.2, 5.0], [2.0, 1.2, 9.0], (count, 3))
    points[:, 2] -= points[:, 1] if nearer_below else -points[:, 1]
    noise = draw.normal(0.0, 0.3, (2, count, 2))
    return by.left.project(points) + noise[0], by.right.project(apply(by.right_from_left, points)) + noise[1]


def matched(rig_: StereoRig, left: FloatArray, right: FloatArray) -> tuple[PairMatches, RectifiedCamera]:
    """The matches as they lie in the pair that `rig_` rectifies."""
    left_turn, right_turn = turns(rig_)
    camera = RectifiedCamera(
        f_px=rig_.left.K[0, 0], cx_px=640.0, cy_px=480.0, baseline_m=rig_.baseline_m, width_px=1280, height_px=960,
        rectified_from_left=frozen(left_turn),
    )  # fmt: skip
    carried = []
    for pixels, lens, turn in ((left, rig_.left, left_turn), (right, rig_.right, right_turn)):
        rays = lens.rays(pixels) @ turn.T
        carried.append(rays[:, :2] / rays[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px])
    return PairMatches(left_px=carried[0], right_px=carried[1]), camera


@pytest.mark.parametrize("lens", ["five", "rational", "fisheye"])
def test_exchanged_photos_are_told_from_a_knock_with_every_lens(lens: LensModel) -> None:
    own = rig(lens)
    left, right = seen(own)
    matches, camera = matched(own, right, left)
    found = swapped_rejection("G1", matches, own, camera)
    assert found is not None and found.code is Reason.PHOTOS_SWAPPED
    assert "exchange" in words_of(found).remedy


@pytest.mark.parametrize("lens", ["five", "rational", "fisheye"])
def test_photos_upside_down_are_told_from_a_knock_with_every_lens(lens: LensModel) -> None:
    own = rig(lens)
    left, right = (np.array([own.left.width_px, own.left.height_px]) - 1.0 - pixels for pixels in seen(own))
    codes = Reason.PHOTOS_UPSIDE_DOWN, Reason.PHOTOS_UPSIDE_DOWN_SWAPPED
    for pair, code in zip(((left, right), (right, left)), codes, strict=True):
        matches, camera = matched(own, *pair)
        found = swapped_rejection("G1", matches, own, camera)
        assert found is not None and found.code is code
        remedy = words_of(found).remedy
        assert "as the cameras stored them" in remedy
        assert ("exchange" in remedy) == (code is Reason.PHOTOS_UPSIDE_DOWN_SWAPPED)


def test_a_good_pair_is_not_called_exchanged() -> None:
    own = rig()
    matches, camera = matched(own, *seen(own))
    assert swapped_rejection("G1", matches, own, camera) is None


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("turn_rad", [-0.03, -0.01, 0.01, 0.03])
def test_a_camera_turned_about_any_axis_is_not_called_exchanged(axis: int, turn_rad: float) -> None:
    own = rig()
    turn = rigid(turn_rad * np.eye(3)[axis], [0.0, 0.0, 0.0])
    matches, camera = matched(own, *seen(replace(own, right_from_left=turn @ own.right_from_left)))
    assert swapped_rejection("G1", matches, own, camera) is None


def test_both_mistakes_are_not_told_of_a_scene_that_stands_upright_as_given_which_a_knock_may_show() -> None:
    own = rig()
    left, right = (np.array([own.left.width_px, own.left.height_px]) - 1.0 - p for p in seen(own, nearer_below=False))
    matches, camera = matched(own, right, left)
    assert swapped_rejection("G1", matches, own, camera) is None


def test_a_handful_of_matches_says_nothing() -> None:
    own = rig()
    left, right = seen(own, count=12)
    matches, camera = matched(own, right, left)
    assert swapped_rejection("G1", matches, own, camera) is None


@pytest.mark.parametrize("turn_rad", [0.0, -0.03, 0.03])
def test_cameras_that_are_alike_fit_both_ways_round_so_rows_alone_prove_nothing(turn_rad: float) -> None:
    """A rig of two equal, parallel cameras keeps its rows when the photos are exchanged, or one camera is turned."""
    one = rig().left
    own = replace(rig(), right=one, right_from_left=rigid([0.0, 0.0, 0.0], [-0.25, 0.0, 0.0]))
    turned = rigid([0.0, turn_rad, 0.0], [0.0, 0.0, 0.0]) @ own.right_from_left
    matches, camera = matched(own, *seen(replace(own, right_from_left=turned)))
    assert swapped_rejection("G1", matches, own, camera) is None
