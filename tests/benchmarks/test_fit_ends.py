"""The fit of where a face ends: known weights come back, scenes are left out, the limit keeps false ones away."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("asbuilt_synthetic")

from asbuilt_bim.measure.outline.border import FEATURES
from benchmarks.faces.fit_ends import MOST_FALSE, Face, fitted, kept, left_out, limit_of, read_back, regression

TRUE = np.array([3.0, -2.0, 0.0, -1.0])


def drawn(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    rows = rng.random((count, 3))
    chance = 1.0 / (1.0 + np.exp(-(rows @ TRUE[:-1] + TRUE[-1])))
    return rows, (rng.random(count) < chance).astype(float)


def test_the_weights_that_answers_were_drawn_by_come_back_within_their_covariance() -> None:
    rows, answers = drawn(np.random.default_rng(1), 20_000)
    weights, covariance = regression(rows, answers)
    assert np.abs(weights - TRUE).max() < 0.3
    assert np.all(np.abs(weights - TRUE) < 4.0 * np.sqrt(np.diag(covariance)))


def test_a_feature_that_parts_all_answers_keeps_a_finite_weight() -> None:
    rows = np.repeat([[0.0], [1.0]], 20, axis=0)
    weights, _ = regression(rows, rows[:, 0])
    assert np.isfinite(weights).all() and 0.0 < weights[0] < 50.0


def faces() -> list[Face]:
    rng = np.random.default_rng(2)
    found = []
    for number in range(40):
        shown = rng.random((4, len(FEATURES)))
        found.append(Face(scene=f"twin {number % 5}", features=shown, ends=shown[:, 0] > 0.3))
    return found


def test_no_scene_has_a_part_in_the_weights_that_judge_it() -> None:
    one = faces()
    other = [Face(scene=f.scene, features=f.features, ends=~f.ends if f.scene == "twin 0" else f.ends) for f in one]
    before, after = (left_out(some, range(len(FEATURES))) for some in (one, other))
    for face, was, now in zip(one, before, after, strict=True):
        assert np.array_equal(was, now) == (face.scene == "twin 0")


def test_above_the_limit_hardly_a_face_is_false() -> None:
    chances = np.linspace(0.99, 0.51, 97)
    whole = np.ones(97, dtype=bool)
    whole[20:] = False
    assert limit_of(chances, whole) == pytest.approx(chances[20])  # the first false one is no proof
    whole[20:] = True
    whole[30] = False  # one in 97 says nothing against one in a hundred
    assert limit_of(chances, whole) == pytest.approx(0.51)
    whole[[31, 32, 33]] = False
    assert limit_of(chances, whole) == pytest.approx(chances[30])
    chances = np.array([0.99, 0.95, 0.9, 0.8, 0.7, 0.6, 0.4])
    assert limit_of(chances, np.ones(7, dtype=bool)) == pytest.approx(0.6)  # likelier whole than not
    assert limit_of(chances, np.zeros(7, dtype=bool)) == 1.0
    assert MOST_FALSE == 0.01


def test_what_was_kept_is_read_back_and_gives_the_same_model(tmp_path: object) -> None:
    import json

    path = tmp_path / "rows.json"  # type: ignore[operator]
    path.write_text(json.dumps(kept(faces())), encoding="utf-8")
    assert fitted(read_back([path])) == fitted(faces())
