"""Floors as the photos show them, whatever dense depth says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.measure.planes.face_hypotheses import floor_sights
from asbuilt_bim.measure.planes.refine import pictures
from tests.measure.outline.test_precision import grainy_pair

INSIDE = np.zeros((96, 160), dtype=bool)
INSIDE[8:88, 40:150] = True
TRUE_PX = 20.3


def bench(off_px: float, contrast: float = 1.0) -> Any:
    """Return what floors are found with: a surface with grain, whose dense depth is off by some disparity."""
    left, right, rays = grainy_pair(4, 1.0, TRUE_PX)
    left, right = (140.0 + contrast * (photo - 140.0) for photo in (left, right))
    q = np.array([0.0, 0.0, TRUE_PX + off_px])
    level = SimpleNamespace(
        rays=rays, measured=INSIDE, disparity_px=np.full(INSIDE.shape, q[2]), sigma_px=np.full(INSIDE.shape, 0.3)
    )
    scene = SimpleNamespace(pieces=(), floors=(SimpleNamespace(q_px=q),), mask=lambda label: INSIDE, level=level)
    return SimpleNamespace(
        scene=scene, marks=np.zeros_like(INSIDE), both=pictures(left, right, np.ones(INSIDE.shape, dtype=bool))
    )


@pytest.mark.parametrize("off_px", [-0.3, -0.07, 0.2])
def test_a_floor_lies_where_the_photos_show_it_and_not_where_dense_depth_puts_it(off_px: float) -> None:
    (found,) = floor_sights(bench(off_px))
    ray = np.array([0.0, 0.0, 1.0])
    sigma = float(np.sqrt(ray @ found.covariance @ ray))
    assert abs(float(found.q_px @ ray) - TRUE_PX) < 4.0 * sigma and 0.0 < sigma < 0.05


def test_a_floor_that_the_photos_dont_hold_stays_as_measured_and_is_less_sure() -> None:
    (found,), (held,) = floor_sights(bench(0.2, contrast=0.0)), floor_sights(bench(0.2))
    assert found.q_px[2] == pytest.approx(TRUE_PX + 0.2, abs=0.01)
    assert found.covariance[2, 2] > 4.0 * held.covariance[2, 2]
