from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from asbuilt_bim.vision.target.circle import SpaceCircle, fit_circle, guessed_circles, mirrored, outlines_of
from tests.vision.flat_scene import CAMERA

AT_A_CORNER = SpaceCircle(
    centre_px=np.array([1000.0, 200.0]),
    disparity_px=40.0,
    radius_m=0.15,
    normal=np.array([0.36, 0.1, -0.92]) / np.sqrt(0.986),
    covariance=np.eye(4),
    rms_px=0.0,
)


def test_both_circles_guessed_from_an_ellipse_are_seen_as_that_ellipse_far_off_the_axis_too() -> None:
    ellipse, _ = outlines_of(AT_A_CORNER, CAMERA)
    assert ellipse is not None
    normals = []
    for circle in guessed_circles(ellipse, 40.0, 0.15, CAMERA):
        seen, _ = outlines_of(circle, CAMERA)
        assert seen is not None and seen.minor_px / seen.major_px == pytest.approx(
            ellipse.minor_px / ellipse.major_px, rel=0.03
        )
        normals.append(circle.normal)
    assert min(np.abs(normal - AT_A_CORNER.normal).max() for normal in normals) < 0.02
    assert np.abs(normals[0] - normals[1]).max() > 0.3


def test_a_circle_that_leans_the_other_way_looks_alike_in_one_photo_and_not_in_the_other() -> None:
    other = mirrored(AT_A_CORNER, CAMERA)
    (left, right), (left_of_other, right_of_other) = outlines_of(AT_A_CORNER, CAMERA), outlines_of(other, CAMERA)
    assert left and right and left_of_other and right_of_other
    assert left.minor_px == pytest.approx(left_of_other.minor_px, rel=0.03)
    assert abs(right.minor_px / right_of_other.minor_px - 1.0) > 0.02
    assert np.abs(mirrored(other, CAMERA).normal - AT_A_CORNER.normal).max() < 1e-9


def test_a_fit_that_starts_leaning_the_wrong_way_ends_leaning_the_right_way() -> None:
    left, right = outlines_of(AT_A_CORNER, CAMERA)
    assert left is not None and right is not None
    edges = left.outline(90)[0], right.outline(90)[0]
    found = fit_circle(*edges, left, right, CAMERA, start=mirrored(AT_A_CORNER, CAMERA))
    assert found is not None and np.abs(found.normal - AT_A_CORNER.normal).max() < 1e-3
    assert found.disparity_px == pytest.approx(AT_A_CORNER.disparity_px, abs=1e-3)


def test_points_of_no_outline_end_a_fit_and_not_the_program() -> None:
    left, right = outlines_of(AT_A_CORNER, CAMERA)
    assert left is not None and right is not None
    edges = [np.linspace([900.0, 100.0], [1100.0, 300.0 + 40.0 * side], 40) for side in (0, 1)]
    found = fit_circle(*edges, left, right, CAMERA, start=AT_A_CORNER)
    assert found is None or abs(np.log(found.radius_m / AT_A_CORNER.radius_m)) < 4.5


def test_a_circle_far_aside_is_recovered_where_its_plane_holds_the_optical_axis() -> None:
    aside = replace(AT_A_CORNER, centre_px=np.array([1230.0, 450.0]), normal=np.array([-0.94, 0.34, 0.02]))
    left, right = outlines_of(aside, CAMERA)
    assert left is not None and right is not None and left.minor_px > 0.4 * left.major_px
    found = fit_circle(left.outline(90)[0][:60], right.outline(90)[0][:60], left, right, CAMERA, held_m=0.15)
    assert found is not None and found.disparity_px == pytest.approx(aside.disparity_px, abs=0.01)
    assert np.abs(found.normal - aside.normal / np.linalg.norm(aside.normal)).max() < 1e-2


def test_a_circle_seen_edge_on_still_faces_the_camera_when_mirrored() -> None:
    turned = replace(AT_A_CORNER, normal=np.array([-0.99, 0.0, -0.14]))
    assert mirrored(turned, CAMERA).normal[2] < 0.0
