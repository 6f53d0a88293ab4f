"""Planes and their frames against closed forms."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import Plane, frame_on_plane
from asbuilt_bim.geometry.transform import apply, inverse, rigid, unit

number = st.floats(-5.0, 5.0, allow_nan=False)
vector = st.tuples(number, number, number)


@given(turn=vector, shift=vector, point=vector)
def test_a_transform_and_its_inverse_bring_a_point_back(
    turn: tuple[float, ...], shift: tuple[float, ...], point: tuple[float, ...]
) -> None:
    b_from_a = rigid(turn, shift)
    assert np.allclose(apply(inverse(b_from_a), apply(b_from_a, point)), point, atol=1e-9)


@given(turn=vector, shift=vector, point=vector)
def test_the_distance_from_a_plane_does_not_depend_on_the_frame(
    turn: tuple[float, ...], shift: tuple[float, ...], point: tuple[float, ...]
) -> None:
    plane = Plane(normal=frozen(unit([1.0, 2.0, -0.5])), offset_m=0.7)
    b_from_a = rigid(turn, shift)
    moved = plane.moved(b_from_a)
    assert np.isclose(moved.distance_m(apply(b_from_a, point)), plane.distance_m(point), atol=1e-9)


def test_a_frame_on_a_wall_stands_upright_and_its_normal_points_out() -> None:
    plane = Plane(normal=frozen([0.0, -1.0, 0.0]), offset_m=2.0)
    frame = frame_on_plane(plane, [3.0, 5.0, 1.0], up=[0.1, 0.0, 1.0])
    assert np.allclose(frame.normal, plane.normal)
    assert np.allclose(frame.origin_m, [3.0, -2.0, 1.0])
    assert frame.v[2] > 0.9
    assert np.allclose(frame.to_uv(frame.from_uv([[0.4, -1.2]])), [[0.4, -1.2]])


def test_a_frame_on_a_level_plane_is_still_a_frame() -> None:
    plane = Plane(normal=frozen([0.0, 0.0, 1.0]), offset_m=0.0)
    frame = frame_on_plane(plane, [0.0, 0.0, 0.0], up=[0.0, 0.0, 1.0])
    assert np.allclose(frame.normal, [0.0, 0.0, 1.0])


def test_a_ray_along_a_plane_meets_it_nowhere() -> None:
    plane = Plane(normal=frozen([0.0, 0.0, 1.0]), offset_m=4.0)
    met = plane.intersect([0.0, 0.0, 0.0], [[0.5, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert np.allclose(met[0], [2.0, 0.0, 4.0])
    assert np.isnan(met[1]).all()
