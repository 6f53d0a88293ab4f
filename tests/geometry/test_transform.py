from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.transform import cross, skew, wrapped


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 2])
def test_a_wrapped_angle_differs_by_whole_turns_and_lies_within_half_a_turn(turns: int) -> None:
    angles = np.linspace(-np.pi, np.pi, 50, endpoint=False)

    np.testing.assert_allclose(wrapped(angles + 2.0 * np.pi * turns + 1e-9), angles + 1e-9, atol=1e-12)


def test_half_a_turn_either_way_is_one_angle() -> None:
    assert wrapped(np.pi) == wrapped(-np.pi) == -np.pi


def test_skew_matrices_of_many_vectors_give_their_cross_products() -> None:
    one, other = np.random.default_rng(0).normal(size=(2, 4, 5, 3))

    np.testing.assert_allclose((skew(one) @ other[..., None])[..., 0], cross(one, other), atol=1e-15)
