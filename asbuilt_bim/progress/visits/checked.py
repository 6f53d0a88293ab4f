"""A station checked on site: will it count, and what of it is doubtful. The reasons are those that a run would give."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from typing import Literal

from asbuilt_bim.codes import EYES_SWAPPED, PHOTO_FAULTS, Note, Reason, SubjectKind, Values
from asbuilt_bim.errors import Rejection
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement
from asbuilt_bim.register.markers import AHEAD_M, sigma_ahead_m
from asbuilt_bim.register.pose import StationPose

Aspect = Literal["photos", "day", "pair", "rig", "disc", "tags", "place"]
Grade = Literal["ok", "doubtful", "not", "unchecked"]
ASPECTS: tuple[Aspect, ...] = ("photos", "day", "pair", "rig", "disc", "tags", "place")
"""In the order in which they are looked at: what follows one that failed isn't, but for what was seen all the same."""

_OF_PHOTOS = PHOTO_FAULTS | {
    *(
        Reason.PHOTO_UNUSABLE,
        Reason.PHOTOS_GREY,
        Reason.PHOTO_TURNED,
        Reason.PHOTO_SIZE,
        Reason.PHOTO_HELD_TURNED,
        Reason.PHOTO_ZOOMED,
    ),
    *(Reason.PHOTO_OF_OTHER_MODEL, Reason.PHOTO_OF_OTHER_CAMERA, Reason.PHOTOS_UNUSABLE, Reason.PHOTOS_DIFFER_IN_SIZE),
    *(Reason.PHOTOS_SAVED_AGAIN, Reason.STATION_FAILED, Reason.STATION_MEMORY, Reason.STATION_CRASHED),
    *(Reason.STATION_WORKER_LOST, Reason.STATION_ENDLESS),
}
_OF_PAIR = {
    Reason.PHOTO_MISSING,
    *(Reason.PHOTO_OF_OTHER_SIDE, Reason.PHOTOS_OF_OTHER_SIDES, Reason.PHOTO_TWICE, Reason.PHOTOS_SWAPPED),
    Reason.PHOTOS_OF_ONE_CAMERA,
    *(Reason.PHOTOS_UPSIDE_DOWN, Reason.PHOTOS_UPSIDE_DOWN_SWAPPED, Reason.PHOTOS_LOOK_SWAPPED),
    *(Reason.PHOTOS_UNRELATED, Reason.PHOTOS_BEHIND_RIG, Reason.PHOTOS_OVERLAP, Reason.PHOTOS_OF_OTHER_STATION),
}
_OF_RIG = {
    *(Reason.PHOTOS_ROWS_APART, Reason.RIG_KNOCKED, Reason.RIG_MOVED, Reason.RIG_UNDETERMINED, Reason.RIG_REFINED),
    *(Reason.SCALE_WRONG, Reason.LENGTHS_DOUBTFUL, Reason.LENGTHS_DOUBTFUL_TOGETHER),
}
_OF_DISC = {
    *(Reason.DISC_NOT_TARGET, Reason.DISC_SPARE, Reason.TARGET_SIZE_DOUBTFUL, Reason.TARGET_AMBIGUOUS),
    *(Reason.TARGET_ROWS_APART, Reason.TARGET_IN_ONE_PHOTO, Reason.TARGET_UNPAIRED, Reason.TARGET_ABSENT),
    Reason.SCALE_UNCHECKED,
}
_OF_ASPECT: Mapping[Aspect, frozenset[Reason]] = {
    "photos": frozenset(_OF_PHOTOS), "pair": frozenset(_OF_PAIR), "rig": frozenset(_OF_RIG),
    "disc": frozenset(_OF_DISC), "tags": frozenset({Reason.MARKERS_OF_OTHER_FAMILY, Reason.MARKER_TWICE}),
    "day": frozenset({Reason.PHOTOS_OF_OTHER_DAY, Reason.STATION_OF_OTHER_DAY}),
}  # fmt: skip
_NO_DOUBT = frozenset({Reason.DISC_NOT_TARGET, Reason.DISC_SPARE, Reason.MARKER_NOT_SURVEYED})
"""What is said of a station that it takes nothing from: another red thing, a tag that waits for its survey."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedAspect:
    """One thing that was looked at: its grade, the reasons against it, and the numbers that its words need.

    `by_file`: not the photos are wrong, but what the project file says of them.
    """

    aspect: Aspect
    grade: Grade
    reasons: tuple[Rejection, ...] = ()
    values: Values = field(default_factory=dict)
    by_file: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedStation:
    """A station: its grade is the worst of its aspects'; `not` means that a run would leave it out."""

    name: str
    grade: Grade
    aspects: tuple[CheckedAspect, ...]
    picture: bytes  # a small JPEG without EXIF of the left photo, b"" where none could be read
    pose: StationPose | None

    @property
    def counts(self) -> bool:
        """Say whether a run would use it."""
        return self.pose is not None

    @property
    def only_named_wrong(self) -> bool:
        """Say whether all that speaks against it is that its files are exchanged, or that one isn't there."""
        against = [one.code for aspect in self.aspects for one in aspect.reasons if one.code not in _NO_DOUBT]
        return bool(against) and all(code in EYES_SWAPPED or code is Reason.PHOTO_MISSING for code in against)

    @property
    def only_file_wrong(self) -> bool:
        """Say whether all that leaves it out is a number of the project file: its photos are fine."""
        wrong = [aspect for aspect in self.aspects if aspect.grade == "not"]
        return bool(wrong) and all(aspect.by_file for aspect in wrong)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckedVisit:
    """Today's stations in their order, and what is wrong with all of them together: the survey, the rig, the day.

    `other_visits` are the days of the project's visits where none has the photos' day; None where one has.
    """

    day: date
    stations: tuple[CheckedStation, ...]
    faults: tuple[Rejection, ...] = ()
    notes: tuple[Note, ...] = ()
    other_visits: tuple[date, ...] | None = None

    @property
    def counting(self) -> int:
        """Return how many stations a run would use."""
        return sum(station.counts for station in self.stations)

    @property
    def again(self) -> tuple[str, ...]:
        """Return the stations to be taken again, by name."""
        return tuple(station.name for station in self.stations if not station.counts)

    @property
    def by_name(self) -> tuple[str, ...]:
        """Return those of them that need no new photo: files to copy, or to give each other's name."""
        return tuple(one.name for one in self.stations if not one.counts and one.only_named_wrong)

    @property
    def by_file(self) -> tuple[str, ...]:
        """Return those of them whose photos are fine: the project file is to be corrected."""
        return tuple(one.name for one in self.stations if not one.counts and one.only_file_wrong)

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Return the stations that count, and of which something is doubtful."""
        return tuple(station.name for station in self.stations if station.counts and station.grade != "ok")


def aspect_of(reason: Rejection) -> Aspect:
    """Return what a reason speaks against; of a code that nothing else claims, the station's place."""
    found = next((aspect for aspect, codes in _OF_ASPECT.items() if reason.code in codes), None)
    if found is not None:
        return found
    return "tags" if reason.subject.kind is SubjectKind.MARKER else "place"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Looked:
    """What a station's check rests on: `outcome` decides; `seen` is what its photos showed, also of one left out."""

    outcome: StationMeasurement | RejectedStation
    seen: StationMeasurement | RejectedStation
    pose: StationPose | None = None
    picture: bytes = b""
    rows_px: float | None = None  # of its rig
    day: date | None = None  # that its photos say
    of_file: Collection[Reason] = ()  # codes that are mistakes of the project file


def checked_station(looked: Looked, reasons: Sequence[Rejection]) -> CheckedStation:
    """Grade a station: `reasons` are all that speak against it, its own and its place's."""
    outcome, pose = looked.outcome, looked.pose
    no_doubt = _NO_DOUBT - _causes(outcome)
    by_aspect: dict[Aspect, list[Rejection]] = {aspect: [] for aspect in ASPECTS}
    for reason in reasons:
        by_aspect[aspect_of(reason)].append(reason)
    aspects: list[CheckedAspect] = []
    ended = rig_wrong = False
    for aspect in ASPECTS:
        found = tuple(by_aspect[aspect])
        against = [one for one in found if one.code not in no_doubt]
        values = {} if aspect == "disc" and rig_wrong else _values(aspect, looked)  # a wrong rig's metres are wrong
        unread = aspect == "photos" and isinstance(outcome, RejectedStation)
        grade: Grade = "ok"
        if against:
            alone = all(one.code in PHOTO_FAULTS for one in against)  # no such fault leaves a station out by itself
            grade = "doubtful" if pose is not None or alone else "not"
        elif (aspect == "place" and pose is None) or ((ended or unread) and not _was_seen(aspect, looked)):
            grade = "unchecked"
        elif aspect == "tags" and pose is None and not values.get("tags"):
            grade = "not"
        ended |= isinstance(outcome, RejectedStation) and any(one.code not in PHOTO_FAULTS for one in against)
        rig_wrong |= aspect == "rig" and grade == "not"
        of_file = bool(against) and all(one.code in looked.of_file for one in against)
        values = {} if grade == "unchecked" else values
        aspects.append(CheckedAspect(aspect=aspect, grade=grade, reasons=found, values=values, by_file=of_file))
    return CheckedStation(
        name=outcome.station, grade=_worst(aspects), aspects=tuple(aspects), picture=looked.picture, pose=pose
    )


def _causes(outcome: StationMeasurement | RejectedStation) -> set[Reason]:
    """Return what leaves a station out that else would take nothing from it: where that is all that was said."""
    codes = {one.code for one in outcome.rejections} - PHOTO_FAULTS
    return codes if isinstance(outcome, RejectedStation) and codes <= _NO_DOUBT else set()


def _was_seen(aspect: Aspect, looked: Looked) -> bool:
    """Say whether an aspect was looked at, whatever else was wrong."""
    seen = looked.seen
    if aspect == "disc":
        return seen.scale is not None and seen.scale.target_diameter_m > 0.0
    return (aspect == "tags" and seen.scale is not None) or bool(_values(aspect, looked))


def _worst(aspects: Sequence[CheckedAspect]) -> Grade:
    grades = {aspect.grade for aspect in aspects}
    if grades & {"not", "unchecked"}:
        return "not"
    return "doubtful" if "doubtful" in grades else "ok"


def _values(aspect: Aspect, looked: Looked) -> Values:
    """Return the numbers that tell how good an aspect is; none where it wasn't measured."""
    seen, pose = looked.seen, looked.pose
    if aspect == "rig":
        return {} if looked.rows_px is None else {"rows_px": looked.rows_px}
    if aspect == "day":
        return {} if looked.day is None else {"day": looked.day.isoformat()}
    if aspect == "place" and pose is not None:
        return {"sigma_m": sigma_ahead_m(pose.world_from_left, pose.covariance), "ahead_m": AHEAD_M}
    if aspect == "photos" and seen.quality is not None:
        both = seen.quality.left, seen.quality.right
        return {"blur_px": max(one.sharpness.blur_px for one in both), "stops": min(one.stops for one in both)}
    if aspect == "pair" and seen.health is not None:
        return {"matches": seen.health.fit.matches}
    if isinstance(seen, RejectedStation):
        return {"tags": seen.scale.marker_ids} if aspect == "tags" and seen.scale is not None else {}
    if aspect == "disc":
        return {} if seen.target is None else {"range_m": float(seen.target.range_m)}
    return {"tags": tuple(marker.marker_id for marker in seen.markers)} if aspect == "tags" else {}
