"""The stations of a visit placed by the design, all judged together.

Each station keeps every place that fits. Those that are tied to each other by prints or points see together: a place of
one is a place of all. Then all are judged by what they have in common.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.chances import Possible, chances
from asbuilt_bim.register.by_design.fitting import LinkedPrior, turned
from asbuilt_bim.register.by_design.heights import camera_height
from asbuilt_bim.register.by_design.place import (
    Ground,
    Place,
    by_design_of,
    grounds,
    is_near,
    merged,
    origin_of,
    places_on,
    pose_of,
    second_of,
)
from asbuilt_bim.register.by_design.planes import Seen, seen_faces
from asbuilt_bim.register.by_design.rough import RoughPlaces
from asbuilt_bim.register.by_design.ties import OWN, Tie, links_of, seen_together
from asbuilt_bim.register.markers import judged
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.pose import StationPose

LEAST_FACES = 2
"""One face leaves a place open along it."""
WRONG = 1e-3
"""How likely a place may be the wrong one at most, all others that fit and none at all counted in."""

Found = tuple[StationPose | None, tuple[Rejection, ...]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Looked:
    """A station that is looked for: what it saw, where it may stand, and the places that fit it alone."""

    station: StationMeasurement
    seen: Seen
    grounds: Sequence[Ground]
    places: Sequence[Place]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Group:
    """Stations that are tied, how each stands to the first, and the places of the first that fit all of them."""

    members: Sequence[Looked]
    ties: Sequence[Tie]
    faces: int
    places: Sequence[Place]


def looked_for(stations: Sequence[StationMeasurement], rough: RoughPlaces, options: RegisterOptions) -> list[Looked]:
    """Return all places that fit each station alone, near its rough place; what has none isn't looked for."""
    here = sorted((one for one in stations if one.station in rough.places), key=lambda one: one.station)
    places = [rough.places[one.station] for one in here]
    known = next((one.level_m for one in places if one.level_m is not None), None)
    found = []
    for one, place in zip(here, places, strict=True):
        seen = seen_faces(one)
        on = grounds(place, rough.design, origin_of(place, rough.design) if known is None else known)
        enough = len(seen.faces.halves_m) >= LEAST_FACES
        fits = [fit for ground in on for fit in places_on(seen, ground, options)] if enough else []
        found.append(Looked(station=one, seen=seen, grounds=on, places=merged(fits)))
    return found


def poses_by_design(
    looked: Sequence[Looked], options: RegisterOptions, links: Sequence[PointLink] = ()
) -> dict[str, Found]:
    """Find where the stations of a visit stood by the design; `links` are of stations by points that both show."""
    groups = [_seen_together(members, ties, options) for members, ties in _tied(looked, links, options)]
    shares = chances([Possible(by_share=[fit.fit.by_share for fit in one.places], faces=one.faces) for one in groups])
    found: dict[str, Found] = {}
    for group, share in zip(groups, shares, strict=True):
        order = np.argsort(-share, kind="stable")
        sorted_group = replace(group, places=[group.places[number] for number in order])
        found |= _judged(sorted_group, share[order], options)
    return found


def _too_little(name: str, count: int) -> Rejection:
    return rejected(Reason.DESIGN_TOO_LITTLE_SEEN, about(SubjectKind.STATION, name), faces=count)


def _tied(
    looked: Sequence[Looked], links: Sequence[PointLink], options: RegisterOptions
) -> list[tuple[list[Looked], list[Tie]]]:
    """Return stations in groups that are tied; the first of each is the one whose place is known best."""
    left = sorted(looked, key=lambda one: (_loose(one), -len(one.seen.faces.halves_m), one.station.station))
    groups = []
    while left:
        first = left[0]
        alike = [one for one in left if _storeys(one) == _storeys(first)]
        levels = {one.station.station: one.seen.level_from_left for one in alike}
        ties = {first.station.station: OWN}
        ties |= links_of(first.station, [one.station for one in alike], levels, links, options)
        members = [one for one in left if one.station.station in ties]
        groups.append((members, [ties[one.station.station] for one in members]))
        left = [one for one in left if one.station.station not in ties]
    return groups


def _loose(one: Looked) -> float:
    return min((np.inf if on.prior.sigma_m is None else on.prior.sigma_m for on in one.grounds), default=np.inf)


def _storeys(one: Looked) -> set[str]:
    return {on.storey.global_id for on in one.grounds}


def _seen_together(members: Sequence[Looked], ties: Sequence[Tie], options: RegisterOptions) -> _Group:
    """Find the places that fit all that tied stations saw."""
    first = members[0]
    if len(members) == 1:
        return _Group(members=members, ties=ties, faces=len(first.seen.faces.halves_m), places=first.places)
    seen = seen_together([one.seen for one in members], ties)
    found: list[Place] = []
    for number, ground in enumerate(first.grounds):
        starts = [
            _first_from(place, tie)
            for one, tie in zip(members, ties, strict=True)
            for place in one.places
            if place.storey.global_id == ground.storey.global_id
        ]
        others = [
            LinkedPrior(level_m=tie.shift_m[:2], turn_rad=tie.turn_rad, known=one.grounds[number].prior)
            for one, tie in zip(members[1:], ties[1:], strict=True)
        ]
        found += places_on(seen, ground, options, starts, others, search=not starts)
    return _Group(members=members, ties=ties, faces=len(seen.faces.halves_m), places=merged(found))


def _first_from(place: Place, tie: Tie) -> tuple[float, FloatArray]:
    """Return where the first of a group stands, where another one stands at a place."""
    return place.at(-tie.turn_rad, -turned(-tie.turn_rad) @ tie.shift_m[:2])


def _judged(group: _Group, shares: FloatArray, options: RegisterOptions) -> dict[str, Found]:
    """Return the poses of a group's stations, or why it has none."""
    names = [one.station.station for one in group.members]
    if group.faces < LEAST_FACES:
        return {name: (None, (_too_little(name, group.faces),)) for name in names}
    fits = int(np.sum(group.places[0].fit.on >= 0)) if group.places else 0
    best, none = float(shares[:1].sum()), 1.0 - float(shares.sum())
    why: tuple[Reason, dict[str, Value]] | None = None
    if none > WRONG * (none + best):
        why = Reason.DESIGN_NOT_FOUND, {"faces": group.faces, "fits": fits}
    elif 1.0 - best > WRONG:
        why = Reason.DESIGN_AMBIGUOUS, second_of(group.places, shares)
    if why is not None:
        code, values = why
        return {name: (None, (rejected(code, about(SubjectKind.STATION, name), **values),)) for name in names}
    return {one.station.station: _at(one, tie, group, shares, options)
            for one, tie in zip(group.members, group.ties, strict=True)}  # fmt: skip


def _at(one: Looked, tie: Tie, group: _Group, shares: FloatArray, options: RegisterOptions) -> Found:
    """Return the pose of a station where its group stands: by what it saw itself, in its own frame."""
    name, best = one.station.station, group.places[0]
    turn, place_m = best.at(tie.turn_rad, tie.shift_m[:2])
    ground = next(on for on in one.grounds if on.storey.global_id == best.storey.global_id)
    own = [best] if tie is OWN and len(group.members) == 1 else [
        place for place in places_on(one.seen, ground, options, [(turn, place_m)], search=False)
        if is_near(place.fit, turn, place_m)
    ]  # fmt: skip
    if not own:
        return None, (_too_little(name, len(one.seen.faces.halves_m)),)
    fits = int(np.sum(own[0].fit.on >= 0))
    height, sigma_m, elsewhere = camera_height(one.seen, own[0].design, own[0].fit, best.storey.elevation_m)
    if elsewhere > WRONG:
        return None, (rejected(Reason.DESIGN_HEIGHT_OPEN, about(SubjectKind.STATION, name), faces=fits),)
    by_design = replace(by_design_of(group.places, shares), faces=fits)
    pose = pose_of(name, one.station.camera.f_px, one.seen, own[0], (height, sigma_m), by_design, options)
    refused = judged(pose, options)
    return (None, (refused,)) if refused is not None else (pose, ())
