"""A thin round column in the plan drawing: what the matcher smears at its silhouettes doesn't make it flat faces."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry import round_piece
from asbuilt_bim.geometry.polyline import straight_pieces
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle, fit_round

F_PX, BASELINE_M, SIGMA_PX, PENALTY = 1050.0, 0.25, 0.12, 30.0
COLUMN = Circle(x_m=0.4, z_m=7.2, radius_m=0.17, f_px=F_PX, baseline_m=BASELINE_M)


def smeared_votes() -> tuple[np.ndarray, np.ndarray]:
    """Return x and disparity (N,) every 2 px, to 5 px beyond the silhouettes, each the mean of a window of 9 px."""
    fine = np.arange(20.0, 100.0, 0.25)
    d = disparity_of_circle(COLUMN, fine)
    seen = np.flatnonzero(np.isfinite(d))
    d = np.interp(fine, fine[seen], d[seen])
    x = np.arange(fine[seen[0]] - 5.0, fine[seen[-1]] + 5.0, 2.0)
    return x, np.array([d[np.abs(fine - at) <= 4.5].mean() for at in x])


def test_a_column_of_50_px_with_smeared_silhouettes_is_one_arc_of_its_radius() -> None:
    x, d = smeared_votes()
    sigma = np.full(len(x), SIGMA_PX)
    runs = straight_pieces(x, d, sigma, PENALTY)
    arc = fit_round(x, d, sigma, runs, PENALTY, F_PX, BASELINE_M)
    assert arc is not None
    assert arc.stop - arc.start == len(x)
    assert arc.circle.radius_m == pytest.approx(0.17, rel=0.15)


@pytest.mark.parametrize("width_px", [20.0, 40.0])
def test_two_faces_that_meet_in_a_corner_are_no_arc(width_px: float) -> None:
    x = np.arange(-width_px, width_px + 1.0, 2.0)
    d = 36.0 - 0.035 * np.abs(x)
    sigma = np.full(len(x), SIGMA_PX)
    runs = straight_pieces(x, d, sigma, PENALTY)
    assert fit_round(x, d, sigma, runs, PENALTY, F_PX, BASELINE_M) is None


def test_no_circle_is_fitted_where_straight_pieces_leave_nothing_to_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(round_piece, "_circle", lambda *_: pytest.fail("a circle was fitted"))
    x = np.arange(-60.0, 61.0, 2.0)
    d = 36.0 + 0.02 * x
    assert fit_round(x, d, np.full(len(x), SIGMA_PX), [(0, len(x))], PENALTY, F_PX, BASELINE_M) is None
