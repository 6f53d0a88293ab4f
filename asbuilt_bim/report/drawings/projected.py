"""Where a station's photo has what the design holds: corners of design faces in pixels of its rectified left photo."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.progress.report import DesignFaceRecord, ProgressReport, StationRecord

NEAREST_M = 0.3
"""Before the camera: nearer points of a design have no place in a picture."""
Decided = Mapping[str, Mapping[str, Sequence[DesignFaceRecord]]]
"""By station and GlobalId: the design faces that the station's photo decided something of."""


def decided_faces(report: ProgressReport) -> Decided:
    """Return which faces each station decided something of; one look over all faces, for all stations."""
    found: dict[str, dict[str, list[DesignFaceRecord]]] = {}
    for face in report.faces:
        for station in face.surface.stations:
            found.setdefault(station, {}).setdefault(face.element, []).append(face)
    return found


def hull_in_picture(
    faces: Sequence[DesignFaceRecord], station: StationRecord, width: int, height: int
) -> FloatArray | None:
    """Return the hull (N, 2) of faces in a picture of a station, px, within its borders; None where it has none."""
    if station.world_from_left is None:
        return None
    seen = np.vstack([np.zeros((0, 2)), *(projected(face, station) for face in faces)])
    if len(seen) < 3:
        return None
    ring = cv2.convexHull(((seen + 0.5) * width / station.width_px).astype(np.float32)).reshape(-1, 2)
    inside: FloatArray = np.clip(ring.astype(np.float64), 0.0, [width, height])
    return inside if np.ptp(inside, axis=0).min() > 1.0 else None


def polygons_in_picture(
    face: DesignFaceRecord, region: Region, station: StationRecord, width: int
) -> list[tuple[FloatArray, ...]]:
    """Return polygons of a face's surface in a picture of a station, each its outer ring (N, 2; px) and its holes."""
    found = []
    for polygon in region if station.world_from_left is not None else ():
        rings = [_pixels(surface_m(face, np.asarray(ring)), station) for ring in polygon if len(ring) >= 3]
        if rings and all(len(ring) for ring in rings):
            found.append(tuple((ring + 0.5) * width / station.width_px for ring in rings))
    return found


def surface_m(face: DesignFaceRecord, uv_m: FloatArray) -> FloatArray:
    """Return world points (N, 3) of points (N, 2) of a face's surface, in metres along its u and v."""
    origin, first, second = face.frame_m
    if face.kind == "plane":
        flat: FloatArray = origin + uv_m[:, :1] * first + uv_m[:, 1:2] * second
        return flat
    angle = uv_m[:, :1] / face.radius_m  # u runs along the lateral surface
    round_it = face.radius_m * (np.cos(angle) * second + np.sin(angle) * np.cross(first, second))
    lateral: FloatArray = origin + uv_m[:, 1:2] * first + round_it
    return lateral


def distance_to(face: DesignFaceRecord, station: StationRecord) -> float:
    """Return how far (m) a face's nearest corner is from a placed station, `NEAREST_M` at least."""
    corners = corners_m(face)
    if station.world_from_left is None or not len(corners):
        return NEAREST_M
    return max(NEAREST_M, float(np.linalg.norm(corners - station.world_from_left[:3, 3], axis=1).min()))


def projected(face: DesignFaceRecord, station: StationRecord) -> FloatArray:
    """Return the corners (N, 2) of a face in a station's rectified pixels; none of a face that reaches past it."""
    return _pixels(corners_m(face), station)


def _pixels(world: FloatArray, station: StationRecord) -> FloatArray:
    """Return world points (N, 3) in a station's rectified pixels (N, 2); none where one lies behind the camera."""
    assert station.world_from_left is not None
    left_from_world = np.linalg.inv(station.world_from_left)
    left = world @ left_from_world[:3, :3].T + left_from_world[:3, 3]
    x, y, z = (left @ station.rectified_from_left.T).T
    if not len(world) or z.min() < NEAREST_M:
        return np.zeros((0, 2))
    return np.stack([station.f_px * x / z + station.cx_px, station.f_px * y / z + station.cy_px], axis=1)


def corners_m(face: DesignFaceRecord) -> FloatArray:
    """Return world points (N, 3) round a face's exposed surface; of a lateral surface two whole circles."""
    rings = [polygon[0] for polygon in face.exposed_uv_m if polygon and len(polygon[0])]
    if not rings:
        return np.zeros((0, 3))
    uv, (origin, first, second) = np.vstack(rings), face.frame_m
    if face.kind == "plane":
        flat: FloatArray = origin + uv[:, :1] * first + uv[:, 1:2] * second
        return flat
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)[:, None]
    circle = face.radius_m * (np.cos(angles) * second + np.sin(angles) * np.cross(first, second))
    levels = [origin + level * first + circle for level in (uv[:, 1].min(), uv[:, 1].max())]
    return np.vstack(levels)
