from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states import features
from asbuilt_bim.progress.states.evidence import Evidence, Verdict
from asbuilt_bim.progress.states.features import FEATURES, Shown, features_of, shown
from asbuilt_bim.progress.states.likelihood import Model, chances, decided, log_odds, model, odds_of
from asbuilt_bim.progress.states.outlines import covered, looks_like_bars, marked, stands_off
from tests.match.small_site import FAR, box, element

OPTIONS = ProgressOptions()
WALL = element("W", "wall", box(0, 0, 0, 3.0, 0.25, 2.0))
SAMPLES = cell_samples(WALL, 0.05)
FRONT = SAMPLES.face == 0
U, V = SAMPLES.uv_m.T
NONE = np.zeros(len(U), dtype=bool)


def evidence(verdict: FloatArray, offset_m: float = 0.0) -> Evidence:
    """Return a station's evidence of these verdicts (N,), with 1 cm of noise."""
    noise = np.random.default_rng(3).normal(0.0, 0.01, len(U))
    return Evidence(
        verdict=verdict.astype(np.uint8), offset_m=offset_m + noise, common_m=np.full(len(U), 0.01),
        drop_m=np.zeros(len(U)), tinted=NONE, through=NONE,
    )  # fmt: skip


def show(seen: Evidence, outlined: BoolArray = NONE, stands_off: BoolArray = NONE) -> Shown:
    """Return what a station before the wall's front shows."""
    return shown("A1", np.add(FAR, [1.5, -5.0, 1.0]), SAMPLES, seen, FRONT, outlined, stands_off, V, OPTIONS)


def of(*pieces: tuple[BoolArray, Verdict]) -> FloatArray:
    """Return verdicts (N,): of the first piece that a sample lies in, else not measured."""
    return np.select([piece for piece, _ in pieces], [verdict for _, verdict in pieces], Verdict.NOT_MEASURED)


def test_a_wall_on_its_design_is_built_and_one_that_is_seen_through_is_open() -> None:
    built, opened = decided(log_odds(show(evidence(of((FRONT, Verdict.NEAR))), FRONT)))
    np.testing.assert_array_equal(built, FRONT)
    assert not opened.any()
    built, opened = decided(log_odds(show(evidence(of((FRONT, Verdict.BEHIND))))))
    np.testing.assert_array_equal(opened, FRONT)
    assert not built.any()


@pytest.mark.parametrize("verdict", [Verdict.NOT_MEASURED, Verdict.BEFORE])
def test_what_a_station_does_not_see_has_even_odds_to_the_last_digit(verdict: Verdict) -> None:
    assert not log_odds(show(evidence(of((FRONT, verdict))))).any()


def test_what_lies_deep_behind_a_hoarding_has_even_odds_however_plainly_the_rest_is_seen() -> None:
    hidden = FRONT & (U > 1.0)
    odds = log_odds(show(evidence(of((hidden, Verdict.BEFORE), (FRONT, Verdict.BEHIND)))))
    assert np.all(odds[FRONT & (U < 0.8)] < -model().limit)
    assert not odds[U > 1.2].any() and not odds[~FRONT].any()


def test_odds_are_even_where_a_sample_is_surely_seen_as_neither_and_they_are_never_endless() -> None:
    count = len(FEATURES)
    seen, base = np.ones((1, count)), np.zeros((count, 2))
    sure = Model(weights=np.vstack([base, [[-80.0, -60.0]]]), often=np.array([0.4, 0.3, 0.3]), limit=2.0)
    assert odds_of(seen, sure)[0] == pytest.approx(0.0, abs=1e-9)
    for weights in ([[80.0, -80.0]], [[-80.0, 80.0]]):
        assert 0.5 < abs(odds_of(seen, replace(sure, weights=np.vstack([base, weights])))[0]) < np.inf
    assert chances(seen, sure.weights).sum(axis=1) == pytest.approx(1.0)


def test_nothing_speaks_for_built_where_no_surface_is_seen_nor_for_open_where_none_is_seen_past() -> None:
    rng = np.random.default_rng(8)
    seen = np.where(rng.random((200, len(FEATURES))) < 0.5, rng.random((200, len(FEATURES))), 0.0)
    odds, names = odds_of(seen, model()), list(FEATURES)
    near, past = (seen[:, names.index(name)] > 0.0 for name in ("near", "behind"))
    assert np.all(odds[~near] <= 0.0) and np.all(odds[~past] >= 0.0)
    assert not odds[~near & ~past].any() and odds.any()


def test_bars_whose_gaps_are_seen_through_are_not_built_though_their_depth_lies_on_the_design() -> None:
    wall, cage = FRONT & (V < 1.0), FRONT & (V > 1.0)
    bars = cage & (np.floor(U / 0.05) % 4 == 0)
    odds = log_odds(show(evidence(of((wall | bars, Verdict.NEAR), (cage, Verdict.BEHIND))), wall))
    assert np.all(decided(odds)[0][wall & (V < 0.8)]) and np.all(odds[cage & (V > 1.2)] < 0.0)


def test_what_is_seen_past_bars_is_behind_whatever_a_matcher_that_smears_them_shut_says() -> None:
    cage = FRONT & (V > 1.0)
    seen = replace(evidence(of((FRONT, Verdict.NEAR))), through=cage)
    built, opened = decided(log_odds(show(seen, FRONT)))
    assert np.all(opened[cage & (V > 1.2)]) and not built[cage & (V > 1.2)].any()
    assert np.all(built[FRONT & (V < 0.8)])


def test_a_patch_whose_mean_stands_before_the_design_is_formwork_and_says_nothing() -> None:
    before = log_odds(show(evidence(of((FRONT, Verdict.NEAR)), offset_m=0.09), FRONT))
    assert not before.any()
    unknown = replace(evidence(of((FRONT, Verdict.NEAR)), offset_m=0.09), common_m=np.full(len(U), 0.05))
    assert np.all(log_odds(show(unknown, FRONT))[FRONT] > 0.0), "its mean isn't known so well"


def test_what_lies_in_an_outline_that_stands_off_says_nothing() -> None:
    half = FRONT & (U < 1.5)
    odds = log_odds(show(evidence(of((FRONT, Verdict.NEAR))), stands_off=half))
    assert not odds[U < 1.3].any() and np.all(odds[FRONT & (U > 1.7)] > model().limit)


def test_low_over_the_foot_depth_can_not_tell_the_element_from_the_ground() -> None:
    low = show(replace(evidence(of((FRONT, Verdict.NEAR))), drop_m=np.full(len(U), 0.2)))
    assert np.all(low.verdict[FRONT & (V < 0.2)] == Verdict.NOT_MEASURED)
    assert np.all(low.verdict[FRONT & (V > 0.2)] == Verdict.NEAR)


def test_another_colour_than_concretes_speaks_against_it() -> None:
    plain = evidence(of((FRONT, Verdict.NEAR)))
    timber = replace(plain, tinted=FRONT)
    assert np.all(log_odds(show(timber))[FRONT] < log_odds(show(plain))[FRONT])
    assert not decided(log_odds(show(timber)))[0].any()


def test_features_are_shares_and_flags_from_nought_to_one() -> None:
    rng = np.random.default_rng(5)
    values = features_of(show(evidence(rng.integers(0, 5, len(U)))))
    assert values.shape == (len(U), len(FEATURES)) and values.min() >= 0.0 and values.max() <= 1.0 + 1e-6


MATCH = FaceMatch(
    station="A1", face_id="A1/1", design_face="W-0", element="W", outline_uv_m=(), area_m2=0.3,
    area_sigma_calibration_m2=0.0, area_sigma_image_m2=0.0, whole=True, overlap=1.0, offset_m=0.0,
    offset_sigma_m=0.005, tilt_rad=None,
)  # fmt: skip


@pytest.mark.parametrize(
    ("area_m2", "offset_m", "sigma_m", "bars"),
    [
        (0.3, 0.0, 0.005, False),
        (0.3, -0.05, 0.005, True),
        (0.3, 0.0, 0.03, True),
        (2.0, -0.05, 0.005, False),
        (0.05, 0.0, 0.005, True),
    ],
)  # fmt: skip
def test_a_small_face_that_can_not_be_told_from_steel_behind_its_cover_counts_for_nothing(
    area_m2: float, offset_m: float, sigma_m: float, bars: bool
) -> None:
    match = replace(MATCH, area_m2=area_m2, offset_m=offset_m, offset_sigma_m=sigma_m)
    assert looks_like_bars(match, OPTIONS) is bars


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_face_stands_off_its_design_only_by_more_than_it_may_err(side: float) -> None:
    assert stands_off(replace(MATCH, offset_m=0.08 * side), OPTIONS)
    assert not stands_off(replace(MATCH, offset_m=0.08 * side, offset_sigma_m=0.03), OPTIONS)


def test_an_outline_covers_its_own_stations_samples_of_its_own_design_face() -> None:
    half = replace(MATCH, station="A1", outline_uv_m=polygon.box(0.0, 0.0, 1.5, 2.0))
    found = covered(WALL, SAMPLES, "A1", {WALL.faces[0].face_id: (half,)})
    assert [one.match for one in found] == [half] and found[0].flat
    np.testing.assert_array_equal(marked(found, len(U)), FRONT & (U < 1.5))
    assert not covered(WALL, SAMPLES, "A2", {WALL.faces[0].face_id: (half,)})


def test_a_new_kind_of_evidence_is_one_file_and_weighs_nothing_until_it_is_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = show(evidence(of((FRONT, Verdict.NEAR))), FRONT)
    before = log_odds(seen)
    monkeypatch.setattr(features, "FEATURES", FEATURES | {})
    example = Path(__file__).parents[3] / "benchmarks" / "site" / "aslant.py"
    assert len(example.read_text(encoding="utf-8").splitlines()) < 60
    runpy.run_path(str(example))
    new = features_of(seen, ["near", "aslant"])
    straight = int(np.argmin(np.where(FRONT, np.hypot(U - 1.5, V - 1.0), np.inf)))
    assert new[straight, 1] < 0.01 < new[FRONT, 1].max() < 1.0 and (new[~FRONT & (SAMPLES.face == 2), 1] == 1.0).all()
    np.testing.assert_array_equal(log_odds(seen), before)
