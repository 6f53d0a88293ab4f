"""Pictures that leave: sharp where something was measured, cells where an element only was judged, else blur."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.progress.report import ProgressReport, StationRecord
from asbuilt_bim.report.drawings.projected import Decided, decided_faces, distance_to, polygons_in_picture

Rings = tuple[FloatArray, ...]
"""A polygon: its outer ring (N, 2) in pixels, then its holes."""
_NEAR = 0.02  # of the picture's width: what lies so near an outline stays sharp
_COARSE = 40  # cells across a picture: a face at 5 m is one of these, nobody is known by it
_CELL_M = 0.15
"""Where an element is missing one looks past its place, and where it was judged without being measured here somebody
may stand before it: in cells of this size there, twelve to a person, as people are whom a network finds. Who stands
further off is smaller, and has fewer."""
_GREY = 0.5  # of the blur: one sees at once what is shown and what isn't


@dataclass(frozen=True, slots=True, kw_only=True)
class Shower:
    """Knows what of a report's pictures may be shown; made once for all of them."""

    whole: bool
    decided: Decided

    def shown(self, image: ByteImage, station: StationRecord) -> ByteImage:
        """Return a station's picture as it may leave."""
        if self.whole:
            return image
        scale = image.shape[1] / station.width_px
        before = [(np.asarray(ring) + 0.5) * scale for ring in station.before_px if len(ring) >= 3]
        kept, coarse = self._polygons(station, image.shape[1])
        return blurred_but(in_cells(image, coarse), kept, before, _target(station, scale), [one for one, _ in coarse])

    def _polygons(self, station: StationRecord, width: int) -> tuple[list[Rings], list[tuple[Rings, float]]]:
        """Return what was outlined, and what was decided without it, each with its cells' size (px).

        What is decided is so by all stations: this one may see somebody before it.
        """
        scale = width / station.width_px
        kept: list[Rings] = []
        coarse: list[tuple[Rings, float]] = []
        for face in station.faces:
            rings = [(np.asarray(r, dtype=np.float64) + 0.5) * scale for r in face.outline_px if len(r) >= 3]
            kept += [tuple(rings)] if rings else []
        outlined = {key for face in station.faces for key in face.elements}
        for key, faces in self.decided.get(station.name, {}).items():
            for one in faces:
                cell_px = _CELL_M * station.f_px * scale / distance_to(one, station)
                judged = (one.surface.open_uv_m, () if key in outlined else one.surface.built_uv_m)
                coarse += [(r, cell_px) for uv_m in judged for r in polygons_in_picture(one, uv_m, station, width)]
        return kept, coarse


def _target(station: StationRecord, scale: float) -> list[FloatArray]:
    """Return the target's circle (N, 2): it stands before elements, and is what the scale hangs on."""
    if station.target_left_px is None or station.target_radius_px is None:
        return []
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    circle = station.target_radius_px * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return [(np.asarray(station.target_left_px) + 0.5 + circle) * scale]


def shower_of(report: ProgressReport, *, whole: bool) -> Shower:
    """Return what may be shown of a report's pictures: all of them, or elements and what was measured."""
    return Shower(whole=whole, decided={} if whole else decided_faces(report))


def in_cells(image: ByteImage, pieces: Sequence[tuple[Rings, float]]) -> ByteImage:
    """Return a picture in which pieces (rings (N, 2), px) are the means of cells, of so many pixels a side."""
    height, width = image.shape[:2]
    found = image.copy()
    for rings, cell_px in pieces:
        points = np.vstack(rings)
        low = np.clip(np.floor(points.min(axis=0)), 0, [width, height]).astype(int)
        high = np.clip(np.ceil(points.max(axis=0)) + 1, 0, [width, height]).astype(int)
        (x0, y0), (x1, y1) = low.tolist(), high.tolist()
        if x1 <= x0 or y1 <= y0:
            continue
        cell = max(2.0, cell_px)
        size = max(1, round((x1 - x0) / cell)), max(1, round((y1 - y0) / cell))
        small = cv2.resize(image[y0:y1, x0:x1], size, interpolation=cv2.INTER_AREA)
        mask = np.zeros((y1 - y0, x1 - x0), np.uint8)
        cv2.fillPoly(mask, [np.round(np.clip(ring, -width, 2 * width) - low).astype(np.int32) for ring in rings], 1)
        coarse = cv2.resize(small, (x1 - x0, y1 - y0), interpolation=cv2.INTER_LINEAR)
        found[y0:y1, x0:x1][mask > 0] = coarse[mask > 0]
    return found


def blurred_but(
    image: ByteImage,
    polygons: Sequence[Rings],
    before: Sequence[FloatArray] = (),
    target: Sequence[FloatArray] = (),
    inside: Sequence[Rings] = (),
) -> ByteImage:
    """Return a picture that is as it was in and near polygons (rings (N, 2), px) alone: people between are grey blur.

    It is as it was `inside` others too, not near them. What stands `before` all of them is blur, but for the `target`.
    """
    height, width = image.shape[:2]
    sharp = np.zeros((height, width), dtype=np.uint8)
    limit = 16.0 * width
    for rings in polygons:  # one by one: where two overlap, both are sharp
        cv2.fillPoly(sharp, [np.round(np.clip(ring, -limit, limit)).astype(np.int32) for ring in rings], 255)
    near = max(3, round(_NEAR * width))
    sharp = np.asarray(cv2.dilate(sharp, np.ones((near, near), np.uint8)), dtype=np.uint8)
    for rings in inside:
        cv2.fillPoly(sharp, [np.round(np.clip(ring, -limit, limit)).astype(np.int32) for ring in rings], 255)
    for value, edges in ((0, before), (255, target)):
        for ring in edges:
            cv2.fillPoly(sharp, [np.round(np.clip(ring, -limit, limit)).astype(np.int32)], value)
    size = (min(_COARSE, width), max(1, min(round(_COARSE * height / width), height)))
    coarse = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(cv2.cvtColor(coarse, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    faded = cv2.addWeighted(coarse, 1.0 - _GREY, grey, _GREY, 0.0)
    blurred = cv2.resize(faded, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.where(sharp[:, :, None] > 0, image, blurred).astype(np.uint8)
