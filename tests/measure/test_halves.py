"""How sure a plane is, by how halves of its pixels agree on it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from asbuilt_bim.measure.planes.halves import DATA, HalvesModel, as_halves_agree, excess_share, model, splits_of
from asbuilt_bim.measure.planes.refine import PlaneFit, pictures, refine_plane
from tests.measure.outline.test_precision import grainy_pair

INSIDE = np.zeros((96, 160), dtype=bool)
INSIDE[8:88, 40:150] = True


def refined(seed: int, bent_px: float, inside: np.ndarray = INSIDE) -> PlaneFit:
    """Refine a plane on a grainy surface whose right half lies nearer by some disparity."""
    left, right, rays = grainy_pair(seed, grain_grey=1.0)
    other, other_right, _ = grainy_pair(seed, 1.0, 20.3 + bent_px)
    left[:, 95:], right[:, 75:] = other[:, 95:], other_right[:, 75:]
    both = pictures(left, right, np.ones((96, 160), dtype=bool))
    fit = refine_plane(both, rays, inside, np.array([0.0, 0.0, 20.0]))
    assert fit is not None
    return fit


def test_halves_of_one_plane_differ_by_chance_and_those_of_two_by_more() -> None:
    even, bent = ([chi_square(seed, bent_px) for seed in range(10)] for bent_px in (0.0, 0.4))
    assert 2.0 < np.median(even) < 12.0  # 6 degrees of freedom
    assert np.median(bent) > 5.0 * np.median(even)


def chi_square(seed: int, bent_px: float) -> float:
    return float(np.sum(splits_of(refined(seed, bent_px))))


def test_a_plane_whose_halves_contradict_each_other_is_less_sure_and_doubted() -> None:
    fit = refined(3, 0.4)
    found = as_halves_agree(fit)
    assert np.all(found.q_px == fit.q_px)
    assert found.covariance[0, 0] > 2.0 * fit.covariance[0, 0]
    assert found.doubt > 0.5


def test_a_plane_too_small_to_be_split_keeps_what_the_model_says() -> None:
    few = np.zeros_like(INSIDE)
    few[40:47, 80:87] = True
    fit = refined(3, 0.0, few)
    found = as_halves_agree(fit)
    assert found.doubt == 1.0  # nothing says that the photos agree
    assert found.covariance == pytest.approx(model().variance * fit.covariance)


def test_the_more_halves_differ_the_wider_a_plane_and_no_comparison_says_nothing() -> None:
    one = HalvesModel(freedom=6.0, variance=1.0)
    assert one.times([]) == 1.0 == one.times([3.0, 3.0])
    assert one.times([30.0, 30.0]) == pytest.approx(66.0 / 12.0)
    assert excess_share(2.0, 3) == 0.0 == excess_share(3.0, 3) and excess_share(30.0, 3) == pytest.approx(0.9)


def test_the_model_says_on_what_it_was_fitted() -> None:
    held = json.loads(DATA.read_text(encoding="utf-8"))
    assert held["fitted_on"]["planes"] > 100 and len(held["fitted_on"]["scenes"]) > 20
    assert 2.0 < model().freedom < 50.0 and 0.5 < model().variance < 2.0
