"""Stepwise straight borders: the path by dynamic programming is the cheapest, and it starts from the middle pixel."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from asbuilt_bim.measure.outline import steps


@pytest.mark.parametrize("seed", range(8))
def test_no_other_path_is_cheaper(seed: int) -> None:
    random = np.random.default_rng(seed)
    cost = (25.0 * random.random((5, 4))).astype(np.float32)
    step = steps.JUMP_COST + steps.JUMP_SHARE * len(cost)

    def price(path: tuple[int, ...]) -> float:
        stepped = sum(one != other for one, other in pairwise(path))
        return float(sum(cost[row, place] for row, place in enumerate(path))) + step * stepped

    found = steps._cheapest(cost)
    assert found.dtype == np.int32
    assert price(tuple(found.tolist())) == pytest.approx(min(map(price, product(range(4), repeat=5))), abs=1e-4)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_the_middle_column_is_the_median_of_all_pixels_columns(share: float) -> None:
    random = np.random.default_rng(3)
    for _ in range(40):
        own = random.random((12, 17)) < share
        own[4, 5] = True
        assert steps._middle_column(own) == int(np.median(np.nonzero(own)[1]))
