"""Green's theorem and set operations against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asbuilt_bim.geometry import polygon


@given(radius=st.floats(0.05, 5.0), x=st.floats(-1e3, 1e3), y=st.floats(-1e3, 1e3), count=st.integers(3, 200))
def test_greens_theorem_gives_the_area_of_a_regular_polygon_anywhere(
    radius: float, x: float, y: float, count: int
) -> None:
    angle = np.arange(count) * 2 * np.pi / count
    ring = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1)
    exact = 0.5 * count * radius**2 * np.sin(2 * np.pi / count)
    assert polygon.ring_area(ring) == pytest.approx(exact, rel=1e-9)
    assert polygon.ring_area(ring[::-1]) == pytest.approx(-exact, rel=1e-9)


def test_the_papers_wall_has_its_printed_area() -> None:
    front = [[0, 0], [0.8, 0], [0.8, 1.3], [1.0, 1.3], [1.0, 3.0], [0, 3.0]]
    assert polygon.ring_area(front) == pytest.approx(0.8 * 1.3 + 1.0 * 1.7)


def test_an_opening_is_not_concrete() -> None:
    wall = polygon.difference(polygon.box(0, 0, 4, 3), polygon.box(1, 0.9, 2, 2.1))
    assert polygon.area(wall) == pytest.approx(12.0 - 1.2)
    assert not polygon.contains(wall, [1.5, 1.5])
    assert polygon.contains(wall, [0.5, 1.5])


def test_overlapping_outlines_are_united_and_never_summed() -> None:
    both = polygon.union([polygon.box(0, 0, 2, 1), polygon.box(1, 0, 3, 1)])
    assert polygon.area(both) == pytest.approx(3.0)


def test_touching_outlines_have_no_common_area() -> None:
    assert polygon.intersection(polygon.box(0, 0, 1, 1), polygon.box(1, 0, 2, 1)) == polygon.EMPTY


def test_segments_in_any_order_enclose_a_region_with_its_hole() -> None:
    def edges(points: list[list[float]]) -> list[list[list[float]]]:
        return [[points[i], points[(i + 1) % len(points)]] for i in range(len(points))]

    outer = edges([[0, 0], [2, 0], [2, 1], [0, 1]])
    hole = edges([[0.5, 0.2], [0.8, 0.2], [0.8, 0.6], [0.5, 0.6]])
    mixed = np.array(outer + hole)[[3, 6, 0, 7, 2, 5, 1, 4]]
    assert polygon.area(polygon.region_from(polygon.enclosed(mixed))) == pytest.approx(2.0 - 0.12)


def test_a_ring_that_crosses_itself_is_mended_and_not_negative() -> None:
    assert polygon.area(polygon.polygon([[[0, 0], [1, 1], [1, 0], [0, 1]]])) == pytest.approx(0.5)


def test_grown_corners_stay_square() -> None:
    assert polygon.area(polygon.grown(polygon.box(0, 0, 1, 1), 0.1)) == pytest.approx(1.44)


def test_two_triangles_on_one_side_are_the_quadrangle_that_shapely_makes_of_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng, quick = np.random.default_rng(5), 0
    for _ in range(200):
        start, along = rng.uniform(-1.0, 1.0, (2, 2))
        across = np.array([-along[1], along[0]])
        apexes = [start + rng.uniform(-0.5, 1.5) * along + side * rng.uniform(0.2, 1.0) * across for side in (-1, 1)]
        corners = [rng.permutation([start, start + along, apex]) for apex in apexes]
        pair = np.stack(corners)
        found = polygon.triangles_region(pair)
        quick += polygon._two_joined(pair) is not None
        with monkeypatch.context() as patched:
            patched.setattr(polygon, "_two_joined", lambda triangles: None)
            slow = polygon.triangles_region(pair)
        assert [ring.tobytes() for rings in found for ring in rings] == [r.tobytes() for rings in slow for r in rings]
    assert quick > 100


def test_two_triangles_that_overlap_or_meet_in_a_point_alone_are_no_quadrangle() -> None:
    shared = [(1.0, 0.0), (0.0, 1.0)]
    for second in ([*shared, (0.1, 0.1)], [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0)], [*shared, (0.5, 0.5)]):
        assert polygon._two_joined(np.array([[shared[0], (0.0, 0.0), shared[1]], second])) is None


def test_a_hull_far_from_the_origin_keeps_its_corners_and_a_point_counts_as_in_it_up_to_a_margin() -> None:
    far = np.array([2_500_000.0, 5_400_000.0])
    points = far + np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0], [2.0, 1.0]])
    hull = polygon.hull_of(points)
    assert len(hull) == 4 and np.allclose(np.sort(hull, axis=0), np.sort(points[:4], axis=0), atol=1e-3)
    inside, near, away = (far + np.array(at) for at in ([2.0, 1.5], [4.4, 1.5], [4.6, 1.5]))
    assert polygon.within_margin(hull, inside, 0.0) and polygon.within_margin(hull, near, 0.5)
    assert not polygon.within_margin(hull, away, 0.5)
