"""Where tags and the target are: print on boards before the concrete, which holds neither a plane nor an edge."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.vision.markers.find import MarkerSighting
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.target.find import TargetSighting

BOARD_SHARE = 1.75
"""A tag's board over its black square: the quiet zone is one or two of its eight to ten cells on each side."""
DISC_SHARE = 1.25
MOST_COVERED = 0.4
"""An instance that is print for this share is a board on a stand."""


def marks_mask(shape: tuple[int, ...], markers: Sequence[MarkerSighting], target: TargetSighting | None) -> BoolArray:
    """Return the pixels (H, W) that boards of markers and the target cover in the rectified left photo."""
    canvas = np.zeros(shape[:2], dtype=np.uint8)
    for marker in markers:
        centre = marker.left_px.mean(axis=0)
        quad: FloatArray = centre + BOARD_SHARE * (marker.left_px - centre)
        cv2.fillPoly(canvas, [np.round(quad).astype(np.int32)], 1)
    if target is not None:
        cx, cy, major, minor, angle = target.ellipse_left
        axes = (max(1, round(0.5 * DISC_SHARE * major)), max(1, round(0.5 * DISC_SHARE * minor)))
        cv2.ellipse(canvas, (round(cx), round(cy)), axes, float(np.degrees(angle)), 0, 360, 1, -1)
    return canvas > 0


def without_boards(instances: Sequence[Instance], marks: BoolArray) -> list[Instance]:
    """Drop the instances that are boards on stands."""
    kept: list[Instance] = []
    for instance in instances:
        x0, y0, x1, y1 = instance.box_px
        mask = instance.mask[y0:y1, x0:x1]
        covered = np.count_nonzero(mask & marks[y0:y1, x0:x1])
        if covered < MOST_COVERED * np.count_nonzero(mask):
            kept.append(instance)
    return kept
