"""What networks are judged by: average precision, overlap, borders, concrete against the rest, relative depth.

Things are matched as COCO does: each class by itself, the surest first, at an IoU of 0.5. Some true things are ignored,
so that finding them neither helps nor harms. One is where fewer than 400 pixels of it show (in a photo 640 px wide), or
where it is nowhere 8 pixels wide. Also where the photo's border leaves less than 1200 pixels of it. What is found on
ignored things, or is itself of fewer than 400 pixels, doesn't count either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.stereo.depth import DepthMap
from benchmarks.networks.pictures import Shot

Mask = NDArray[np.bool_]
KINDS = ("wall", "column")
LEAST_PX, LEAST_WIDTH_PX, LEAST_CUT_PX = 400.0, 8.0, 1200.0
FURTHEST_M = 50.0
"""Depth counts up to here: further things are backdrop."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueThing:
    """One element in view."""

    kind: str
    mask: Mask
    ignored: bool


def true_things(shot: Shot) -> list[TrueThing]:
    """Return the elements of which a photo shows anything."""
    scale = shot.element.shape[1] / 640.0
    inner = cv2.erode(shot.pair.valid_left.astype(np.uint8), np.ones((5, 5), np.uint8), borderValue=0) > 0
    found: list[TrueThing] = []
    for number in np.unique(shot.element[shot.element > 0]):
        mask = shot.element == number
        size = np.count_nonzero(mask) / scale**2
        width = 2.0 * float(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5).max()) / scale
        cut = bool((mask & ~inner).any())
        ignored = size < LEAST_PX or width < LEAST_WIDTH_PX or (cut and size < LEAST_CUT_PX)
        found.append(TrueThing(kind=shot.kinds[number - 1], mask=mask, ignored=ignored))
    return found


@dataclass(kw_only=True)
class Tally:
    """What one way of segmenting made of all photos."""

    hits: dict[str, list[tuple[float, bool]]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    wanted: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    overlaps: list[float] = field(default_factory=list)
    borders_px: list[float] = field(default_factory=list)
    both: int = 0
    either: int = 0

    def add(self, found: Sequence[Instance], things: Sequence[TrueThing]) -> None:
        """Match a photo's instances to its elements."""
        for kind in KINDS:
            self.wanted[kind] += sum(thing.kind == kind and not thing.ignored for thing in things)
            self._match([one for one in found if one.label == kind], [thing for thing in things if thing.kind == kind])
        if things or found:
            shape = things[0].mask.shape if things else found[0].mask.shape
            out = _any([thing.mask for thing in things if thing.ignored], shape)
            concrete = _any([thing.mask for thing in things], shape) & ~out
            answered = _any([one.mask for one in found], shape) & ~out
            self.both += int(np.count_nonzero(concrete & answered))
            self.either += int(np.count_nonzero(concrete | answered))

    def join(self, other: Tally) -> None:
        """Take in what was made of further photos."""
        for kind in KINDS:
            self.hits[kind] += other.hits[kind]
            self.wanted[kind] += other.wanted[kind]
        self.overlaps += other.overlaps
        self.borders_px += other.borders_px
        self.both += other.both
        self.either += other.either

    def _match(self, found: Sequence[Instance], things: Sequence[TrueThing]) -> None:
        free = [thing for thing in things if not thing.ignored]
        ignored = [thing for thing in things if thing.ignored]
        for one in sorted(found, key=lambda instance: -instance.score):
            shares = [overlap(one.mask, thing.mask) for thing in free]
            if shares and max(shares) >= 0.5:
                best = free.pop(int(np.argmax(shares)))
                self.hits[best.kind].append((one.score, True))
                self.overlaps.append(max(shares))
                self.borders_px.append(border_px(one.mask, best.mask))
                continue
            size = np.count_nonzero(one.mask)
            crumb = size < LEAST_PX * (one.mask.shape[1] / 640.0) ** 2
            if crumb or any(np.count_nonzero(one.mask & thing.mask) >= 0.5 * size for thing in ignored):
                continue
            self.hits[one.label].append((one.score, False))

    def precision(self, kind: str) -> float:
        """Return the average precision of a class at IoU 0.5, all points interpolated."""
        ranked = sorted(self.hits[kind], key=lambda hit: -hit[0])
        right = np.cumsum([hit[1] for hit in ranked]) if ranked else np.zeros(0)
        exact = right / np.arange(1, len(right) + 1)
        best_on = np.maximum.accumulate(exact[::-1])[::-1] if len(exact) else exact
        gains = np.diff(np.concatenate([[0], right]))
        return float(np.sum(best_on * gains) / max(self.wanted[kind], 1))

    @property
    def overlap(self) -> float:
        """Return the mean IoU of what was matched."""
        return float(np.mean(self.overlaps or [0.0]))

    @property
    def border(self) -> float:
        """Return the median over matched things of their borders' median error, in pixels of a photo 640 wide."""
        return float(np.median(self.borders_px or [np.inf]))

    @property
    def concrete(self) -> float:
        """Return the IoU of walls and columns together against the rest."""
        return self.both / max(self.either, 1)


@dataclass(kw_only=True)
class DepthTally:
    """What relative depth came to after the best scale and shift of each photo."""

    errors: list[float] = field(default_factory=list)
    close: list[float] = field(default_factory=list)

    def add(self, nearness: NDArray[np.float32], shot: Shot) -> None:
        """Fit scale and shift in inverse depth by least squares, as Ranftl et al. 2020, and compare depths."""
        true = shot.inverse_depth_per_m.astype(np.float64)
        known = shot.pair.valid_left & (true > 1.0 / FURTHEST_M)
        x, y = nearness[known].astype(np.float64), true[known]
        scale, shift = np.linalg.lstsq(np.stack([x, np.ones_like(x)], axis=1), y, rcond=None)[0]
        ratio = np.maximum(scale * x + shift, 1.0 / FURTHEST_M) / y  # true over estimated depth
        self.errors.append(float(np.mean(np.abs(1.0 / ratio - 1.0))))
        self.close.append(float(np.mean(np.maximum(ratio, 1.0 / ratio) < 1.25)))

    def join(self, other: DepthTally) -> None:
        """Take in what was made of further photos."""
        self.errors += other.errors
        self.close += other.close


def filled(stereo: DepthMap) -> NDArray[np.float32]:
    """Return stereo's disparity (H, W), where it has none that of the nearest pixel that has: no network at all."""
    away = cv2.distanceTransformWithLabels(
        (~stereo.valid).astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )
    seeds = np.asarray(away[1])
    of_seed = np.zeros(int(seeds.max()) + 1, dtype=np.float32)
    of_seed[seeds[stereo.valid]] = stereo.disparity_px[stereo.valid]
    return of_seed[seeds]


def overlap(one: Mask, other: Mask) -> float:
    """Return the IoU of two masks."""
    both = np.count_nonzero(one & other)
    return both / max(np.count_nonzero(one) + np.count_nonzero(other) - both, 1)


def border_px(one: Mask, other: Mask) -> float:
    """Return the median distance of a mask's border to the truth's, in pixels at 640 px of photo width."""
    rims = [m & ~(cv2.erode(m.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0) for m in (one, other)]
    away = cv2.distanceTransform((~rims[1]).astype(np.uint8), cv2.DIST_L2, 5)
    return float(np.median(away[rims[0]])) * 640.0 / one.shape[1]


def _any(masks: list[Mask], shape: tuple[int, ...]) -> Mask:
    return np.any(masks, axis=0) if masks else np.zeros(shape, dtype=bool)
