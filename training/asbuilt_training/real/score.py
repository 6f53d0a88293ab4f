"""How well concrete is found in real photographs: wall and column together against the rest, unclear pixels aside."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.geometry.arrays import ByteImage
from numpy.typing import NDArray

from asbuilt_training.real.labels import COLUMN, STONE, UNCLEAR, WALL, Distance, LabelledPhoto

WIDTH_PX = 1280
"""Answers are compared at this width at most: the polygons aren't drawn more sharply than that."""

Mask = NDArray[np.bool_]
Finder = Callable[[ByteImage], Mask]
"""Takes a BGR photo and says which of its pixels (H, W) are concrete wall or column."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """Pixels that count: concrete and found, called concrete and none, concrete and missed, and all."""

    right: int
    wrong: int
    missed: int
    all: int

    @property
    def iou(self) -> float:
        """Return intersection over union, NaN where the labels show no concrete: there only `alarms` says something."""
        concrete = self.right + self.missed
        return self.right / (concrete + self.wrong) if concrete else float("nan")

    @property
    def precision(self) -> float:
        """Return the share of what was called concrete that is."""
        return self.right / (self.right + self.wrong) if self.right + self.wrong else float("nan")

    @property
    def recall(self) -> float:
        """Return the share of the concrete that was found."""
        return self.right / (self.right + self.missed) if self.right + self.missed else float("nan")

    @property
    def alarms(self) -> float:
        """Return the share of the pixels that count that was called concrete and is none."""
        return self.wrong / self.all if self.all else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scored:
    """One photo: what it shows, what was answered, and how that counts; maps at the width compared at."""

    photo: LabelledPhoto
    image: ByteImage
    kinds: NDArray[np.uint8]
    answer: Mask
    counts: Counts


def counts_of(answer: Mask, kinds: NDArray[np.uint8]) -> Counts:
    """Count an answer (h, w) against a map of kinds (h, w)."""
    concrete = (kinds == WALL) | (kinds == COLUMN) | (kinds == STONE)
    clear = kinds != UNCLEAR
    said = answer & clear
    right = int(np.count_nonzero(said & concrete))
    return Counts(
        right=right, wrong=int(np.count_nonzero(said)) - right, missed=int(np.count_nonzero(concrete)) - right,
        all=int(np.count_nonzero(clear)),
    )  # fmt: skip


def score(photo: LabelledPhoto, data: Path, finder: Finder) -> Scored:
    """Ask a finder about a photo of the data folder, in the photo's own size, and count its answer."""
    image = decode(read_photo(data / photo.file))
    kinds = photo.kinds(min(WIDTH_PX, photo.size_px[0]))
    size = (kinds.shape[1], kinds.shape[0])
    answer = cv2.resize(finder(image).astype(np.uint8), size, interpolation=cv2.INTER_AREA) > 0
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return Scored(photo=photo, image=small, kinds=kinds, answer=answer, counts=counts_of(answer, kinds))


def by_view(scored: Iterable[Scored], distance: Distance) -> dict[str, list[Counts]]:
    """Return the counts of each view of a distance, in the order in which the views come."""
    views: dict[str, list[Counts]] = {}
    for one in scored:
        if one.photo.distance == distance:
            views.setdefault(one.photo.view, []).append(one.counts)
    return views


def view_iou(counts: Sequence[Counts]) -> float:
    """Return the mean IoU of a view's photos: frames of one camera say the same thing twice, and count once."""
    return float(np.mean([one.iou for one in counts]))


def mean_iou(views: dict[str, list[Counts]]) -> tuple[float, int]:
    """Return the mean over the views that show concrete, and how many they are."""
    known = [value for value in map(view_iou, views.values()) if np.isfinite(value)]
    return (float(np.mean(known)) if known else float("nan")), len(known)


def everything(image: ByteImage) -> Mask:
    """Call every pixel concrete: the IoU is then the concrete's share of the photo."""
    return np.ones(image.shape[:2], dtype=bool)


def greyish(image: ByteImage) -> Mask:
    """Call concrete what is grey and neither dark nor glaring: what colour alone can do."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    saturation, value = hsv[..., 1], hsv[..., 2]
    return np.asarray((saturation < 40) & (value > 70) & (value < 225))


def in_quarters(finder: Finder) -> Finder:
    """Return a finder that looks at a photo's four quarters one by one, at twice the sharpness and without context."""

    def found(image: ByteImage) -> Mask:
        height, width = image.shape[:2]
        mask = np.zeros((height, width), dtype=bool)
        for rows in (slice(0, height // 2), slice(height // 2, height)):
            for columns in (slice(0, width // 2), slice(width // 2, width)):
                mask[rows, columns] = finder(np.ascontiguousarray(image[rows, columns]))
        return mask

    return found
