"""Round or flat: the photos decide, between a plane and circles both as the matcher bent them and as wide as seen."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.grow import Piece
from asbuilt_bim.geometry.level import LevelledMap, level_view, levelled_map, pixel_rays
from asbuilt_bim.geometry.round_piece import Circle, circle_between, disparity_of_circle
from asbuilt_bim.vision.scene.read import flat_if_flatter

WIDTH, HEIGHT, F_PX, BASELINE_M = 240, 240, 1050.0, 0.25
MIDDLE, HALF_PX = 140.0, 28.0
COLUMN = circle_between(
    Circle(x_m=0.0, z_m=7.0, radius_m=0.2, f_px=F_PX, baseline_m=BASELINE_M),
    MIDDLE - HALF_PX - WIDTH / 2, MIDDLE + HALF_PX - WIDTH / 2,
)  # fmt: skip
FLATTENED = replace(COLUMN, radius_m=2.0 * COLUMN.radius_m, z_m=COLUMN.z_m + COLUMN.radius_m)


def seen(disparity_px: FloatArray) -> tuple[LevelledMap, SimpleNamespace]:
    """Return the levelled map and both photos of a surface with grain; its disparity (WIDTH,) is that of each row."""
    noise = np.random.default_rng(3).normal(0.0, 40.0, (HEIGHT, WIDTH + 80)).astype(np.float32)
    right = cv2.GaussianBlur(noise, (0, 0), 1.2) + 120.0
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32))
    left = cv2.remap(
        right, columns - disparity_px.astype(np.float32), rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP
    )
    pair = SimpleNamespace(left=np.clip(left, 0, 255), right=np.clip(right[:, :WIDTH], 0, 255))
    rays = pixel_rays(WIDTH, HEIGHT, F_PX, WIDTH / 2, HEIGHT / 2)
    disparity = np.tile(disparity_px, (HEIGHT, 1))
    level = levelled_map(disparity, np.full_like(disparity, 0.1), level_view([0.0, -1.0, 0.0], F_PX), rays, BASELINE_M)
    return level, pair


def bent(circle: Circle) -> Piece:
    """Return a piece that the matcher bent into this circle, between the column's silhouettes."""
    return Piece(
        x0_px=MIDDLE - HALF_PX - WIDTH / 2, x1_px=MIDDLE + HALF_PX - WIDTH / 2, slope=0.0, offset_px=38.3,
        circle=circle, chain=0,
    )  # fmt: skip


def round_disparity() -> FloatArray:
    found = disparity_of_circle(COLUMN, np.arange(float(WIDTH)) - WIDTH / 2)
    return np.where(np.isfinite(found), found, np.nanmin(found))


def test_a_circle_between_two_places_has_its_silhouettes_there_and_is_as_near() -> None:
    half = HALF_PX * np.array([-1.0, 1.0])
    assert np.isnan(disparity_of_circle(COLUMN, MIDDLE - WIDTH / 2 + 1.004 * half)).all()
    assert np.isfinite(disparity_of_circle(COLUMN, MIDDLE - WIDTH / 2 + 0.996 * half)).all()
    assert np.hypot(COLUMN.x_m, COLUMN.z_m) - COLUMN.radius_m == pytest.approx(6.8)


def test_a_round_column_that_the_matcher_flattened_is_as_round_as_its_sides_say() -> None:
    level, pair = seen(round_disparity())
    found = flat_if_flatter(bent(FLATTENED), level, pair)  # type: ignore[arg-type]
    assert found.circle is not None
    assert found.circle.radius_m == pytest.approx(COLUMN.radius_m, rel=0.05)


def test_a_plane_that_the_matcher_bent_round_is_flat() -> None:
    level, pair = seen(np.full(WIDTH, 38.3))
    found = flat_if_flatter(bent(COLUMN), level, pair)  # type: ignore[arg-type]
    assert found.circle is None and found.offset_px == pytest.approx(38.3, abs=0.1)
