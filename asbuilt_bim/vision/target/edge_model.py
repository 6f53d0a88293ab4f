"""Where an edge between two colours lies, with the lens, the tone curve and JPEG in the model, and how sure that is.

Half of an edge's contrast is at its place in linear light only. A photo shows light through a tone curve, and JPEG then
halves the colours' resolution. So a colour edge moves towards the darker side where the lens is sharp, and towards the
brighter one where it isn't. Before white or black it moves by 0.4 px. So each profile across the edge is compared with
what a straight edge between its own two colours would look like there, and the place that fits best is taken. What is
behind may change along a profile too; no place fits then, and such profiles say how little they are to be trusted.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, frozen
from asbuilt_bim.vision.edges import DISPLAY_GAMMA

_BLURS_PX = 0.4 * 1.25 ** np.arange(10)
"""Lens and pixel together, as the sigma of a bell: from a sharp lens to 3 px, a target far out of focus."""
STEP_PX = 0.5
_SEARCH = 0.6  # of the reach: a place further out has no two sides left to compare
COLOUR_BLUR_PX = (
    1.2  # halving and doubling: a box of two pixels, then a triangle of two to both sides, and what JPEG drops
)
_HALF_COLOUR_PX = 0.5 * COLOUR_BLUR_PX  # of three planes one keeps its resolution
BETWEEN_PIXELS_PX = 0.35  # what reading between pixels blurs
_NOISE = 0.011  # of full scale: three grey levels
JPEG_PX = 0.1  # an edge moves by so much with its place in JPEG's raster of blocks
_WELL_FITTED = 0.25  # of the profiles fit as well as the noise allows; the others are measured against them
_TWO_SIDES = 4.0 * _NOISE  # what has but one colour fits anywhere, and says nothing of how well edges fit
_MOST_BENT = 0.5  # of a blur for each radius: first order holds no further
_PASSES = 2
_LEAST_APART = 0.3  # of an edge's contrast: where its profile's ends show less of it, its colours aren't known
_KERNEL_END = 4.0  # sigmas of the colours' blur


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedEdges:
    """Edge places on N profiles: `points` (N, 2), NaN where none was found; `sigma_px` (N,) how sure each one is.

    `contrast` (N,) is what both sides differ by, of full scale.
    """

    points: FloatArray
    sigma_px: FloatArray
    contrast: FloatArray


def colour_planes(image: ByteImage) -> Float32Array:
    """Return a photo (BGR) as JPEG stores it: brightness and two colour differences, float32 (H, W, 3) about 0..1."""
    planes = cv2.cvtColor(image.astype(np.float32) / np.float32(255.0), cv2.COLOR_BGR2YCrCb)
    return np.asarray(planes, dtype=np.float32)


def place_edges(
    planes: Float32Array,
    points: FloatArray,
    outward: FloatArray,
    reach_px: float,
    blur_px: float,
    bend: FloatArray | float = 0.0,
    gamma: float = DISPLAY_GAMMA,
) -> PlacedEdges:
    """Place the edge near each of `points` (N, 2) along its `outward` unit direction (N, 2).

    `planes` are those of `colour_planes`. Profiles reach `reach_px` to both sides; their outer halves say what inside
    and outside look like. `bend` (N,) is the edge's curvature in 1/px: blur moves a bent edge inwards.

    Reference: Bouma et al. 2005, the dislocation of curved surfaces by a point spread function, first order.
    """
    profiles = profiles_across(planes, points, outward, reach_px)
    shifts = int(np.ceil(_SEARCH * reach_px / STEP_PX))
    ends = _ends_of(profiles, gamma)
    row, offset = np.arange(len(profiles)), np.zeros(len(profiles))
    for _ in range(_PASSES):
        # which colours both sides have depends on where the edge is: or it would be found where it was looked for
        fits, cost = _compared(profiles, ends, shifts, blur_px, np.nan_to_num(offset))
        best = np.clip(np.argmin(cost, axis=1), 1, cost.shape[1] - 2)
        before, at, after = cost[row, best - 1], cost[row, best], cost[row, best + 1]
        curve = np.maximum(before - 2.0 * at + after, 1e-9)
        aside = 0.5 * (before - after) / curve
        offset = np.where(np.abs(aside) <= 1.0, (best - shifts + aside) * STEP_PX, np.nan)
    has_edge = ends.contrast > _TWO_SIDES
    misfit = np.mean(np.square(profiles - fits[row, best].transpose(0, 2, 1)), axis=(1, 2))
    usual = max(float(np.quantile(misfit[has_edge] if has_edge.any() else misfit, _WELL_FITTED)), 1e-9)
    sigma = np.hypot(JPEG_PX, np.sqrt(2.0 / curve) * STEP_PX) * np.maximum(misfit / usual, 1.0)
    offset = offset + straightened(blur_px, bend)
    return PlacedEdges(points=points + offset[:, None] * outward, sigma_px=sigma, contrast=ends.contrast)


def straightened(blur_px: float, bend: FloatArray | float) -> FloatArray | float:
    """Return how far (px) an edge of curvature `bend` (1/px) lies beyond where blur shows it."""
    return 0.5 * blur_px**2 * np.minimum(bend, _MOST_BENT / blur_px)


def likely_blur(profiles: list[FloatArray], gamma: float = DISPLAY_GAMMA) -> float:
    """Return the blur (px) with which edges fit the profiles (N, S, 3) of all photos best.

    It must be right to a tenth: a third of a pixel off moves an edge between dark and bright by a fifth. `gamma` is as
    in `linear_light`.
    """
    costs = np.zeros(len(_BLURS_PX))
    for some in profiles:
        shifts, ends, middle = some.shape[1] // 3, _ends_of(some, gamma), np.zeros(1)
        each = np.stack([_compared(some, ends, shifts, float(blur), middle)[1].min(axis=1) for blur in _BLURS_PX])
        # on a cover, or between two reds, any blur fits
        has_edge = ends.contrast > _TWO_SIDES
        each = each[:, has_edge] if has_edge.any() else each
        costs += np.sort(each, axis=1)[:, : max(1, each.shape[1] // 2)].mean(axis=1)
    best = int(np.clip(np.argmin(costs), 1, len(costs) - 2))
    before, at, after = np.log(costs[best - 1 : best + 2] + 1e-9)
    aside = 0.5 * (before - after) / max(before - 2.0 * at + after, 1e-9)
    return float(_BLURS_PX[best] * 1.25 ** np.clip(aside, -1.0, 1.0))


def misfits(profiles: FloatArray, blur_px: float, gamma: float) -> FloatArray:
    """Return the mean square (N,) by which profiles (N, S, 3) miss the edges that fit them best, wherever these lie.

    NaN where both ends show one colour. `gamma` is as in `linear_light`.
    """
    ends = _ends_of(profiles, gamma)
    fits, cost = _compared(profiles, ends, profiles.shape[1] // 3, blur_px, np.zeros(1))
    apart = profiles - fits[np.arange(len(fits)), np.argmin(cost, axis=1)].transpose(0, 2, 1)
    return np.where(ends.contrast > _TWO_SIDES, np.mean(np.square(apart), axis=(1, 2)), np.nan)


def profiles_across(planes: Float32Array, points: FloatArray, outward: FloatArray, reach_px: float) -> FloatArray:
    """Return the planes (N, S, 3) along profiles across an outline, from inside to outside."""
    offsets = _offsets(int(np.ceil(reach_px / STEP_PX)))
    at = (points[:, None, :] + offsets[None, :, None] * outward[:, None, :]).astype(np.float32)
    x, y = np.ascontiguousarray(at[..., 0]), np.ascontiguousarray(at[..., 1])
    values = cv2.remap(planes, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(values, dtype=np.float64).reshape(len(points), len(offsets), 3)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ends:
    """What N profiles (N, S, 3) show at their ends, `count` samples each: linear colours (N, 3) of both sides.

    `uneven` (N, 3) is what the planes differ by there, `contrast` (N,) what both sides do. With a `gamma` of 1 grey
    levels count as light.
    """

    count: int
    gamma: float
    inside: FloatArray
    outside: FloatArray
    uneven: FloatArray
    contrast: FloatArray


def _ends_of(profiles: FloatArray, gamma: float = DISPLAY_GAMMA) -> _Ends:
    count = max(2, profiles.shape[1] // 4)
    first, last = profiles[:, :count], profiles[:, -count:]
    inside, outside = first.mean(axis=1), last.mean(axis=1)
    return _Ends(
        count=count, gamma=gamma, inside=linear_light(inside, gamma), outside=linear_light(outside, gamma),
        uneven=first.var(axis=1) + last.var(axis=1), contrast=np.linalg.norm(inside - outside, axis=1),
    )  # fmt: skip


def _compared(
    profiles: FloatArray, ends: _Ends, shifts: int, blur_px: float, about_px: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the edge at every place, as windows (N, K, 3, S), and how far (N, K) each is from the profiles."""
    count = profiles.shape[1]
    one, other = _unmixed(ends, count // 2, blur_px, about_px)
    edge = _edge_between(one, other, count // 2 + shifts, blur_px, ends.gamma)
    windows = np.lib.stride_tricks.sliding_window_view(edge, count, axis=1)[:, ::-1]
    apart = profiles.transpose(0, 2, 1)[:, None] - windows
    cost = np.einsum("nkc,nc->nk", np.einsum("nkcs,nkcs->nkc", apart, apart), 1.0 / (_NOISE**2 + ends.uneven))
    return windows, cost


def _edge_between(inside: FloatArray, outside: FloatArray, steps: int, blur_px: float, gamma: float) -> FloatArray:
    """Return what edges at 0 between linear colours (N, 3) look like `steps` to both sides: (N, 2 steps + 1, 3)."""
    pad = int(_KERNEL_END * COLOUR_BLUR_PX / STEP_PX)
    share = share_of_inside(steps + pad, 1.0, blur_px)
    light = outside[:, None, :] + share[None, :, None] * (inside - outside)[:, None, :]
    planes = _shown(light, gamma)
    inner = slice(pad, -pad)
    brightness = _bell(steps + pad, BETWEEN_PIXELS_PX)[inner] @ planes[..., :1]
    return np.concatenate([brightness, _bell(steps + pad, COLOUR_BLUR_PX)[inner] @ planes[..., 1:]], axis=-1)


def _unmixed(ends: _Ends, steps: int, blur_px: float, about_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the linear colours (N, 3) of both sides without what a wide blur brings from the other side.

    The profiles reach `steps` to both sides; `about_px` (N,), or one for all, is where the edges about are.
    """
    offsets, grid = _offsets(steps), 0.5 * _offsets(4 * steps)
    seen = np.interp(
        offsets - about_px[:, None], grid, share_of_inside(4 * steps, 0.5, math.hypot(blur_px, _HALF_COLOUR_PX))
    )
    within = seen[:, : ends.count].mean(axis=1)[:, None]
    beyond = seen[:, -ends.count :].mean(axis=1)[:, None]
    apart = np.maximum(within - beyond, _LEAST_APART)
    one: FloatArray = np.maximum(((1.0 - beyond) * ends.inside - (1.0 - within) * ends.outside) / apart, 0.0)
    other: FloatArray = np.maximum((within * ends.outside - beyond * ends.inside) / apart, 0.0)
    return one, other


@lru_cache(maxsize=256)
def share_of_inside(steps: int, scale: float, blur_px: float) -> FloatArray:
    """Return how much (2 steps + 1,) of a blurred edge's inside is seen at `scale` times half pixels from it."""
    offsets = scale * _offsets(steps)
    return frozen(np.array([0.5 * math.erfc(offset / (math.sqrt(2.0) * blur_px)) for offset in offsets]))


def _offsets(steps: int) -> FloatArray:
    return np.asarray(np.arange(-steps, steps + 1) * STEP_PX, dtype=np.float64)


@lru_cache(maxsize=64)
def _bell(steps: int, sigma_px: float) -> FloatArray:
    """Return the matrix (S, S) that blurs what is known at `_offsets(steps)`."""
    offsets = _offsets(steps)
    kernel = np.exp(-0.5 * ((offsets[:, None] - offsets) / sigma_px) ** 2)
    return frozen(kernel / kernel.sum(axis=1, keepdims=True))


def linear_light(planes: FloatArray, gamma: float = DISPLAY_GAMMA) -> FloatArray:
    """Return linear light BGR (..., 3) of colour planes; with a `gamma` of 1 the grey levels that show it, 0..1."""
    bgr = cv2.cvtColor(planes.reshape(1, -1, 3).astype(np.float32), cv2.COLOR_YCrCb2BGR).reshape(planes.shape)
    return np.asarray(np.clip(bgr, 0.0, 1.0), dtype=np.float64) ** gamma


def _shown(light: FloatArray, gamma: float) -> FloatArray:
    """Return the colour planes of linear light (N, S, 3)."""
    shown = np.clip(light, 0.0, 1.0).astype(np.float32) ** np.float32(1.0 / gamma)
    return np.asarray(cv2.cvtColor(shown, cv2.COLOR_BGR2YCrCb), dtype=np.float64)
