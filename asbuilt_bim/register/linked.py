"""Stations that no survey places alone: linked to the others by prints, and what that shows to be wrong."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.block_adjustment import Known
from asbuilt_bim.register.growth import Viewpoint
from asbuilt_bim.register.markers import judged
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.pose import StationPose, SurveyedMarker
from asbuilt_bim.register.tags import TagPlace
from asbuilt_bim.register.visit import Sources, VisitPlaces, place_visit

Found = tuple[StationPose | None, tuple[Rejection, ...]]
SUPERSEDED = frozenset(
    {
        *(Reason.MARKERS_TOO_FEW, Reason.MARKERS_DISAGREE, Reason.MARKERS_AMBIGUOUS, Reason.POSE_RESIDUAL),
        *(Reason.POSE_UNCERTAIN, Reason.MARKER_CONTRADICTS, Reason.MARKER_NOT_SURVEYED),
        *(Reason.DESIGN_TOO_LITTLE_SEEN, Reason.DESIGN_NOT_FOUND, Reason.DESIGN_AMBIGUOUS, Reason.DESIGN_HEIGHT_OPEN),
    }
)
"""What a station says alone, and no longer once the visit places it."""
MOST_SHARED = 3
"""Prints that a station shares with the others: not even half of so many in place, and it is of another site."""
EXCHANGED_SHARE = 0.25
"""Of the way between two prints: as near as that to each other's place, they were exchanged."""
MOST_TRIED = 6
"""Pairs that are exchanged for a try: each places the whole visit anew."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linked:
    """What the visit together says: of each station, of its prints, and of what is known of them."""

    stations: Mapping[str, Found]
    tags: Mapping[int, TagPlace]  # of prints that nobody surveyed
    rejections: tuple[Rejection, ...]
    mirrored: Rejection | None = None


def worth_linking(
    measured: Sequence[StationMeasurement],
    alone: Mapping[str, Found],
    survey: Mapping[int, SurveyedMarker],
    remembered: Mapping[int, TagPlace],
    given: Collection[str],
) -> bool:
    """Say whether stations together know more than each alone.

    That is by a print that isn't surveyed, or is wrongly; or where a station's pose is `given`, and it sees prints.
    """
    seen_by: dict[int, int] = {}
    for station in measured:
        for sighting in station.markers:
            seen_by[sighting.marker_id] = seen_by.get(sighting.marker_id, 0) + 1
    wrong = {
        int(note.subject.name)
        for _, notes in alone.values()
        for note in notes
        if note.code is Reason.MARKER_CONTRADICTS
    }
    placed = [station.station for station in measured if alone[station.station][0] is not None]
    surveyed = {tag for tag, one in survey.items() if len(one.corners_m) == 4}
    if any(station.station in given and station.markers for station in measured):
        return True
    return any(
        tag in remembered or (count > 1 and (tag not in surveyed or tag in wrong or len(placed) < len(measured)))
        or (tag in survey and tag not in surveyed)
        for tag, count in seen_by.items()
    )  # fmt: skip


def link_stations(
    measured: Sequence[StationMeasurement],
    alone: Mapping[str, Found],
    given: Mapping[str, StationPose],
    points: Mapping[str, Sequence[Known]],
    survey: Mapping[int, SurveyedMarker],
    remembered: Mapping[int, TagPlace],
    options: RegisterOptions,
    links: Sequence[PointLink] = (),
) -> Linked | None:
    """Place all stations together, and say of each where it stood or why not; None where nothing holds them.

    `alone` is what each station's own survey says of it: where to start from.
    """
    viewpoints = [
        Viewpoint(name=one.station, camera=one.camera, seen={mark.marker_id: mark for mark in one.markers})
        for one in measured
    ]
    sources = Sources(
        poses={name: (pose.world_from_left, pose.covariance) for name, pose in given.items()},
        survey=survey,
        remembered={tag: place for tag, place in remembered.items() if tag not in survey},
        sizes_m={},
        starts={name: pose.world_from_left for name, (pose, _) in alone.items() if pose is not None},
        points=points,
        links=links,
    )

    def placed(by: Sources) -> VisitPlaces:
        return place_visit(viewpoints, by, options)

    places = placed(sources)
    if (mirrored := _mirrored(places, sources, viewpoints, placed)) is not None:
        return Linked(stations=alone, tags={}, rejections=(), mirrored=mirrored)
    if places.torn is not None:
        agree, count = places.torn
        torn = rejected(Reason.SURVEY_CONTRADICTS, about(SubjectKind.SURVEY), agree=agree, seen=count)
        stations = {
            name: found if name in given or name in points else _survey_refused(name) for name, found in alone.items()
        }
        return Linked(stations=stations, tags={}, rejections=(torn,))
    if not places.poses:
        return None
    exchanged = _exchanged(places, sources, placed)
    wrong = {tag for pair in exchanged for tag in pair} - places.moved_m.keys()
    if wrong:  # what hangs on it stands elsewhere, and nothing else says so
        kept = {tag: marker for tag, marker in survey.items() if tag not in wrong}
        places = replace(placed(replace(sources, survey=kept)), moved_m=places.moved_m)
    found = {one.station: _of_station(one, alone[one.station], places, given, options) for one in measured}
    tags = {tag: place for tag, place in places.tags.items() if tag not in survey}
    return Linked(stations=found, tags=tags, rejections=_moved(places, sources, exchanged))


def _mirrored(
    places: VisitPlaces,
    sources: Sources,
    viewpoints: Sequence[Viewpoint],
    placed: Callable[[Sources], VisitPlaces],
) -> Rejection | None:
    """Return why the survey can't be used, where more of its prints stand as surveyed with its axes exchanged.

    Prints on one wall are their own mirror image, seen from the other side: only all walls together tell.
    """
    seen = {tag for one in viewpoints for tag in one.seen if tag in sources.survey}
    agree = _as_surveyed(places, seen)
    if agree == len(seen):
        return None
    axes = np.array([1, 0, 2])
    survey = {tag: replace(one, corners_m=frozen(one.corners_m[:, axes])) for tag, one in sources.survey.items()}
    free = replace(sources, starts={})  # as each station stands alone says nothing in the mirror
    mirrored = _as_surveyed(placed(replace(free, survey=survey)), seen)
    if mirrored <= agree or mirrored <= _as_surveyed(placed(free), seen):
        return None
    found = {"seen": len(seen), "agree_mirrored": mirrored, "agree": agree}
    return rejected(Reason.SURVEY_MIRRORED, about(SubjectKind.SURVEY), **found)


def _as_surveyed(places: VisitPlaces, seen: Collection[int]) -> int:
    if places.torn is not None:
        return places.torn[0]
    return sum(tag in places.tags and tag not in places.moved_m for tag in seen)


def _survey_refused(name: str) -> Found:
    return None, (rejected(Reason.STATION_SURVEY_REFUSED, about(SubjectKind.STATION, name)),)


def _not_placed(station: StationMeasurement, shared: int, used: int) -> Rejection:
    """Say why a station isn't linked: it shows nothing that others show, or shows it elsewhere."""
    subject = about(SubjectKind.STATION, station.station)
    if shared >= MOST_SHARED:
        return rejected(Reason.STATION_CONTRADICTS, subject, agree=used, seen=shared)
    return rejected(Reason.STATION_NOT_LINKED, subject, seen=len(station.markers))


def _of_station(
    station: StationMeasurement,
    alone: Found,
    places: VisitPlaces,
    given: Mapping[str, StationPose],
    options: RegisterOptions,
) -> Found:
    name, (own, notes) = station.station, alone
    shared = places.shared.get(name, frozenset())
    if name not in places.poses:
        return own, notes if own is not None else (*notes, _not_placed(station, len(shared), 0))
    kept = tuple(note for note in notes if note.code not in SUPERSEDED)
    kept += tuple(
        rejected(Reason.MARKER_IN_ANOTHER_PLACE, about(SubjectKind.MARKER, str(tag), name))
        for tag in places.not_used.get(name, ())
    )
    used = places.used[name]
    by_markers = own is None or own.method in ("markers", "linked")
    agree = len(shared & set(used))
    if by_markers and len(shared) >= MOST_SHARED and 2 * agree <= len(shared):
        return None, (*(one for one in kept if one.code is not Reason.MARKER_IN_ANOTHER_PLACE),
                      _not_placed(station, len(shared), agree))  # fmt: skip
    linked_to = places.linked_to.get(name, ())
    if by_markers and not linked_to and len(used) < options.min_markers:
        few = rejected(
            Reason.MARKERS_TOO_FEW, about(SubjectKind.STATION, name), found=len(used), needed=options.min_markers,
            any_read=True,
        )  # fmt: skip
        return None, (*kept, few)
    off = name in places.poses_off_m
    if off:
        code = Reason.DESIGN_POSE_CONTRADICTS if given[name].method == "design" else Reason.POSE_CONTRADICTS
        kept += (_pose_off(code, name, places.poses_off_m[name]),)
    if name in places.hanging:
        alone_by = {"marker": places.hanging[name]}
        return None, (*kept, rejected(Reason.STATION_ON_ONE_MARKER, about(SubjectKind.STATION, name), **alone_by))
    pose, covariance = places.poses[name]
    method = own.method if own is not None else "linked"
    by_design = own.by_design if own is not None and not off else None
    method = "linked" if method == "design" and off else method
    placed = StationPose(
        station=name, world_from_left=frozen(pose), covariance=frozen(covariance),
        residual_px=places.residual_px[name], markers_used=used, method=method, linked_to=linked_to,
        by_design=by_design,
    )  # fmt: skip
    refused = judged(placed, options)
    return (None, (*kept, refused)) if refused is not None else (placed, kept)


def _pose_off(code: Reason, name: str, off_m: FloatArray) -> Rejection:
    away, up = float(np.linalg.norm(off_m)), float(off_m[2])
    return rejected(code, about(SubjectKind.STATION, name), away_m=away, up_m=up)


def _exchanged(
    places: VisitPlaces, sources: Sources, placed: Callable[[Sources], VisitPlaces]
) -> tuple[tuple[int, int], ...]:
    """Return pairs of prints that were exchanged: each stands in the other's place, or with both exchanged all agrees.

    Where few stations see one of two, it alone holds them: they stand wrongly, and nothing contradicts it.
    """
    known = {tag: marker.corners_m.mean(axis=0) for tag, marker in sources.survey.items()}
    moved = [tag for tag in sorted(places.moved_m) if tag in places.tags]
    known |= {tag: places.tags[tag].centre_m - places.moved_m[tag] for tag in moved}
    found: list[tuple[int, int]] = []
    tried: list[tuple[float, int, int]] = []
    for tag in moved:
        for other in sorted(known.keys() - {tag}):
            apart = float(np.linalg.norm(known[other] - known[tag]))
            share = float(np.linalg.norm(places.tags[tag].centre_m - known[other])) / max(apart, 1e-9)
            back = float(np.linalg.norm(places.tags[other].centre_m - known[tag])) if other in moved else np.inf
            if max(share, back / max(apart, 1e-9)) < EXCHANGED_SHARE:
                found.append((min(tag, other), max(tag, other)))
            elif tag in sources.survey and other in sources.survey and (share < EXCHANGED_SHARE or other in moved):
                tried.append((share, min(tag, other), max(tag, other)))
    for _, one, other in sorted(tried)[:MOST_TRIED]:
        if {one, other} & {tag for pair in found for tag in pair}:
            continue
        survey = dict(sources.survey)
        survey[one], survey[other] = (
            replace(survey[tag], corners_m=survey[theirs].corners_m) for tag, theirs in ((one, other), (other, one))
        )
        again = placed(replace(sources, survey=survey))
        agrees = {one, other} & again.tags.keys() and not {one, other} & again.moved_m.keys()
        if agrees and len(again.moved_m) < len(places.moved_m):
            found.append((one, other))
    return tuple(sorted(set(found)))


def _moved(places: VisitPlaces, sources: Sources, exchanged: Sequence[tuple[int, int]]) -> tuple[Rejection, ...]:
    """Name prints that stand elsewhere than they are known to, and those that were exchanged."""
    notes: list[Rejection] = []
    for one, other in exchanged:
        centres = [_known_centre(tag, places, sources) for tag in (one, other)]
        apart = float(np.linalg.norm(centres[0] - centres[1]))
        pair = about(SubjectKind.MARKER, f"{one}, {other}")
        notes.append(rejected(Reason.MARKERS_EXCHANGED, pair, one=one, other=other, away_m=apart))
    named = {tag for pair in exchanged for tag in pair}
    for tag, off in sorted(places.moved_m.items()):
        if tag in places.tags and tag not in named:
            code = Reason.MARKER_MOVED if tag in sources.survey else Reason.MARKER_MOVED_SINCE
            notes.append(rejected(code, about(SubjectKind.MARKER, str(tag)), away_m=float(np.linalg.norm(off))))
    return tuple(notes)


def _known_centre(tag: int, places: VisitPlaces, sources: Sources) -> FloatArray:
    if tag in sources.survey:
        centre: FloatArray = sources.survey[tag].corners_m.mean(axis=0)
        return centre
    return places.tags[tag].centre_m - places.moved_m[tag]
