"""Files of masks: a PNG of labels, COCO JSON, or clicked polygons (JSON, CSV); all in pixels of the original photo."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from asbuilt_bim.camera.photo.picture_file import look_at
from asbuilt_bim.errors import MaskError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.storage.regular_file import as_text, read_bytes
from asbuilt_bim.storage.strict_json import parse_json
from asbuilt_bim.vision.masks.bounds import MAX_POINTS, check_outlines
from asbuilt_bim.vision.masks.coco import MAX_MASKS, coco_masks, ring_of
from asbuilt_bim.vision.masks.given import GivenMask
from asbuilt_bim.vision.masks.segment import InstanceClass

MAX_BYTES = 50_000_000
CLICKS, CLICKS_VERSION = "asbuilt-bim/clicks", 1
CSV_COLUMNS = ("polygon", "class", "x_px", "y_px")
_KINDS = "a PNG, or text (COCO JSON, clicked polygons as JSON or CSV), is expected"
_CLASSES: dict[str, InstanceClass] = {"wall": "wall", "column": "column"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MaskFile:
    """The masks of a file, and what of it was left out."""

    masks: tuple[GivenMask, ...]
    left_out: tuple[str, ...] = ()


def read_masks(
    path: Path, size: tuple[int, int], photo_name: str = "", classes: Mapping[int, InstanceClass] | None = None
) -> MaskFile:
    """Read masks of a photo of `size` (width, height); `classes` says what the values of a PNG of labels are.

    Raises:
        MaskError: the file can't be read, is too large, is none of the known kinds, or doesn't fit the photo.
    """
    data = read_bytes(path, MAX_BYTES, MaskError, f"masks {path}")
    try:
        if data.startswith(b"\x89PNG"):
            found = MaskFile(masks=_png(data, size, classes or {}))
        elif path.suffix.lower() == ".csv":
            found = MaskFile(masks=_clicks_csv(data))
        else:
            document = _json(as_text(data, MaskError, _KINDS))
            if "annotations" in document:
                masks, left_out = coco_masks(document, size, photo_name)
                found = MaskFile(masks=masks, left_out=left_out)
            else:
                found = MaskFile(masks=_clicks_json(document))
        check_outlines(found.masks)
    except MaskError as problem:
        raise MaskError(f"masks {path}: {problem}") from problem
    if not found.masks:
        raise MaskError("; ".join((f"masks {path}: holds no wall and no column of this photo", *found.left_out)))
    return found


def _json(text: str) -> dict[str, Any]:
    try:
        document = parse_json(text)
    except RecursionError as problem:
        raise MaskError("is nested too deeply") from problem
    except ValueError as problem:
        raise MaskError(f"is not JSON: {problem}") from problem
    if not isinstance(document, dict):
        raise MaskError("keys with values are expected, as COCO has them")
    return document


def _png(data: bytes, size: tuple[int, int], classes: Mapping[int, InstanceClass]) -> tuple[GivenMask, ...]:
    outside = look_at(data)
    if outside.problem:
        raise MaskError(outside.problem)
    if (outside.width_px, outside.height_px) != size:
        raise MaskError(
            f"{outside.width_px} x {outside.height_px} px, the left photo has {size[0]} x {size[1]}; "
            "masks are of the ORIGINAL photo"
        )
    try:
        labels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        labels = None
    if labels is None or labels.ndim != 2:
        raise MaskError("a PNG of labels has one channel: 0 for the rest, one number for each wall or column")
    values = [int(value) for value in np.unique(labels) if value]
    if len(values) > MAX_MASKS:
        raise MaskError(f"{len(values)} labels, limit {MAX_MASKS}; is this a photo?")
    unknown = [value for value in values if value not in classes]
    if unknown:
        shown = ", ".join(map(str, unknown[:10]))
        raise MaskError(f"the labels {shown} have no class; say it: --mask-class {unknown[0]}=wall (or =column)")
    return tuple(GivenMask(label=classes[v], name=f"label {v}", pixels=np.asarray(labels == v)) for v in values)


def _clicks_json(document: dict[str, Any]) -> tuple[GivenMask, ...]:
    if document.get("format") != CLICKS or document.get("version") != CLICKS_VERSION:
        raise MaskError(f'is neither COCO (annotations) nor "format": "{CLICKS}", "version": {CLICKS_VERSION}')
    polygons = document.get("polygons")
    if not isinstance(polygons, list) or len(polygons) > MAX_MASKS:
        raise MaskError(f"polygons must be a list of at most {MAX_MASKS}")
    masks: list[GivenMask] = []
    for index, one in enumerate(polygons):
        where = f"polygons[{index}]"
        if not isinstance(one, dict) or not set(one) <= {"class", "points_px", "holes_px"}:
            raise MaskError(f"{where}: class, points_px and, where there are holes, holes_px are expected")
        holes = one.get("holes_px", [])
        if not isinstance(holes, list) or len(holes) > MAX_MASKS:
            raise MaskError(f"{where}.holes_px: a list of polygons is expected")
        rings = tuple(frozen(_ring(ring, where)) for ring in (one.get("points_px"), *holes))
        masks.append(GivenMask(label=_class(one.get("class"), where), name=where, polygons=(rings,)))
    return tuple(masks)


def _clicks_csv(data: bytes) -> tuple[GivenMask, ...]:
    table = csv_table(data, "clicked polygons", MaskError)
    if table.header != CSV_COLUMNS:
        raise MaskError(f"the first line must be {','.join(CSV_COLUMNS)}")
    points: dict[str, list[list[float]]] = {}
    labels: dict[str, InstanceClass] = {}
    for number, row in table.rows:
        if len(row) < len(CSV_COLUMNS) or number > MAX_POINTS:
            raise MaskError(f"line {number}: {len(CSV_COLUMNS)} cells are expected, and at most {MAX_POINTS} lines")
        name, label = row[0], _class(row[1], f"line {number}")
        if labels.setdefault(name, label) != label:
            raise MaskError(f"line {number}: polygon {name} is a {labels[name]} above")
        try:
            points.setdefault(name, []).append([float(row[2]), float(row[3])])
        except ValueError as problem:
            raise MaskError(f"line {number}: x_px and y_px are numbers of pixels") from problem
    if len(points) > MAX_MASKS:
        raise MaskError(f"{len(points)} polygons, limit {MAX_MASKS}")
    return tuple(
        GivenMask(label=labels[name], name=f"polygon {name}", polygons=((frozen(_ring(ring, f"polygon {name}")),),))
        for name, ring in points.items()
    )


def _ring(values: Any, where: str) -> Any:
    if not isinstance(values, list) or not 3 <= len(values) <= MAX_POINTS:
        raise MaskError(f"{where}: three points [x, y] or more are expected")
    ring = ring_of(values, where)
    if ring.ndim != 2 or ring.shape[1] != 2:
        raise MaskError(f"{where}: points [x, y] are expected")
    return ring


def _class(value: Any, where: str) -> InstanceClass:
    if not isinstance(value, str) or value not in _CLASSES:
        raise MaskError(f"{where}: class {value!r:.40} is neither wall nor column")
    return _CLASSES[value]
