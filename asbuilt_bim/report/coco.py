"""Masks as COCO JSON, so that any annotation tool can open and correct them: polygons of the ORIGINAL left photos.

COCO's pixel (0, 0) begins at 0.0; here its centre is at 0.0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource

CATEGORIES: tuple[InstanceClass, ...] = ("wall", "column")
CORNER_PX = 0.5
TOLERANCE_PX = 0.7
"""A ring's points that lie within this of the line between others say nothing; people have to drag the rest."""
LEAST_PART_PX = 150
"""A part or a hole of a mask that is smaller is a crumb or a pore."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledInstance:
    """An instance as an annotation: rings (N, 2) of the ORIGINAL left photo, integers being pixel centres."""

    label: InstanceClass
    score: float
    source: InstanceSource
    segmenter: str
    rings: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledPhoto:
    """A left photo with its instances; `file_name` as the project names it."""

    file_name: str
    width_px: int
    height_px: int
    instances: tuple[LabelledInstance, ...]


def labelled(instance: Instance, photo: Intrinsics, camera: RectifiedCamera) -> LabelledInstance:
    """Carry an instance's mask through the lens to rings of the original photo.

    A hole is joined to its outer ring by a cut: COCO's polygons have none.
    """
    rings = [frozen(photo.project(camera.rays(ring))) for ring in _rings(instance.mask)]
    return LabelledInstance(
        label=instance.label, score=instance.score, source=instance.source,
        segmenter=instance.segmenter, rings=tuple(rings),
    )  # fmt: skip


def coco_document(photos: Sequence[LabelledPhoto]) -> dict[str, object]:
    """Return the COCO document of photos: images, categories, annotations."""
    images: list[dict[str, object]] = []
    annotations: list[dict[str, object]] = []
    for number, photo in enumerate(photos, start=1):
        size = {"width": photo.width_px, "height": photo.height_px}
        images.append({"id": number, "file_name": photo.file_name} | size)
        for one in photo.instances:
            annotations.append(_annotation(one, number, len(annotations) + 1))
    categories = [{"id": number, "name": name} for number, name in enumerate(CATEGORIES, start=1)]
    description = "Masks of asbuilt-bim, to be corrected; pixels of the original left photos."
    return {
        "info": {"description": description},
        "images": images,
        "categories": categories,
        "annotations": annotations,
    }


def _annotation(one: LabelledInstance, image: int, number: int) -> dict[str, object]:
    corners = [np.round(ring + CORNER_PX, 2) for ring in one.rings]
    low, high = np.min([c.min(axis=0) for c in corners], axis=0), np.max([c.max(axis=0) for c in corners], axis=0)
    area = sum(abs(cv2.contourArea(c.astype(np.float32))) for c in corners)
    return {
        "id": number,
        "image_id": image,
        "category_id": CATEGORIES.index(one.label) + 1,
        "segmentation": [c.ravel().tolist() for c in corners],
        "bbox": [round(float(v), 2) for v in (*low, *(high - low))],
        "area": round(float(area), 1),
        "iscrowd": 0,
        "score": round(one.score, 3),
        "source": str(one.source),
        "segmenter": one.segmenter,
    }


def _rings(mask: BoolArray) -> list[FloatArray]:
    """Return a ring (N, 2) of rectified pixels round each part of a mask, along the pixels' AREAS, holes cut in."""
    height, width = mask.shape
    doubled = cv2.resize(mask.astype(np.uint8), (2 * width, 2 * height), interpolation=cv2.INTER_NEAREST)
    found, tree = cv2.findContours(doubled, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    rings: list[FloatArray] = []
    for number, ring in enumerate(found):
        if tree[0][number][3] >= 0 or cv2.contourArea(ring) < 4 * LEAST_PART_PX:
            continue
        whole = _simple(ring)
        for hole, other in enumerate(found):
            if tree[0][hole][3] == number and cv2.contourArea(other) >= 4 * LEAST_PART_PX:
                whole = _cut_in(whole, _simple(other))
        if len(whole) >= 3:
            rings.append(whole)
    return rings


def _simple(ring: np.ndarray) -> FloatArray:
    """Return a ring of doubled pixels as few points of single ones."""
    few = cv2.approxPolyDP(ring, 2.0 * TOLERANCE_PX, closed=True)
    return np.asarray((few.reshape(-1, 2).astype(np.float64) - 0.5) / 2.0)


def _cut_in(outer: FloatArray, hole: FloatArray) -> FloatArray:
    """Join a hole to its ring by a cut there and back between their nearest points."""
    apart = np.linalg.norm(outer[:, None] - hole[None], axis=2)
    at, on = np.unravel_index(int(np.argmin(apart)), apart.shape)
    around = np.concatenate([hole[on:], hole[: on + 1]])
    return np.concatenate([outer[: at + 1], around, outer[at:]])
