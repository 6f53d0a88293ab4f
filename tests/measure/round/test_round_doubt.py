"""A round column's circle and its sigma: silhouettes of both photos, and what they are worth where they disagree."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure.round import circle as round_circle
from asbuilt_bim.measure.round.circle import RoundCircle, fit_circle
from asbuilt_bim.measure.round.lateral_surface import LateralEnd
from asbuilt_bim.measure.round.silhouettes import Silhouette, touch_silhouettes

COLUMN = Circle(x_m=0.3, z_m=6.0, radius_m=0.2, f_px=1000.0, baseline_m=0.25)
DISTANCE_M = float(np.hypot(0.3, 6.0))
SIGMA = 1.2e-4
STEREO = Circle(x_m=0.28, z_m=6.1, radius_m=0.17, f_px=1000.0, baseline_m=0.25)


def silhouettes(*, both: bool = True, off_px: float = 0.0) -> list[Silhouette]:
    """Return the column's true silhouettes; the left photo's left one `off_px` further out."""
    seen: list[Silhouette] = []
    for eye in ((0.0, 0.0), (0.25, 0.0))[: 2 if both else 1]:
        away = np.array([COLUMN.x_m, COLUMN.z_m]) - eye
        half = float(np.arcsin(COLUMN.radius_m / np.hypot(*away)))
        for side in (-1, 1):
            wrong = -off_px / COLUMN.f_px if eye == (0.0, 0.0) and side == -1 else 0.0
            bearing = float(np.arctan2(*away)) + side * half + wrong
            seen.append(Silhouette(eye_m=np.array(eye), bearing_rad=bearing, sigma_rad=SIGMA, side=side))
    return seen


def test_four_silhouettes_and_the_distance_give_the_circle_exactly() -> None:
    found = touch_silhouettes(STEREO, silhouettes(), DISTANCE_M, 0.003)
    assert found is not None
    assert (found.circle.x_m, found.circle.z_m) == pytest.approx((0.3, 6.0), abs=1e-9)
    assert found.circle.radius_m == pytest.approx(0.2, abs=1e-9)
    assert np.sqrt(found.covariance[2, 2]) < 0.0007


def test_one_silhouette_that_is_another_things_edge_is_left_out() -> None:
    found = touch_silhouettes(STEREO, silhouettes(off_px=2.0), DISTANCE_M, 0.003)
    assert found is not None
    assert len(found.used) == 3
    assert found.circle.radius_m == pytest.approx(0.2, abs=1e-4)


def test_a_column_with_one_side_only_has_no_circle_by_silhouettes() -> None:
    right = [one for one in silhouettes() if one.side == 1]
    assert touch_silhouettes(STEREO, right, DISTANCE_M, 0.003) is None


def test_radius_sigma_holds_in_monte_carlo() -> None:
    rng = np.random.default_rng(5)
    pulls: list[float] = []
    for _ in range(200):
        moved = {side: SIGMA * rng.normal() for side in (-1, 1)}  # blur moves a side alike in both photos
        seen = [
            Silhouette(eye_m=s.eye_m, bearing_rad=s.bearing_rad + moved[s.side], sigma_rad=SIGMA, side=s.side)
            for s in silhouettes()
        ]
        found = touch_silhouettes(STEREO, seen, DISTANCE_M + 0.003 * rng.normal(), 0.003)
        assert found is not None
        pulls.append((found.circle.radius_m - 0.2) / float(np.sqrt(found.covariance[2, 2])))
    assert 0.8 < float(np.std(pulls)) < 1.2


def test_a_side_that_may_be_another_line_widens_the_radius_and_hides_no_silhouette_that_is_wrong() -> None:
    rng = np.random.default_rng(6)
    pulls: list[float] = []
    for _ in range(200):
        moved = {side: 5.0 * SIGMA * rng.normal() for side in (-1, 1)}  # the same line stands in both photos
        seen = [replace(s, bearing_rad=s.bearing_rad + moved[s.side], ambiguity_rad=5.0 * SIGMA) for s in silhouettes()]
        found = touch_silhouettes(STEREO, seen, DISTANCE_M, 0.003)
        assert found is not None
        pulls.append((found.circle.radius_m - 0.2) / float(np.sqrt(found.covariance[2, 2])))
    assert 0.8 < float(np.std(pulls)) < 1.2
    wrong = [replace(s, ambiguity_rad=5.0 * SIGMA) for s in silhouettes(off_px=2.0)]
    found = touch_silhouettes(STEREO, wrong, DISTANCE_M, 0.003)
    assert found is not None
    assert len(found.used) == 3


def fitted(monkeypatch: pytest.MonkeyPatch, seen: list[Silhouette], end: LateralEnd | None) -> RoundCircle:
    """Fit with these silhouettes, and with a mantle that ends as told off every circle."""
    monkeypatch.setattr(round_circle, "find_silhouettes", lambda *_: seen)
    monkeypatch.setattr(round_circle, "_distance", lambda *_: (DISTANCE_M, 0.003))
    monkeypatch.setattr(round_circle, "_lateral_ends", lambda *_: [end, end])
    return fit_circle(SimpleNamespace(), STEREO, np.ones((2, 2), bool))  # type: ignore[arg-type]


PLAIN = LateralEnd(offset_px=0.0, strength=0.8, outside=0.8, within=0.1)


def test_silhouettes_where_the_lateral_ends_prove_the_circle(monkeypatch: pytest.MonkeyPatch) -> None:
    found = fitted(monkeypatch, silhouettes(), PLAIN)
    assert found.proven
    assert found.circle.radius_m == pytest.approx(0.2, abs=1e-6)
    assert found.radius_sigma_m < 0.0007


@pytest.mark.parametrize(
    "end",
    [None, replace(PLAIN, offset_px=4.0), replace(PLAIN, outside=0.2, strength=0.3)],
    ids=["not in the right photo", "the mantle goes on", "the same on both sides"],
)
def test_silhouettes_that_the_mantle_does_not_end_on_are_doubted(
    monkeypatch: pytest.MonkeyPatch, end: LateralEnd | None
) -> None:
    found = fitted(monkeypatch, silhouettes(both=False), end)
    assert not found.proven
    assert found.circle.radius_m == pytest.approx(0.2, abs=1e-6)
    assert found.radius_sigma_m == pytest.approx(0.015, rel=0.01)


def test_without_silhouettes_the_stereo_circle_is_told_as_rough_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    found = fitted(monkeypatch, [], PLAIN)
    assert not found.proven
    assert found.circle.radius_m == STEREO.radius_m
    assert found.radius_sigma_m == pytest.approx(0.03 * 0.17 + 0.005)
