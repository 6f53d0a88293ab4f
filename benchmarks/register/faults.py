"""Faults of a visit's places, put into simulated visits: what is wrong, and by which name it has to be told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.placement import given_pose, register
from asbuilt_bim.register.pose import Placement, StationPose
from asbuilt_bim.register.tags import TagPlace
from benchmarks.register.visits import STOREY_M, Print, Visit, moved_in, simulated, surveyed

STATIONS, SURVEYED = 12, 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fault:
    """A visit with a fault, and the code, and the subject, that name it."""

    visit: Visit
    code: Reason
    subject: str
    given: Mapping[str, StationPose] = field(default_factory=dict)
    remembered: Mapping[int, TagPlace] = field(default_factory=dict)
    without: Visit | None = None  # the same visit without the fault, of a fault that prints can't always show


def told_alike(fault: Fault, placement: Placement) -> bool:
    """Say whether the faultless visit is told the very same: prints of one wall are their own mirror image."""
    if fault.without is None:
        return False
    faultless = register(fault.without.measured, fault.without.survey, RegisterOptions())
    return [(one.code, one.subject) for one in faultless.rejections] == [
        (one.code, one.subject) for one in placement.rejections
    ]


def named(fault: Fault, placement: Placement) -> bool:
    """Say whether a fault is told by its name, and what it is about."""
    return any(
        one.code is fault.code and (not fault.subject or fault.subject in (one.subject.name, one.subject.at_station))
        for one in placement.rejections
    )


def two_exchanged(seed: int) -> Fault:
    """Exchange two surveyed prints in the survey."""
    visit, rng = _well_surveyed(seed)
    one, other = _often_seen(visit, rng)[:2]
    rows = {marker.marker_id: marker for marker in visit.survey}
    rows[one], rows[other] = replace(rows[other], marker_id=one), replace(rows[one], marker_id=other)
    pair = ", ".join(map(str, sorted((one, other))))
    return Fault(visit=replace(visit, survey=tuple(rows.values())), code=Reason.MARKERS_EXCHANGED, subject=pair)


def one_moved(seed: int) -> Fault:
    """Move a surveyed print, by 5 cm to a metre, after it was surveyed."""
    visit, rng = _well_surveyed(seed)
    one = _often_seen(visit, rng)[0]
    off = rng.normal(0.0, 1.0, 3)
    off *= rng.uniform(0.05, 1.0) / np.linalg.norm(off)
    rows = [replace(m, corners_m=frozen(m.corners_m + off)) if m.marker_id == one else m for m in visit.survey]
    return Fault(visit=replace(visit, survey=tuple(rows)), code=Reason.MARKER_MOVED, subject=str(one))


def one_moved_since(seed: int) -> Fault:
    """Move a print that nobody surveyed, by 10 cm to a metre, between two visits."""
    visit, rng = _well_surveyed(seed, 6)
    before = register(visit.measured, visit.survey, RegisterOptions()).tags
    again = [mark.marker_id for station in moved_in(seed, STATIONS, -1, 0.0).measured for mark in station.markers]
    often = [n for n in _often_seen(visit, rng, surveyed_ones=False) if n in before and again.count(n) >= 2]
    one = min(often, key=lambda n: before[n].sigma_m)
    step = rng.uniform(0.1, 1.0)
    later = moved_in(seed, STATIONS, one, step)
    return Fault(visit=replace(later, survey=visit.survey), code=Reason.MARKER_MOVED_SINCE, subject=str(one),
                 remembered=before)  # fmt: skip


def pose_of_another_storey(seed: int) -> Fault:
    """Give a station's pose a storey too high or too low."""
    visit, rng = _well_surveyed(seed)
    name = visit.measured[int(rng.integers(1, STATIONS))].station
    pose = visit.true[name].copy()
    pose[2, 3] += STOREY_M * rng.choice([-1.0, 1.0])
    return Fault(visit=visit, code=Reason.POSE_CONTRADICTS, subject=name,
                 given={name: given_pose(name, pose, 0.002, 0.02)})  # fmt: skip


def mirrored_survey(seed: int) -> Fault:
    """Exchange easting and northing of the whole survey."""
    visit, _ = _well_surveyed(seed)
    rows = [replace(one, corners_m=frozen(one.corners_m[:, [1, 0, 2]])) for one in visit.survey]
    survey = replace(visit, survey=tuple(rows))
    return Fault(visit=survey, code=Reason.SURVEY_MIRRORED, subject="", without=visit)


def station_of_another_site(seed: int) -> Fault:
    """Put a station of another site among the visit's, whose prints have the same numbers."""
    visit, rng = _well_surveyed(seed)
    other = simulated(seed + 50_000, STATIONS)
    foreign = next(one for one in other.measured[int(rng.integers(0, STATIONS)) :] if len(one.markers) >= 3)
    measured = (*visit.measured, replace(foreign, station="X"))
    true = visit.true | {"X": np.full((4, 4), 1e6)}
    return Fault(visit=replace(visit, measured=measured, true=true), code=Reason.STATION_CONTRADICTS, subject="X")


FAULTS = (two_exchanged, one_moved, one_moved_since, pose_of_another_storey, mirrored_survey, station_of_another_site)


def _well_surveyed(seed: int, count: int = SURVEYED) -> tuple[Visit, np.random.Generator]:
    """Return a visit whose survey has ten prints, of those that two stations see or more."""
    visit, rng = simulated(seed, STATIONS), np.random.default_rng([seed, 77])
    ids = [one.marker_id for station in visit.measured for one in station.markers]
    twice = sorted({number for number in ids if ids.count(number) >= 2})
    chosen = set(rng.permutation(twice)[:count].tolist())
    prints: list[Print] = [one for one in visit.prints if one.marker_id in chosen]
    return replace(visit, survey=surveyed(prints, rng)), rng


def _often_seen(visit: Visit, rng: np.random.Generator, *, surveyed_ones: bool = True) -> list[int]:
    """Return prints that two stations see, or more, in a random order, the surveyed ones or the others."""
    ids = [one.marker_id for station in visit.measured for one in station.markers]
    known = {one.marker_id for one in visit.survey}
    found = sorted({n for n in ids if ids.count(n) >= 2 and (n in known) == surveyed_ones})
    return [int(n) for n in rng.permutation(found)]
