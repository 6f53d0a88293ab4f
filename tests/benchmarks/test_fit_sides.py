"""The fit of what a side errs by: known numbers come back, another line now and then doesn't widen them."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("asbuilt_synthetic")

from asbuilt_bim.measure.outline.edges import Line
from benchmarks.faces.fit_sides import Error, fitted, left_out, off_px, read_back

EDGE_PX, LEVEL_PX = 0.1, 0.2
TRUE = (np.array([[100.0, 50.0], [300.0, 50.0]]), np.array([[300.0, 50.0], [300.0, 250.0]]))


def drawn(count: int, other: float = 0.0) -> list[Error]:
    """Return lines that err by known numbers, a share of them by being another line."""
    rng = np.random.default_rng(7)
    found = []
    for number in range(count):
        parts = ("edge", "level") if number % 2 else ("edge",)
        own = float(rng.uniform(0.02, 0.15))
        sigma = np.hypot(np.hypot(own, EDGE_PX), LEVEL_PX * (number % 2))
        off = float(rng.normal(0.0, 1.5 if rng.random() < other else sigma))
        found.append(Error(scene=f"twin {number % 6}", off_px=off, own_px=own, parts=parts))
    return found


@pytest.mark.parametrize("other", [0.0, 0.02])
def test_the_numbers_that_sides_were_drawn_by_come_back(other: float) -> None:
    edge, level, *_ = fitted(drawn(3000, other))
    assert edge == pytest.approx(EDGE_PX, rel=0.1) and level == pytest.approx(LEVEL_PX, rel=0.1)


def test_a_number_that_sides_err_by_buys_likelihood() -> None:
    errors = drawn(400)
    assert left_out(errors) - left_out(errors, "level") > 10.0


def test_a_line_is_held_against_the_true_edge_that_runs_along_it_and_no_other() -> None:
    along = Line(start=np.array([120.0, 51.5]), stop=np.array([280.0, 51.5]))
    assert off_px(along, TRUE) == pytest.approx(1.5 * np.sign(-along.normal[1]))
    for start, stop in (([120.0, 60.0], [280.0, 60.0]), ([320.0, 50.0], [420.0, 50.0]), ([120.0, 40.0], [160.0, 60.0])):
        assert off_px(Line(start=np.array(start), stop=np.array(stop)), TRUE) is None


def test_lines_are_kept_and_read_back(tmp_path: Path) -> None:
    errors = drawn(3)
    (tmp_path / "rows.json").write_text(json.dumps({"lines": [asdict(one) for one in errors]}), encoding="utf-8")
    assert read_back([tmp_path / "rows.json"]) == errors
