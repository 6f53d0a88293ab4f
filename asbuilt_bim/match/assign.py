"""Gives each measured face to the design faces that it lies on; what fits none is named with the nearest miss."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from asbuilt_bim.bim.candidates import candidates
from asbuilt_bim.bim.model import BimModel, DesignFace, ElementClass
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.regions import to_frame
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.match.score import Comparison, WorldFace, compare, in_world
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.register.pose import Placement, StationPose
from asbuilt_bim.scale.share import Share, in_turn

WHOLE_SHARE = 0.9
"""A face lies on one design face alone when no more than a tenth of it, its mask's noise, lies elsewhere."""

STRAY_SHARE, STRAY_M2 = 0.3, 0.5
"""A matched face of which more than this lies on no design face is worth a word."""

MAX_TILT_SIGMA_RAD = float(np.radians(0.5))
"""Tilt from plumb is given where it is better known than half a degree (2.5 cm over a storey)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Station:
    """A station's measured faces, and the design faces that it could see, with kind and name of their elements."""

    pose: StationPose
    faces: tuple[MeasuredFace, ...]
    nearby: tuple[DesignFace, ...]
    elements: Mapping[str, tuple[ElementClass, str]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """What became of one station's faces."""

    matches: tuple[FaceMatch, ...]
    unmatched: tuple[Rejection, ...]


def match_faces(placement: Placement, design: BimModel, options: MatchOptions, share: Share = in_turn) -> MatchResult:
    """Match every measured face of the placed stations to the design, nothing lost.

    A face that runs over several design faces is divided along their borders. Where two design faces claim the same
    region of an outline, the one that fits better has it. `unobserved` are the design faces that no station faces. The
    stations are matched each on its own, in as many processes as `share` has.
    """
    elements = {element.global_id: element for element in design.elements}
    stations: list[_Station] = []
    in_view: set[str] = set()
    for placed in placement.stations:
        pose, measurement = placed.pose, placed.measurement
        nearby = candidates(design, pose.world_from_left, measurement.camera, options.max_distance_m)
        in_view.update(face.face_id for face in nearby)
        own = {face.element: elements[face.element] for face in nearby}
        named = {global_id: (one.kind, one.name or global_id) for global_id, one in own.items()}
        stations.append(_Station(pose=pose, faces=measurement.faces, nearby=nearby, elements=named))
    found = share(partial(_matched, options), stations)
    unobserved = [face.face_id for e in design.elements for face in e.faces if face.face_id not in in_view]
    return MatchResult(
        stations=placement.stations,
        matches=tuple(match for one in found for match in one.matches),
        unmatched=tuple(rejection for one in found for rejection in one.unmatched),
        unobserved=tuple(unobserved),
    )


def _matched(options: MatchOptions, stations: Sequence[_Station]) -> list[_Found]:
    """Match stations one by one; named in the module, so that a process can be given it."""
    return [_of_station(one, options) for one in stations]


def _of_station(station: _Station, options: MatchOptions) -> _Found:
    matches: list[FaceMatch] = []
    unmatched: list[Rejection] = []
    for face in station.faces:
        seen = in_world(face, station.pose)
        pairs = [compare(seen, one, station.elements[one.element][0], options) for one in station.nearby]
        compared = [pair for pair in pairs if pair is not None]
        found = _divide(seen, [pair for pair in compared if pair.fault is None], options)
        matches.extend(found)
        unmatched.extend(_left_over(seen, found, compared, station.elements))
    return _Found(matches=tuple(matches), unmatched=tuple(unmatched))


def _divide(seen: WorldFace, fitting: Sequence[Comparison], options: MatchOptions) -> list[FaceMatch]:
    """Give each region of an outline to the best design face there: first inside the borders, then what passes them."""
    ranked = sorted(fitting, key=lambda pair: (-pair.score, pair.design.face_id))
    parts: list[Region] = []
    taken: Region = polygon.EMPTY
    for pair in ranked:
        parts.append(polygon.difference(pair.strict, taken))
        taken = polygon.union([taken, pair.strict])
    for index, pair in enumerate(ranked):
        if not parts[index]:
            continue  # nothing of it lies inside this one's border: what passes is a neighbour's
        passing = polygon.difference(pair.loose, taken)
        parts[index] = polygon.union([parts[index], passing])
        taken = polygon.union([taken, pair.loose])
    whole_area = max(polygon.area(seen.outline), 1e-9)
    least = max(options.min_area_m2, options.min_share * whole_area)
    kept = [(pair, part) for pair, part in zip(ranked, parts, strict=True) if polygon.area(part) > least]
    found = [_match(seen, pair, part, whole_area, len(kept) == 1) for pair, part in kept]
    stray = max(0.0, 1.0 - sum(match.overlap for match in found))
    largest = max(found, key=lambda match: match.overlap, default=None)
    return [replace(m, past_design_m2=stray * seen.face.area_m2) if m is largest else m for m in found]


def _match(seen: WorldFace, pair: Comparison, part: Region, whole_area: float, alone: bool) -> FaceMatch:
    share = polygon.area(part) / whole_area
    face = seen.face
    tilt, tilt_sigma = _tilt(seen)
    return FaceMatch(
        station=seen.pose.station,
        face_id=face.face_id,
        design_face=pair.design.face_id,
        element=pair.design.element,
        outline_uv_m=to_frame(part, seen.frame, pair.design.frame),
        area_m2=face.area_m2 * share,
        area_sigma_calibration_m2=face.area_sigma_calibration_m2 * share,
        area_sigma_image_m2=face.area_sigma_image_m2 * share,
        whole=face.whole and alone and share >= WHOLE_SHARE,
        overlap=share,
        offset_m=pair.offset_m,
        offset_sigma_m=pair.offset_sigma_m,
        tilt_rad=tilt,
        tilt_sigma_rad=tilt_sigma,
    )


def _tilt(seen: WorldFace) -> tuple[float | None, float | None]:
    """Return how far the face leans out of plumb (positive: its top overhangs) with its sigma, in radians.

    Both are None where that isn't known well.
    """
    up = np.array([0.0, 0.0, 1.0])
    if isinstance(seen.frame, PlaneFrame):
        lean = -float(np.arcsin(np.clip(seen.frame.normal @ up, -1.0, 1.0)))
        level: FloatArray = seen.frame.u
    else:
        axis = seen.frame.axis * np.sign(seen.frame.axis @ up or 1.0)
        lean = float(np.arccos(np.clip(axis @ up, -1.0, 1.0)))
        level = seen.frame.zero
    turned = float(level @ seen.pose.covariance[:3, :3] @ level)
    sigma = float(np.sqrt(max(turned + float(seen.face.place_covariance[1, 1]), 0.0)))
    return (lean, sigma) if sigma <= MAX_TILT_SIGMA_RAD else (None, None)


def _left_over(
    seen: WorldFace,
    found: Sequence[FaceMatch],
    compared: Sequence[Comparison],
    elements: Mapping[str, tuple[ElementClass, str]],
) -> list[Rejection]:
    face, subject = seen.face, about(SubjectKind.FACE, seen.face.face_id, seen.pose.station)
    if found:
        past_m2 = sum(match.past_design_m2 for match in found)
        if past_m2 > max(STRAY_SHARE * face.area_m2, STRAY_M2):
            return [rejected(Reason.FACE_PAST_DESIGN, subject, past_m2=past_m2, area_m2=face.area_m2)]
        return []
    failed = [(pair.fault, pair) for pair in compared if pair.fault is not None]
    if not failed:
        return [rejected(Reason.FACE_WITHOUT_DESIGN, subject)]
    fault, nearest = min(failed, key=lambda one: (one[1].excess, abs(one[1].offset_m)))
    _, name = elements[nearest.design.element]
    return [rejected(fault, subject, nearest=name, **nearest.values)]
