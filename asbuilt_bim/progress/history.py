"""What earlier visits decided, kept on the faces and dates of the elements; made from reports alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.report import DesignFaceRecord, ProgressReport
from asbuilt_bim.progress.surface import SurfaceState

SAME_ANGLE_RAD = float(np.radians(5.0))
SAME_OFFSET_M = 0.10
"""A face of a revised model that lies no further from an old one of its element takes over what was seen of it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VisitHistory:
    """What is known from earlier visits: faces with their states, and dates, by the elements' GlobalIds."""

    visits: tuple[date, ...]
    faces: dict[str, tuple[DesignFaceRecord, ...]]
    first_built: dict[str, date]  # the first visit that saw something of it built
    complete_on: dict[str, date]  # the first visit that found it complete
    last_seen: dict[str, date]

    def earlier(self, element: str, face: DesignFace) -> SurfaceState | None:
        """Return what is known of a face, by its id, or re-projected in the world from a face of the same element."""
        own = self.faces.get(element, ())
        for record in own:
            if record.face_id == face.face_id:
                return record.surface
        for record in own:
            moved = _reprojected(record, face)
            if moved is not None:
                return moved
        return None


EMPTY_HISTORY = VisitHistory(visits=(), faces={}, first_built={}, complete_on={}, last_seen={})


def remember(history: VisitHistory, report: ProgressReport) -> VisitHistory:
    """Return the history with one more visit, of which the report already holds what was known before."""
    day = report.visit_date
    faces: dict[str, tuple[DesignFaceRecord, ...]] = {}
    for record in report.faces:
        faces[record.element] = (*faces.get(record.element, ()), record)
    built = {e.global_id for e in report.elements if e.cells_built > 0.0}
    complete = {e.global_id for e in report.elements if e.state == "complete"}
    return VisitHistory(
        visits=(*history.visits, day),
        faces=history.faces | faces,
        first_built={key: day for key in built} | history.first_built,
        complete_on={key: day for key in complete} | history.complete_on,
        last_seen=history.last_seen | {e.global_id: e.last_seen for e in report.elements if e.last_seen is not None},
    )


def frame_of(record: DesignFaceRecord) -> PlaneFrame | CylinderFrame:
    """Return a kept face's frame."""
    first, second, third = (frozen(row) for row in record.frame_m)
    if record.kind == "plane":
        return PlaneFrame(origin_m=first, u=second, v=third)
    return CylinderFrame(origin_m=first, axis=second, zero=third, radius_m=record.radius_m)


def _reprojected(record: DesignFaceRecord, face: DesignFace) -> SurfaceState | None:
    old, new = frame_of(record), face.frame
    if not isinstance(old, PlaneFrame) or not isinstance(new, PlaneFrame):
        return None
    if old.normal @ new.normal < np.cos(SAME_ANGLE_RAD) or abs(new.plane.distance_m(old.origin_m)) > SAME_OFFSET_M:
        return None

    def carried(region: Region) -> Region:
        moved = polygon.region_of([[new.to_uv(old.from_uv(ring)) for ring in rings] for rings in region])
        return polygon.intersection(moved, face.exposed_uv_m)

    surface = record.surface
    return replace(
        surface,
        face_id=face.face_id,
        built_uv_m=carried(surface.built_uv_m),
        open_uv_m=carried(surface.open_uv_m),
        outline_uv_m=carried(surface.outline_uv_m),
    )
