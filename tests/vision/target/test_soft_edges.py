"""Blurred edges before what changes: found where they were drawn, from wherever they are looked for."""

import cv2
import numpy as np
import pytest

from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.vision.target.edge_model import colour_planes, place_edges
from asbuilt_bim.vision.target.ellipse import Ellipse
from asbuilt_bim.vision.target.soft_edges import place_soft_edges

RED = np.array([0.01, 0.01, 0.14])  # linear BGR of red paint in shade
SIZE, FINE, BLUR_PX = 120, 4, 2.2
DISC = Ellipse(x_px=59.3, y_px=60.6, major_px=30.0, minor_px=27.0, angle_rad=0.4)
POINTS, OUTWARD = DISC.outline(140)


def planes(behind: FloatArray) -> Float32Array:
    """Return a JPEG's planes of a red disc before grey stripes (linear, (SIZE * FINE,) from left to right)."""
    fine = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    grid = np.stack(np.meshgrid(fine, fine), axis=-1).reshape(-1, 2)
    red = (DISC.distance_px(grid) < 0.0).reshape(SIZE * FINE, SIZE * FINE, 1)
    sharp = np.where(red, RED, behind[None, :, None])
    light = cv2.GaussianBlur(sharp.reshape(SIZE, FINE, SIZE, FINE, 3).mean(axis=(1, 3)), None, BLUR_PX)
    done = (255.0 * light ** (1 / 2.2) + np.random.default_rng(3).normal(0.0, 2.0, light.shape)).clip(0, 255)
    jpeg = cv2.imencode(".jpg", done.astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 90])[1]
    return colour_planes(np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR)))


def stripes() -> FloatArray:
    """Return a background that changes within a blur's reach, and otherwise to both sides of the disc."""
    x = (np.arange(SIZE * FINE) + 0.5) / FINE
    return 0.3 + 0.25 * np.sin(x / 3.1) + np.where(x < 60.0, 0.1, 0.0)


def aside(seen: Float32Array, soft: bool, shift_px: float) -> float:
    """Return how far to the right the disc is placed, looked for `shift_px` to the right of where it is."""
    start, bend = POINTS + np.array([shift_px, 0.0]), DISC.bend(140)
    if soft:
        placed = place_soft_edges(seen, start, OUTWARD, BLUR_PX, bend)
    else:
        placed = place_edges(seen, start, OUTWARD, 3.5, BLUR_PX, bend)
    off = np.sum((placed.points - POINTS) * OUTWARD, axis=1)
    good = np.isfinite(off)
    weight = np.where(good, 1.0 / placed.sigma_px**2, 0.0)
    rows = np.c_[OUTWARD, np.ones(len(OUTWARD))]
    return float(np.linalg.solve(rows.T @ (rows * weight[:, None]), rows.T @ (weight * np.where(good, off, 0.0)))[0])


@pytest.mark.parametrize("grey", [0.02, 0.2, 0.8])
def test_a_blurred_outline_lies_where_it_was_drawn_before_one_grey(grey: float) -> None:
    placed = place_soft_edges(planes(np.full(SIZE * FINE, grey)), POINTS, OUTWARD, BLUR_PX, DISC.bend(140))
    assert abs(np.nanmedian(np.sum((placed.points - POINTS) * OUTWARD, axis=1))) < 0.2


def test_before_stripes_an_outline_is_not_found_where_it_is_looked_for() -> None:
    seen = planes(stripes())
    found = {soft: [aside(seen, soft, shift) for shift in (-0.7, 0.7)] for soft in (True, False)}
    assert np.ptp(found[True]) < 0.15 < np.ptp(found[False])
    assert np.abs(found[True]).max() < 0.15


def test_an_edge_before_what_changes_claims_less_than_one_before_one_grey() -> None:
    even, uneven = (
        place_soft_edges(planes(behind), POINTS, OUTWARD, BLUR_PX, DISC.bend(140))
        for behind in (np.full(SIZE * FINE, 0.3), stripes())
    )
    assert np.nanmedian(even.sigma_px) < np.nanmedian(uneven.sigma_px)
