"""A face's border rarely runs along its samples' boxes: what they leave belongs to the nearest sample."""

from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.bim.border_boxes import border_boxes, grid_of, sample_areas
from asbuilt_bim.geometry import polygon

STEP = np.array([0.05, 0.05])
STRIPS = polygon.union([polygon.box(0.0, 0.0, 0.07, 1.0), polygon.box(0.28, 0.0, 0.35, 1.0)])


def test_two_strips_beside_a_contact_are_all_their_samples() -> None:
    grid = grid_of(STRIPS, STEP)
    samples = grid[polygon.contains(STRIPS, grid)]
    assert len(samples) == 40
    np.testing.assert_allclose(sample_areas(STRIPS, samples, STEP), 0.07 * 0.05)
    past, owner = border_boxes(STRIPS, samples, STEP)
    np.testing.assert_allclose(np.abs(samples[owner] - past), np.tile([0.05, 0.0], (40, 1)), atol=1e-9)


def test_a_plain_rectangle_has_no_border_boxes() -> None:
    wall = polygon.box(0.0, 0.0, 1.0, 1.0)
    grid = grid_of(wall, STEP)
    assert len(border_boxes(wall, grid, STEP)[0]) == 0
    np.testing.assert_allclose(sample_areas(wall, grid, STEP), 0.0025)


def test_a_slanted_border_is_shared_out_whole() -> None:
    gable = polygon.polygon([[[0.0, 0.0], [3.0, 0.0], [1.3, 2.0]]])
    grid = grid_of(gable, np.array([0.05, 0.05]))
    samples = grid[polygon.contains(gable, grid)]
    assert sample_areas(gable, samples, STEP).sum() == pytest.approx(3.0, rel=1e-9)
