"""The fit of what a line says of an edge: known numbers come back, and a true end is found where it was drawn."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("asbuilt_synthetic")

from asbuilt_bim.measure.outline.edges import REACH_PX, EdgeModel, Line
from benchmarks.faces.border_truth import BEYOND_PX
from benchmarks.faces.fit_edges import NUMBERS, Choice, fitted, kept, left_out, model_of, read_back, true_place_px

TRUE = EdgeModel(clear=7.0, faint=2.0, spread_px=0.8)


def drawn(count: int) -> list[Choice]:
    """Return sides whose true line is drawn by the model itself, among lines a few of which show plainly."""
    rng = np.random.default_rng(3)
    off_px = np.arange(-36, 37) * 0.25
    found = []
    for number in range(count):
        scores = np.where(rng.random(73) < 0.15, rng.exponential(6.0, 73), 0.0)
        odds = TRUE.odds(scores, off_px)
        chances = np.exp(odds - odds.max())
        true_px = float(rng.choice(off_px, p=chances / chances.sum()))
        found.append(Choice(scene=f"twin {number % 6}", scores=scores, off_px=off_px, true_px=true_px))
    return found


def test_the_numbers_that_choices_were_drawn_by_come_back() -> None:
    found = model_of(fitted(drawn(1500)))
    assert found.clear == pytest.approx(TRUE.clear, rel=0.25)
    assert found.spread_px == pytest.approx(TRUE.spread_px, rel=0.3)


def test_leaving_out_what_a_line_shows_costs_likelihood() -> None:
    choices = drawn(400)
    assert left_out(choices, "clear") > left_out(choices) + 20.0


def test_choices_are_kept_and_read_back(tmp_path: Path) -> None:
    choices = drawn(3)
    (tmp_path / "rows.json").write_text(json.dumps(kept(choices)), encoding="utf-8")
    for one, other in zip(choices, read_back([tmp_path / "rows.json"]), strict=True):
        assert one.scene == other.scene and one.true_px == other.true_px
        assert np.allclose(one.scores, other.scores, atol=1e-4)


def upright_end(at_px: float) -> tuple[np.ndarray, dict[int, object]]:
    """Return labels (200, 200) of a face that ends upright at `at_px`, and its truth."""
    labels = np.zeros((200, 200), dtype=np.uint8)
    labels[:, : int(at_px)] = 1
    columns = np.arange(-BEYOND_PX, 200 + BEYOND_PX, dtype=np.float64)
    off = np.tile(at_px - columns, (200 + 2 * BEYOND_PX, 1))
    return labels, {0: SimpleNamespace(off_end_px=off, extent=off > 0.0)}


@pytest.mark.parametrize("at_px", [98.0, 100.0, 106.5])
def test_the_true_end_is_found_as_far_off_the_line_as_it_lies(at_px: float) -> None:
    labels, truth = upright_end(at_px)
    line = Line(start=np.array([100.0, 10.0]), stop=np.array([100.0, 190.0]))
    assert line.normal[0] > 0.0
    found = true_place_px(line, labels, truth)  # type: ignore[arg-type]
    assert found == pytest.approx(at_px - 100.0, abs=0.6)
    assert abs(found) < REACH_PX


def test_an_end_that_something_stands_before_is_no_truth() -> None:
    labels, truth = upright_end(104.0)
    labels[:, 96:] = 7
    line = Line(start=np.array([100.0, 10.0]), stop=np.array([100.0, 190.0]))
    assert true_place_px(line, labels, truth) is None  # type: ignore[arg-type]


def test_what_the_package_holds_has_the_numbers_that_are_fitted() -> None:
    assert set(NUMBERS) == set(EdgeModel.__dataclass_fields__)
