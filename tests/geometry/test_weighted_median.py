from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import weighted_median


def test_equal_weights_give_the_median() -> None:
    for values in ([3.0, 1.0, 2.0], [4.0, 1.0, 2.0, 3.0], [5.0]):
        assert weighted_median(np.array(values), np.ones(len(values))) == pytest.approx(np.median(values))


def test_a_value_with_most_of_the_weight_decides() -> None:
    assert weighted_median(np.array([0.0, 10.0, 1.0]), np.array([1.0, 1.0, 100.0])) == pytest.approx(1.0, abs=0.02)
