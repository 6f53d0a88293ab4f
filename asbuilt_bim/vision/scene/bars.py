"""Starter bars and cages separated from concrete: depth smears the gaps between bars shut, the photos don't.

Bars stand over the concrete that they are for, or where nothing is poured yet, at the design's own depth. Two signs
show them. What is seen between bars lies behind, so the photos disagree along the depth that was smeared over it. And
their fine structure runs upright, line beside line, where concrete has grain.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, IntArray, freeze, median
from asbuilt_bim.geometry.masks import box_of
from asbuilt_bim.vision.scene.read import NOTHING, OFF_PX, Scene
from asbuilt_bim.vision.stereo.matching import grey
from asbuilt_bim.vision.stereo.warp import right_at

WIDE_M, HIGH_M = 0.30, 0.15
"""A window holds two bars of a usual mesh or cage, and ends half a lift's joint from a pour line."""
LINE_M = 0.12
"""Grain is finer than this, a bar is longer."""
GAP_M = 0.35
"""Between two bars of one row at most, and a patch of smooth concrete without a match: a mask is closed over it.
Windows are larger, and are seen to lie behind."""
THIN_M, LEAST_RUN_PX = 0.11, 3
"""No wall or column is thinner; starter bars and tripod legs are."""
LEAST_WINDOW_PX = (9, 5)
DISAGREE = 2.2
"""Photos disagree on bars by so many times what they do on the photo's surfaces in the middle: 3 to 6 times."""
UPRIGHT = 0.6
"""Share of the energy of the slopes along the rows that lasts over `LINE_M`: 0.9 of bars, 0.4 of concrete."""
NARROW_M = 1.05
"""A column's side, or a wall's end; two wide faces that meet in an edge may be two walls' and poured apart."""
STEP_M = 0.02
LEAST_M, LEAST_M2 = 0.15, 0.01
"""How far bars stand out at least to be found, a window, and what of them is no speckle."""
SMOOTH_PX = 0.8
DOUBT_PX = 5.0
"""How far the line may lie too low: what is called neither is left to the edge that the photos show."""
BORDER_PX = 3
"""A silhouette is no bar, and depth runs over it by some pixels."""
MOST_DISTANCE_M = 16.0
"""Beyond, a bar is a pixel wide and its windows hold a hundred."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Looks:
    """The left photo's slope along the rows and how far the right one differs along the measured depth, grey levels."""

    slope: Float32Array
    difference: Float32Array  # NaN where nothing was measured
    usual: float  # difference on upright surfaces, in the middle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Votes:
    """What the pixels (h, w) of an upright piece, in its window of the photo, say of bars.

    `closed` holds the gaps between bars too; `vote` is 1 for bars, -1 for concrete, 0 for neither; `structure` is in
    grey levels.
    """

    window: tuple[slice, slice]
    closed: BoolArray
    vote: IntArray
    on_it: BoolArray  # measured on the piece
    structure: Float32Array
    below_m: FloatArray  # below the camera
    px_per_m: float
    width_m: float


def without_bars(scene: Scene, pair: RectifiedPair, marks: BoolArray) -> Scene:
    """Take bars out of a scene's surfaces: they get a label of their own, `Scene.bars_label`.

    `marks` (H, W) is print on boards, which has upright lines too.
    """
    upright = (scene.labels >= 0) & (scene.labels < len(scene.pieces))
    if not upright.any():
        return scene
    looks = _looks(scene, pair, upright)
    found = [_votes(scene, number, looks, marks) for number in range(len(scene.pieces))]
    labels = scene.labels.copy()
    for number, votes in enumerate(found):
        if votes is None:
            continue
        line_m = _pour_line(_of_one_pour(scene, number, found))
        part = labels[votes.window]
        part[(part == number) & (votes.below_m < line_m)] = NOTHING
        over = votes.closed & (part == NOTHING) & (votes.below_m < line_m - DOUBT_PX / votes.px_per_m)
        part[over & votes.on_it] = scene.bars_label
    freeze(labels)
    sizes = np.bincount(labels[(labels >= 0) & (labels < len(scene.pieces))], minlength=len(scene.pieces))
    return replace(scene, labels=labels, sizes=sizes)


def _of_one_pour(scene: Scene, number: int, found: list[_Votes | None]) -> list[_Votes]:
    """Return the votes on a piece, and those on a wider one that it meets in a convex edge: one pour has one top.

    Of a narrow face silhouettes are the most, and its own votes are few.
    """
    own = found[number]
    beside = [k for k in (number - 1, number + 1) if 0 <= k < len(found) and scene.pieces[min(k, number)].convex_next]
    pooled = [own, *(found[k] for k in beside)] if own is not None and own.width_m < NARROW_M else [own]
    return [v for v in pooled if v is not None and own is not None and v.closed.shape[1] >= own.closed.shape[1]]


def _looks(scene: Scene, pair: RectifiedPair, upright: BoolArray) -> _Looks:
    left, right = (cv2.GaussianBlur(grey(image), (0, 0), SMOOTH_PX) for image in (pair.left, pair.right))
    disparity = scene.level.disparity_px.astype(np.float32)
    there = right_at(np.asarray(right, dtype=np.float32), np.nan_to_num(disparity))
    difference = np.where(scene.level.measured, np.abs(left - there), np.float32(np.nan)).astype(np.float32)
    slope = np.asarray(cv2.Sobel(left, cv2.CV_32F, 1, 0, ksize=3, scale=0.125), dtype=np.float32)
    known = difference[upright & scene.level.measured]
    return _Looks(slope=slope, difference=difference, usual=median(known) if known.size else 0.0)


def _votes(scene: Scene, number: int, looks: _Looks, marks: BoolArray) -> _Votes | None:
    """Let the pixels of an upright piece vote, its gaps that bars leave among them; None for one too far away."""
    own = scene.mask(number)
    window = box_of(own)
    own, level = own[window], scene.level
    d = scene.pieces[number].at(level.x_px[window])
    middle = median(d[own & np.isfinite(d)]) if np.any(own & np.isfinite(d)) else 0.0
    if not middle * MOST_DISTANCE_M > level.view.f_px * level.baseline_m:
        return None
    px_per_m = middle / level.baseline_m
    gap = max(3, round(GAP_M * px_per_m))
    padded = cv2.copyMakeBorder(own.view(np.uint8), 0, 0, gap, gap, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, np.ones((1, gap), np.uint8))[:, gap:-gap] > 0
    judged = closed & ~marks[window]
    thin = max(LEAST_RUN_PX, round(THIN_M * px_per_m))
    like_bars = _like_bars(judged, looks, window, px_per_m)
    vote = np.where(judged & like_bars, 1, np.where(judged & _wider(own, thin), -1, 0))
    with np.errstate(invalid="ignore"):
        on_it = level.measured[window] & (np.abs(level.d_px[window] - d) < OFF_PX)
    structure = np.abs(looks.slope[window]) + np.nan_to_num(looks.difference[window], nan=looks.usual)
    return _Votes(
        window=window,
        closed=closed,
        vote=vote,
        on_it=on_it,
        structure=structure.astype(np.float32),
        below_m=level.y_px[window] * level.baseline_m / np.where(np.isfinite(d), d, middle),
        px_per_m=px_per_m,
        width_m=own.shape[1] / px_per_m,
    )


def _wider(area: BoolArray, run_px: int) -> BoolArray:
    """Keep an area's runs along the rows that are no shorter."""
    opened = cv2.morphologyEx(area.astype(np.uint8), cv2.MORPH_OPEN, np.ones((1, run_px), np.uint8))
    return np.asarray(opened > 0)


def _like_bars(inside: BoolArray, looks: _Looks, window: tuple[slice, slice], px_per_m: float) -> BoolArray:
    """Say round which pixels (h, w) the photos disagree, and fine structure runs upright."""
    size = tuple(max(least, round(m * px_per_m)) for least, m in zip(LEAST_WINDOW_PX, (WIDE_M, HIGH_M), strict=True))
    kernel = np.ones((1, 2 * BORDER_PX + 1), np.uint8)
    inner = cv2.erode(inside.astype(np.uint8), kernel, borderValue=0) > 0

    def total(values: FloatArray | Float32Array) -> Float32Array:
        weighted = np.where(inner, values, 0.0).astype(np.float32)
        summed = cv2.boxFilter(weighted, -1, size, normalize=False, borderType=cv2.BORDER_CONSTANT)
        return np.asarray(summed, dtype=np.float32)

    slope, difference = looks.slope[window], looks.difference[window]
    lasting = cv2.blur(slope, (1, max(3, round(LINE_M * px_per_m))))
    known = np.isfinite(difference)
    apart = total(np.nan_to_num(difference)) / np.maximum(total(known.astype(np.float32)), 1.0)
    upright: BoolArray = total(lasting * lasting) > UPRIGHT * total(slope * slope)
    return upright & (apart > DISAGREE * looks.usual)


def _pour_line(pooled: list[_Votes]) -> float:
    """Return how far below the camera (m) the bars end: the height over which most looks like them, under it most not.

    Minus infinity where they are too low to be found.
    """
    below, vote, structure = (
        np.concatenate([getattr(votes, name)[votes.vote != 0] for votes in pooled])
        for name in ("below_m", "vote", "structure")
    )
    if below.size == 0:
        return -np.inf
    low = float(below.min())
    step = np.floor((below - low) / STEP_M).astype(np.intp)
    score = np.cumsum(np.bincount(step, weights=vote))
    least = LEAST_M2 * pooled[0].px_per_m ** 2
    solid = np.maximum.accumulate(score) - score > least  # concrete doesn't stand on bars
    score = score[: int(np.argmax(solid)) if solid.any() else len(score)]
    best = len(score) - int(np.argmax(score[::-1])) if len(score) else 0
    if best * STEP_M < LEAST_M or score[best - 1] <= least:
        return -np.inf
    count = np.bincount(step)
    return low + _sharp(best, np.bincount(step, weights=structure) / np.maximum(count, 1), count > 0) * STEP_M


def _sharp(step: int, structure: FloatArray, known: BoolArray) -> int:
    """Put a line that windows found, a number of steps from the top, where the fine structure (steps,) itself ends."""
    reach = round(HIGH_M / STEP_M)
    over, under = (structure[a:b] for a, b in ((max(0, step - 2 * reach), max(0, step - reach // 2)),
                                               (step + reach // 2, step + 2 * reach)))  # fmt: skip
    if not len(over) or not len(under) or np.mean(over) <= np.mean(under):
        return step
    first = max(0, step - reach)
    gain = np.cumsum(
        (structure - 0.5 * (np.mean(over) + np.mean(under)))[first : step + reach] * known[first : step + reach]
    )
    return first + int(np.argmax(gain)) + 1
