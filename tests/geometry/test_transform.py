from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.transform import apply, cross, laid_over, rigid, skew, wrapped


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 2])
def test_a_wrapped_angle_differs_by_whole_turns_and_lies_within_half_a_turn(turns: int) -> None:
    angles = np.linspace(-np.pi, np.pi, 50, endpoint=False)

    np.testing.assert_allclose(wrapped(angles + 2.0 * np.pi * turns + 1e-9), angles + 1e-9, atol=1e-12)


def test_half_a_turn_either_way_is_one_angle() -> None:
    assert wrapped(np.pi) == wrapped(-np.pi) == -np.pi


def test_skew_matrices_of_many_vectors_give_their_cross_products() -> None:
    one, other = np.random.default_rng(0).normal(size=(2, 4, 5, 3))

    np.testing.assert_allclose((skew(one) @ other[..., None])[..., 0], cross(one, other), atol=1e-15)


def test_points_laid_over_others_give_back_their_transform_and_never_a_mirror() -> None:
    rng = np.random.default_rng(3)
    a = rng.normal(size=(6, 3))
    b_from_a = rigid([0.3, -1.2, 0.7], [4.0, -2.0, 9.0])
    assert np.allclose(laid_over(a, apply(b_from_a, a)), b_from_a)
    assert np.allclose(laid_over(a, apply(b_from_a, a) + 5.0 * np.eye(6)[:, :1], np.r_[0.0, np.ones(5)]), b_from_a)
    assert np.linalg.det(laid_over(a, a * [1.0, 1.0, -1.0])[:3, :3]) == pytest.approx(1.0)
