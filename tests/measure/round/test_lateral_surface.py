"""Where a round column's surface ends: joints on it and edges of the background don't pass for its silhouette."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.level import level_view
from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure.outline.edges import gradients
from asbuilt_bim.measure.round.lateral_surface import LateralEnd, lateral_end
from asbuilt_bim.measure.round.silhouettes import chord_plane, expected_side
from asbuilt_bim.vision.stereo.matching import grey
from tests.measure.box_world import Quad, Round, World, make_camera, photograph

COLUMN = Circle(x_m=0.15, z_m=5.0, radius_m=0.2, f_px=900.0, baseline_m=0.25)
TOP_M, FOOT_M = -0.4, 0.5


def upright(x_m: float, z_m: float, along: tuple[float, float], grey: float, seed: int) -> Quad:
    """Return an upright quad from (x, z), as wide as `along` (x, z) says."""
    u = np.array([along[0], 0.0, along[1]])
    v = np.array([0.0, 2.0, 0.0])
    return Quad(name="", corner=np.array([x_m, -1.0, z_m]), u=u, v=v, grey=grey, seed=seed)


def joint(inside_px: float) -> Quad:
    """Return a dark strip on the lateral surface that the left photo shows `inside_px` within the right silhouette."""
    reach = COLUMN.radius_m - inside_px * COLUMN.z_m / COLUMN.f_px
    out = np.array([reach, -np.sqrt(COLUMN.radius_m**2 - reach**2)]) / COLUMN.radius_m
    x_m, z_m = np.array([COLUMN.x_m, COLUMN.z_m]) + 1.003 * COLUMN.radius_m * out
    return upright(x_m, z_m, (-0.012 * out[1], 0.012 * out[0]), 60.0, 5)


def bench(*quads: Quad, wall_m: float | None = 9.0) -> SimpleNamespace:
    """Photograph the column before a wall (or even sky) and lay both photos out."""
    world = World(quads=list(quads))
    world.rounds.append(Round(name="", x=COLUMN.x_m, z=COLUMN.z_m, radius=0.2, top=-2.0, bottom=2.0, seed=44))
    if wall_m is not None:
        world.quads.append(upright(-4.0, wall_m, (8.0, 0.0), 120.0, 9))
    pair, _ = photograph(world, make_camera(320, 200, COLUMN.f_px), supersample=2)
    return on_bench(pair)


def on_bench(pair: RectifiedPair) -> SimpleNamespace:
    left, right = grey(pair.left), grey(pair.right)
    return SimpleNamespace(
        pair=pair, grey_levels=(left, right), slopes=gradients(left, right, pair.valid_right),
        scene=SimpleNamespace(level=SimpleNamespace(view=level_view((0.0, -1.0, 0.0), COLUMN.f_px))),
    )  # fmt: skip


def found_end(on: SimpleNamespace, circle: Circle, side: int = 1) -> LateralEnd | None:
    mask = np.zeros(on.pair.valid_left.shape, dtype=bool)
    mask[30:170] = True
    line = expected_side(on, circle, np.zeros(2), mask, side)  # type: ignore[arg-type]
    return lateral_end(on, circle, line, chord_plane(on, circle))  # type: ignore[arg-type]


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("narrower", [0.88, 1.0, 1.06])
def test_the_lateral_surface_ends_at_the_silhouette_wherever_stereo_put_the_side(narrower: float, side: int) -> None:
    circle = replace(COLUMN, radius_m=narrower * COLUMN.radius_m)
    end = found_end(bench(), circle, side)
    assert end is not None
    off = COLUMN.f_px / COLUMN.z_m * COLUMN.radius_m * (1.0 - narrower)
    assert end.offset_px == pytest.approx(off, abs=0.8)
    assert end.outside - end.within > 0.25


def test_a_joint_on_the_lateral_surface_is_no_end_though_stereo_put_the_side_there() -> None:
    circle = replace(COLUMN, x_m=COLUMN.x_m - 2.5 * COLUMN.z_m / COLUMN.f_px, radius_m=0.2 - 2.5 * 5.0 / 900.0)
    end = found_end(bench(joint(5.0)), circle)
    assert end is not None
    assert end.offset_px == pytest.approx(5.0, abs=0.8)


def test_before_an_even_sky_the_edge_is_the_end() -> None:
    end = found_end(bench(wall_m=None), replace(COLUMN, radius_m=0.19))
    assert end is not None
    assert end.offset_px == pytest.approx(1.8, abs=0.8)
    assert end.strength > 0.5


def test_a_wall_that_goes_on_in_the_plane_of_the_sides_proves_no_end() -> None:
    end = found_end(bench(wall_m=5.0), COLUMN)
    assert end is not None
    assert end.outside - end.within < 0.25


def test_a_side_that_the_right_photo_does_not_show_has_no_end_there() -> None:
    on = bench()
    valid: FloatArray = np.array(on.pair.valid_right)
    valid[:, 140:] = False
    assert found_end(on_bench(replace(on.pair, valid_right=valid)), COLUMN) is None
