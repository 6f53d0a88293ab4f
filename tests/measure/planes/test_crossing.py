from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.outline.edges import Line
from asbuilt_bim.measure.planes.crossing import apart, between, crossing_near, side_by_side

CAMERA = RectifiedCamera(
    f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960,
    rectified_from_left=frozen(np.eye(3)),
)  # fmt: skip
EDGE = Line(start=np.array([700.0, 300.0]), stop=np.array([700.0, 650.0]))


def corner(distance_m: float) -> tuple[FloatArray, FloatArray]:
    """q (2, 3) of two upright faces at a right angle, seen alike, whose edge the picture shows at x = 700."""
    ray = np.array([(700.0 - CAMERA.cx_px) / CAMERA.f_px, 0.0, 1.0])
    found = []
    for turn in (0.25 * np.pi, -0.25 * np.pi):
        n = np.array([np.sin(turn), 0.0, np.cos(turn)])
        found.append(n * CAMERA.f_px * CAMERA.baseline_m / distance_m / float(n @ ray))
    return found[0], found[1]


@pytest.mark.parametrize("distance_m", [4.0, 8.0])
def test_where_two_planes_cross_is_as_sure_as_monte_carlo_says(distance_m: float) -> None:
    """The same tenth of a pixel in disparity costs twice as much of the place at twice the distance."""
    one, two = corner(distance_m)
    rng = np.random.default_rng(1)
    covariance = np.diag([0.6**2, 0.02**2, 0.05**2])
    joint = side_by_side([covariance, covariance])
    found = crossing_near(EDGE, one - two, apart(joint, 0, 1), CAMERA, most_px=20.0)
    assert found is not None
    drawn = []
    for _ in range(500):
        noise = rng.multivariate_normal(np.zeros(6), joint)
        other = crossing_near(EDGE, one - two + noise[:3] - noise[3:], apart(joint, 0, 1), CAMERA, most_px=60.0)
        assert other is not None
        drawn.append(0.5 * float(other.line.start[0] + other.line.stop[0]))
    assert float(found.line.start[0]) == pytest.approx(700.0, abs=1e-6)
    assert np.std(drawn) == pytest.approx(found.sigma_px, rel=0.1)


def test_planes_that_err_together_place_their_edge_better_than_each_alone() -> None:
    one, two = corner(6.0)
    own = np.diag([0.6**2, 0.02**2, 0.05**2])
    alone = side_by_side([own, own])
    together = alone.copy()
    together[:3, 3:] = together[3:, :3] = 0.95 * own
    sigmas = []
    for joint in (alone, together):
        found = crossing_near(EDGE, one - two, apart(joint, 0, 1), CAMERA, most_px=20.0)
        assert found is not None
        sigmas.append(found.sigma_px)
    assert sigmas[1] == pytest.approx(np.sqrt(0.05) * sigmas[0], rel=1e-6)


def test_planes_that_are_one_or_cross_elsewhere_place_no_edge() -> None:
    one, two = corner(6.0)
    open_ = np.eye(3)
    assert crossing_near(EDGE, np.zeros(3), open_, CAMERA, most_px=20.0) is None
    aside = EDGE.moved(30.0, 30.0)
    assert crossing_near(aside, one - two, open_, CAMERA, most_px=20.0) is None


def test_an_edge_that_the_photos_show_outweighs_planes_that_hardly_know_where_they_cross() -> None:
    one, two = corner(8.0)
    covariance = np.diag([4.0, 1e-4, 1e-2])
    planes = crossing_near(EDGE, one - two, covariance, CAMERA, most_px=20.0)
    assert planes is not None and planes.sigma_px > 1.0
    placed = between(planes, planes.line.moved(1.5, 1.5), 0.4)
    assert 1.2 < float((placed.line.start - planes.line.start) @ planes.line.normal) < 1.5
    assert placed.sigma_px < 0.4
    contradicted = between(planes, planes.line.moved(9.0, 9.0), 0.4)
    assert contradicted.sigma_px > 2.0 * placed.sigma_px


def test_planes_that_know_where_they_cross_hold_an_edge_that_might_be_another_line() -> None:
    one, two = corner(8.0)
    planes = crossing_near(EDGE, one - two, np.diag([1e-4, 1e-8, 1e-6]), CAMERA, most_px=20.0)
    assert planes is not None and planes.sigma_px < 0.4
    placed = between(planes, planes.line.moved(2.0, 2.0), 2.0)
    assert float((placed.line.start - planes.line.start) @ planes.line.normal) < 0.1
