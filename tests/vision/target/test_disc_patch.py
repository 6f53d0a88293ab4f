"""A disc's inside: what is printed on it is missing from its red, however blurred."""

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
    return Patch(corner=np.zeros(2), red=red, planes=np.repeat(red[..., None], 3, axis=2))


@pytest.mark.parametrize(("height_px", "blur_px"), [(6, 0.6), (6, 2.4), (8, 3.0)])
def test_what_a_print_takes_of_the_inside_is_missing_at_any_blur(height_px: int, blur_px: float) -> None:
    printed = patch_of((20, 32 - height_px // 2, 44, 32 - height_px // 2 + height_px), blur_px)
    assert 0.06 < 1.0 - filled_share(printed, inside_of(printed, DISC)) < 0.35


@pytest.mark.parametrize("blur_px", [0.6, 2.4, 3.0])
def test_a_plain_discs_inside_is_all_red_whatever_the_blur(blur_px: float) -> None:
    plain = patch_of((0, 0, 0, 0), blur_px)
    assert filled_share(plain, inside_of(plain, DISC)) == 1.0
