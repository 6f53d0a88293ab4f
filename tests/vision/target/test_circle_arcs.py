from __future__ import annotations

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.target.circle import SpaceCircle, fit_circle, outlines_of
from asbuilt_bim.vision.target.circle_arcs import without_foreign_arc
from tests.vision.flat_scene import CAMERA

NORMAL = np.array([-0.3, 0.4, -1.0])
CIRCLE = SpaceCircle(
    centre_px=np.array([600.0, 500.0]), disparity_px=40.0, radius_m=0.15, normal=NORMAL / np.linalg.norm(NORMAL),
    covariance=np.eye(4), rms_px=0.1,
)  # fmt: skip


def _outlines(inward_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the outlines of `CIRCLE` in both photos, points moved inwards by so much."""
    outlines = [guide.outline(120) for guide in outlines_of(CIRCLE, CAMERA) if guide is not None]
    left, right = (points - inward_px[:, None] * outward for points, outward in outlines)
    return left, right


def test_a_covers_edge_along_a_fifth_of_the_outline_does_not_move_the_circle() -> None:
    along = np.arange(120) - 70.0
    chord = np.where(np.abs(along) < 13, 1.6 - 1.0 * (along / 13) ** 2, 0.0)
    left, right = outlines_of(CIRCLE, CAMERA)
    assert left is not None and right is not None
    found = fit_circle(*_outlines(chord), left, right, CAMERA)
    assert found is not None and found.rms_px < 0.02
    assert abs(found.disparity_px - 40.0) < 0.03 and np.abs(found.centre_px - CIRCLE.centre_px).max() < 0.05


def test_an_even_misfit_leaves_no_arc_out_and_one_arc_that_stands_out_goes() -> None:
    arcs = np.repeat(np.arange(12), 10)
    even = np.resize([0.1, -0.1], 120)
    jacobian = np.ones((120, 1))
    assert without_foreign_arc(jacobian, even, arcs).all()
    odd = np.where((arcs == 3) | (arcs == 4), 5.0 * even, even)
    assert (without_foreign_arc(jacobian, odd, arcs) == ~np.isin(arcs, (3, 4))).all()


def test_a_second_arc_is_left_out_by_what_was_still_kept_and_not_by_what_went_before() -> None:
    along = np.arange(120)
    seen, wave = along < 84, 0.4 * np.sin(along / 84.0 * 4.0 * np.pi + 1.6)
    left, right = outlines_of(CIRCLE, CAMERA)
    assert left is not None and right is not None
    points = [outline[seen] for outline in _outlines(wave)]
    found = fit_circle(*points, left, right, CAMERA, held_m=0.15)
    assert found is not None
    guide = outlines_of(found, CAMERA)[0]
    assert guide is not None and np.mean(np.abs(guide.distance_px(points[0])) < 0.7) > 0.8
