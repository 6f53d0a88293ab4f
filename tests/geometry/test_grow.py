from __future__ import annotations

import numpy as np
import pytest

from asbuilt_bim.geometry.disparity_plane import fit_q, plane_of
from asbuilt_bim.geometry.grow import GrowOptions, grow_pieces, upright_pixels
from asbuilt_bim.geometry.level import LevelledMap, grow_floors, level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.plane import Plane
from asbuilt_bim.geometry.polyline import fit_circle, fit_line, straight_pieces
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle

F, B, W, H = 500.0, 0.25, 640, 480
UP = np.array([0.03, -0.995, -0.09])


def level_map_of(disparity: np.ndarray) -> LevelledMap:
    rays = pixel_rays(W, H, F, 318.0, 241.0)
    return levelled_map(disparity, np.full((H, W), 0.1), level_view(UP, F), rays, B)


def column_map(noise: float = 0.05) -> tuple[LevelledMap, np.ndarray, np.ndarray]:
    """Two sides of a corner-on column before a floor 1.5 m below the camera; elsewhere nothing was measured."""
    view = level_view(UP, F)
    rays = pixel_rays(W, H, F, 318.0, 241.0)
    x, y, forward = view.coordinates(rays)
    left, right = 0.12 * x + 34.0, -0.05 * x + 25.5
    column = np.where((x > -80) & (x < 30) & (np.abs(y) < 150), np.minimum(left, right), np.nan)
    floor = np.where(y > 20, y * B / 1.5, np.nan)
    d = np.where(np.isfinite(column), column, floor) * forward
    d = d + np.random.default_rng(3).normal(0.0, noise, d.shape)
    return level_map_of(d), view.q_upright(0.12, 34.0), view.q_upright(-0.05, 25.5)


def test_a_plane_and_its_disparities_are_the_same_thing() -> None:
    plane = Plane(normal=np.array([0.6, 0.0, -0.8]), offset_m=-3.2)
    q = plane.normal * (F * B / plane.offset_m)
    back = plane_of(q, F * B)
    point = np.array([0.2, 0.5, 0.0])
    point[2] = (plane.offset_m - point @ plane.normal) / plane.normal[2]
    ray = point / point[2]
    assert F * B / point[2] == pytest.approx(float(q @ ray), rel=1e-12)
    assert back.normal == pytest.approx(plane.normal)
    assert back.offset_m == pytest.approx(plane.offset_m)


def test_a_robust_fit_ignores_a_fifth_of_outliers() -> None:
    rng = np.random.default_rng(1)
    rays = np.concatenate([rng.uniform(-0.3, 0.3, (4000, 2)), np.ones((4000, 1))], axis=1)
    q = np.array([12.0, -5.0, 40.0])
    d = rays @ q + rng.normal(0.0, 0.1, 4000)
    d[:800] += 6.0
    found, covariance = fit_q(rays, d, np.full(4000, 0.1))
    assert found == pytest.approx(q, abs=0.08)
    assert np.sqrt(np.diag(covariance)).max() < 0.05


def test_a_fit_of_two_points_is_refused() -> None:
    with pytest.raises(ValueError, match="3 points, not 2"):
        fit_q(np.ones((2, 3)), np.ones(2), np.ones(2))


def test_in_the_levelled_view_an_upright_plane_depends_on_x_only() -> None:
    view = level_view(UP, F)
    rays = pixel_rays(W, H, F, 318.0, 241.0)
    x, _, forward = view.coordinates(rays)
    q = view.q_upright(0.1, 30.0)
    assert np.abs((rays @ q) / forward - (0.1 * x + 30.0)).max() < 1e-9
    assert abs(q @ view.down) < 1e-12


def test_both_sides_of_a_column_are_grown_and_meet_in_a_convex_edge() -> None:
    level, q_left, q_right = column_map()
    upright, _ = upright_pixels(level)
    pieces = grow_pieces(level, upright, GrowOptions())
    assert len(pieces) == 2
    for piece, q in zip(pieces, (q_left, q_right), strict=True):
        assert level.view.q_upright(piece.slope, piece.offset_px) == pytest.approx(q, abs=0.25)
    assert pieces[0].convex_next


def test_the_floor_is_no_upright_piece_but_a_floor_at_its_height() -> None:
    level, _, _ = column_map()
    _, slope = upright_pixels(level)
    floors = grow_floors(level, slope)
    assert len(floors) == 1
    assert floors[0].below_m == pytest.approx(1.5, abs=0.03)
    normal = floors[0].q_px / np.linalg.norm(floors[0].q_px)
    assert abs(normal @ level.view.down) > np.cos(np.radians(0.3))


def test_two_floors_a_slab_thickness_apart_are_told_apart() -> None:
    view = level_view(UP, F)
    rays = pixel_rays(W, H, F, 318.0, 241.0)
    x, y, forward = view.coordinates(rays)
    d = np.where(y > 20, y * B / np.where(x < 0, 1.5, 1.35), np.nan) * forward
    level = level_map_of(d)
    _, slope = upright_pixels(level)
    heights = sorted(floor.below_m for floor in grow_floors(level, slope))
    assert heights == pytest.approx([1.35, 1.5], abs=0.03)


def test_a_round_column_is_grown_as_a_circle() -> None:
    view = level_view(UP, F)
    rays = pixel_rays(W, H, F, 318.0, 241.0)
    x, y, forward = view.coordinates(rays)
    true = Circle(x_m=0.2, z_m=4.0, radius_m=0.25, f_px=F, baseline_m=B)
    d = np.where(np.abs(y) < 150, disparity_of_circle(true, x), np.nan) * forward
    level = level_map_of(d + np.random.default_rng(4).normal(0.0, 0.05, d.shape))
    upright, _ = upright_pixels(level)
    pieces = grow_pieces(level, upright, GrowOptions())
    circles = [piece.circle for piece in pieces if piece.circle is not None]
    assert len(circles) == 1
    assert circles[0].radius_m == pytest.approx(0.25, rel=0.08)
    assert (circles[0].x_m, circles[0].z_m) == pytest.approx((0.2, 4.0), abs=0.03)


def test_nothing_grows_where_nothing_was_measured() -> None:
    level = level_map_of(np.full((H, W), np.nan))
    upright, slope = upright_pixels(level)
    assert grow_pieces(level, upright, GrowOptions()) == []
    assert grow_floors(level, slope) == []


def test_a_bent_chain_is_cut_at_its_corner_and_a_straight_one_is_not() -> None:
    x = np.arange(60.0)
    noise = np.random.default_rng(5).normal(0.0, 0.05, 60)
    bent = np.where(x < 25, 0.2 * x, 5.0 - 0.1 * (x - 25)) + noise
    pieces = straight_pieces(x, bent, np.full(60, 0.05), 30.0)
    assert len(pieces) == 2
    assert abs(pieces[0][1] - 25) <= 1
    assert straight_pieces(x, 0.2 * x + noise, np.full(60, 0.05), 30.0) == [(0, 60)]


def test_a_line_fit_leaves_outliers_out() -> None:
    x = np.arange(50.0)
    y = 0.3 * x - 2.0
    y[::10] += 5.0
    slope, offset = fit_line(x, y, np.full(50, 0.05))
    assert (slope, offset) == pytest.approx((0.3, -2.0), abs=0.02)


def test_three_exact_points_give_their_circle() -> None:
    angle = np.array([0.1, 1.0, 2.2])
    found = fit_circle(2.0 + 0.5 * np.cos(angle), 7.0 + 0.5 * np.sin(angle), np.ones(3))
    assert found == pytest.approx((2.0, 7.0, 0.5), abs=1e-9)


def facade(disparity_px: float) -> LevelledMap:
    """Return a facade that fills the upper half of the photo at a disparity; nothing else was measured."""
    view = level_view(UP, F)
    _, y, forward = view.coordinates(pixel_rays(W, H, F, 318.0, 241.0))
    d = np.where((y < 0) & (y > -200), disparity_px, np.nan) * forward
    return level_map_of(d + np.random.default_rng(5).normal(0.0, 0.03, d.shape))


def test_the_least_disparity_is_where_twice_its_sigma_is_a_fifth_of_it() -> None:
    options = GrowOptions()
    least = options.least_disparity_px
    sigma_px = np.hypot(options.mode_sigma_px, options.rig_sigma_px)
    near, far = ((F * B / (least + step)) ** 2 for step in (-0.5 * sigma_px, 0.5 * sigma_px))
    middle = (F * B / least) ** 2
    assert (near - far) / middle == pytest.approx(options.most_sigma_share, rel=0.02)  # of an area, by a sigma of depth
    assert options.reach_m(F, B) == pytest.approx(F * B / least)
    assert options.reach_m(2.0 * F, 3.0 * B) == pytest.approx(6.0 * options.reach_m(F, B))


@pytest.mark.parametrize("disparity_px", [4.5, 2.5])
def test_a_facade_that_a_narrow_rig_sees_at_few_pixels_of_disparity_is_grown(disparity_px: float) -> None:
    level = facade(disparity_px)
    upright, _ = upright_pixels(level)
    pieces = grow_pieces(level, upright, GrowOptions())
    widest = max(pieces, key=lambda piece: piece.x1_px - piece.x0_px)
    assert widest.x1_px - widest.x0_px > 500.0
    assert widest.offset_px == pytest.approx(disparity_px, abs=0.1)


def test_a_facade_beyond_the_reach_is_not_grown() -> None:
    level = facade(1.5)
    assert grow_pieces(level, upright_pixels(level)[0], GrowOptions()) == []
