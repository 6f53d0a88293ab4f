"""Planes in a true disparity map: the one within a polygon, and every upright region that is large enough.

A plane is linear in disparity, d = q . r. The truth's own noise and how even a real wall is share one tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.geometry.disparity_plane import fit_q, plane_of
from asbuilt_bim.geometry.masks import nonzero

LEAST_PIXELS, LEAST_SHARE = 60, 0.2
"""Of truth within a polygon, and of its pixels: less says nothing of it."""
UPRIGHT_DEG = 20.0
LEAST_AREA_M2, LEAST_SIDE_PX, LEAST_FILLED = 0.5, 60.0, 0.3
"""Of a region; the narrow side is of the rectangle round it, and a frame or a lattice fills too little of that."""
TILE_PX, STEP_PX = 24, 12
_TRIALS, _GROWTHS, _MOST_FITTED = 300, 8, 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Near:
    """How far a map may lie off a plane: in px, and as a share of its disparity, so of its distance."""

    px: float
    share: float

    def of(self, disparity_px: Float32Array | FloatArray) -> FloatArray:
        """Return it for each disparity."""
        return np.minimum(self.px, self.share * disparity_px.astype(np.float64))


TRUTH = Near(px=0.25, share=0.01)
PLAIN = Near(px=0.75, share=0.1)
"""For the disparities of plain matching, in place of truth."""
CAMERA_DOWN = (0.0, 1.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TruthPlane:
    """A plane q (3,) in px and the share of the pixels asked for that lie on it."""

    q_px: FloatArray
    share: float
    pixels: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Region:
    """An upright planar region: its pixels (H, W), plane, area on it, narrow side in the photo, and usual distance."""

    mask: BoolArray
    q_px: FloatArray
    area_m2: float
    side_px: float
    distance_m: float


def plane_within(truth_px: Float32Array, rays: FloatArray, mask: BoolArray) -> TruthPlane | None:
    """Fit the plane that most of the truth's pixels in a mask lie on; None where there is too little truth.

    Triples drawn at random, always the same ones, find it among others; the pixels on it then settle it.
    """
    rows, columns = nonzero(mask & np.isfinite(truth_px))
    if len(rows) < max(LEAST_PIXELS, LEAST_SHARE * np.count_nonzero(mask)):
        return None
    r, d = rays[rows, columns], truth_px[rows, columns].astype(np.float64)
    some, near = slice(None, None, max(1, len(d) // 3000)), TRUTH.of(d)
    draw = np.random.default_rng(0)
    best, q = -1, np.zeros(3)
    for _ in range(_TRIALS):
        three = draw.choice(len(d), 3, replace=False)
        if np.linalg.cond(r[three]) > 1e6:
            continue
        tried = np.linalg.solve(r[three], d[three])
        on = int(np.count_nonzero(np.abs(d[some] - r[some] @ tried) < near[some]))
        if on > best:
            best, q = on, tried
    for _ in range(3):
        on_plane = np.abs(d - r @ q) < near
        if np.count_nonzero(on_plane) < 10:
            return None
        q, _ = fit_q(r[on_plane], d[on_plane], near[on_plane] / 3.0)
    return TruthPlane(q_px=q, share=float(np.mean(np.abs(d - r @ q) < near)), pixels=len(d))


def is_upright(q_px: FloatArray, down: ArrayLike = CAMERA_DOWN) -> bool:
    """Say whether a plane's normal is within 20 degrees of level; where nothing says what is down, it is y."""
    return bool(abs(q_px @ np.asarray(down)) < np.sin(np.deg2rad(UPRIGHT_DEG)) * np.linalg.norm(q_px))


def angle_deg(one: FloatArray, other: FloatArray) -> float:
    """Return the angle between two unit normals, whichever side they point to."""
    return float(np.degrees(np.arccos(np.clip(abs(one @ other), 0.0, 1.0))))


def upright_regions(
    truth_px: Float32Array,
    rays: FloatArray,
    focal_baseline: float,
    near: Near = TRUTH,
    down: ArrayLike = CAMERA_DOWN,
) -> list[Region]:
    """Return the upright planar regions of 0.5 m2 and 60 px, the evenest tile's first.

    Each tile whose truth is even and upright is grown on all pixels that lie on its plane and hang together with it.
    """
    free, used, found = np.isfinite(truth_px), np.zeros(truth_px.shape, dtype=bool), list[Region]()
    for _, top, left in sorted(_seeds(truth_px, rays, near, down)):
        tile = np.s_[top : top + TILE_PX, left : left + TILE_PX]
        if used[tile].mean() > 0.2:
            continue
        grown = _grown(truth_px, rays, free, tile, near)
        if grown is None:
            continue
        mask, q = grown
        used |= mask
        (side, filled), area = _box_of(mask), _area_m2(mask, q, rays, focal_baseline)
        if is_upright(q, down) and area >= LEAST_AREA_M2 and side >= LEAST_SIDE_PX and filled >= LEAST_FILLED:
            away = focal_baseline / float(np.nanmedian(truth_px[mask]))
            found.append(Region(mask=mask, q_px=q, area_m2=area, side_px=side, distance_m=away))
            free &= ~mask
    return found


def _seeds(truth_px: Float32Array, rays: FloatArray, near: Near, down: ArrayLike) -> list[tuple[float, int, int]]:
    """Return rms, top and left of the tiles whose truth lies on an upright plane."""
    seeds = []
    height, width = truth_px.shape
    for top in range(0, height - TILE_PX, STEP_PX):
        for left in range(0, width - TILE_PX, STEP_PX):
            tile = np.s_[top : top + TILE_PX, left : left + TILE_PX]
            seen = np.isfinite(truth_px[tile])
            if seen.mean() < 0.4:
                continue
            r, d = rays[tile][seen], truth_px[tile][seen].astype(np.float64)
            q, _ = fit_q(r, d, near.of(d) / 3.0)
            miss = np.abs(d - r @ q)
            if is_upright(q, down) and np.mean(miss < near.of(d)) > 0.95:
                seeds.append((float(np.sqrt(np.mean(miss**2))), top, left))
    return seeds


def _grown(
    truth_px: Float32Array, rays: FloatArray, free: BoolArray, tile: tuple[slice, slice], near: Near
) -> tuple[BoolArray, FloatArray] | None:
    """Grow a tile on its plane; returns pixels, gaps in the truth filled, and the plane."""
    mask = np.zeros(truth_px.shape, dtype=bool)
    mask[tile] = True
    q, before = np.zeros(3), 0
    for _ in range(_GROWTHS):
        rows, columns = nonzero(mask & free)
        if len(rows) < LEAST_PIXELS:
            return None
        some = slice(None, None, max(1, len(rows) // _MOST_FITTED))
        d = truth_px[rows, columns][some].astype(np.float64)
        q, _ = fit_q(rays[rows, columns][some], d, near.of(d) / 3.0)
        with np.errstate(invalid="ignore"):
            on_plane = free & (np.abs(truth_px - rays @ q) < near.of(truth_px))
        mask = _connected(on_plane, np.isfinite(truth_px) & ~on_plane, tile)
        count = int(np.count_nonzero(mask))
        if count == 0:
            return None
        if abs(count - before) < 0.005 * count:
            break
        before = count
    return mask, q


def _connected(on_plane: BoolArray, off_plane: BoolArray, tile: tuple[slice, slice]) -> BoolArray:
    """Return what hangs together with a tile: gaps of 4 px without truth are bridged, bridges of under 7 px cut."""
    closed = cv2.morphologyEx(on_plane.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8)) > 0
    solid = cv2.morphologyEx((closed & ~off_plane).astype(np.uint8), cv2.MORPH_OPEN, np.ones((7, 7), np.uint8))
    _, labels = cv2.connectedComponents(np.asarray(solid, dtype=np.uint8), connectivity=4)
    inside = labels[tile][labels[tile] > 0]
    if not inside.size:
        return np.zeros(on_plane.shape, dtype=bool)
    return np.asarray(labels == int(np.bincount(inside).argmax()))


def _box_of(mask: BoolArray) -> tuple[float, float]:
    """Return the narrow side of the rectangle round a mask, and the share of it that the mask fills."""
    rows, columns = nonzero(mask)
    if len(rows) < 3:
        return 0.0, 0.0
    sides = cv2.minAreaRect(np.stack([columns, rows], axis=1).astype(np.float32))[1]
    return float(min(sides)), len(rows) / max(float(sides[0] * sides[1]), 1.0)


def _area_m2(mask: BoolArray, q_px: FloatArray, rays: FloatArray, focal_baseline: float) -> float:
    """Return what the pixels see of the plane: each h^2 / (f^2 (n . r)^3), f being the step between rays."""
    plane = plane_of(q_px, focal_baseline)
    step = float(rays[0, 1, 0] - rays[0, 0, 0])
    cosine = np.maximum(rays[mask] @ -plane.normal, 1e-3)
    return float(np.sum(plane.offset_m**2 * step**2 / cosine**3))
