"""Whether a face was seen whole: the fitted probability, what it is made of, and what speaks against it most."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.measure.outline import ends as ends_module
from asbuilt_bim.measure.outline.border import FEATURES, border_sides, flat_surface
from asbuilt_bim.measure.outline.ends import DATA, End, Ends, face_probability, judge_ends, model, side_probabilities
from tests.measure.outline.test_border import FACE_PX, HIGH, PIECE, PLANE, SIZE, bench, outline, put


def judged(on: SimpleNamespace, strength: float = 0.7) -> Ends:
    """Judge the square face of a workbench."""
    return judge_ends(on, border_sides(outline(strength)), flat_surface(PLANE, PIECE))  # type: ignore[arg-type]


def test_a_face_before_a_background_was_seen_whole() -> None:
    found = judged(bench())
    assert found.probability >= model().limit
    assert not (found.cut_by_frame or found.occluded or found.open_edge)


def test_a_face_that_the_frame_cuts_is_not_whole_however_plain_an_edge_runs_there() -> None:
    on = bench()
    on.frame[:, HIGH - 4 :] = True
    put(on, slice(HIGH - 4, SIZE), np.nan)
    found = judged(on)
    assert found.probability < model().limit
    assert found.cut_by_frame and not found.occluded


def test_a_face_with_a_near_thing_along_a_side_is_hidden() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX + 20.0)
    found = judged(on, strength=0.0)
    assert found.probability < model().limit
    assert found.occluded and not found.cut_by_frame


def test_a_face_whose_plane_goes_on_is_open() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), FACE_PX)
    found = judged(on, strength=0.0)
    assert found.probability < model().limit
    assert found.open_edge and not (found.cut_by_frame or found.occluded)


def test_a_side_knows_how_likely_it_is_an_end_and_how_far_the_face_may_go_on() -> None:
    on = bench()
    put(on, slice(HIGH, SIZE), np.nan)
    found = judged(on, strength=0.0)
    lost, seen = found.of_edge(1), found.of_edge(3)
    assert lost.probability < 0.5 < seen.probability
    assert (lost.open_px, seen.open_px, seen.far_px) == pytest.approx((39.0, 3.0, 3.0))
    assert lost.far_px >= SIZE - HIGH
    assert found.of_edge(99) == End(probability=found.probability, open_px=39.0, far_px=39.0)


def test_a_face_is_no_likelier_whole_than_its_weakest_side_lets_it() -> None:
    face = model().face
    chances = [face_probability(np.array([0.99, 0.99, weak]), face) for weak in (0.99, 0.8, 0.3, 0.05)]
    assert chances == sorted(chances, reverse=True)
    assert chances[0] > 0.9 and chances[-1] < 0.2
    assert face_probability(np.array([1.0, 0.0]), face) < 1e-3


def test_the_model_says_on_what_and_how_surely_it_was_fitted() -> None:
    held = json.loads(DATA.read_text(encoding="utf-8"))
    weights, covariance = np.array(held["weights"]), np.array(held["covariance"])
    assert covariance.shape == (len(FEATURES) + 1,) * 2
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert set(held["buys"]) == set(FEATURES)
    assert held["fitted_on"]["whole"] > 25
    sure = dict(zip(FEATURES, weights[:-1] / np.sqrt(np.diag(covariance))[:-1], strict=True))
    assert sure["behind"] > 2.0 and sure["edge"] > 2.0 and sure["stands"] > 2.0
    assert side_probabilities(np.zeros((1, len(FEATURES))), weights)[0] < 0.5  # of what nothing is known


def test_a_model_of_other_features_is_refused(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    other = json.loads(DATA.read_text(encoding="utf-8")) | {"features": ["behind"]}
    path = tmp_path / "ends.json"  # type: ignore[operator]
    path.write_text(json.dumps(other), encoding="utf-8")
    monkeypatch.setattr(ends_module, "DATA", path)
    model.cache_clear()
    with pytest.raises(ValueError, match="other features"):
        model()
    model.cache_clear()
