"""A disc's inside: what covers it reaches its rim, a print on it doesn't, however blurred."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from asbuilt_bim.vision.target.disc_patch import Patch, filled_share, inside_of
from asbuilt_bim.vision.target.ellipse import Ellipse

SIZE = 64
DISC = Ellipse(x_px=31.5, y_px=31.5, major_px=17.0, minor_px=17.0, angle_rad=0.0)


def patch_of(print_px: tuple[int, int, int, int], blur_px: float) -> Patch:
    """Return a red disc's patch with something white (x0, y0, x1, y1) on it."""
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    red = np.where(np.hypot(x - 31.5, y - 31.5) < 17.0, 0.8, 0.0).astype(np.float32)
    x0, y0, x1, y1 = print_px
    red[y0:y1, x0:x1] = 0.0
    red = np.asarray(cv2.GaussianBlur(red, None, blur_px), dtype=np.float32)
    return Patch(corner=np.zeros(2), light=red[..., None], red=red, planes=np.repeat(red[..., None], 3, axis=2))


@pytest.mark.parametrize(("height_px", "blur_px"), [(6, 0.6), (6, 2.4), (4, 3.0), (5, 3.5)])
def test_a_print_that_keeps_off_the_rim_is_a_hole_at_any_blur(height_px: int, blur_px: float) -> None:
    printed = patch_of((20, 32 - height_px // 2, 44, 32 - height_px // 2 + height_px), blur_px)
    assert filled_share(printed, inside_of(printed, DISC))[1] > 0.06


@pytest.mark.parametrize("blur_px", [0.6, 2.4, 3.0])
def test_what_reaches_over_the_rim_is_no_hole(blur_px: float) -> None:
    covered = patch_of((22, 29, 64, 35), blur_px)
    assert filled_share(covered, inside_of(covered, DISC))[1] < 0.02


@pytest.mark.parametrize("seed", [3, 6])
def test_a_bar_thinner_than_the_blur_that_noise_cuts_short_before_the_rim_is_no_hole(seed: int) -> None:
    covered = patch_of((0, 30, 64, 33), 2.3)
    noise = cv2.GaussianBlur(np.random.default_rng(seed).normal(0.0, 0.1, covered.red.shape), None, 1.0)
    noisy = replace(covered, red=(covered.red + noise).astype(np.float32))
    assert filled_share(noisy, inside_of(noisy, DISC))[1] < 0.03
