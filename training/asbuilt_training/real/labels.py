"""Our labels of real photographs: polygons in COCO's shape, painted in their order; the photographs lie elsewhere."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

Distance = Literal["far", "ground"]
LABELS = Path(__file__).resolve().parents[2] / "real" / "labels"
REST, WALL, COLUMN, STONE, UNCLEAR = 0, 1, 2, 3, 255
KINDS = {"rest": REST, "wall": WALL, "column": COLUMN, "stone column": STONE, "unclear": UNCLEAR}
"""What a polygon may be, and its value in a map of kinds."""
STEP = 16
"""cv2.fillPoly takes sixteenths of a pixel: corners of polygons needn't be rounded to whole ones."""

Kinds = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """One polygon: its label, and its corners (N, 2) in pixels of the whole photo, integers being pixel centres."""

    label: str
    corners_px: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledPhoto:
    """One photo by its path below the data folder, what was drawn on it, and from where it looks."""

    file: str
    sha256: str
    size_px: tuple[int, int]  # width, height
    view: str  # photos of one view show the same place from the same place
    distance: Distance
    shapes: tuple[Shape, ...]  # a later one lies over an earlier one

    def kinds(self, width_px: int | None = None) -> Kinds:
        """Return the labels as a map of kinds, uint8 (h, w), at the photo's size or at a smaller width."""
        width, height = self.size_px
        scale = 1.0 if width_px is None else width_px / width
        drawn: Kinds = np.zeros((round(height * scale), round(width * scale)), dtype=np.uint8)
        for shape in self.shapes:
            corners = (shape.corners_px + 0.5) * scale - 0.5
            cv2.fillPoly(drawn, [np.rint(corners * STEP).astype(np.int32)], KINDS[shape.label], shift=4)
        return drawn

    def is_there(self, data: Path) -> bool:
        """Say whether the photo lies in the data folder, byte for byte the one that was labelled."""
        path = data / self.file
        return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == self.sha256


def read_labels(folder: Path = LABELS) -> list[LabelledPhoto]:
    """Read all label files of a folder.

    Raises:
        ValueError: a file isn't in our shape; the message names it.
    """
    return [photo for path in sorted(folder.glob("*.json")) for photo in _of_file(path)]


def _of_file(path: Path) -> list[LabelledPhoto]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        names = {one["id"]: one["name"] for one in document["categories"]}
        shapes: dict[int, list[Shape]] = {}
        for one in document["annotations"]:
            (flat,) = one["segmentation"]
            corners = np.asarray(flat, dtype=np.float64).reshape(-1, 2)
            shapes.setdefault(one["image_id"], []).append(Shape(label=names[one["category_id"]], corners_px=corners))
        return [
            LabelledPhoto(
                file=one["file_name"], sha256=one["sha256"], size_px=(one["width"], one["height"]), view=one["view"],
                distance=one["distance"], shapes=tuple(shapes.get(one["id"], ())),
            )
            for one in document["images"]
        ]  # fmt: skip
    except (KeyError, TypeError, ValueError) as problem:
        raise ValueError(f"labels {path}: not in the shape of our COCO files ({problem!r})") from problem
