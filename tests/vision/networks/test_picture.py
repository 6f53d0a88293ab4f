from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.vision.networks.card import InputCard
from asbuilt_bim.vision.networks.picture import Fit, input_of

STEP = (2.0, 2.0)


def letterboxed(width: int, height: int) -> Fit:
    return input_of(
        np.zeros((height, width, 3), dtype=np.uint8), InputCard(width_px=64, height_px=64, resize="letterbox")
    )[1]


@pytest.mark.parametrize("box", [(0, 0, 32, 3), (0, 29, 32, 3), (0, 0, 32, 32), (7, 9, 4, 12)])
def test_a_part_is_carried_to_the_photo_as_the_whole_map_is_also_where_it_lies_in_the_padding(
    box: tuple[int, int, int, int],
) -> None:
    fit = letterboxed(90, 30)
    small = np.random.default_rng(3).normal(size=(32, 32)).astype(np.float32)
    rows, columns, part = fit.part_to_photo(small, box, STEP)
    assert part.shape == (rows.stop - rows.start, columns.stop - columns.start)
    assert part == pytest.approx(fit.to_photo(small, *STEP)[rows, columns], abs=0.07)  # OpenCV's fixed-point weights


@pytest.mark.parametrize("box", [(0, 0, 3, 32), (29, 0, 3, 32)])
def test_a_part_beside_an_upright_photo_is_carried_too(box: tuple[int, int, int, int]) -> None:
    fit = letterboxed(30, 90)
    rows, columns, part = fit.part_to_photo(np.ones((32, 32), dtype=np.float32), box, STEP)
    assert part.shape == (rows.stop - rows.start, columns.stop - columns.start)
    assert columns.stop - columns.start >= 1
