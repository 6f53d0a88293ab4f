from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.robust_least_squares import (
    CAUCHY,
    TUKEY,
    Fit,
    by_differences,
    cauchy,
    fit,
    reweighted_linear,
    robust_fit,
    robust_sigma,
    tukey,
)

X = np.linspace(-1.0, 1.0, 60)
LINE = np.stack([X, np.ones_like(X)], axis=-1)
TIME = np.linspace(0.0, 2.0, 80)
DECAY = np.array([3.0, 1.2])


def decay(at: FloatArray) -> FloatArray:
    return at[0] * np.exp(-at[1] * TIME)


def by_decay(at: FloatArray) -> FloatArray:
    return np.stack([np.exp(-at[1] * TIME), -at[0] * TIME * np.exp(-at[1] * TIME)], axis=-1)


def decay_fit(seen: FloatArray, sigma: float, start: FloatArray) -> Fit:
    return fit(lambda at: (decay(at) - seen) / sigma, start, lambda at: by_decay(at) / sigma)


def test_without_outliers_a_line_is_the_one_of_the_normal_equations() -> None:
    target = 0.7 * X - 2.0 + np.random.default_rng(0).normal(0.0, 0.05, len(X))
    found = reweighted_linear(LINE, target, 10.0)  # so unsure that nothing is far off
    closed = np.linalg.solve(LINE.T @ LINE, LINE.T @ target)
    assert found.parameters == pytest.approx(closed, abs=1e-4)
    assert found.scale == 1.0
    assert found.covariance == pytest.approx(100.0 * np.linalg.inv(LINE.T @ LINE), abs=1e-4)


def test_weights_are_closed_forms() -> None:
    sigmas = np.array([0.0, 0.5 * TUKEY, TUKEY, 10.0 * TUKEY])
    assert tukey(sigmas).tolist() == [1.0, 0.75**2, 0.0, 0.0]
    assert tukey(sigmas, reach=2.0 * TUKEY)[2] == 0.75**2
    assert cauchy(np.array([0.0, CAUCHY])).tolist() == [1.0, 0.5]


def test_a_sigma_is_found_though_two_in_five_are_foreign() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.3, 5000)
    assert robust_sigma(noise) == pytest.approx(0.3, rel=0.05)
    noise[:2000] = 50.0
    assert robust_sigma(noise) < 3.0 * 0.3


def test_one_point_in_five_may_be_anything() -> None:
    target = 0.7 * X - 2.0
    target[::5] += np.random.default_rng(2).uniform(5.0, 500.0, len(target[::5]))
    plain = np.linalg.solve(LINE.T @ LINE, LINE.T @ target)
    assert np.abs(plain - [0.7, -2.0]).max() > 10.0
    found = reweighted_linear(LINE, target, 0.01)
    assert found.parameters == pytest.approx([0.7, -2.0], abs=1e-9) and found.weights[::5].max() == 0.0
    pulled = reweighted_linear(LINE, target, 0.01, loss=cauchy)  # it never quite lets go
    assert pulled.parameters == pytest.approx([0.7, -2.0], abs=0.5) and pulled.weights[::5].min() > 0.0


def test_weights_say_what_points_count() -> None:
    target = np.where(X < 0.0, 1.0, 1.1)
    heavy = np.where(X < 0.0, 1e6, 1.0)
    assert reweighted_linear(LINE[:, 1:], target, 1.0, heavy).parameters[0] == pytest.approx(1.0, abs=1e-4)


def test_what_points_leave_open_stays_at_zero() -> None:
    twice = np.stack([np.ones_like(X), np.ones_like(X)], axis=-1)
    assert reweighted_linear(twice, np.full(len(X), 4.0), 0.1).parameters == pytest.approx([2.0, 2.0], abs=1e-3)
    nothing = reweighted_linear(np.zeros((5, 2)), np.ones(5), 0.1)
    assert nothing.parameters.tolist() == [0.0, 0.0]


def test_a_ridge_draws_to_zero_by_its_share() -> None:
    design = np.ones((20, 1))
    found = reweighted_linear(design, np.full(20, 3.0), 1.0, ridge=0.25)
    assert found.parameters[0] == pytest.approx(3.0 / 1.25)


@pytest.mark.parametrize("linear", [True, False])
def test_covariance_holds_in_a_monte_carlo(linear: bool) -> None:
    rng = np.random.default_rng(3)
    squares = []
    for _ in range(400):
        if linear:
            noisy = 0.7 * X - 2.0 + rng.normal(0.0, 0.2, len(X))
            found, true = reweighted_linear(LINE, noisy, 0.2), np.array([0.7, -2.0])
        else:
            found, true = decay_fit(decay(DECAY) + rng.normal(0.0, 0.02, len(TIME)), 0.02, np.ones(2)), DECAY
        error = found.parameters - true
        squares.append(error @ np.linalg.solve(found.covariance, error))
    # chi-squared of two: mean 2, deviation 2; Tukey's weights give up some 10 %, the scale some more
    assert 2.0 - 4.0 * 2.0 / 20.0 < np.mean(squares) < (1.25 if linear else 1.0) * 2.0 + 4.0 * 2.0 / 20.0


def test_an_exact_model_comes_back_from_a_bad_start() -> None:
    found = decay_fit(decay(DECAY), 0.1, np.array([0.1, 8.0]))
    assert found.parameters == pytest.approx(DECAY, abs=1e-8)
    assert found.cost < 1e-12


def test_a_model_is_fenced_in_by_nan() -> None:
    def fenced(at: FloatArray) -> FloatArray:
        return np.full(len(TIME), np.nan) if at[1] < 1.5 else decay(at) - decay(DECAY)

    found = fit(fenced, np.array([3.0, 4.0]), by_decay)
    assert 1.5 <= found.parameters[1] < 1.6 and np.all(np.isfinite(found.residuals))
    with pytest.raises(ValueError, match="finite"):
        fit(fenced, np.array([3.0, 1.0]), by_decay)


def test_a_robust_fit_lets_go_of_gross_errors_and_keeps_to_its_prior_without_data() -> None:
    seen = decay(DECAY) + np.random.default_rng(4).normal(0.0, 0.01, len(TIME))
    seen[::4] += 3.0
    weak, start = np.full(2, 1e-3), np.array([2.0, 1.0])
    found = robust_fit(lambda at: (decay(at) - seen) / 0.01, start, np.full(2, 1e-6), weak)
    assert found.parameters == pytest.approx(DECAY, abs=0.02)
    assert found.weights[::4].max() == 0.0 and 0.7 < found.scale < 1.6
    flat = robust_fit(lambda at: np.zeros(9), np.ones(2), np.full(2, 1e-6), np.ones(2))
    assert flat.parameters == pytest.approx([0.0, 0.0], abs=1e-6)


def test_information_is_that_of_finite_differences() -> None:
    found = decay_fit(decay(DECAY), 0.1, np.ones(2))
    jacobian = by_differences(lambda at: decay(at) / 0.1, DECAY, np.full(2, 1e-6))
    assert jacobian == pytest.approx(found.jacobian, abs=1e-6)
    assert found.information == pytest.approx(jacobian.T @ jacobian, rel=1e-6)
