"""Top and foot of a round column: where both photos show an edge round it, at one height of its lateral surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.round_piece import Circle, disparity_of_circle
from asbuilt_bim.measure.outline.edges import STEP_PX, edge_share
from asbuilt_bim.measure.outline.fit import LEAST_STRENGTH, MASK_SIGMA_PX
from asbuilt_bim.measure.round.lateral_surface import LateralEnd, foreign_share, shares_around
from asbuilt_bim.measure.workbench import Workbench
from asbuilt_bim.vision.stereo.warp import sample

CORE = 0.6
"""Share of a column's half width round its axis where heights are read: further out the lateral surface turns away."""
SPAN = 0.75
"""Share of it on which the ends' edges are looked for: their place is known there, they only get fainter."""
BAND_PX = 4.0
REACH_PX, WITHIN_PX, OUTSIDE_PX = 10.0, 20.0, 8.0
RAGGED_PX = 5.0
"""How far a mask ends off its column, most often: the matcher's window smears it, a floor meets it."""
BAND, MOST_COLUMNS, LEAST_COLUMNS = 4, 200, 12
STAND_OUT = 1.25
"""Rough concrete is full of edges: an end must show by a quarter more than any of them within."""
EDGE_SIGMA_PX = 0.3
"""What an end's place is worth at best: the shade of its arris and of what meets it leans by some tenths of a pixel."""
SURE, PEAK_PX = 4, 1.0
"""An edge that scores nine tenths of the best one is the end half as likely; one of seven tenths hardly."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundEnds:
    """Top and foot below the camera (m, negative: above), the sigma of their distance, and whether both are proven."""

    top_m: float
    foot_m: float
    height_sigma_m: float
    proven: bool


def find_ends(bench: Workbench, circle: Circle, mask: BoolArray) -> RoundEnds | None:
    """Find the column's top and foot near those of its mask (H, W); None where the mask hardly shows its middle."""
    level = bench.scene.level
    rows, columns = np.nonzero(mask)
    x = level.x_px[rows, columns]
    d = disparity_of_circle(circle, x)
    half = circle.f_px * circle.radius_m / circle.z_m
    core = np.isfinite(d) & (np.abs(x - circle.f_px * circle.x_m / circle.z_m) < CORE * half)
    if np.count_nonzero(core) < 50:
        return None
    below = level.y_px[rows, columns][core] * level.baseline_m / d[core]
    pixel_m = circle.z_m / circle.f_px
    rough = _mask_ends(below, columns[core])
    top, foot = (_end_near(bench, circle, start, way) for start, way in zip(rough, (-1.0, 1.0), strict=True))
    return RoundEnds(
        top_m=rough[0] - top.offset_px * pixel_m,
        foot_m=rough[1] + foot.offset_px * pixel_m,
        height_sigma_m=float(np.hypot(top.sigma_px, foot.sigma_px)) * pixel_m,
        proven=top.plain and foot.plain,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _End:
    """How far outward an end lies off its mask's (px), its sigma, and whether the photos show it plainly."""

    offset_px: float
    sigma_px: float
    plain: bool


NO_EDGE = _End(offset_px=0.0, sigma_px=MASK_SIGMA_PX, plain=False)


def _end_near(bench: Workbench, circle: Circle, below_m: float, outward: float) -> _End:
    """Look for the end near a height below the camera; the mask's own where no edge is seen, or the photos end."""
    half = circle.f_px * circle.radius_m / circle.z_m
    count = int(np.clip(2.0 * SPAN * half, LEAST_COLUMNS, MOST_COLUMNS))
    x = circle.f_px * circle.x_m / circle.z_m + np.linspace(-SPAN, SPAN, count) * half
    across = np.arange(-WITHIN_PX, REACH_PX + OUTSIDE_PX + STEP_PX, STEP_PX)
    at, d = _unrolled(bench, circle, x, below_m + outward * across * circle.z_m / circle.f_px)
    px, py = at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)
    there = (at[..., 0] - d).astype(np.float32)
    seen = sample(bench.pair.valid_left.astype(np.float32), px, py) > 0.9
    seen &= sample(bench.slopes.valid_right, there, py) > 0.9
    left, right = (sample(image, u, py) for image, u in zip(bench.grey_levels, (px, there), strict=True))
    foreign = foreign_share(np.where(seen, left - right, np.nan)[None], across <= -REACH_PX, BAND)
    rise_left, rise_right = (sample(s, u, py) for s, u in ((bench.slopes.left_y, px), (bench.slopes.right_y, there)))
    edges = edge_share(rise_left * seen, rise_right * seen)
    return _best_end(foreign, edges, np.asarray(seen.all(axis=0)), across)


def _best_end(foreign: FloatArray, edges: FloatArray, seen: BoolArray, across: FloatArray) -> _End:
    """Return the end where most of the edge and most of a change in face cost meet; several make it less sure."""
    near = np.flatnonzero(np.abs(across) <= REACH_PX)
    outside, within = np.array([shares_around(foreign, across - across[k]) for k in near]).T
    score = edges[near] * (0.5 + outside - within) * np.exp(-0.5 * np.square(across[near] / RAGGED_PX))
    k = int(np.argmax(score))
    if score[k] <= 0.0 or not seen[np.abs(across - across[near[k]]) < BAND_PX].all():
        return NO_EDGE
    end = LateralEnd(
        offset_px=float(across[near[k]]),
        strength=float(edges[near[k]]),
        outside=float(outside[k]),
        within=float(within[k]),
    )
    stands_out = end.strength > STAND_OUT * float(edges[across < end.offset_px - BAND_PX].max())
    if not (end.parts or stands_out) or end.strength < LEAST_STRENGTH:
        return NO_EDGE
    weight = np.square(np.clip(score / score[k], 0.0, None)) ** SURE
    peak = np.abs(across[near] - end.offset_px) <= PEAK_PX
    place = float(np.average(across[near][peak], weights=weight[peak]))
    spread = float(np.sqrt(np.average(np.square(across[near] - place), weights=weight)))
    is_one = (
        spread < MASK_SIGMA_PX
    )  # no surer than the mask's rough end, it was one of several: a foot in its own shade
    return _End(
        offset_px=place,
        sigma_px=float(np.hypot(spread, EDGE_SIGMA_PX)),
        plain=is_one and (end.parts or (stands_out and end.plain)),
    )


def _unrolled(bench: Workbench, circle: Circle, x_px: FloatArray, below_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places (S, T, 2) of the surface in the left photo, at level x (S,) and heights (T,), and disparities."""
    level, camera = bench.scene.level, bench.pair.camera
    d = disparity_of_circle(circle, x_px)[:, None]
    y = below_m[None, :] * d / level.baseline_m
    rays = np.stack([np.broadcast_to(x_px[:, None], y.shape), y, np.full_like(y, circle.f_px)], axis=-1) / circle.f_px
    rectified = rays @ level.view.level_from_rectified
    at: FloatArray = rectified[..., :2] / rectified[..., 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    return at, d / rectified[..., 2]


def _mask_ends(below: FloatArray, columns: NDArray[np.intp]) -> tuple[float, float]:
    """Return top and foot: medians over the columns of pixels of each one's first and last, half a pixel further."""
    order = np.argsort(columns, kind="stable")
    _, starts, counts = np.unique(columns[order], return_index=True, return_counts=True)
    values = below[order]
    top = np.minimum.reduceat(values, starts)
    foot = np.maximum.reduceat(values, starts)
    half = 0.5 * float(np.median((foot - top) / np.maximum(counts, 1)))
    return float(np.median(top)) - half, float(np.median(foot)) + half
