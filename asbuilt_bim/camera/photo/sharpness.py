"""How sharp a photo is, from its own edges: each tells how wide it is by what a little more blur takes from it."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import TakenPhoto
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, frozen

SCALE_PX = 0.8
"""An edge's slope is compared at this blur and at twice it: under a pixel, where a sharp photo has its detail."""
LEAST_SLOPE_GREY = 3.0
"""Grey levels a pixel: less is a store of blocks (JPEG) and of noise."""
OVER_NOISE = 6.0
"""Times the noise of a slope: less may be noise, which is always sharp."""
FEWEST = 60
"""Edges of which a median says something."""
FEWEST_IN_PART = 20
LEFT_SHARE = 0.3
"""Of the differences between directions: what a wave leaves more of is the scene's own lines, and no motion."""
DIRECTIONS = 8
PARTS = 12
"""Of the photo's width, that are compared with the other photo's."""
SMEARED_PX = 1.0
"""A part is smeared where its edges are so much wider than the same things' in the other photo."""
NEAREST_PARTS = 3
"""Things lie by up to two parts further left in the right photo: a wall 3 m off, by a sixth of the width."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sharpness:
    """Widths are standard deviations in pixels, `motion_px` the length of the line that a point became."""

    edges: int  # of which it was worked out; 0: there are too few, and the rest says nothing
    blur_px: float = 0.0
    motion_px: float = 0.0
    motion_deg: float = 0.0  # 0 level, 90 upright
    parts: FloatArray = field(default_factory=lambda: frozen(np.zeros((0, PARTS))))
    """(rows, PARTS) variance of the edges' blur in parts of the photo; NaN where too few are."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Edges:
    """Of n edge pixels: squared ratio of slopes (n,), direction of the slope in 0..pi (n,), row and column (n,)."""

    ratio: Float32Array
    direction: Float32Array
    row: FloatArray
    column: FloatArray


def sharpness_of(
    picture: Float32Array, usable: BoolArray, noise_grey: float, taken: TakenPhoto | None = None
) -> Sharpness:
    """Measure how sharp a photo's grey levels (H, W) are where `usable` (H, W); `taken` says where its parts lie.

    Blur by s widens a step so that its slope falls with 1 / sqrt(s^2 + t^2) under more blur t. Two such t give s.
    Motion widens edges across it and none along it: a wave over the edges' directions.
    """
    edges = _edges(picture, usable, noise_grey)
    if len(edges.ratio) < FEWEST:
        return Sharpness(edges=0)
    middle = _variance(float(np.median(edges.ratio)))
    length, angle = _motion(edges)
    blur = max(middle - length**2 / 24.0, 0.0)  # a line's variance, over all directions
    return Sharpness(
        edges=len(edges.ratio), blur_px=float(np.sqrt(blur)), motion_px=length, motion_deg=angle,
        parts=_parts(edges, picture.shape, taken),
    )  # fmt: skip


def _edges(picture: Float32Array, usable: BoolArray, noise_grey: float) -> _Edges:
    across, down = _slopes(picture, SCALE_PX)
    slope = cv2.magnitude(across, down)
    least = max(LEAST_SLOPE_GREY, OVER_NOISE * noise_grey * 0.28 / SCALE_PX**2)
    peak = usable & (slope > least) & (slope >= cv2.dilate(slope, np.ones((3, 3), np.uint8)))
    row, column = np.nonzero(peak)
    wide = cv2.magnitude(*_slopes(picture, 2.0 * SCALE_PX))[row, column]
    ratio = np.asarray((slope[row, column] / np.maximum(wide, 1e-3)) ** 2, dtype=np.float32)
    direction = np.mod(np.arctan2(down[row, column], across[row, column]), np.pi)
    return _Edges(ratio=ratio, direction=direction, row=row.astype(np.float64), column=column.astype(np.float64))


def _slopes(picture: Float32Array, scale_px: float) -> tuple[Float32Array, Float32Array]:
    soft = cv2.GaussianBlur(picture, (0, 0), scale_px)
    step = np.array([[-0.5, 0.0, 0.5]], dtype=np.float32)
    across, down = cv2.filter2D(soft, -1, step), cv2.filter2D(soft, -1, step.T)
    return np.asarray(across, dtype=np.float32), np.asarray(down, dtype=np.float32)


def _variance(ratio: float) -> float:
    """Return the blur's variance (px^2) of an edge by its squared ratio of slopes; negative of what is thinner."""
    return SCALE_PX**2 * (4.0 - ratio) / max(ratio - 1.0, 1e-2)


def _motion(edges: _Edges) -> tuple[float, float]:
    """Fit a wave to the variance by direction: a line of length L has L^2 / 12 along it, none across."""
    bins = np.round(edges.direction / np.pi * DIRECTIONS).astype(int) % DIRECTIONS
    known = [k for k in range(DIRECTIONS) if np.count_nonzero(bins == k) >= FEWEST]
    if len(known) < DIRECTIONS // 2 + 1:
        return 0.0, 0.0
    variance = [_variance(float(np.median(edges.ratio[bins == k]))) for k in known]
    angle = 2.0 * np.pi * np.array(known) / DIRECTIONS
    design = np.column_stack([np.ones(len(known)), np.cos(angle), np.sin(angle)])
    (mean, level, aslant), *_ = np.linalg.lstsq(design, np.array(variance), rcond=None)
    left = np.array(variance) - design @ np.array([mean, level, aslant])
    if np.sum(left**2) > LEFT_SHARE * np.sum((np.array(variance) - mean) ** 2):
        return 0.0, 0.0
    return float(np.sqrt(24.0 * np.hypot(level, aslant))), float(np.degrees(np.arctan2(aslant, level)) / 2.0 % 180.0)


def _parts(edges: _Edges, size: tuple[int, ...], taken: TakenPhoto | None) -> FloatArray:
    at, ratio = np.stack([edges.column, edges.row], axis=-1), edges.ratio
    if taken is not None:
        size, at = (taken.camera.height_px, taken.camera.width_px), taken.rectified(at)
        here = ((at >= 0.0) & (at < (size[1], size[0]))).all(axis=1)
        at, ratio = at[here], ratio[here]
    side = size[1] / PARTS
    column, row = (at // side).astype(int).T
    parts = np.full((int(size[0] // side) + 1, PARTS), np.nan)
    number = row * PARTS + column
    order = np.argsort(number, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(number[order])) + 1):
        if len(own) >= FEWEST_IN_PART:
            parts[row[own[0]], column[own[0]]] = _variance(float(np.median(ratio[own])))
    return frozen(parts)


def smeared_shares(left: Sharpness, right: Sharpness) -> tuple[float, float]:
    """Return the share of either photo's parts whose edges are wider than the same things' in the other.

    Drops and dirt lie on one lens. What is soft in itself, or out of the depth of field, is so in both photos.
    """
    return _smeared(left.parts, right.parts), _smeared(right.parts[:, ::-1], left.parts[:, ::-1])


def _smeared(own: FloatArray, other: FloatArray) -> float:
    if not own.size or own.shape != other.shape:
        return 0.0
    shifted = [np.pad(other, ((0, 0), (k, 0)), constant_values=np.nan)[:, :PARTS] for k in range(NEAREST_PARTS)]
    there = np.max(np.where(np.isnan(shifted), -np.inf, shifted), axis=0)
    compared = np.isfinite(own) & np.isfinite(there)
    wider = compared & (own > there + SMEARED_PX**2)
    return float(wider.sum() / max(int(compared.sum()), 1))
