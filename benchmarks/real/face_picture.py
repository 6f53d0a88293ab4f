"""What was measured, drawn over the photo: outlines with their areas, and the truth's regions tinted."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.photo.read import decode
from asbuilt_bim.measure.pair import PairMeasurement
from benchmarks.real.face_truth import plain_regions
from benchmarks.real.shots import Shot
from benchmarks.real.truth_planes import Region, upright_regions

COLOURS = ((60, 60, 255), (60, 220, 60), (255, 120, 40), (40, 220, 255), (255, 60, 220), (220, 220, 40))
TINT = np.array([255.0, 180.0, 90.0])


def draw(path: Path, shot: Shot, found: PairMeasurement) -> None:
    """Write a picture of the left photo with every face's outline, number and area, and the regions.

    Those are the truth's; where there is none they are plain matching's, and the photo is the rectified one.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    rectified = shot.truth_px is None
    image = (found.detail.pair.left if rectified else decode(shot.photos.left)).astype(np.float64)
    for region in _regions(shot, found):
        image[region.mask] = 0.6 * image[region.mask] + 0.4 * TINT
    canvas = np.ascontiguousarray(image.astype(np.uint8))
    for number, face in enumerate(found.faces):
        colour = COLOURS[number % len(COLOURS)]
        outline = face.outline_px if rectified else found.photo_outline_px(face)
        rings = [np.round(ring).astype(np.int32) for ring in outline]
        cv2.polylines(canvas, rings, True, colour, 2)
        x, y = rings[0].mean(axis=0)
        text = f"{face.face_id.rsplit('/', 1)[1]}: {face.area_m2:.2f}+-{face.area_sigma_m2:.2f}"
        cv2.putText(canvas, text, (max(int(x) - 40, 0), int(y)), cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)
    cv2.imwrite(str(path), canvas)


def _regions(shot: Shot, found: PairMeasurement) -> list[Region]:
    if shot.truth_px is None:
        return plain_regions(found)
    return upright_regions(shot.truth_px, shot.rays(), shot.focal_baseline)
