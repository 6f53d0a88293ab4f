"""A round column's sigma where its silhouettes and the stereo circle disagree."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure import round as round_column
from asbuilt_bim.measure.round import _from_silhouettes, _Tangent

COLUMN = Circle(x_m=0.0, z_m=6.0, radius_m=0.2, f_px=1000.0, baseline_m=0.25)


def radius_and_sigma(monkeypatch: pytest.MonkeyPatch, stereo_radius_m: float) -> tuple[float, float]:
    """Fit with silhouettes of a radius of 0.2 m and a stereo circle of another."""
    edge = float(np.tan(np.arcsin(0.2 / 6.0)))
    monkeypatch.setattr(round_column, "_silhouette", lambda b, c, m, side: _Tangent(tangent=side * edge, sigma=1.2e-4))
    monkeypatch.setattr(round_column, "_distance", lambda *_: (6.0, 0.003))
    stereo = replace(COLUMN, radius_m=stereo_radius_m)
    circle, sigma, _ = _from_silhouettes(SimpleNamespace(), stereo, np.ones((2, 2), bool))  # type: ignore[arg-type]
    return circle.radius_m, sigma


def test_silhouettes_give_the_radius_to_half_a_millimetre(monkeypatch: pytest.MonkeyPatch) -> None:
    radius, sigma = radius_and_sigma(monkeypatch, 0.205)
    assert radius == pytest.approx(0.2, abs=1e-6)
    assert sigma < 0.0007


def test_silhouettes_that_stereo_contradicts_are_doubted_by_half_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    radius, sigma = radius_and_sigma(monkeypatch, 0.24)
    assert radius == pytest.approx(0.2, abs=1e-6)
    assert sigma == pytest.approx(0.02, rel=0.01)
