"""Surveyed tags that a station will see, and where two more would help most of the stations that see too few."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.transform import cross, unit
from asbuilt_bim.progress.visits.checked import CheckedStation, CheckedVisit
from asbuilt_bim.progress.visits.plan_visit import PlannedVisit
from asbuilt_bim.progress.visits.sights import LIFT_M, Reach, rig_frames, sighted_points
from asbuilt_bim.progress.visits.squares import SIDE_M
from asbuilt_bim.progress.visits.surroundings import Surroundings
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import SurveyedMarker

NEEDED = RegisterOptions().min_markers  # surveyed tags that hold a station
NEAR_M, MOST_SLANT_RAD = 1.5, float(np.radians(60.0))
LEAST_PX = 30.0
"""Of a tag's side in a photo: at 20 px it is still read, and clutter and turning take a third."""
HEIGHTS_M = 0.8, 2.2
"""Over the floor: within reach, and above what lies about."""
APART_M = 1.5
"""Between two tags: nearer ones hold the pose no better than one of twice the size."""
_PER_STOREY = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagInPlace:
    """A tag in the world: its middle (3,), its normal (3,) towards who reads it, and its side."""

    number: int
    middle_m: FloatArray
    normal: FloatArray
    size_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HelpfulTag:
    """A place for a tag on an element, and the planned stations, by number, that would see it."""

    storey: str
    element: BimElement
    middle_m: FloatArray  # (3,) in the world
    over_floor_m: float
    stations: tuple[int, ...]
    needy: tuple[int, ...]  # of these, those that see too few surveyed tags


def surveyed_tags(survey: Sequence[SurveyedMarker]) -> tuple[TagInPlace, ...]:
    """Return the tags of a survey as they hang."""
    found = []
    for marker in survey:
        across, down = marker.corners_m[1] - marker.corners_m[0], marker.corners_m[3] - marker.corners_m[0]
        normal = cross(down, across)
        if np.linalg.norm(normal) > 0.0:
            size = float(np.linalg.norm(across))
            middle = marker.corners_m.mean(axis=0)
            found.append(TagInPlace(number=marker.marker_id, middle_m=middle, normal=unit(normal), size_m=size))
    return tuple(found)


def tags_in_view(rig: StereoRig, around: Surroundings, pose: FloatArray, tags: Sequence[TagInPlace]) -> tuple[int, ...]:
    """Return the tags that a station at a pose (4, 4) sees in both photos, large enough to be read."""
    if not tags:
        return ()
    points, normals = np.array([tag.middle_m for tag in tags]), np.array([tag.normal for tag in tags])
    size = min(tag.size_m for tag in tags)
    seen = _seen(rig, around, pose, points, normals, size)
    return tuple(tag.number for tag, one in zip(tags, seen, strict=True) if one)


def with_unread_tags(
    visit: CheckedVisit, rig: StereoRig, around: Surroundings, tags: Sequence[TagInPlace]
) -> CheckedVisit:
    """Return a visit that says of each placed station which surveyed tags should be in view, and were not read.

    One of them may be covered, gone, or behind what no design holds: that takes nothing from the station.
    """
    return replace(visit, stations=tuple(_with_unread(one, rig, around, tags) for one in visit.stations))


def _with_unread(
    station: CheckedStation, rig: StereoRig, around: Surroundings, tags: Sequence[TagInPlace]
) -> CheckedStation:
    if station.pose is None:
        return station
    due = tags_in_view(rig, around, station.pose.world_from_left, tags)
    aspects = []
    for one in station.aspects:
        read = one.values.get("tags", ())
        unread = tuple(tag for tag in due if isinstance(read, tuple) and tag not in read)
        told = one.aspect == "tags" and bool(unread)
        aspects.append(replace(one, values={**one.values, "unread": unread}) if told else one)
    return replace(station, aspects=tuple(aspects))


def _seen(
    rig: StereoRig, around: Surroundings, pose: FloatArray, points_m: FloatArray, normals: FloatArray, size_m: float
) -> BoolArray:
    far = float(rig.left.K[0, 0]) * size_m / LEAST_PX
    reach = Reach(near_m=NEAR_M, far_m=far, slant_rad=MOST_SLANT_RAD)
    seen = rig_frames(rig, 2.0 * LEAST_PX / rig.left.width_px).show(pose, points_m)
    some = np.flatnonzero(seen)
    seen[some] = sighted_points(around, pose[:3, 3], points_m[some] + LIFT_M * normals[some], normals[some], reach)
    return seen


def helpful_tags(
    visit: PlannedVisit,
    rig: StereoRig,
    tags: Sequence[TagInPlace],
    size_m: float,
    standing: Sequence[BimElement],
) -> tuple[HelpfulTag, ...]:
    """Return two places a storey at most, each the one that helps most stations; none where every one sees enough.

    A station is helped where it sees enough tags with those that are found.
    """
    found: list[HelpfulTag] = []
    for storey in dict.fromkeys(station.storey for station in visit.stations):
        stations = [station for station in visit.stations if station.storey == storey]
        lacking = np.array(
            [NEEDED - len(tags_in_view(rig, visit.around, one.world_from_left, tags)) for one in stations]
        )
        own = [element for element in standing if element.storey == storey]
        points, normals, owner, height = _walls(own)
        if not len(points) or not (lacking > 0).any():
            continue
        sees = np.array([_seen(rig, visit.around, one.world_from_left, points, normals, size_m) for one in stations])
        usable, short = np.ones(len(points), dtype=np.bool_), lacking > 0
        for tag in tags:
            usable &= np.linalg.norm(points - tag.middle_m, axis=1) > APART_M
        taken: list[int] = []
        for _ in range(_PER_STOREY):
            helped = (lacking[:, None] > 0) & sees & usable
            best = int(np.lexsort((-(sees & usable).sum(axis=0), -helped.sum(axis=0)))[0])
            if not helped[:, best].any():
                break
            taken.append(best)
            lacking = lacking - sees[:, best]
            usable &= np.linalg.norm(points - points[best], axis=1) > APART_M
        for best in taken:
            helped_by = short & (lacking <= 0) & sees[:, best]
            if not helped_by.any():
                continue
            found.append(
                HelpfulTag(
                    storey=storey,
                    element=own[owner[best]],
                    middle_m=points[best],
                    over_floor_m=float(height[best]),
                    stations=tuple(one.number for one, yes in zip(stations, sees[:, best], strict=True) if yes),
                    needy=tuple(one.number for one, yes in zip(stations, helped_by, strict=True) if yes),
                )
            )
    return tuple(found)


def _walls(elements: Sequence[BimElement]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return places for tags on flat sides: points and normals (N, 3), the element's index and the height (N,)."""
    points, normals, owner, height = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0)]
    for number, element in enumerate(elements):
        samples = cell_samples(element, SIDE_M)
        flat = np.array([not isinstance(face.frame, CylinderFrame) for face in element.faces], dtype=np.bool_)
        over = samples.points_m[:, 2] - float(element.vertices_m[:, 2].min())
        fit = flat[samples.face] & (over >= HEIGHTS_M[0]) & (over <= HEIGHTS_M[1])
        points.append(samples.points_m[fit])
        normals.append(samples.normals[fit])
        owner.append(np.full(int(fit.sum()), number))
        height.append(over[fit])
    joined = [np.concatenate(part) for part in (points, normals, owner, height)]
    return joined[0], joined[1], joined[2].astype(np.intp), joined[3]
