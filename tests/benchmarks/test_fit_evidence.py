"""The benchmark that fits what evidence is worth, on samples whose law is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.states.features import FEATURES
from asbuilt_bim.progress.states.likelihood import DATA, Model, chances

pytest.importorskip("asbuilt_synthetic")
pytest.importorskip("embreex")

from benchmarks.site.fit_evidence import (
    MOST_WRONG,
    Rows,
    Together,
    joined,
    left_out,
    limit_of,
    log_likelihood,
    often,
    regression,
    together,
    wrong_share,
)

TRUE = np.array([[3.0, -1.0], [-2.0, 2.5], [-0.5, -0.5]])  # of two features and the base, for built and for open


def drawn(seed: int, count: int = 20_000, alike: int = 20) -> Rows:
    """Return samples that follow a known law; each element holds so many that are one and the same."""
    rng = np.random.default_rng(seed)
    features = np.repeat(rng.random((count // alike, 2)), alike, axis=0)
    chance = chances(features[::alike], TRUE)
    seen = np.repeat([rng.choice(3, p=one) for one in chance], alike)
    return Rows(
        site=f"s{seed}", features=features, seen=seen, built=seen == 1, weight=np.full(count, 1.0),
        sample=np.arange(count), element=np.repeat(np.arange(count // alike), alike),
    )  # fmt: skip


def test_the_weights_of_a_known_law_come_back_within_their_sigmas() -> None:
    rows = drawn(1)
    weights, covariance = regression(rows, [0, 1])
    sigma = np.sqrt(np.diag(covariance)).reshape(2, 3).T
    assert np.all(np.abs(weights - TRUE) < 4.0 * sigma) and np.all(sigma < 0.6)


def test_samples_that_err_alike_do_not_make_weights_surer() -> None:
    def sigmas(alike: int) -> FloatArray:
        return np.sqrt(np.diag(regression(drawn(2, 4000 * alike, alike), [0, 1])[1]))

    np.testing.assert_allclose(sigmas(10), sigmas(1), rtol=0.1)


def test_a_feature_buys_what_leaving_it_out_costs_on_other_sites() -> None:
    sites = [drawn(3), drawn(4)]
    whole = log_likelihood(sites, [0, 1], left_out(sites, [0, 1]))
    assert whole > log_likelihood(sites, [1], left_out(sites, [1])) + 0.01


def test_the_limit_is_the_least_from_which_on_few_enough_are_wrong() -> None:
    odds = np.linspace(-5.0, 5.0, 10_001)
    rng = np.random.default_rng(6)
    built = rng.random(len(odds)) < 1.0 / (1.0 + np.exp(-2.0 * odds))
    given = Together(odds=odds, built=built, weight=np.ones(len(odds)))
    limit = limit_of(given)
    assert wrong_share(given, limit) <= MOST_WRONG < wrong_share(given, limit - 0.2)


def test_what_stations_say_of_one_sample_adds_up() -> None:
    first = drawn(7, 2000, 1)
    one = replace(first, features=np.hstack([first.features, np.ones((2000, len(FEATURES) - 2))]))
    other = joined([one, one])
    twice = replace(other, sample=np.tile(one.sample, 2))
    weights = np.zeros((len(FEATURES) + 1, 2))
    weights[0] = 2.0, -2.0
    fitted = Model(weights=weights, often=often(one), limit=2.0)
    np.testing.assert_allclose(together([twice], [fitted]).odds, 2.0 * together([one], [fitted]).odds)
    assert other.element.max() == 2 * one.element.max() + 1


def test_the_package_holds_weights_covariance_and_what_each_feature_buys() -> None:
    held = json.loads(DATA.read_text(encoding="utf-8"))
    size = len(FEATURES) + 1
    assert np.shape(held["weights"]) == (size, 2) and np.shape(held["covariance"]) == (2 * size, 2 * size)
    assert held["buys"].keys() == set(FEATURES)
    assert np.all(np.diag(held["covariance"]) > 0.0) and held["limit"] > 0.0
