"""A user's labels (COCO JSON) and photos, read as pictures to learn from.

Labels come from other people's tools: sizes are bounded, names don't leave the photos' folder, and what is wrong is
named by its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.errors import MaskError
from asbuilt_bim.storage.strict_json import parse_json
from asbuilt_bim.vision.masks.coco import CORNER_PX, MAX_POINTS, class_of, ring_of

from asbuilt_training.shards import Picture

MAX_BYTES = 200_000_000
MAX_PHOTOS, MAX_CATEGORIES, MAX_MASKS, MAX_PARTS = 2000, 60, 1000, 2000
LONGEST_PX = 768
"""Photos are kept at twice the network's width: crops of them are as sharp as it can see."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnLabels:
    """Photos with their labels; class 0 is what isn't labelled, 1 walls, 2 columns, 3 and up the rest."""

    names: tuple[str, ...]
    pictures: tuple[Picture, ...]
    classes: tuple[tuple[int, str, str], ...]  # number, the file's name for it, wall, column or other


def read_labels(path: Path, photos: Path) -> OwnLabels:
    """Read a COCO file and the photos that it names, which lie in the folder `photos`.

    Raises:
        MaskError: the file is no COCO JSON, too large, names no wall or column, or doesn't fit its photos.
        PhotoError: a photo can't be read.
    """
    try:
        return _read(_document(path), photos)
    except MaskError as problem:
        raise MaskError(f"labels {path}: {problem}") from problem


def _read(document: dict[str, Any], photos: Path) -> OwnLabels:
    numbers, classes = _classes(document)
    images = _list(document, "images", MAX_PHOTOS)
    of_image = _of_image(images, _list(document, "annotations", MAX_PHOTOS * 100))
    names: list[str] = []
    pictures: list[Picture] = []
    for index, image in enumerate(images):
        where = f"images[{index}]"
        name, own = image["file_name"], of_image[image["id"]]
        if name in names:
            raise MaskError(f"{where}: {name[:80]!r} is images[{names.index(name)}], too; put its labels under one")
        if len(own) > MAX_MASKS:
            raise MaskError(f"{where}: {len(own)} masks, limit {MAX_MASKS}")
        pictures.append(_picture(_inside(photos, name, where), image, own, numbers, where))
        names.append(name)
    if not any((picture.kind > 0).any() for picture in pictures):
        raise MaskError("no photo has a single label; there is nothing to learn")
    return OwnLabels(names=tuple(names), pictures=tuple(pictures), classes=classes)


def _of_image(
    images: list[dict[str, Any]], annotations: list[dict[str, Any]]
) -> dict[int, list[tuple[int, dict[str, Any]]]]:
    """Return each image's annotations with their indices; a label that belongs to none would be learned as background.

    Raises:
        MaskError: two images have one id, or an annotation's image isn't there.
    """
    found: dict[int, list[tuple[int, dict[str, Any]]]] = {}
    for index, image in enumerate(images):
        number = image.get("id")
        if not isinstance(image.get("file_name"), str) or not isinstance(number, int) or isinstance(number, bool):
            raise MaskError(f"images[{index}]: needs id (a whole number) and file_name")
        if number in found:
            raise MaskError(f"images[{index}].id: {number} is another image's, too")
        found[number] = []
    for index, annotation in enumerate(annotations):
        of = annotation.get("image_id")
        if not isinstance(of, int) or isinstance(of, bool) or of not in found:
            raise MaskError(f"annotations[{index}].image_id: {of!s:.40} is no id of the file's images")
        found[of].append((index, annotation))
    return found


def _document(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise MaskError(f"{path.stat().st_size / 1e6:.0f} MB, limit {MAX_BYTES / 1e6:.0f} MB")
        document = parse_json(path.read_bytes())
    except (OSError, ValueError, RecursionError) as problem:
        raise MaskError(f"is no JSON that can be read: {str(problem)[:120]}") from problem
    if not isinstance(document, dict):
        raise MaskError("is no COCO file; it has no images, categories and annotations")
    return document


def _classes(document: dict[str, Any]) -> tuple[dict[int, int], tuple[tuple[int, str, str], ...]]:
    """Return which class each category is, and the classes: the file's walls as one, its columns as one, each other."""
    named: list[tuple[int, str]] = []
    for index, category in enumerate(_list(document, "categories", MAX_CATEGORIES)):
        number, name = category.get("id"), category.get("name")
        if not isinstance(number, int) or isinstance(number, bool) or not isinstance(name, str) or not name.strip():
            raise MaskError(f"categories[{index}]: needs id (a whole number) and name")
        named.append((number, name.strip()[:60]))
    meanings = [class_of(name) for _, name in named]
    if not any(meanings):
        raise MaskError("categories: none is named wall, column or pillar; there is nothing to measure")
    numbers: dict[int, int] = {}
    classes: list[tuple[int, str, str]] = []
    for wanted, number in (("wall", 1), ("column", 2)):
        own = [(key, name) for (key, name), meaning in zip(named, meanings, strict=True) if meaning == wanted]
        numbers |= {key: number for key, _ in own}
        classes.append((number, " or ".join(name for _, name in own)[:80] or wanted, wanted))
    for (key, name), meaning in zip(named, meanings, strict=True):
        if meaning is None:
            numbers[key] = len(classes) + 1
            classes.append((len(classes) + 1, name, "other"))
    return numbers, tuple(classes)


def _picture(
    path: Path, image: dict[str, Any], own: list[tuple[int, dict[str, Any]]], numbers: dict[int, int], where: str
) -> Picture:
    bgr = decode(read_photo(path))
    height, width = bgr.shape[:2]
    if (image.get("width"), image.get("height")) != (width, height):
        said = f"{image.get('width')!s:.12} x {image.get('height')!s:.12}"
        raise MaskError(f"{where}: says {said} px, {path.name} has {width} x {height}; labels are of another photo")
    scale = min(LONGEST_PX / max(width, height), 1.0)
    size = (max(round(width * scale), 32), max(round(height * scale), 32))
    kind, instance = np.zeros(size[::-1], dtype=np.uint8), np.zeros(size[::-1], dtype=np.uint16)
    for count, (index, annotation) in enumerate(own, start=1):
        category = annotation.get("category_id")
        number = numbers.get(category) if isinstance(category, int) else None
        if number is None:
            raise MaskError(f"annotations[{index}].category_id: is none of the file's categories")
        mask = _mask(annotation.get("segmentation"), f"annotations[{index}].segmentation", (width, height), size)
        kind[mask], instance[mask] = number, count if number <= 2 else 0
    small = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
    return Picture(
        rgb=np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2RGB), dtype=np.uint8), kind=kind, instance=instance,
        inverse_depth_per_m=np.zeros(size[::-1], dtype=np.float32), fx_px=float(size[0]), fy_px=float(size[0]),
        cx_px=(size[0] - 1) / 2, cy_px=(size[1] - 1) / 2, left_px=np.arange(size[0], dtype=np.float32) + 0.5,
        baseline_m=0.0, up=np.array([0.0, -1.0, 0.0]),
    )  # fmt: skip


def _mask(segmentation: Any, where: str, size: tuple[int, int], small: tuple[int, int]) -> np.ndarray:
    """Return bool (h, w) at the size that is kept, of polygons in pixels of the photo."""
    if isinstance(segmentation, dict):
        raise MaskError(f"{where}: run lengths aren't read here; export polygons")
    if not isinstance(segmentation, list) or not 1 <= len(segmentation) <= MAX_PARTS:
        raise MaskError(f"{where}: a list of 1 to {MAX_PARTS} polygons is expected")
    filled = np.zeros(small[::-1], dtype=np.uint8)
    for part in segmentation:
        if not isinstance(part, list) or len(part) < 6 or len(part) % 2 or len(part) > 2 * MAX_POINTS:
            raise MaskError(f"{where}: each polygon is a list x, y, x, y ... of three points or more")
        ring = ring_of(part, where).reshape(-1, 2) * (small[0] / size[0], small[1] / size[1]) - CORNER_PX
        one = np.zeros_like(filled)
        cv2.fillPoly(one, [np.round(np.clip(ring, -4000, 8000) * 16).astype(np.int32)], 1, shift=4)
        filled |= one
    return filled > 0


def _inside(folder: Path, name: str, where: str) -> Path:
    """Return the path of a photo, which must lie in the folder."""
    path = (folder / name.replace("\\", "/")).resolve()
    if "\0" in name or not path.is_relative_to(folder.resolve()):
        raise MaskError(f"{where}.file_name: {name[:80]!r} leaves the folder of the photos")
    return path


def _list(document: dict[str, Any], key: str, most: int) -> list[dict[str, Any]]:
    found = document.get(key)
    if not isinstance(found, list) or len(found) > most:
        raise MaskError(f"{key}: must be a list of at most {most}")
    if wrong := [k for k, one in enumerate(found) if not isinstance(one, dict)]:
        raise MaskError(f"{key}[{wrong[0]}]: keys with values are expected")
    return found
