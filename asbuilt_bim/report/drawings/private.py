"""Pictures that leave: sharp where elements stand or should stand, and where something was measured; grey blur else."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.progress.report import ProgressReport, StationRecord
from asbuilt_bim.report.drawings.projected import Decided, decided_faces, polygons_in_picture

Rings = tuple[FloatArray, ...]
"""A polygon: its outer ring (N, 2) in pixels, then its holes."""
_NEAR = 0.02  # of the picture's width: what lies so near an outline stays sharp
_COARSE = 40  # cells across a picture: a face at 5 m is one of these, nobody is known by it
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
        return blurred_but(image, self._polygons(station, image.shape[1]))

    def _polygons(self, station: StationRecord, width: int) -> list[Rings]:
        """Return what was outlined, and what was decided of elements: as open, and as built where no outline shows it.

        What stands before an element hides it: it was not decided there, as far as this station alone says so.
        """
        scale = width / station.width_px
        kept: list[Rings] = []
        for face in station.faces:
            rings = [(np.asarray(r, dtype=np.float64) + 0.5) * scale for r in face.outline_px if len(r) >= 3]
            kept += [tuple(rings)] if rings else []
        outlined = {key for face in station.faces for key in face.elements}
        for key, faces in self.decided.get(station.name, {}).items():
            for one in faces:
                kept += polygons_in_picture(one, one.surface.open_uv_m, station, width)
                if key not in outlined:
                    kept += polygons_in_picture(one, one.surface.built_uv_m, station, width)
        if station.target_left_px is not None and station.target_radius_px is not None:
            turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
            circle = station.target_radius_px * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            kept.append(((np.asarray(station.target_left_px) + 0.5 + circle) * scale,))
        return kept


def shower_of(report: ProgressReport, *, whole: bool) -> Shower:
    """Return what may be shown of a report's pictures: all of them, or elements and what was measured."""
    return Shower(whole=whole, decided={} if whole else decided_faces(report))


def blurred_but(image: ByteImage, polygons: Sequence[Rings]) -> ByteImage:
    """Return a picture that is sharp in and near polygons (rings (N, 2), px) alone: people between are grey blur."""
    height, width = image.shape[:2]
    sharp = np.zeros((height, width), dtype=np.uint8)
    limit = 16.0 * width
    for rings in polygons:  # one by one: where two overlap, both are sharp
        cv2.fillPoly(sharp, [np.round(np.clip(ring, -limit, limit)).astype(np.int32) for ring in rings], 255)
    near = max(3, round(_NEAR * width))
    sharp = np.asarray(cv2.dilate(sharp, np.ones((near, near), np.uint8)), dtype=np.uint8)
    size = (min(_COARSE, width), max(1, min(round(_COARSE * height / width), height)))
    coarse = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(cv2.cvtColor(coarse, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    faded = cv2.addWeighted(coarse, 1.0 - _GREY, grey, _GREY, 0.0)
    blurred = cv2.resize(faded, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.where(sharp[:, :, None] > 0, image, blurred).astype(np.uint8)
