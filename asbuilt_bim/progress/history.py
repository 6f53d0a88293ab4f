"""What earlier visits decided, kept on the faces and dates of the elements; made from reports alone."""

from dataclasses import dataclass, field, replace
from datetime import date
from functools import partial

import numpy as np

from asbuilt_bim.bim.cells import element_cells
from asbuilt_bim.bim.model import BimElement, DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import DesignFaceRecord, ElementProgress, MarkerRecord, ProgressReport
from asbuilt_bim.progress.surface import SurfaceState

SAME_ANGLE_RAD = float(np.radians(5.0))
"""A face of a revised model that is turned no further from an old one of its element may take over what was seen."""
STILL_M = 0.002
"""What a face's corner may move between two exports: rounding, no revision."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VisitHistory:
    """What is known from earlier visits: faces with their states, and dates, by the elements' GlobalIds."""

    visits: tuple[date, ...]
    faces: dict[str, tuple[DesignFaceRecord, ...]]
    first_built: dict[str, date]  # the first visit that saw something of it built, of what is still held to stand
    complete_on: dict[str, date]  # the first visit since which it has been complete, and certainly so
    elements: dict[str, ElementProgress]  # what the last visit said of each
    moves_m: dict[str, FloatArray]  # of elements that stand beside their design
    markers: dict[int, MarkerRecord] = field(default_factory=dict)  # those that nobody surveyed

    def earlier(self, element: str, face: DesignFace, options: ProgressOptions) -> SurfaceState | None:
        """Return what is known of a face: by its id where it stands where it stood, else re-projected in the world.

        An id follows from the element's own geometry: a wall that a revision moved keeps it, and what was seen of it
        was seen elsewhere. It counts where it would if its photos were judged by the new design.
        """
        own = self.faces.get(element, ())
        for record in own:
            if record.face_id == face.face_id and stands_still(frame_of(record), face.frame):
                return record.surface
        for record in own:
            moved = _reprojected(record, face, options)
            if moved is not None:
                return moved
        return None

    def as_it_stood(self, element: BimElement) -> ElementProgress | None:
        """Return what the last visit said of an element; None where nobody saw it, it moved, or other cells show."""
        last = self.elements.get(element.global_id)
        if last is None or last.last_seen is None:
            return None
        frames = {record.face_id: frame_of(record) for record in self.faces.get(element.global_id, ())}
        still = (face.face_id in frames and stands_still(frames[face.face_id], face.frame) for face in element.faces)
        cells = last.cells_built + last.cells_open + last.cells_unknown + last.cells_conflict
        return last if cells == element_cells(element).count and all(still) else None


EMPTY_HISTORY = VisitHistory(visits=(), faces={}, first_built={}, complete_on={}, elements={}, moves_m={})


def remember(history: VisitHistory, report: ProgressReport) -> VisitHistory:
    """Return the history with one more visit, of which the report already holds what was known before."""
    day = report.visit_date
    faces: dict[str, tuple[DesignFaceRecord, ...]] = {}
    for record in report.faces:
        faces[record.element] = (*faces.get(record.element, ()), record)
    built = {e.global_id: e.first_built or day for e in report.elements if e.cells_built > 0.0}
    complete = {e.global_id: e.complete_on or day for e in report.elements if _certain(e, report.complete_from)}
    return VisitHistory(
        visits=tuple(sorted({*history.visits, *report.earlier_visits, day})),
        faces=history.faces | faces,
        first_built={key: min(since, history.first_built.get(key, since)) for key, since in built.items()},
        complete_on={key: min(since, history.complete_on.get(key, since)) for key, since in complete.items()},
        elements=history.elements | {e.global_id: e for e in report.elements},
        moves_m={e.global_id: frozen(np.array(e.move_m)) for e in report.elements if e.move_m is not None},
        markers=history.markers | {record.marker_id: record for record in report.markers},
    )


def _certain(element: ElementProgress, complete_from: float) -> bool:
    """Say whether an element is complete beyond what was not seen of it; results of before said so of all that are."""
    return element.state == "complete" and element.completion.lower >= complete_from


def frame_of(record: DesignFaceRecord) -> PlaneFrame | CylinderFrame:
    """Return a kept face's frame."""
    first, second, third = (frozen(row) for row in record.frame_m)
    if record.kind == "plane":
        return PlaneFrame(origin_m=first, u=second, v=third)
    return CylinderFrame(origin_m=first, axis=second, zero=third, radius_m=record.radius_m)


def stands_still(old: PlaneFrame | CylinderFrame, new: PlaneFrame | CylinderFrame) -> bool:
    """Say whether two frames of one face lie in the same place of the world, to `STILL_M` a metre out."""
    probes = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    return bool(np.linalg.norm(old.from_uv(probes) - new.from_uv(probes), axis=1).max() < STILL_M)


def _reprojected(record: DesignFaceRecord, face: DesignFace, options: ProgressOptions) -> SurfaceState | None:
    old, new = frame_of(record), face.frame
    if isinstance(old, PlaneFrame) and isinstance(new, PlaneFrame):
        if old.normal @ new.normal < np.cos(SAME_ANGLE_RAD) or _stands_off(record.surface, old, new, options):
            return None
        carry = partial(_on_plane, old, new)
    elif isinstance(old, CylinderFrame) and isinstance(new, CylinderFrame):
        off = np.linalg.norm(np.cross(old.origin_m - new.origin_m, new.axis)) + abs(old.radius_m - new.radius_m)
        if old.axis @ new.axis < np.cos(SAME_ANGLE_RAD) or off > options.building_tolerance_m:
            return None
        carry = partial(_unrolled_onto, old, new)
    else:
        return None

    def carried(region: Region) -> Region:
        return polygon.intersection(carry(region), face.exposed_uv_m) if region else ()

    surface = record.surface
    built, opened = carried(surface.built_uv_m), carried(surface.open_uv_m)
    outline = carried(surface.outline_uv_m)
    if not built and not opened and not outline:
        return None
    stretch = new.radius_m / old.radius_m if isinstance(new, CylinderFrame) and isinstance(old, CylinderFrame) else 1.0
    before = polygon.area(surface.outline_uv_m) * stretch  # a smaller face keeps its share of what was measured
    left = min(polygon.area(outline) / before, 1.0) if before > 0.0 else 0.0
    measured = surface.as_built_area_m2
    return replace(
        surface,
        face_id=face.face_id,
        built_uv_m=built,
        open_uv_m=opened,
        outline_uv_m=outline,
        row_log_odds=None,  # its rows are others
        built_area_m2=polygon.area(built),
        open_area_m2=polygon.area(opened),
        as_built_area_m2=measured * left if measured is not None and outline else None,
        as_built_sigma_calibration_m2=surface.as_built_sigma_calibration_m2 * left,
        as_built_sigma_image_m2=surface.as_built_sigma_image_m2 * left,
        offset_m=_offset_m(surface, old, new),  # its tilt is from plumb, whatever the design
    )


def _offset_m(surface: SurfaceState, old: PlaneFrame | CylinderFrame, new: PlaneFrame | CylinderFrame) -> float | None:
    """Return how far from its new design what was measured stands, in the middle of where it was measured."""
    seen = surface.outline_uv_m or surface.built_uv_m
    if surface.offset_m is None or not seen:
        return surface.offset_m
    at = old.from_uv(polygon.centroid(seen), surface.offset_m)
    return float(new.plane.distance_m(at) if isinstance(new, PlaneFrame) else new.distance_m(at))


def _stands_off(surface: SurfaceState, old: PlaneFrame, new: PlaneFrame, options: ProgressOptions) -> bool:
    """Say whether what was seen stands further off its new design than concrete may, by its measured plane if any."""
    seen = surface.outline_uv_m or surface.built_uv_m
    at = old.from_uv(polygon.centroid(seen)) if seen else old.origin_m
    off = _offset_m(surface, old, new)
    if off is None:
        return bool(abs(new.plane.distance_m(at)) > options.building_tolerance_m)
    return abs(off) > options.building_tolerance_m + 2.0 * (surface.offset_sigma_m or 0.0)


def _on_plane(old: PlaneFrame, new: PlaneFrame, region: Region) -> Region:
    return polygon.region_of([[new.to_uv(old.from_uv(ring)) for ring in rings] for rings in region])


def _unrolled_onto(old: CylinderFrame, new: CylinderFrame, region: Region) -> Region:
    """Return a region on a cylinder of another seam and radius: turned, stretched, and wrapped round the new seam."""
    side = np.cross(new.axis, new.zero)
    turn = float(np.arctan2(old.zero @ side, old.zero @ new.zero))
    rise = float((old.origin_m - new.origin_m) @ new.axis)
    girth = 2.0 * np.pi * new.radius_m
    stretch = np.array([new.radius_m / old.radius_m, 1.0])
    turned = [
        polygon.region_of([[ring * stretch + [new.radius_m * turn + wrap * girth, rise] for ring in r] for r in region])
        for wrap in (-1, 0, 1)
    ]
    return polygon.union(turned)
