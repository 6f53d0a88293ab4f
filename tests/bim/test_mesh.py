"""Meshes: inside-out ones are turned, sections and volumes are exact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.bim.mesh import (
    Mesh,
    crossings,
    inside,
    is_closed,
    merged,
    pieces,
    section,
    signed_volume,
    turned_outwards,
    welded,
)
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import area, enclosed, region_from

_QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    x, y, z = size
    corners = [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0), (0, 0, z), (x, 0, z), (x, y, z), (0, y, z)]
    triangles = [t for a, b, c, d in _QUADS for t in ((a, b, c), (a, c, d))]
    return Mesh(vertices_m=np.array(corners, dtype=float) + at, triangles=np.array(triangles, dtype=np.int32))


@given(st.tuples(*[st.floats(0.05, 20.0)] * 3), st.tuples(*[st.floats(-1e5, 1e5)] * 3))
def test_the_volume_of_a_box_does_not_depend_on_where_it_stands(
    size: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    assert signed_volume(box(size, at)) == pytest.approx(float(np.prod(size)), rel=1e-6)


def test_an_inside_out_box_is_turned() -> None:
    mesh = box((1.0, 2.0, 3.0))
    wrong = Mesh(vertices_m=mesh.vertices_m, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
    assert signed_volume(wrong) == pytest.approx(-6.0)
    assert signed_volume(turned_outwards(wrong)) == pytest.approx(6.0)


def test_a_box_with_its_triangles_turned_at_random_is_mended() -> None:
    mesh = box((1.0, 2.0, 3.0))
    triangles = mesh.triangles.copy()
    triangles[::3] = triangles[::3, ::-1]
    mixed = Mesh(vertices_m=mesh.vertices_m, triangles=triangles)
    assert not is_closed(mixed)
    assert signed_volume(turned_outwards(mixed)) == pytest.approx(6.0)


def test_welding_joins_what_a_kernel_gives_twice_and_two_boxes_stay_two_pieces() -> None:
    mesh = merged((box((1.0, 1.0, 1.0)), box((1.0, 1.0, 1.0), (5.0, 0.0, 0.0))))
    soup = Mesh(
        vertices_m=mesh.corners_m.reshape(-1, 3),
        triangles=np.arange(3 * len(mesh.triangles), dtype=np.int32).reshape(-1, 3),
    )
    whole = welded(soup)
    assert len(whole.vertices_m) == 16
    assert len(pieces(whole)) == 2
    assert all(is_closed(piece) for piece in pieces(whole))


def test_a_section_has_the_area_of_the_cut_and_misses_above() -> None:
    mesh = box((2.0, 3.0, 1.0))
    frame = PlaneFrame(origin_m=frozen([0, 0, 0]), u=frozen([1, 0, 0]), v=frozen([0, 1, 0]))
    assert area(region_from(enclosed(section(mesh, frame, 0.5)))) == pytest.approx(6.0)
    assert len(section(mesh, frame, 1.5)) == 0


def test_inside_is_told_for_points_all_over() -> None:
    points = np.random.default_rng(3).uniform(-1.0, 3.0, (2000, 3))
    truth = ((points > 0.0) & (points < [1.0, 2.0, 1.5])).all(axis=1)
    assert (inside(box((1.0, 2.0, 1.5)), points) == truth).all()


def test_a_ray_tells_how_far_the_first_wall_is() -> None:
    count, far = crossings(box((1.0, 1.0, 1.0)), [[0.3, 0.4, 5.0], [9.0, 0.4, 5.0]], [0.0, 0.0, -1.0])
    assert count.tolist() == [2, 0]
    assert far[0] == pytest.approx(4.0) and np.isinf(far[1])
