"""The unrolled lateral surface of a round column against closed forms."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.transform import rigid

COLUMN = CylinderFrame(
    origin_m=frozen([2.0, 5.0, 0.5]), axis=frozen([0.0, 0.0, 1.0]), zero=frozen([1.0, 0.0, 0.0]), radius_m=0.25
)


def test_a_quarter_turn_counter_clockwise_from_above_is_a_quarter_of_the_circumference() -> None:
    assert np.allclose(COLUMN.to_uv([2.0, 5.25, 1.5]), [np.pi / 2 * 0.25, 1.0])


@given(angle=st.floats(-3.1, 3.1), height=st.floats(-4.0, 4.0))
def test_lateral_surface_coordinates_come_back(angle: float, height: float) -> None:
    uv = [[0.25 * angle, height]]
    assert np.allclose(COLUMN.to_uv(COLUMN.from_uv(uv)), uv, atol=1e-9)
    assert np.allclose(COLUMN.distance_m(COLUMN.from_uv(uv, height_m=0.03)), 0.03)


def test_a_ray_meets_the_near_side_of_a_column_and_misses_beside_it() -> None:
    met = COLUMN.intersect([2.0, 0.0, 1.0], [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    assert np.allclose(met[0], [2.0, 4.75, 1.0])
    assert np.isnan(met[1]).all()


def test_u_and_v_turn_outwards_everywhere() -> None:
    uv = np.array([[0.0, 0.0], [0.3, 1.0], [-0.6, 2.0]])
    step = 1e-6
    du = (COLUMN.from_uv(uv + np.array([step, 0.0])) - COLUMN.from_uv(uv)) / step
    dv = (COLUMN.from_uv(uv + np.array([0.0, step])) - COLUMN.from_uv(uv)) / step
    assert np.allclose(np.cross(du, dv), COLUMN.outward(uv), atol=1e-5)


def test_a_moved_column_keeps_its_lateral_surface_coordinates() -> None:
    b_from_a = rigid([0.2, -0.4, 1.0], [10.0, -3.0, 0.2])
    points = COLUMN.from_uv([[0.1, 0.7]])
    moved = COLUMN.moved(b_from_a)
    assert np.allclose(moved.to_uv(points @ b_from_a[:3, :3].T + b_from_a[:3, 3]), [[0.1, 0.7]])
