"""The fit of how sure a plane is: known numbers come back, and halves that tell buy likelihood."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("asbuilt_synthetic")

from asbuilt_bim.measure.planes.halves import NUMBERS
from benchmarks.faces.fit_planes import Plane, buys, fitted, kept, read_back

FREEDOM, VARIANCE = 6.0, 0.8


def drawn(count: int, halves: bool = True) -> list[Plane]:
    """Return planes whose own variance is off by a factor that the model draws, as errors and halves show it."""
    rng = np.random.default_rng(5)
    own = np.diag([1e-4, 4e-4, 1e-6])
    found = []
    for number in range(count):
        factor = FREEDOM * VARIANCE / rng.chisquare(FREEDOM)
        splits = tuple(factor * rng.chisquare(NUMBERS, 2)) if halves else ()
        error = rng.multivariate_normal(np.zeros(3), factor * own)
        found.append(Plane(scene=f"twin {number % 6}", error=error, own=own, splits=splits))
    return found


def test_the_numbers_that_planes_were_drawn_by_come_back() -> None:
    found = fitted(drawn(1500))
    assert found.freedom == pytest.approx(FREEDOM, rel=0.25)
    assert found.variance == pytest.approx(VARIANCE, rel=0.1)


def test_halves_that_know_the_factor_buy_likelihood() -> None:
    assert buys(drawn(400)) > 20.0
    assert buys(drawn(400, halves=False)) == pytest.approx(0.0)


def test_planes_are_kept_and_read_back(tmp_path: Path) -> None:
    planes = drawn(3)
    (tmp_path / "rows.json").write_text(json.dumps(kept(planes)), encoding="utf-8")
    for one, other in zip(planes, read_back([tmp_path / "rows.json"]), strict=True):
        assert one.scene == other.scene and one.splits == other.splits
        assert np.all(one.error == other.error) and np.all(one.own == other.own)
