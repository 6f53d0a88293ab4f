"""COCO JSON read with care: polygons, run lengths plain and packed, categories that mean walls and columns."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asbuilt_bim.errors import MaskError
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.polygon import Rings
from asbuilt_bim.vision.masks.bounds import MAX_POINTS
from asbuilt_bim.vision.masks.given import GivenMask
from asbuilt_bim.vision.masks.segment import InstanceClass

MAX_MASKS = 100
"""Walls and columns of one photo; a file of more holds another photo's too, or is meant to exhaust the machine."""
MAX_ANNOTATIONS = 100_000  # of a data set with many photos
CORNER_PX = 0.5
"""COCO's pixel (0, 0) begins at 0.0, here its centre is at 0.0."""
_COLUMN, _WALL = ("column", "pillar"), ("wall",)


def class_of(name: str) -> InstanceClass | None:
    """Return which class a category's name says, None where it is neither a wall nor a column."""
    plain = name.casefold()
    if any(word in plain for word in _COLUMN):
        return "column"
    return "wall" if any(word in plain for word in _WALL) else None


def coco_masks(
    document: dict[str, Any], size: tuple[int, int], photo_name: str
) -> tuple[tuple[GivenMask, ...], tuple[str, ...]]:
    """Return the masks of the photo and what was left out; `size` is (width, height) of the original left photo.

    Of a file with several images the one named `photo_name` is taken, and of one its name must hold the photo's.

    Raises:
        MaskError: a part is missing or of the wrong kind, too large, or of another size than the photo.
    """
    image = _image(document, size, photo_name)
    classes, strangers = _categories(document)
    masks: list[GivenMask] = []
    left_out: dict[str, int] = {}
    for index, annotation in enumerate(_list(document, "annotations", "the file", MAX_ANNOTATIONS)):
        where = f"annotations[{index}]"
        if not isinstance(annotation, dict):
            raise MaskError(f"{where}: keys with values are expected")
        if annotation.get("image_id") != image:
            continue
        category = annotation.get("category_id")
        known = isinstance(category, int) and not isinstance(category, bool)
        if not known or (category not in classes and category not in strangers):
            raise MaskError(f"{where}.category_id: is none of the file's categories")
        if category in strangers:
            left_out[strangers[category]] = left_out.get(strangers[category], 0) + 1
            continue
        masks.append(_mask(annotation.get("segmentation"), where, classes[category], size))
        if len(masks) > MAX_MASKS:
            raise MaskError(f"more than {MAX_MASKS} masks of one photo; is this the right file?")
    notes = tuple(f"{count} masks of '{name}', which is no wall or column" for name, count in left_out.items())
    return tuple(masks), notes


def _image(document: dict[str, Any], size: tuple[int, int], photo_name: str) -> int:
    images = [image for image in _list(document, "images", "the file", 100_000) if isinstance(image, dict)]
    named = [i for i in images if str(i.get("file_name", "")).replace("\\", "/").rsplit("/", 1)[-1] == photo_name]
    chosen = named or (images if len(images) == 1 else [])
    if len(chosen) != 1:
        raise MaskError(f"images: {len(chosen)} of {len(images)} are named {photo_name}; one is wanted")
    name = str(chosen[0].get("file_name", ""))
    if not named and name and not _holds(name, Path(photo_name).stem):
        raise MaskError(
            f"images: its one image is {name[:60]!r}, not {photo_name}: masks of another photo? "
            f'Where they are this photo\'s, write "file_name": "{photo_name}" into the file'
        )
    given = (chosen[0].get("width"), chosen[0].get("height"))
    if given != size:
        raise MaskError(
            f"images: {given[0]!s:.20} x {given[1]!s:.20} px, the left photo has {size[0]} x {size[1]}; "
            "masks are of the ORIGINAL photo"
        )
    number = chosen[0].get("id")
    if not isinstance(number, int):
        raise MaskError("images: id is not a whole number")
    if sum(image.get("id") == number for image in images) > 1:
        raise MaskError(f"images: the id {number} stands twice; masks of two photos couldn't be distinguished")
    return number


def _holds(name: str, stem: str) -> bool:
    """Say whether a picture's name holds a photo's as a word: services put signs of their own before and after it."""
    return re.search(rf"(?<![^\W_]){re.escape(stem)}(?![^\W_])", name, re.IGNORECASE) is not None


def _categories(document: dict[str, Any]) -> tuple[dict[int, InstanceClass], dict[int, str]]:
    classes: dict[int, InstanceClass] = {}
    strangers: dict[int, str] = {}
    for index, category in enumerate(_list(document, "categories", "the file", 10_000)):
        number, name = (category.get("id"), category.get("name")) if isinstance(category, dict) else (None, None)
        if not isinstance(number, int) or not isinstance(name, str):
            raise MaskError(f"categories[{index}]: needs id (a whole number) and name")
        if number in classes or number in strangers:
            raise MaskError(f"categories[{index}]: the id {number} stands twice; its masks' class isn't known")
        found = class_of(name)
        if found is None:
            strangers[number] = name[:40]
        else:
            classes[number] = found
    return classes, strangers


def _mask(segmentation: Any, where: str, label: InstanceClass, size: tuple[int, int]) -> GivenMask:
    if isinstance(segmentation, dict):
        return GivenMask(label=label, name=where, pixels=_run_lengths(segmentation, where, size))
    if not isinstance(segmentation, list) or not segmentation:
        raise MaskError(f"{where}.segmentation: a list of polygons, or run lengths with counts and size, are expected")
    rings: list[Rings] = []
    for part in segmentation:
        if not isinstance(part, list) or len(part) < 6 or len(part) % 2 or len(part) > 2 * MAX_POINTS:
            raise MaskError(f"{where}.segmentation: each polygon is a list x, y, x, y ... of three points or more")
        rings.append((frozen(ring_of(part, where).reshape(-1, 2) - CORNER_PX),))
    return GivenMask(label=label, name=where, polygons=tuple(rings))


def ring_of(values: Sequence[Any], where: str) -> FloatArray:
    """Return finite numbers of plain values, nested as they are.

    Raises:
        MaskError: something else is among them.
    """
    try:
        array = np.asarray(values)
    except ValueError as problem:
        raise MaskError(f"{where}: the points are not all of one length") from problem
    if array.dtype.kind not in "if" or not np.isfinite(array).all() or np.abs(array).max(initial=0.0) > 1e5:
        raise MaskError(f"{where}: finite numbers of pixels are expected")
    return array.astype(np.float64)


def _run_lengths(segmentation: dict[str, Any], where: str, size: tuple[int, int]) -> BoolArray:
    width, height = size
    if segmentation.get("size") != [height, width]:
        raise MaskError(f"{where}.segmentation.size: {segmentation.get('size')!r:.60} is not [{height}, {width}]")
    counts = segmentation.get("counts")
    if isinstance(counts, str):
        counts = _unpacked(counts, where, width * height)
    whole = isinstance(counts, list) and all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in counts)
    if not isinstance(counts, list) or not whole or len(counts) > width * height + 1:
        raise MaskError(f"{where}.segmentation.counts: whole numbers, or COCO's packed text, are expected")
    if sum(counts) != width * height:
        raise MaskError(f"{where}.segmentation.counts: add up to {sum(counts)}, not to {width * height} pixels")
    values = np.arange(len(counts)) % 2 == 1
    pixels: BoolArray = np.repeat(values, np.array(counts, dtype=np.int64)).reshape(width, height).T
    return np.ascontiguousarray(pixels)


def _unpacked(text: str, where: str, most: int) -> list[int]:
    """Unpack COCO's text: groups of 5 bits, lowest first; from the third on a difference to the one before the last."""
    counts: list[int] = []
    value = bits = 0
    for letter in text:
        code = ord(letter) - 48
        if not 0 <= code < 64 or bits > 30:
            raise MaskError(f"{where}.segmentation.counts: is no packed COCO text")
        value |= (code & 31) << bits
        bits += 5
        if code & 32:
            continue
        if code & 16:
            value -= 1 << bits
        value += counts[-2] if len(counts) > 2 else 0
        if not 0 <= value <= most:
            raise MaskError(f"{where}.segmentation.counts: a run of {value} pixels can't be")
        counts.append(value)
        value = bits = 0
    if bits:
        raise MaskError(f"{where}.segmentation.counts: ends in the middle of a number")
    return counts


def _list(document: dict[str, Any], key: str, where: str, most: int) -> list[Any]:
    found = document.get(key)
    if not isinstance(found, list) or len(found) > most:
        raise MaskError(f"{where}: {key} must be a list of at most {most}")
    return found
