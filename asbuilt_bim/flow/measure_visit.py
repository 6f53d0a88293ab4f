"""A visit's stations, measured: read, found in the cache or worked on, and gathered in the file's order."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from functools import partial
from typing import Protocol

import cv2

from asbuilt_bim.camera.photo.read import Photo, read_photo, side_by_side
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import EYES_SWAPPED, Note, Reason, SubjectKind, about
from asbuilt_bim.errors import AsBuiltError, PhotoError, Rejection, rejected
from asbuilt_bim.flow.rig_check import Outcome, WatchedVisit, refused, watch_rig, watch_scale
from asbuilt_bim.flow.shown_again import NONE_BORROWED, Photographed, Shown, stations_shown_before
from asbuilt_bim.measure.standing_before import standing_before
from asbuilt_bim.measure.station import (
    MeasureOptions,
    RejectedStation,
    StationMeasurement,
    StationPhotos,
    measure_station,
)
from asbuilt_bim.progress.report import RigRecord
from asbuilt_bim.project.check import a_day_off, of_its_day, of_other_day, of_other_days, other_days
from asbuilt_bim.project.model import Project, Station, Visit
from asbuilt_bim.project.networks import NONE, NetworkChoice, identities, identity_with, load_models, names_plugin
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.rig_lengths import KnownLengths
from asbuilt_bim.scale.apart import Ended, Limits, run_apart
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.cluster import Scheduler
from asbuilt_bim.scale.codec import plain_digest
from asbuilt_bim.scale.executor import Timed, WorkerLoss, one_thread, processors, run_jobs
from asbuilt_bim.scale.fingerprint import library_versions, measuring_code_digest

PICTURE_WIDTH_PX = 1280
_STATION = Limits(seconds=1800.0, memory_bytes=math.inf)
"""A station takes seconds, of twelve megapixels a minute: what takes half an hour hangs, in a plugin maybe."""


class Progress(Protocol):
    """Takes note of how far a step is: `done` of `total` pieces, `what` was the last one."""

    def __call__(self, step: str, done: int, total: int, what: str = "") -> None:
        """Take note."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationJob:
    """All that one station's measurement depends on."""

    photos: StationPhotos
    rig: StereoRig
    options: MeasureOptions
    networks: NetworkChoice = NONE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredVisit:
    """The stations of a visit in the file's order; what could not be measured is in `rejections`."""

    measured: tuple[StationMeasurement, ...]
    rejections: tuple[Rejection, ...]
    pictures: dict[str, bytes]  # by station: JPEG without EXIF, rejected stations' too where there is one
    from_cache: int
    rig: tuple[RigRecord, ...] = ()
    notes: tuple[Note, ...] = ()
    shown: tuple[Shown, ...] = ()  # what the stations of this visit and of those before it showed
    borrowed: Mapping[Photographed, Rejection] = field(
        default_factory=dict
    )  # stations of earlier visits whose photos are this one's
    scale_share: float = 0.0  # by which known lengths contradict the rig's scale
    of_its_day: bool = False  # every station's photos say so, and nobody says that the camera's clock is wrong


@dataclass(frozen=True, slots=True, kw_only=True)
class Workplace:
    """Where and how stations are measured; nothing here changes a number."""

    workers: int = 0  # 0: one per processor
    scheduler: Scheduler | None = None  # of a Dask cluster, instead of processes here
    cache: Cache = field(default_factory=lambda: Cache(folder=None))


def options_of(project: Project) -> MeasureOptions:
    """Return the measuring options with the project's target and markers in them."""
    measure = project.options.measure
    target = replace(measure.target, required=project.target.required, diameter_m=project.target.diameter_m)
    return replace(measure, target=target, marker_family=project.markers.family)


@one_thread()
def measure_job(job: StationJob) -> Outcome:
    """Measure one station, and what stands before its faces; whatever goes wrong inside rejects it by name.

    Runs in a worker process, and takes with it what needs a station's depth alone.
    An error of this program's own must not cost the other stations their place, so it is caught here, and named.
    """
    name = job.photos.name
    try:
        found = measure_station(job.photos, job.rig, job.options, models=load_models(job.networks))
        return replace(found, before_px=standing_before(found)) if isinstance(found, StationMeasurement) else found
    except AsBuiltError as problem:
        return _rejected(Reason.STATION_FAILED, name, str(problem))
    except MemoryError:
        return _rejected(Reason.STATION_MEMORY, name)
    except Exception as problem:
        return _rejected(Reason.STATION_CRASHED, name, f"{type(problem).__name__}: {problem}")


def measure_apart(job: StationJob) -> Outcome | WorkerLoss:
    """Measure one station in a process of its own, which is ended where a plugin in it never answers."""
    limits, begun = _STATION.raised(), time.monotonic()
    found = run_apart(Timed(work=measure_job, limit_s=limits.seconds), job, limits=limits)
    if not isinstance(found, Ended):
        return found
    late = found.why == "time" or time.monotonic() - begun >= limits.seconds
    return WorkerLoss(limit_s=limits.seconds if late else None)


def measure_visit(
    visit: Visit,
    project: Project,
    rig: StereoRig,
    place: Workplace,
    progress: Progress,
    survey: Sequence[SurveyedMarker] = (),
    earlier: Sequence[Shown] = (),
    borrowed: Mapping[Photographed, Rejection] = NONE_BORROWED,
) -> MeasuredVisit:
    """Measure every station of a visit; results come from the cache where nothing they depend on has changed.

    The stations' photos together judge the rig: where it was knocked, the stations are refused, or measured again with
    a refined rig where the project asks for that. Its scale is held against the target, the prints and the survey.
    Photos of another day, and photos that an `earlier` station has shown, decide nothing; nor do those that are
    `borrowed` from a station of a later visit, whose own day they say.
    """
    taken: dict[str, date] = {}
    step = f"measure {visit.date.isoformat()}"
    outcomes, known = _measured(visit.stations, step, project, rig, place, progress, taken)
    barred = {name: of_other_day(name, visit, taken) for name in of_other_days(visit, taken)}
    barred |= {name: why for (day, name), why in borrowed.items() if day == visit.date and name in outcomes}
    of_day = of_its_day(visit, taken)
    showing = {
        station.name: found.thumbnail_jpeg
        for station in visit.stations
        if isinstance(found := outcomes[station.name], StationMeasurement) and station.name not in barred
    }
    twins = stations_shown_before(visit.date, showing, earlier, of_day)
    barred |= twins.refused
    outcomes |= {name: refused(outcomes[name], reason) for name, reason in barred.items()}

    def again(names: Sequence[str], refined: StereoRig) -> dict[str, Outcome]:
        stations = [one for one in visit.stations if one.name in names and one.name not in barred]
        return _measured(stations, f"{step} again, rig refined", project, refined, place, progress)[0]

    in_order = [outcomes[station.name] for station in visit.stations]
    lengths = KnownLengths(diameter_m=project.target.diameter_m, size_m=project.markers.size_m, survey=survey)
    watched = watch_rig(in_order, rig, again if project.rig.refine else None, lengths)
    seen = _gathered(watch_scale(watched, project, rig, survey), known)
    warned = (*other_days(visit, taken), *seen.rejections)
    whole = of_day >= {station.name for station in visit.stations}
    notes = (*a_day_off(visit, taken), *seen.notes)
    return replace(seen, rejections=warned, notes=notes, shown=twins.known, borrowed=twins.borrowed, of_its_day=whole)


def measure_stations(
    stations: Sequence[Station], step: str, project: Project, rig: StereoRig, place: Workplace, progress: Progress
) -> dict[str, Outcome]:
    """Measure some stations by themselves, or find them in the cache: by name, without a look at what they share."""
    return _measured(stations, step, project, rig, place, progress)[0]


def _measured(
    stations: Sequence[Station],
    step: str,
    project: Project,
    rig: StereoRig,
    place: Workplace,
    progress: Progress,
    taken: dict[str, date] | None = None,
) -> tuple[dict[str, Outcome], int]:
    """Measure stations with a rig; returns the outcomes by name, and how many came from the cache.

    `taken` is given the day that a station's left photo says it was taken, where it says one.
    """
    options = options_of(project)
    rig_digest = plain_digest(rig, StereoRig)
    networks = [f"{name} {digest}" for name, digest in identities(project.networks).items()]
    outcomes: dict[str, Outcome] = {}
    keys: dict[str, str] = {}
    known: list[str] = []

    by_name = {station.name: station for station in stations}

    def note(name: str, outcome: Outcome) -> None:
        outcomes[name] = with_photos(outcome, by_name[name], project)
        progress(step, len(outcomes), len(stations), name)

    def jobs() -> Iterator[StationJob]:
        for station in stations:
            photos = read_pair(station, project)
            if isinstance(photos, RejectedStation):
                note(station.name, photos)
                continue
            if taken is not None and photos.left.exif.taken is not None:
                taken[station.name] = photos.left.exif.taken
            key = _key(photos, rig_digest, options, networks)
            found = place.cache.get(key, StationMeasurement)
            if found is not None:
                known.append(station.name)
                note(station.name, found)
                continue
            keys[station.name] = key
            yield StationJob(photos=photos, rig=rig, options=options, networks=project.networks)

    progress(step, 0, len(stations))
    at_most = _STATION.raised().seconds
    alike = partial(identity_with, project.networks)
    alone = place.scheduler is None and (place.workers or processors()) == 1  # without processes that can be ended
    work = measure_apart if alone and names_plugin(project.networks) else measure_job
    for done in run_jobs(
        work, jobs(), workers=place.workers, scheduler=place.scheduler, limit_s=at_most, identity=alike
    ):
        name = done.job.photos.name
        if isinstance(done.result, WorkerLoss):
            note(name, lost_station(name, done.result))
        else:
            if isinstance(done.result, StationMeasurement):  # what failed may be mended: never kept
                place.cache.put(keys[name], done.result, StationMeasurement)
            note(name, done.result)
    return outcomes, len(known)


def read_pair(station: Station, project: Project) -> StationPhotos | RejectedStation:
    """Read a station's two photos, or the file that holds both; one that can't be used rejects the station."""
    photos: list[Photo] = []
    rejections = []
    for path in (station.left,) if station.side_by_side else (station.left, station.right):
        name = project.relative(path)  # results are passed on: they name files as the project does
        subject = about(SubjectKind.STATION, station.name)
        if not path.exists():
            side = "only" if station.side_by_side else "left" if path == station.left else "right"
            rejections.append(rejected(Reason.PHOTO_MISSING, subject, photo=name, side=side))
            continue
        try:
            photo = replace(read_photo(path), name=name)
            photos += side_by_side(photo) if station.side_by_side else (photo,)
        except PhotoError as problem:
            detail = str(problem).replace(str(path), name)
            rejections.append(rejected(Reason.PHOTO_UNUSABLE, subject, photo=name, detail=detail))
    if rejections:
        return RejectedStation(station=station.name, rejections=tuple(rejections))
    return StationPhotos(name=station.name, left=photos[0], right=photos[1])


def with_photos(outcome: Outcome, station: Station, project: Project) -> Outcome:
    """Return an outcome that names the photos where they are exchanged: what a person has to rename."""
    if not isinstance(outcome, RejectedStation) or station.side_by_side or station.of_video:
        return outcome
    names = {"left_photo": project.relative(station.left), "right_photo": project.relative(station.right)}
    told = [
        replace(one, values={**one.values, **names}) if one.code in EYES_SWAPPED else one for one in outcome.rejections
    ]
    return replace(outcome, rejections=tuple(told))


def picture_name(day: date, station: str) -> str:
    """Return where in the run folder a station's picture lies."""
    return f"pictures/{day.isoformat()}/{station}.jpg"


def _key(photos: StationPhotos, rig_digest: str, options: MeasureOptions, networks: list[str]) -> str:
    libraries = [f"{name} {version}" for name, version in sorted(library_versions().items())]
    return digest_of(
        [
            "station",
            photos.name,
            photos.left.digest,
            photos.right.digest,
            rig_digest,
            repr(options),
            measuring_code_digest(),
            *libraries,
            *networks,
        ]
    )


def _gathered(watched: WatchedVisit, from_cache: int) -> MeasuredVisit:
    outcomes = watched.outcomes
    return MeasuredVisit(
        measured=tuple(o for o in outcomes if isinstance(o, StationMeasurement)),
        rejections=(*watched.warnings, *(rejection for outcome in outcomes for rejection in outcome.rejections)),
        pictures={outcome.station: picture for outcome in outcomes if (picture := _picture(outcome))},
        from_cache=from_cache,
        rig=watched.records,
        notes=watched.notes,
        scale_share=watched.scale_share,
    )


def _picture(outcome: Outcome) -> bytes:
    """Return a JPEG without EXIF of what the station saw, b"" where nothing could be seen."""
    if isinstance(outcome, StationMeasurement):
        return outcome.thumbnail_jpeg
    if outcome.picture is None:
        return b""
    scale = min(1.0, PICTURE_WIDTH_PX / outcome.picture.shape[1])
    small = cv2.resize(outcome.picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return data.tobytes() if done else b""


def lost_station(station: str, loss: WorkerLoss) -> RejectedStation:
    """Return a station that could not be measured since its process died, or was ended."""
    if loss.limit_s is None:
        return _rejected(Reason.STATION_WORKER_LOST, station)
    endless = rejected(Reason.STATION_ENDLESS, about(SubjectKind.STATION, station), limit_s=loss.limit_s)
    return RejectedStation(station=station, rejections=(endless,))


def _rejected(code: Reason, station: str, detail: str = "") -> RejectedStation:
    subject = about(SubjectKind.STATION, station)
    rejection = rejected(code, subject, **({"detail": detail} if detail else {}))
    return RejectedStation(station=station, rejections=(rejection,))
