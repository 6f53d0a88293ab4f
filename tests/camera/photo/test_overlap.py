from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.camera.photo.overlap import check_pair, match_pair, overlap_share
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.report.wording.reasons import words_of

WIDTH, HEIGHT = 900, 600
CAMERA = RectifiedCamera(
    f_px=800.0, cx_px=450.0, cy_px=300.0, baseline_m=0.25, width_px=WIDTH, height_px=HEIGHT,
    rectified_from_left=np.eye(3),
)  # fmt: skip


def scene(seed: int = 0) -> ByteImage:
    """A wide wall full of blotches of all sizes."""
    random = np.random.default_rng(seed)
    wall = np.full((HEIGHT + 100, 3 * WIDTH), 120.0)
    for size in (4, 9, 20, 45):
        grain = random.normal(0, 40, (wall.shape[0] // size + 2, wall.shape[1] // size + 2))
        wall += cv2.resize(grain, None, fx=size, fy=size, interpolation=cv2.INTER_CUBIC)[
            : wall.shape[0], : wall.shape[1]
        ]
    return np.repeat(np.clip(wall, 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


def pair(disparity_px: int, rows_px: int = 0, seeds: tuple[int, int] = (0, 0)) -> RectifiedPair:
    """A wall seen with one disparity; the right photo is shifted down by `rows_px`."""
    x, y = WIDTH, 50
    valid = np.ones((HEIGHT, WIDTH), dtype=bool)
    return RectifiedPair(
        name="G1",
        left=scene(seeds[0])[y : y + HEIGHT, x : x + WIDTH],
        right=scene(seeds[1])[y - rows_px : y - rows_px + HEIGHT, x + disparity_px : x + disparity_px + WIDTH],
        valid_left=valid,
        valid_right=valid,
        camera=CAMERA,
    )


def test_a_good_pair_passes_and_its_overlap_is_measured() -> None:
    good = pair(60)
    assert check_pair(good) == ()
    matches = match_pair(good)
    assert np.median(matches.disparity_px) == pytest.approx(60.0, abs=0.5)
    assert overlap_share(good, matches) == pytest.approx(1.0 - 60 / WIDTH, abs=0.04)


def test_frames_that_share_a_fifth_are_rejected_with_the_share() -> None:
    (rejection,) = check_pair(pair(720))
    assert rejection.code is Reason.PHOTOS_OVERLAP and 0.14 <= float(str(rejection.values["share"])) <= 0.26


def test_frames_that_share_two_fifths_pass() -> None:
    assert check_pair(pair(540)) == ()


def test_swapped_photos_are_named() -> None:
    good = pair(60)
    (rejection,) = check_pair(replace(good, left=good.right, right=good.left))
    assert rejection.code is Reason.PHOTOS_LOOK_SWAPPED and "exchange" in words_of(rejection).remedy


def test_a_right_camera_turned_outwards_is_told_from_swapped_photos() -> None:
    """The ground comes nearer downwards; all disparities are shifted by -40 px, so that its far part is negative."""
    ground, rows = scene(), np.arange(HEIGHT)
    left = ground[50 : 50 + HEIGHT, WIDTH : 2 * WIDTH]
    x, y = np.meshgrid(np.arange(WIDTH, dtype=np.float32), rows.astype(np.float32))
    right = cv2.remap(ground, x + WIDTH + (y / HEIGHT * 70 - 40).astype(np.float32), y + 50, cv2.INTER_LINEAR)
    knocked = replace(pair(60), left=left, right=right)
    (rejection,) = check_pair(knocked)
    assert rejection.code is Reason.PHOTOS_BEHIND_RIG and "calibrate" in words_of(rejection).remedy
    (rejection,) = check_pair(replace(knocked, left=right, right=left))
    assert rejection.code is Reason.PHOTOS_LOOK_SWAPPED


def test_photos_of_two_scenes_are_rejected() -> None:
    (rejection,) = check_pair(pair(60, seeds=(0, 1)))
    assert rejection.code is Reason.PHOTOS_UNRELATED


def test_rows_that_do_not_correspond_are_rejected_with_the_residual() -> None:
    (rejection,) = check_pair(pair(60, rows_px=6))
    assert rejection.code is Reason.PHOTOS_ROWS_APART and 5.0 < float(str(rejection.values["rows_px"])) < 7.0


def test_a_pair_without_any_feature_is_rejected_and_does_not_fail() -> None:
    blank = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    assert "0 common features" in str(words_of(check_pair(replace(pair(60), left=blank, right=blank))[0]))
