"""Places the measured stations in the world: by a given pose, by control points, or by the surveyed markers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import unit
from asbuilt_bim.measure.station import DepthReference, StationMeasurement
from asbuilt_bim.register.agree import largest_agreement
from asbuilt_bim.register.by_design.joint import looked_for, poses_by_design
from asbuilt_bim.register.by_design.place import LEVEL_SIGMA_RAD
from asbuilt_bim.register.by_design.planes import level_from_left
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.known import known_points
from asbuilt_bim.register.linked import SUPERSEDED, Found, link_stations, worth_linking
from asbuilt_bim.register.markers import judged_pose, off_values, pose_from_markers
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.point_look import look_for_links
from asbuilt_bim.register.pose import PlacedStation, Placement, StationPose, SurveyedMarker
from asbuilt_bim.register.solve import Sighted
from asbuilt_bim.register.tags import TagPlace
from asbuilt_bim.scale.share import Share, in_turn

NO_DEPTH = DepthReference(png=b"", sigma_png=b"", scale=1)
NOTHING: Mapping[str, StationPose] = MappingProxyType({})
NO_POINTS: Mapping[str, Sequence[ControlPoint]] = MappingProxyType({})
NO_TAGS: Mapping[int, TagPlace] = MappingProxyType({})
SUBSET = 4
"""Three points leave up to four poses; the fourth settles which."""
MIRRORED_SHARE = 0.5
"""Of the surveyed markers that are seen, more agree in the mirror; and so many don't as they are given."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlPoint:
    """A named point: `world_m` (3,) and `left_px` (2,) in rectified pixels: clicks go through the lens model first."""

    name: str
    world_m: FloatArray
    left_px: FloatArray


def pose_from_control_points(
    station: StationMeasurement, points: Sequence[ControlPoint], options: RegisterOptions
) -> tuple[StationPose | None, tuple[Rejection, ...]]:
    """Find a station's pose from control points; a point that contradicts the others is named and left out."""
    subject = about(SubjectKind.STATION, station.station)
    if len(points) < options.min_control_points:
        few = rejected(Reason.CONTROL_POINTS_TOO_FEW, subject, found=len(points), needed=options.min_control_points)
        return None, (few,)
    seen = _sighted_points(points, options)
    agreement = largest_agreement(station.camera, seen, SUBSET)
    needed = max(options.min_control_points - 1, len(seen) // 2 + 1)  # of many points a few agree by chance
    if agreement is None or len(agreement.used) < needed or agreement.ambiguous:
        none = rejected(
            Reason.CONTROL_POINTS_DISAGREE,
            subject,
            agree=len(agreement.used) if agreement else 0,
            found=len(points),
            needed=needed,
        )
        return None, (none,)
    notes = tuple(
        rejected(
            Reason.CONTROL_POINT_CONTRADICTS,
            about(SubjectKind.CONTROL_POINT, name, station.station),
            **off_values(sigmas),
        )
        for name, sigmas in agreement.wrong.items()
    )
    pose, refused = judged_pose(station.station, station.camera.f_px, agreement, options, "control_points")
    return pose, (*notes, *refused)


def _sighted_points(points: Sequence[ControlPoint], options: RegisterOptions) -> list[Sighted]:
    return [
        Sighted(
            name=point.name,
            world_m=point.world_m.reshape(1, 3),
            left_px=point.left_px.reshape(1, 2),
            right_px=None,
            sigma_px=options.control_point_sigma_px,
            sigma_m=options.control_point_sigma_m,
        )
        for point in points
    ]


def register(
    measured: Sequence[StationMeasurement],
    survey: Sequence[SurveyedMarker],
    options: RegisterOptions,
    *,
    given: Mapping[str, StationPose] = NOTHING,
    control_points: Mapping[str, Sequence[ControlPoint]] = NO_POINTS,
    remembered: Mapping[int, TagPlace] = NO_TAGS,
    share: Share = in_turn,
    rough: RoughPlaces | None = None,
) -> Placement:
    """Place each station: by its given pose, else by its control points, else by the surveyed markers that it sees.

    What none of these places is looked for in the design, from where somebody says that it stood, roughly; all such
    stations are judged together.

    Then all of them together, where prints link them that nobody surveyed, or an earlier visit `remembered`, by id; and
    where points that both show link a station that isn't placed yet.
    `given` and `control_points` are by the station's name. No station is placed by a mirrored survey. Markers place
    each station on its own, in as many processes as `share` has.
    """
    by_markers = [one for one in measured if one.station not in given and one.station not in control_points]
    alone = share(partial(_by_markers, survey, options), [_with_markers_alone(one) for one in by_markers])
    found = {one.station: placed for one, placed in zip(by_markers, alone, strict=True)}
    mirrored = mirrored_survey(by_markers, [pose for pose, _ in found.values() if pose], survey, options)
    points = {name: _sighted_points(own, options) for name, own in control_points.items()}
    for station in measured:
        name = station.station
        if name in given:
            found[name] = given[name], ()
        elif name in control_points:
            found[name] = pose_from_control_points(station, control_points[name], options)
    designed, links = _by_design(measured, found, rough, options, share) if mirrored is None else ({}, ())
    found |= designed
    given = {**given, **{name: pose for name, (pose, _) in designed.items() if pose is not None}}
    known = {one.marker_id: one for one in survey} if mirrored is None else {}
    notes: tuple[Rejection, ...] = () if mirrored is None else (mirrored,)
    if mirrored is not None:
        found |= {one.station: (None, (_not_placed(one.station),)) for one in by_markers}
    tags: Mapping[int, TagPlace] = {}
    if mirrored is None and (links or worth_linking(measured, found, known, remembered, given)):
        cameras = {one.station: one.camera for one in measured}
        rows = {
            name: [known_points(one.name, 0, cameras[name], one) for one in own if found[name][0] is not None]
            for name, own in points.items() if name in cameras
        }  # fmt: skip
        linked = link_stations(measured, found, given, rows, known, remembered, options, links)
        if linked is not None and linked.mirrored is not None:
            notes = (linked.mirrored,)
            found |= {one.station: (None, (_not_placed(one.station),)) for one in by_markers}
        elif linked is not None:
            found, tags, notes = dict(linked.stations), linked.tags, linked.rejections
    poses = [(station, found[station.station][0]) for station in measured]
    return Placement(
        stations=tuple(PlacedStation(measurement=one, pose=pose) for one, pose in poses if pose is not None),
        rejections=(*notes, *(note for station in measured for note in found[station.station][1])),
        tags=tags,
    )


def _by_design(
    measured: Sequence[StationMeasurement],
    found: Mapping[str, Found],
    rough: RoughPlaces | None,
    options: RegisterOptions,
    share: Share,
) -> tuple[dict[str, Found], tuple[PointLink, ...]]:
    """Place by the design what has a rough place and nothing better, and look for links of what isn't placed by then.

    Links between stations that the design leaves open tie these, and they are judged once more.
    """
    todo = [one for one in measured if rough is not None and found[one.station][0] is None]
    looked = looked_for(todo, rough, options) if rough is not None else []
    designed = _told(poses_by_design(looked, options), found)
    unplaced = {name for name, (pose, _) in {**found, **designed}.items() if pose is None}
    links = look_for_links(measured, unplaced, share)
    still_open = unplaced & designed.keys()
    if any({link.first, link.second} <= still_open for link in links):
        designed = _told(poses_by_design(looked, options, links), found)
    return designed, links


def _told(designed: Mapping[str, Found], found: Mapping[str, Found]) -> dict[str, Found]:
    """Return what the design says of each station, with what else was said: without success both reasons are told."""
    told: dict[str, Found] = {}
    for name, (pose, reasons) in designed.items():
        kept = tuple(note for note in found[name][1] if pose is None or note.code not in SUPERSEDED)
        told[name] = pose, (*kept, *reasons)
    return told


def _with_markers_alone(station: StationMeasurement) -> StationMeasurement:
    """Return a station without its faces and pictures, which needn't travel."""
    return replace(station, faces=(), depth_ref=NO_DEPTH, thumbnail_jpeg=b"")


def _by_markers(
    survey: Sequence[SurveyedMarker], options: RegisterOptions, stations: Sequence[StationMeasurement]
) -> list[tuple[StationPose | None, tuple[Rejection, ...]]]:
    """Place stations one by one; named in the module, so that a process can be given it."""
    return [pose_from_markers(one, survey, options) for one in stations]


def _not_placed(station: str) -> Rejection:
    return rejected(Reason.STATION_SURVEY_MIRRORED, about(SubjectKind.STATION, station))


def given_pose(station: str, world_from_left: ArrayLike, sigma_rad: float, sigma_m: float) -> StationPose:
    """Make a pose (4, 4) that another instrument knows, with the standard deviation of each angle and coordinate."""
    return StationPose(
        station=station,
        world_from_left=frozen(world_from_left),
        covariance=frozen(np.diag([sigma_rad**2] * 3 + [sigma_m**2] * 3)),
        residual_px=0.0,
        markers_used=(),
        method="given",
    )


def levelled(pose: StationPose, up: FloatArray) -> StationPose:
    """Return a given pose whose pitch and roll nobody measured, turned level by what is plumb: `up` (3,), left frame.

    Its bearing stays as given.
    """
    east, north = unit(pose.world_from_left[:2, 2])
    world_from_level = np.array([[north, east, 0.0], [-east, north, 0.0], [0.0, 0.0, 1.0]])
    world_from_left, covariance = pose.world_from_left.copy(), pose.covariance.copy()
    world_from_left[:3, :3] = world_from_level @ level_from_left(up)
    covariance[:2, :2] = np.eye(2) * LEVEL_SIGMA_RAD**2
    return replace(pose, world_from_left=frozen(world_from_left), covariance=frozen(covariance))


def mirrored_survey(
    measured: Sequence[StationMeasurement],
    poses: Sequence[StationPose],
    survey: Sequence[SurveyedMarker],
    options: RegisterOptions,
) -> Rejection | None:
    """Return why a visit's survey can't be used, where its markers agree in the mirror alone.

    `poses` are those that the stations were given by the survey as it is.
    """
    known = {marker.marker_id for marker in survey}
    seen = sum(sighting.marker_id in known for station in measured for sighting in station.markers)
    used = sum(len(pose.markers_used) for pose in poses)
    if used >= MIRRORED_SHARE * seen:
        return None
    exchanged = [replace(one, corners_m=frozen(one.corners_m[:, np.array([1, 0, 2])])) for one in survey]
    found = (pose_from_markers(station, exchanged, options)[0] for station in measured)
    agree = sum(len(pose.markers_used) for pose in found if pose is not None)
    if agree <= MIRRORED_SHARE * seen:
        return None
    return rejected(Reason.SURVEY_MIRRORED, about(SubjectKind.SURVEY), seen=seen, agree_mirrored=agree, agree=used)
