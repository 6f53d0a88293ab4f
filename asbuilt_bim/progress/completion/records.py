"""Stations, measured faces and design faces as the result keeps them."""

from collections.abc import Collection, Mapping, Sequence
from datetime import date

import numpy as np

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.standing_before import standing_before
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.report import DesignFaceRecord, FaceRecord, MarkerRecord, StationRecord
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.register.pose import StationPose
from asbuilt_bim.register.tags import TagPlace


def station_record(
    station: StationMeasurement,
    pose: StationPose | None,
    day: date,
    matches: Mapping[str, Sequence[FaceMatch]],
    parts: Collection[str] = (),
) -> StationRecord:
    """Return a station's record; photo paths and picture stay "" until the edge, which knows files, fills them in.

    `parts` are the ids of faces that looked whole and aren't.
    """
    camera, target = station.camera, station.target
    return StationRecord(
        name=station.station,
        day=day,
        left_photo="",
        right_photo="",
        left_digest=station.left_digest,
        right_digest=station.right_digest,
        f_px=camera.f_px,
        cx_px=camera.cx_px,
        cy_px=camera.cy_px,
        baseline_m=camera.baseline_m,
        width_px=camera.width_px,
        height_px=camera.height_px,
        rectified_from_left=camera.rectified_from_left,
        world_from_left=pose.world_from_left if pose else None,
        pose_covariance=pose.covariance if pose else None,
        pose_residual_px=pose.residual_px if pose and (pose.markers_used or not pose.linked_to) else None,
        pose_method=pose.method if pose else "",
        markers_used=pose.markers_used if pose else (),
        linked_to=pose.linked_to if pose else (),
        before_px=standing_before(station) if station.before_px is None else station.before_px,
        target_left_px=target.left_px if target else None,
        target_right_px=target.right_px if target else None,
        target_radius_px=target.radius_px if target else None,
        target_depth_m=target.depth_m if target else None,
        target_depth_sigma_m=target.depth_sigma_m if target else None,
        target_range_m=target.range_m if target else None,
        target_diameter_m=target.diameter_m if target else None,
        faces=tuple(
            face_record(face, pose, matches.get(face.face_id, ()), face.whole and face.face_id not in parts)
            for face in station.faces
        ),
        picture="",
        seconds=station.seconds,
    )


def face_record(face: MeasuredFace, pose: StationPose | None, matches: Sequence[FaceMatch], whole: bool) -> FaceRecord:
    """Return a measured face's record, its outline in world metres where the station is placed."""
    rings: tuple[FloatArray, ...] = ()
    if pose is not None:
        frame = face.frame.moved(pose.world_from_left)
        rings = tuple(frozen(frame.from_uv(ring)) for ring in face.outline_uv_m)
    return FaceRecord(
        face_id=face.face_id,
        label=face.label,
        kind="cylinder" if isinstance(face.frame, CylinderFrame) else "plane",
        outline_px=face.outline_px,
        outline_world_m=rings,
        area_m2=face.area_m2,
        area_sigma_calibration_m2=face.area_sigma_calibration_m2,
        area_sigma_image_m2=face.area_sigma_image_m2,
        whole=whole,
        cut_by_frame=face.cut_by_frame,
        occluded=face.occluded,
        width_m=face.width_m,
        height_m=face.height_m,
        width_px=face.width_px,
        design_faces=tuple(match.design_face for match in matches),
        elements=tuple(dict.fromkeys(match.element for match in matches)),
        source=face.source,
        segmenter=face.segmenter,
    )


def design_face_record(face: DesignFace, surface: SurfaceState) -> DesignFaceRecord:
    """Return a design face's record with its state."""
    frame = face.frame
    if isinstance(frame, CylinderFrame):
        rows, radius = [frame.origin_m, frame.axis, frame.zero], frame.radius_m
    else:
        rows, radius = [frame.origin_m, frame.u, frame.v], 0.0
    return DesignFaceRecord(
        face_id=face.face_id,
        element=face.element,
        kind="cylinder" if isinstance(frame, CylinderFrame) else "plane",
        role=face.role,
        frame_m=frozen(np.stack(rows)),
        radius_m=radius,
        area_m2=face.area_m2,
        exposed_area_m2=face.exposed_area_m2,
        exposed_uv_m=face.exposed_uv_m,
        surface=surface,
    )


def marker_records(
    found: Mapping[int, TagPlace], before: Mapping[int, MarkerRecord], day: date, moved: Collection[int]
) -> tuple[MarkerRecord, ...]:
    """Return the markers that nobody surveyed, each where it is known best; one that was moved where it is now."""
    records = dict(before)
    for marker_id, place in found.items():
        known = before.get(marker_id)
        if known is not None and marker_id not in moved and place_of(known).sigma_m < place.sigma_m:
            continue
        records[marker_id] = MarkerRecord(
            marker_id=marker_id,
            world_from_marker=frozen(place.world_from_tag),
            size_m=place.size_m,
            marker_covariance=frozen(place.covariance),
            found_on=day,
        )
    return tuple(records[marker_id] for marker_id in sorted(records))


def place_of(record: MarkerRecord) -> TagPlace:
    """Return a marker's place as registration takes it."""
    return TagPlace(world_from_tag=record.world_from_marker, size_m=record.size_m, covariance=record.marker_covariance)
