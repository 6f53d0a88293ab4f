"""Simulated visits of a hall: several stations that see the same boxes and the same prints, and where each stood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.solve import project_both
from asbuilt_bim.vision.markers.find import MarkerSighting
from benchmarks.register.design_seen import (
    CAMERA,
    Box,
    column,
    design_of,
    hidden,
    measured,
    segments_of,
    standing,
    wall,
)

STATIONS, PRINTS = 6, 24
PRINT_M, FROM_EDGE_M = 0.25, 0.15
READ_M, READ_COSINE, NOISE_PX = (0.8, 9.0), 0.35, 0.08
"""From where a print is read, and how well."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenVisit:
    """Stations of one visit with their true poses (4, 4), and the design that they are looked for in."""

    stations: tuple[StationMeasurement, ...]
    true: tuple[FloatArray, ...]
    design: BimModel


def hall(rng: np.random.Generator) -> list[Box]:
    """Return two walls at a corner and some columns of different widths."""
    wide, deep = rng.uniform(6.0, 10.0), rng.uniform(6.0, 9.0)
    boxes = [wall((-wide, deep), (wide, deep)), wall((wide, deep), (wide, -deep))]
    for _ in range(int(rng.integers(4, 9))):
        middle = float(rng.uniform(-4.0, 4.0)), float(rng.uniform(2.5, deep - 1.0))
        boxes.append(column(middle, float(rng.choice([0.3, 0.35, 0.4, 0.5, 0.6]))))
    return boxes


def hall_visit(rng: np.random.Generator, *, prints: bool, mirrored: bool = False) -> SeenVisit:
    """Return a visit of a hall, part of it not built; `mirrored`: what stands there is the design's mirror image."""
    boxes = hall(rng)
    built = [box.mirrored() if mirrored else box for box in boxes if rng.random() < 0.8]
    there = design_of(built)
    squares = [square for box in built for square in _prints(box, rng)] if prints else []
    chosen = [squares[k] for k in rng.permutation(len(squares))[:PRINTS]]
    true = [standing(rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 1.0), rng.uniform(-50.0, 50.0)) for _ in range(STATIONS)]
    stations = [
        _reading(measured(there, pose, int(rng.integers(1 << 30)), f"A{k}"), pose, chosen, there, rng)
        for k, pose in enumerate(true)
    ]
    return SeenVisit(stations=tuple(stations), true=tuple(true), design=design_of(boxes))


def _prints(box: Box, rng: np.random.Generator) -> list[FloatArray]:
    """Return corners (4, 3) of prints on the sides of a box, none where a side is too narrow."""
    found = []
    corners = box.corners()
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.linalg.norm(end - start))
        for _ in range(max(1, int(length / 2.0))):
            if length > 2.0 * FROM_EDGE_M:
                along = np.append((end - start) / length, 0.0)
                middle = np.append(start, rng.uniform(0.8, 2.2))
                middle = middle + rng.uniform(FROM_EDGE_M, length - FROM_EDGE_M) * along
                up, half = np.array([0.0, 0.0, 1.0]), 0.5 * PRINT_M
                found.append(
                    np.array([middle + half * (a * along + b * up) for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))])
                )
    return found


def _reading(
    station: StationMeasurement, pose: FloatArray, prints: list[FloatArray], there: BimModel, rng: np.random.Generator
) -> StationMeasurement:
    """Return a station that reads the prints in its view, too."""
    seen = []
    segments = segments_of(there)
    for number, corners in enumerate(prints):
        outwards = np.cross(corners[1] - corners[0], corners[0] - corners[3])
        outwards /= np.linalg.norm(outwards)
        middle = corners.mean(axis=0)
        away = pose[:3, 3] - middle
        far = float(np.linalg.norm(away))
        if not READ_M[0] < far < READ_M[1] or away @ outwards < READ_COSINE * far:
            continue
        if ((corners - pose[:3, 3]) @ pose[:3, 2]).min() < 0.5:
            continue
        pixels, _ = project_both(station.camera, pose, corners)
        inside = (pixels > 5.0).all() and (pixels < np.tile([CAMERA.width_px - 5.0, CAMERA.height_px - 5.0], 2)).all()
        if inside and not hidden(pose[:2, 3], (middle + 0.01 * outwards)[None, :2], segments)[0]:
            pixels = pixels + rng.normal(0.0, NOISE_PX, pixels.shape)
            seen.append(
                MarkerSighting(marker_id=number, left_px=frozen(pixels[:, :2]), right_px=frozen(pixels[:, 2:]),
                               sigma_px=NOISE_PX)
            )  # fmt: skip
    return replace(station, markers=tuple(seen))
