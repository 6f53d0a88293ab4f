"""Today's photos checked before the site is left: what a run does with a station before stereo, and its words.

A station that passes will be measured, unless its faces show what only faces can: a survey that lies beside the design.
One that tags don't place is measured at once, since the design or points may.
"""

import filecmp
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date

import cv2

from asbuilt_bim.camera.photo.read import read_photo
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.errors import AsBuiltError, PhotoError, Rejection, rejected
from asbuilt_bim.flow.check_places import PlacedBy, placed_today
from asbuilt_bim.flow.measure_visit import Progress, lost_station, options_of, read_pair, with_photos
from asbuilt_bim.flow.rig_check import MeasureAgain, Outcome, decoded, refused, watch_rig, watch_scale
from asbuilt_bim.flow.shown_again import stations_shown_before
from asbuilt_bim.measure.options import MeasureOptions
from asbuilt_bim.measure.sighting import sight_station
from asbuilt_bim.measure.station import RejectedStation, StationMeasurement, StationPhotos, sighted_alone
from asbuilt_bim.measure.station_faces import thumbnail
from asbuilt_bim.measure.step_timer import Clock, StepTimer
from asbuilt_bim.progress.visits.checked import CheckedStation, CheckedVisit, Looked, checked_station
from asbuilt_bim.project.check import NEAR, a_day_off, is_of, of_other_day, of_other_days, other_days
from asbuilt_bim.project.model import Project, Station, Visit
from asbuilt_bim.register.scale import KnownLength
from asbuilt_bim.report.tables import station_of
from asbuilt_bim.scale.executor import WorkerLoss, one_thread, run_jobs

PICTURE_PX = 480
"""Of the page's pictures: enough to see a covered tag, and a visit of forty stations can still be mailed."""
_LIMIT_S = 600.0
"""A station takes three seconds, of twelve megapixels twenty: what takes ten minutes hangs."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SightJob:
    """All that checking one station depends on."""

    photos: StationPhotos
    rig: StereoRig
    options: MeasureOptions


@one_thread()
def sight_job(job: SightJob) -> Outcome:
    """Sight one station; whatever goes wrong inside rejects it by name. Runs in a worker process."""
    try:
        return sighted(job.photos, job.rig, job.options)
    except AsBuiltError as problem:
        return _failed(Reason.STATION_FAILED, job.photos.name, str(problem))
    except MemoryError:
        return _failed(Reason.STATION_MEMORY, job.photos.name)
    except Exception as problem:
        return _failed(Reason.STATION_CRASHED, job.photos.name, f"{type(problem).__name__}: {problem}")


def sighted(
    photos: StationPhotos, rig: StereoRig, options: MeasureOptions, clock: Clock = lambda: 0.0
) -> StationMeasurement | RejectedStation:
    """Return what a run finds of a station before stereo: a measurement without faces, or why there is none."""
    timer = StepTimer(clock)
    seen = sight_station(photos, rig, options, timer)
    return seen if isinstance(seen, RejectedStation) else sighted_alone(seen, thumbnail(seen.pair), timer)


def check_stations(
    stations: Sequence[Station],
    project: Project,
    rig: StereoRig,
    by: PlacedBy,
    today: date,
    progress: Progress,
    workers: int = 0,
) -> CheckedVisit:
    """Check today's stations as a run would: each by itself, then rig and scale by all, then their places.

    `today` counts where no photo says in its EXIF when it was taken.
    """
    taken: dict[str, date] = {}
    found = _sighted(stations, project, rig, progress, workers, taken)
    day = max(set(taken.values()), key=lambda one: (sum(one == other for other in taken.values()), one), default=today)
    visits = _visits(day, stations, project)
    barred = {
        name: of_other_day(name, visit, taken) for visit in visits for name in of_other_days(visit, _of(visit, taken))
    }
    copies = _copies(stations, project)
    barred |= _taken_again(copies, taken, day)
    showing = {name: one.thumbnail_jpeg for name, one in found.items() if isinstance(one, StationMeasurement)}
    barred |= stations_shown_before(day, {k: v for k, v in showing.items() if k not in barred}, ()).refused
    showed = dict(found)
    found |= {name: refused(found[name], reason) for name, reason in barred.items()}

    def again(names: Sequence[str], refined: StereoRig) -> dict[str, Outcome]:
        some = [one for one in stations if one.name in names and one.name not in barred]
        return _sighted(some, project, refined, progress, workers, {})

    mended = again if project.rig.refine else None
    outcomes = [found[one.name] for one in stations]
    visited = checked_visit(
        outcomes, project, rig, by, day, mended, stations=stations, progress=progress, showed=showed, taken=taken
    )
    off = [fault for visit in visits for fault in other_days(visit, _of(visit, taken))]
    lacks = bool(_of(visits[0], taken)) and not any(is_of(day, visit) for visit in project.visits)
    others = tuple(visit.date for visit in project.visits) if lacks else None
    notes = [note for visit in visits for note in a_day_off(visit, _of(visit, taken))]
    notes += _in_project(copies, barred)
    return replace(visited, faults=(*off, *visited.faults), notes=(*notes, *visited.notes), other_visits=others)


def _visits(day: date, stations: Sequence[Station], project: Project) -> tuple[Visit, ...]:
    """Return a visit of the day with what the project doesn't name yet, and the visits in which it names the rest."""
    here = {one.left.resolve(): one for one in stations}
    named = []
    for visit in project.visits:
        told = tuple(here.pop(left) for one in visit.stations if (left := one.left.resolve()) in here)
        named += [replace(visit, stations=told)] if told else []
    return Visit(date=day, stations=tuple(here.values())), *named


def _copies(stations: Sequence[Station], project: Project) -> dict[str, tuple[date, str]]:
    """Return the stations whose left photo is, byte for byte, that of a station of the project: its visit and name.

    What was saved again in between a run finds: it looks at all photos.
    """
    here = {one.left.resolve() for one in stations}
    others: dict[int, list[tuple[date, Station]]] = {}
    for visit in project.visits:
        for one in visit.stations:
            if one.left.resolve() not in here and one.left.is_file():
                others.setdefault(one.left.stat().st_size, []).append((visit.date, one))
    found: dict[str, tuple[date, str]] = {}
    for station in (one for one in stations if one.left.is_file()):
        for day, other in others.get(station.left.stat().st_size, ()):
            if filecmp.cmp(station.left, other.left, shallow=False):
                found[station.name] = day, other.name
    return found


def _taken_again(copies: Mapping[str, tuple[date, str]], taken: Mapping[str, date], day: date) -> dict[str, Rejection]:
    """Refuse copies of another visit's photos that no EXIF dates: they are no photos of this `day`."""
    return {
        name: rejected(
            Reason.PHOTOS_OF_OTHER_STATION, about(SubjectKind.STATION, name), other=other, other_visit=when.isoformat()
        )
        for name, (when, other) in copies.items()
        if name not in taken and abs(when - day) > NEAR
    }


def _in_project(copies: Mapping[str, tuple[date, str]], barred: Collection[str]) -> tuple[Note, ...]:
    """Return a note on stations whose photos the project has already, where they were taken: they count once."""
    had = [f"{other} of {when.isoformat()}" for name, (when, other) in copies.items() if name not in barred]
    values: Values = {"stations": tuple(dict.fromkeys(had))[:8], "count": len(set(had))}
    return (noted(Reason.PHOTOS_IN_PROJECT, about(SubjectKind.VISIT), **values),) if had else ()


def _of(visit: Visit, taken: Mapping[str, date]) -> dict[str, date]:
    return {one.name: taken[one.name] for one in visit.stations if one.name in taken}


def day_of(stations: Sequence[Station], today: date) -> date:
    """Return the day of the first station whose photos say one, `today` where none does."""
    return next((day for one in stations if (day := _taken(one)) is not None), today)


def _taken(station: Station) -> date | None:
    """Return the day that a station's photos say, the left one first; one that can't be read says none."""
    for path in (station.left, station.right):
        try:
            taken = read_photo(path).exif.taken
        except PhotoError:
            continue  # it costs its station, by name
        if taken is not None:
            return taken
    return None


def _sighted(
    stations: Sequence[Station],
    project: Project,
    rig: StereoRig,
    progress: Progress,
    workers: int,
    taken: dict[str, date],
) -> dict[str, Outcome]:
    """Sight the stations, here or in several processes; `taken` is given the days that the photos tell."""
    found: dict[str, Outcome] = {}
    options = options_of(project)

    by_name = {station.name: station for station in stations}

    def note(name: str, outcome: Outcome) -> None:
        found[name] = with_photos(outcome, by_name[name], project)
        progress("check", len(found), len(stations), name)

    def jobs() -> Iterator[SightJob]:
        for station in stations:
            photos = read_pair(station, project)
            day = _taken(station) if isinstance(photos, RejectedStation) else photos.left.exif.taken
            if day is not None:
                taken[station.name] = day
            if isinstance(photos, RejectedStation):
                note(station.name, photos)
                continue
            yield SightJob(photos=photos, rig=rig, options=options)

    progress("check", 0, len(stations))
    for done in run_jobs(sight_job, jobs(), workers=workers, limit_s=_LIMIT_S):
        name = done.job.photos.name
        note(name, lost_station(name, done.result) if isinstance(done.result, WorkerLoss) else done.result)
    return found


def checked_visit(
    outcomes: Sequence[Outcome],
    project: Project,
    rig: StereoRig,
    by: PlacedBy,
    day: date,
    again: MeasureAgain | None = None,
    *,
    stations: Sequence[Station] = (),
    progress: Progress = lambda *_: None,
    showed: Mapping[str, Outcome] | None = None,
    taken: Mapping[str, date] | None = None,
) -> CheckedVisit:
    """Judge rig and scale by all stations, place them, and grade each by all that speaks against it.

    `again` sights stations with a rig as their photos show it, where the project asks for that. `showed` is what each
    was sighted to show, also of one that is left out, and `taken` the day that its photos say.
    """
    before = {one.station: one for one in outcomes} | dict(showed or {})
    watched = watch_scale(watch_rig(outcomes, rig, again), project, rig, by.known.survey)
    measured = tuple(one for one in watched.outcomes if isinstance(one, StationMeasurement))
    placed = placed_today(measured, stations, project, rig, day, by, progress)
    placement = placed.placement
    poses = {one.pose.station: one.pose for one in placement.stations}
    rows: dict[str, float] = {}
    for record in watched.records:
        rows.update(zip(record.stations, record.station_rows_px, strict=True))
    of_file = _of_file(watched.warnings)
    checked: list[CheckedStation] = []
    for sighted_one in watched.outcomes:
        outcome = placed.refused.get(sighted_one.station, sighted_one)
        own = [one for one in placement.rejections if station_of(one) == outcome.station]
        reasons = (*outcome.rejections, *own)
        picture = _picture(outcome)
        name = outcome.station
        looked = Looked(
            outcome=outcome, seen=before[name] if isinstance(outcome, RejectedStation) else outcome,
            pose=poses.get(name), picture=picture, rows_px=rows.get(name), day=(taken or {}).get(name),
            of_file=of_file | _wrong_date(outcome, day),
        )  # fmt: skip
        checked.append(checked_station(looked, reasons))
    names = {outcome.station for outcome in watched.outcomes}
    of_all = tuple(one for one in placement.rejections if station_of(one) not in names)
    return CheckedVisit(day=day, stations=tuple(checked), faults=(*watched.warnings, *of_all), notes=watched.notes)


def _of_file(warnings: Sequence[Rejection]) -> frozenset[Reason]:
    """Return the codes that are mistakes of the project file: a scale that all lengths contradict, or a diameter.

    The disc's diameter is the file's mistake where it alone comes out wrong, beside other lengths that don't.
    """
    alone = any(
        one.code is Reason.LENGTHS_DOUBTFUL
        and one.values["wrong"] == (KnownLength.TARGET_DIAMETER.value,)
        and one.values["kinds"] != one.values["wrong"]
        for one in warnings
    )
    return frozenset({Reason.SCALE_WRONG} | ({Reason.DISC_NOT_TARGET} if alone else set()))


def _wrong_date(outcome: Outcome, day: date) -> frozenset[Reason]:
    """Return the code of another day where it is the date that the project file gives the photos, not theirs."""
    dates = {one.values["day"] for one in outcome.rejections if one.code is Reason.STATION_OF_OTHER_DAY}
    return frozenset({Reason.STATION_OF_OTHER_DAY} if dates - {day.isoformat()} else ())


def _picture(outcome: Outcome) -> bytes:
    """Return a small JPEG without EXIF of what the left photo shows, b"" where nothing could be read."""
    picture = decoded(outcome.thumbnail_jpeg) if isinstance(outcome, StationMeasurement) else outcome.picture
    if picture is None:
        return b""
    scale = min(1.0, PICTURE_PX / picture.shape[1])
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return data.tobytes() if done else b""


def _failed(code: Reason, station: str, detail: str = "") -> RejectedStation:
    subject = about(SubjectKind.STATION, station)
    values = {"detail": detail} if detail else {}
    return RejectedStation(station=station, rejections=(rejected(code, subject, **values),))
