"""Where a round column ends: at edges that both photos show."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.level import level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure.outline.edges import gradients
from asbuilt_bim.measure.round.ends import STEP_PX, RoundEnds, _best_end, find_ends
from asbuilt_bim.vision.stereo.matching import grey
from tests.measure.box_world import Quad, Round, World, make_camera, photograph

COLUMN = Circle(x_m=0.15, z_m=5.0, radius_m=0.2, f_px=900.0, baseline_m=0.25)
TOP_M, FOOT_M = -0.45, 0.4
PIXEL_M = COLUMN.z_m / COLUMN.f_px


def ends_of(mask_top_m: float, mask_foot_m: float, foot_m: float = FOOT_M) -> RoundEnds:
    """Photograph a column on the ground before a wall; read its ends from a mask that ends elsewhere."""
    world = World()
    world.ground(foot_m)
    world.rounds.append(Round(name="", x=COLUMN.x_m, z=COLUMN.z_m, radius=0.2, top=TOP_M, bottom=foot_m, seed=44))
    wall = [np.array(v) for v in ((-4.0, -3.0, 9.0), (8.0, 0.0, 0.0), (0.0, 4.0, 0.0))]
    world.quads.append(Quad(name="", corner=wall[0], u=wall[1], v=wall[2], grey=110.0, seed=9))
    pair, _ = photograph(world, make_camera(320, 200, COLUMN.f_px), supersample=2)
    left, right, camera = grey(pair.left), grey(pair.right), pair.camera
    rays = pixel_rays(camera.width_px, camera.height_px, camera.f_px, camera.cx_px, camera.cy_px)
    level = levelled_map(
        np.full(left.shape, 45.0), np.ones(left.shape), level_view((0.0, -1.0, 0.0), 900.0), rays, 0.25
    )
    front_m = COLUMN.z_m - COLUMN.radius_m
    below = rays[..., 1] * front_m
    mask = (below > mask_top_m) & (below < mask_foot_m) & (np.abs(rays[..., 0] * 5.0 - COLUMN.x_m) < COLUMN.radius_m)
    bench = SimpleNamespace(
        pair=pair, grey_levels=(left, right), slopes=gradients(left, right, pair.valid_right),
        scene=SimpleNamespace(level=level),
    )  # fmt: skip
    found = find_ends(bench, COLUMN, mask)  # type: ignore[arg-type]
    assert found is not None
    return found


@pytest.mark.parametrize("off_px", [-4.0, 0.0, 4.0])
def test_top_and_foot_are_the_edges_that_both_photos_show_though_the_mask_ends_elsewhere(off_px: float) -> None:
    found = ends_of(TOP_M + off_px * PIXEL_M, FOOT_M + off_px * PIXEL_M)
    assert found.top_m == pytest.approx(TOP_M, abs=0.7 * PIXEL_M)
    assert found.foot_m == pytest.approx(FOOT_M, abs=0.7 * PIXEL_M)
    assert found.height_sigma_m < 1.5 * PIXEL_M
    assert found.proven


def test_a_column_whose_mask_breaks_off_before_the_photo_ends_has_no_proven_foot() -> None:
    found = ends_of(TOP_M, 0.3, foot_m=0.9)
    assert not found.proven
    assert found.height_sigma_m >= 3.0 * PIXEL_M


@pytest.mark.parametrize(("places_px", "plain"), [((4.0,), True), ((-4.0, 4.0), False)])
def test_a_foot_that_may_be_either_of_two_edges_far_apart_is_not_proven(
    places_px: tuple[float, ...], plain: bool
) -> None:
    across = np.arange(-20.0, 18.0, STEP_PX)
    edges = 0.1 + 0.6 * np.max([np.abs(across - place) < 0.6 for place in places_px], axis=0)
    end = _best_end(np.zeros(len(across)), edges, np.ones(len(across), dtype=bool), across)
    assert end.plain is plain
    assert (end.sigma_px < 1.0) is plain
