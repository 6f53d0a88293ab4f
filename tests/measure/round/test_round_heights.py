"""Where a round column ends: at its concrete, not at the bars that stand out of it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from asbuilt_bim.geometry.level import level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.round_piece import Circle
from asbuilt_bim.measure.outline.edges import gradients
from asbuilt_bim.measure.round.ends import STEP_PX, RoundEnds, _best_end, find_ends, solid_heights
from asbuilt_bim.vision.stereo.matching import grey
from tests.measure.box_world import Quad, Round, World, make_camera, photograph

WIDTH = 30
COLUMN = Circle(x_m=0.15, z_m=5.0, radius_m=0.2, f_px=900.0, baseline_m=0.25)
TOP_M, FOOT_M = -0.45, 0.4
PIXEL_M = COLUMN.z_m / COLUMN.f_px


def pixels(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.nonzero(mask)
    return rows.astype(np.float64), columns


def column_with_bars(top: int, foot: int, bars: tuple[int, ...], hoops: tuple[int, ...]) -> np.ndarray:
    mask = np.zeros((foot + 20, WIDTH), dtype=bool)
    mask[top:foot] = True
    for bar in bars:
        mask[5:top, bar : bar + 2] = True
    for hoop in hoops:
        mask[hoop : hoop + 2] = True
    return mask


@pytest.mark.parametrize("top", range(80, 88))
def test_starter_bars_and_hoops_over_a_column_are_not_its_height(top: int) -> None:
    rows, columns = pixels(column_with_bars(top, 300, bars=(3, 9, 17, 25), hoops=(20, 45, 70)))
    solid = solid_heights(rows, float(WIDTH))
    tops = [rows[solid & (columns == c)].min() for c in range(WIDTH)]
    assert np.median(tops) == top
    assert rows[solid].max() == 299


def test_a_thing_before_a_column_takes_nothing_off_its_height() -> None:
    mask = column_with_bars(40, 300, bars=(), hoops=())
    mask[120:180] = False
    rows, _ = pixels(mask)
    solid = solid_heights(rows, float(WIDTH))
    assert solid.all()


def test_a_column_half_hidden_over_its_whole_height_keeps_it_and_loses_its_bars() -> None:
    mask = column_with_bars(80, 300, bars=(3, 9), hoops=(20, 45))
    mask[:, 12:] = False
    rows, columns = pixels(mask)
    solid = solid_heights(rows, float(WIDTH))
    assert np.median([rows[solid & (columns == c)].min() for c in range(12)]) == 80


def test_a_mask_of_a_few_rows_is_taken_as_it_is() -> None:
    rows, _ = pixels(column_with_bars(10, 18, bars=(), hoops=()))
    assert solid_heights(rows, float(WIDTH)).all()


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
