"""Lets the design's directions steady the measured areas: softly, tested, and never the offsets or tilts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from asbuilt_bim.bim.model import BimModel, DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.plane import Plane, PlaneFrame, frame_on_plane
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.geometry.transform import inverse, rotate, unit
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.regions import mapped
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.register.pose import StationPose
from asbuilt_bim.scale.share import Share, in_turn

STEP_M, STEP_RAD = 1e-4, 1e-5
"""Steps of the finite differences: far under what moves an area visibly, far over rounding."""

WORTH = 0.9
"""The design is used where it takes a tenth or more off the plane's share of the area's sigma."""
_Item = tuple[FaceMatch, MeasuredFace, DesignFace, StationPose]


def adjust_with_design(
    matched: MatchResult, design: BimModel, options: MatchOptions, share: Share = in_turn
) -> MatchResult:
    """Recompute areas with normals that lean on the design's, where measurement and design agree within 3 sigma.

    The outline's rays are met again with the plane of the combined normal. Offsets, angles and tilts stay as measured,
    and so does the area of a face that disagrees with its design: a deviation is never hidden.
    `share` has the matches adjusted each on its own, here or in several processes.
    """
    faces = {face.face_id: face for element in design.elements for face in element.faces}
    poses = {placed.pose.station: placed.pose for placed in matched.stations}
    measured = {face.face_id: face for placed in matched.stations for face in placed.measurement.faces}
    items = [(m, measured[m.face_id], faces[m.design_face], poses[m.station]) for m in matched.matches]
    return replace(matched, matches=tuple(share(partial(_all_adjusted, options), items)))


def _all_adjusted(options: MatchOptions, items: Sequence[_Item]) -> list[FaceMatch]:
    return [_adjusted(*item, options) for item in items]


def _adjusted(
    match: FaceMatch, face: MeasuredFace, design: DesignFace, pose: StationPose, options: MatchOptions
) -> FaceMatch:
    if not isinstance(face.frame, PlaneFrame) or not isinstance(design.frame, PlaneFrame):
        return match
    lean = _combined(face, face.frame, design.frame, pose, options)
    if lean is None:
        return match
    shift, after = lean
    before = np.asarray(face.covariance, dtype=np.float64)
    part = _part_on_face(match, face.frame, design.frame, pose)
    middle = polygon.centroid(polygon.polygon(face.outline_uv_m))
    slopes = _area_slopes(part, face.frame, middle)
    variance_before, variance_after = float(slopes @ before @ slopes), float(slopes @ after @ slopes)
    if variance_after > WORTH**2 * variance_before:
        return match
    plane = _moved_plane(face.frame, middle, shift)
    moved, frame = _met_again(part, face.frame, plane)
    seen = design.frame.moved(inverse(pose.world_from_left))
    scale = polygon.area(moved) / max(polygon.area(part), 1e-9)
    image = max(match.area_sigma_image_m2**2 - variance_before, 0.0) + variance_after
    return replace(
        match,
        outline_uv_m=mapped(moved, lambda ring: seen.to_uv(frame.from_uv(ring))),
        area_m2=match.area_m2 * scale,
        area_sigma_image_m2=float(np.sqrt(image)) * scale,
        area_sigma_calibration_m2=match.area_sigma_calibration_m2 * scale,
    )


def _combined(
    face: MeasuredFace, frame: PlaneFrame, design: PlaneFrame, pose: StationPose, options: MatchOptions
) -> tuple[FloatArray, FloatArray] | None:
    """Return the shift [offset, tilt u, tilt v] of the measured plane and its new covariance; None where they disagree.

    The design's normal is an observation of the two tilts, with the pose's turn and the building's own tolerance.
    """
    turn = pose.world_from_left[:3, :3]
    normal = rotate(turn.T, design.normal)
    # A tilt a about u moves the normal by -a v, one b about v by +b u.
    tilts = np.array([-(normal @ frame.v), normal @ frame.u]) / (normal @ frame.normal)
    axes = turn @ np.column_stack([frame.u, frame.v])
    allowed = axes.T @ pose.covariance[:3, :3] @ axes + np.eye(2) * np.radians(options.building_tilt_deg) ** 2
    before = np.asarray(face.covariance, dtype=np.float64)
    spread = before[1:, 1:] + allowed
    if float(tilts @ np.linalg.solve(spread, tilts)) > options.sigmas**2:
        return None
    gain = before[:, 1:] @ np.linalg.inv(spread)
    return gain @ tilts, before - gain @ before[1:, :]


def _part_on_face(match: FaceMatch, frame: PlaneFrame, design: PlaneFrame, pose: StationPose) -> Region:
    """Return the match's outline in the measured face's own (u, v), carried back along the measured normal."""
    world = frame.moved(pose.world_from_left)
    plane = world.plane

    def back(ring: FloatArray) -> FloatArray:
        # The outline was projected along the design's... and the measured plane is met again along the design's normal.
        points = design.from_uv(ring)
        along = plane.distance_m(points) / (design.normal @ plane.normal)
        return world.to_uv(points - along[:, None] * design.normal)

    return mapped(match.outline_uv_m, back)


def _moved_plane(frame: PlaneFrame, middle_uv: FloatArray, shift: Sequence[float] | FloatArray) -> Plane:
    offset, tilt_u, tilt_v = (float(value) for value in shift)
    normal = unit(frame.normal - tilt_u * frame.v + tilt_v * frame.u)
    through = frame.from_uv(middle_uv) + offset * frame.normal
    return Plane(normal=frozen(normal), offset_m=float(normal @ through))


def _met_again(part: Region, frame: PlaneFrame, plane: Plane) -> tuple[Region, PlaneFrame]:
    """Meet the rays of a region's rings, from the camera at the left frame's origin, with another plane."""
    target = frame_on_plane(plane, frame.origin_m, frame.v)
    return mapped(part, lambda ring: target.to_uv(plane.intersect(np.zeros(3), frame.from_uv(ring)))), target


def _area_slopes(part: Region, frame: PlaneFrame, middle_uv: FloatArray) -> FloatArray:
    """Return the derivative (3,) of the part's area by [offset, tilt u, tilt v] of its plane, rays held."""
    slopes = np.zeros(3)
    for index, step in enumerate((STEP_M, STEP_RAD, STEP_RAD)):
        ahead, behind = (
            polygon.area(_met_again(part, frame, _moved_plane(frame, middle_uv, sign * step * np.eye(3)[index]))[0])
            for sign in (1.0, -1.0)
        )
        slopes[index] = (ahead - behind) / (2.0 * step)
    return slopes
