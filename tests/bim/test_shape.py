"""An element's axes: length first, along the placement where that fits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.bim.shape import axes
from tests.bim.test_mesh import box


def _turned(mesh: Mesh, angle_rad: float, shift: tuple[float, float, float]) -> Mesh:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return Mesh(vertices_m=mesh.vertices_m @ turn.T + shift, triangles=mesh.triangles)


@given(st.floats(-3.0, 3.0), st.floats(0.1, 9.0), st.floats(0.1, 9.0), st.floats(-1e5, 1e5))
def test_a_turned_box_gets_its_own_sides_back(angle: float, x: float, y: float, far: float) -> None:
    mesh = _turned(box((x, y, 2.5)), angle, (far, -far, 3.0))
    axis_from_world, extents = axes(mesh)
    assert extents == pytest.approx([max(x, y), min(x, y), 2.5], abs=1e-5)
    own = mesh.vertices_m @ axis_from_world[:3, :3].T + axis_from_world[:3, 3]
    np.testing.assert_allclose(own.min(axis=0), [0.0, -min(x, y) / 2.0, 0.0], atol=1e-5)
    assert np.linalg.det(axis_from_world[:3, :3]) == pytest.approx(1.0)


def test_the_placement_axis_decides_the_direction_of_a_wall() -> None:
    mesh = _turned(box((4.0, 0.2, 3.0)), 0.5, (0.0, 0.0, 0.0))
    back = axes(mesh, -np.array([np.cos(0.5), np.sin(0.5)]))[0]
    np.testing.assert_allclose(back[0, :2], [-np.cos(0.5), -np.sin(0.5)], atol=1e-9)


def test_a_placement_that_runs_across_the_wall_is_not_followed() -> None:
    mesh = _turned(box((4.0, 0.2, 3.0)), 0.5, (0.0, 0.0, 0.0))
    assert axes(mesh, np.array([1.0, 0.0]))[1] == pytest.approx([4.0, 0.2, 3.0], abs=1e-9)
