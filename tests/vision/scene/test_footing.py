"""Nothing of a wall is seen beneath the floor that it stands on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import Floor, LevelledMap, level_view, levelled_map, pixel_rays
from asbuilt_bim.vision.scene.read import BENEATH_PX, footed

F, B, W, H = 1000.0, 0.25, 300, 500
BELOW_M, AWAY_M = 1.5, 6.0
FOOT_ROW = 50 + F * BELOW_M / AWAY_M  # the principal point lies on row 50
ROWS_A_PX = BELOW_M / B
"""Rows that a floor takes to come nearer by a pixel of disparity."""


def level_of(disparity: NDArray[np.float64]) -> LevelledMap:
    rays = pixel_rays(W, H, F, 150.0, 50.0)
    return levelled_map(disparity, np.full((H, W), 0.1), level_view([0.0, -1.0, 0.0], F), rays, B)


def scene(carried_rows: int) -> tuple[NDArray[np.int16], LevelledMap, list[Piece], list[Floor]]:
    """A wall 6 m away on a floor 1.5 m below the camera; its label goes on over the floor for some rows."""
    labels = np.full((H, W), -1, dtype=np.int16)
    labels[round(FOOT_ROW) :, :] = 1
    labels[20 : round(FOOT_ROW) + carried_rows, 100:200] = 0
    wall = Piece(x0_px=-50.0, x1_px=50.0, slope=0.0, offset_px=F * B / AWAY_M, circle=None, chain=0)
    floor = np.array([0.0, 1.0, 0.0]) * (F * B / BELOW_M)
    return labels, level_of(np.full((H, W), 40.0)), [wall], [Floor(q_px=floor, below_m=BELOW_M)]


def foot_of(labels: NDArray[np.int16]) -> int:
    return int(np.flatnonzero((labels == 0).any(axis=1))[-1])


def test_a_wall_ends_where_it_meets_the_floor_whatever_the_matcher_carried_on() -> None:
    for carried in (8, 20):
        labels, level, pieces, floors = scene(carried)
        found = footed(labels, level, pieces, floors)
        assert foot_of(found) == pytest.approx(FOOT_ROW + BENEATH_PX * ROWS_A_PX, abs=1.0)
        assert np.all(found[round(FOOT_ROW) + 4 :, :] == 1)  # what it loses is the floor's


def test_a_wall_that_ends_at_the_floor_loses_nothing() -> None:
    labels, level, pieces, floors = scene(0)
    assert np.array_equal(footed(labels, level, pieces, floors), labels)


def test_a_wall_on_lower_ground_behind_the_edge_of_a_slab_keeps_its_foot() -> None:
    labels, level, pieces, floors = scene(60)
    assert np.array_equal(footed(labels, level, pieces, floors), labels)


def test_a_wall_with_no_floor_seen_at_its_foot_keeps_it() -> None:
    labels, level, pieces, floors = scene(15)
    labels[labels == 1] = -1
    assert np.array_equal(footed(labels, level, pieces, floors), labels)
