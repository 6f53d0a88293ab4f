"""The fit of where a face ends: known weights come back, scenes are left out, the limit keeps false ones away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("asbuilt_synthetic")

from asbuilt_bim.measure.outline.border import FEATURES
from benchmarks.faces.fit_ends import FALSE_COSTS, Face, fitted, kept, left_out, read_back, regression

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
        ends = shown[:, 0] > 0.3
        found.append(
            Face(scene=f"twin {number % 5}", features=shown, ends=ends, held=float(ends[1:].all()), narrow_px=200.0)
        )
    return found


def test_no_scene_has_a_part_in_the_weights_that_judge_it() -> None:
    one = faces()
    other = [replace(f, ends=~f.ends) if f.scene == "twin 0" else f for f in one]
    before, after = (left_out(some, range(len(FEATURES))) for some in (one, other))
    for face, was, now in zip(one, before, after, strict=True):
        assert np.array_equal(was, now) == (face.scene == "twin 0")


def test_the_limit_is_where_a_false_whole_costs_as_much_as_those_that_are_lost() -> None:
    assert fitted(faces())["limit"] == pytest.approx(FALSE_COSTS / (FALSE_COSTS + 1.0), abs=1e-4)


def test_a_face_counts_as_whole_by_what_its_outline_holds_whatever_its_sides_are() -> None:
    fit = fitted([replace(face, held=0.98) for face in faces()])
    assert dict(fit["fitted_on"])["whole"] == 40  # type: ignore[call-overload]
    assert [replace(faces()[0], held=0.92, narrow_px=px).whole for px in (30.0, 60.0)] == [True, False]


def test_what_was_kept_is_read_back_and_gives_the_same_model(tmp_path: object) -> None:
    import json

    path = tmp_path / "rows.json"  # type: ignore[operator]
    path.write_text(json.dumps(kept(faces())), encoding="utf-8")
    assert fitted(read_back([path])) == fitted(faces())
