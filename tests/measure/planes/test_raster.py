"""What is asked of a mask is asked within its box only, and comes out as if it were asked of the whole frame."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.masks import box_of, nonzero
from asbuilt_bim.measure.planes.raster import shrunk


@pytest.mark.parametrize("border_px", [1, 2, 3])
def test_a_mask_loses_the_same_border_in_its_box_as_in_the_frame(border_px: int) -> None:
    random = np.random.default_rng(border_px)
    square = np.ones((2 * border_px + 1,) * 2, np.uint8)
    for _ in range(20):
        mask = np.zeros((60, 80), dtype=bool)
        y, x = random.integers(0, 40), random.integers(0, 50)
        mask[y : y + 25, x : x + 40] = random.random(mask[y : y + 25, x : x + 40].shape) < 0.98
        whole = cv2.erode(mask.astype(np.uint8), square, borderValue=0) > 0
        assert np.array_equal(shrunk(mask, border_px), whole)
        assert all(np.array_equal(*both) for both in zip(nonzero(mask), np.nonzero(mask), strict=True))


def test_an_empty_mask_has_an_empty_box_and_nothing_to_lose() -> None:
    mask = np.zeros((6, 8), dtype=bool)
    assert mask[box_of(mask)].size == 0
    assert not shrunk(mask, 2).any()
    assert nonzero(mask)[0].size == 0
