"""Checks of a project: its files are there, and its photos are of the days that it says."""

from collections.abc import Mapping
from datetime import date, timedelta

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import ProjectError, Rejection, rejected
from asbuilt_bim.project.mistakes import first_rows
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.storage.regular_file import file_alike

NEAR = timedelta(days=1)
"""Camera clocks run on another zone's time, and a visit may last past midnight."""


def refuse_missing(project: Project) -> None:
    """Check that every file of a project is there, but for the photos: a missing photo costs its station alone.

    Raises:
        ProjectError: with every file that is missing, by its key.
    """
    missing = [f"  {key}: {project.relative(path)}{file_alike(path)}" for key, path in project.missing.items()]
    if missing:
        what = f"{len(missing)} files aren't there; copy them there, or correct the paths:"
        if len(missing) == 1:
            what = "a file isn't there; copy it there, or correct the path:"
        raise ProjectError("\n".join([f"{project.path}: {what}", *first_rows(missing)]))


def missing_photos(project: Project) -> tuple[str, ...]:
    """Return a line for every photo of a visit that isn't there: each costs its station, as a run's end says again."""
    return tuple(
        f"visit {visit.date}, station {station.name}: there is no {project.relative(path)}{file_alike(path)}"
        for visit in project.visits
        for station in visit.stations
        for path in dict.fromkeys((station.left, station.right))
        if not path.exists()
    )


def is_of(day: date, visit: Visit) -> bool:
    """Say whether a run takes photos of a day for a visit's: all of them where its camera's clock is wrong."""
    return visit.camera_clock_wrong or abs(day - visit.date) <= NEAR


def of_other_days(visit: Visit, taken: Mapping[str, date]) -> tuple[str, ...]:
    """Return the stations that decide nothing, since photos say that they were `taken` (by station) on another day.

    Where not one photo says that it is of the visit's day, no station decides anything: those that say nothing were
    copied with the others. A camera's clock may be wrong. Only the user knows, and says so in the project file.
    """
    off = tuple(name for name, day in taken.items() if abs(day - visit.date) > NEAR)
    if not off or visit.camera_clock_wrong:
        return ()
    return off if len(off) < len(taken) else tuple(station.name for station in visit.stations)


def of_its_day(visit: Visit, taken: Mapping[str, date]) -> frozenset[str]:
    """Return the stations whose photos say that they were `taken` (by station) on the visit's day.

    None where the camera's clock is wrong.
    """
    near = (name for name, day in taken.items() if abs(day - visit.date) <= NEAR)
    return frozenset() if visit.camera_clock_wrong else frozenset(near)


def other_days(visit: Visit, taken: Mapping[str, date]) -> tuple[Rejection, ...]:
    """Return one warning where photos say that they were `taken` (by station) on another day than the visit's."""
    off = {name: day for name, day in taken.items() if abs(day - visit.date) > NEAR}
    if not off:
        return ()
    return (
        rejected(
            Reason.PHOTOS_OF_OTHER_DAY,
            about(SubjectKind.VISIT, visit.date.isoformat()),
            stations=tuple(off),
            days=tuple(day.isoformat() for day in off.values()),
            count=len(visit.stations),
            clock_wrong=visit.camera_clock_wrong,
        ),
    )


def a_day_off(visit: Visit, taken: Mapping[str, date]) -> tuple[Note, ...]:
    """Return a note where all photos say that they were `taken` (by station) on one day, just beside the visit's."""
    days = set(taken.values())
    day = days.pop() if len(days) == 1 else visit.date
    if day == visit.date or abs(day - visit.date) > NEAR or visit.camera_clock_wrong:
        return ()
    subject = about(SubjectKind.VISIT, visit.date.isoformat())
    return (noted(Reason.PHOTOS_A_DAY_OFF, subject, day=day.isoformat(), visit=visit.date.isoformat()),)


def to_come(day: date, today: date) -> tuple[Note, ...]:
    """Return a note where a visit's day is after today's; tomorrow has begun somewhere."""
    if day - today <= NEAR:
        return ()
    subject = about(SubjectKind.VISIT, day.isoformat())
    return (noted(Reason.VISIT_TO_COME, subject, visit=day.isoformat(), today=today.isoformat()),)


def of_other_day(station: str, visit: Visit, taken: Mapping[str, date]) -> Rejection:
    """Return why a station decides nothing whose photos, or those beside it, are of another day than its visit's.

    `taken` is when photos say that they were, by station.
    """
    day = taken.get(station)
    return rejected(
        Reason.STATION_OF_OTHER_DAY,
        about(SubjectKind.STATION, station),
        day=visit.date.isoformat(),
        taken=day.isoformat() if day else "",
    )
