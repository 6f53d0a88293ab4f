"""Checks of a project before it is measured: its files are there, and a pair of photos counts for one station."""

import hashlib
from collections.abc import Mapping
from datetime import date, timedelta
from pathlib import Path

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import ProjectError, Rejection, rejected
from asbuilt_bim.project.read import Project, Station, Visit, first_rows
from asbuilt_bim.storage.regular_file import open_regular

_EMPTY = hashlib.sha256().digest()
NEAR = timedelta(days=1)
"""Camera clocks run on another zone's time, and a visit may last past midnight."""


def refuse_missing(project: Project) -> None:
    """Check that every file of a project is there, but for the photos: a missing photo costs its station alone.

    Raises:
        ProjectError: with every file that is missing, by its key.
    """
    missing = [f"  {key}: {project.relative(path)}" for key, path in project.missing.items()]
    if missing:
        count = "a file isn't" if len(missing) == 1 else f"{len(missing)} files aren't"
        rows = first_rows(missing)
        raise ProjectError("\n".join([f"{project.path}: {count} there; copy them there, or correct the paths:", *rows]))


def same_photos(project: Project, visit: Visit) -> dict[str, Rejection]:
    """Return, by station of one visit, why its photos are not its own: an earlier station has the same two.

    Earlier is a visit before this one, or a station above it in the same visit. Only files of equal length are read;
    one that can't be read, and photos exchanged or mixed between stations, are left to those who measure them.
    """
    earlier: dict[tuple[int, int], list[tuple[Visit, Station]]] = {}
    found: dict[str, Rejection] = {}
    for other in project.visits:
        if other.date > visit.date:
            break
        for station in other.stations:
            known = earlier.setdefault((_size(station.left), _size(station.right)), [])
            if other.date == visit.date and known:
                own = _digests(station)
                twin = next((pair for pair in known if own is not None and _digests(pair[1]) == own), None)
                if twin is not None:
                    found[station.name] = _rejection(station, visit, *twin, project)
            known.append((other, station))
    return found


def _rejection(station: Station, visit: Visit, other: Visit, twin: Station, project: Project) -> Rejection:
    return rejected(
        Reason.PHOTOS_OF_OTHER_STATION,
        about(SubjectKind.STATION, station.name),
        other=twin.name,
        other_visit="" if other.date == visit.date else other.date.isoformat(),
        left=project.relative(station.left),
        right=project.relative(station.right),
        other_left=project.relative(twin.left),
        other_right=project.relative(twin.right),
    )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _digests(station: Station) -> tuple[bytes, bytes] | None:
    """Return the SHA-256 of a station's two files, None where one is empty or can't be read."""
    digests = []
    for path in (station.left, station.right):
        try:
            with open_regular(path) as file:
                digests.append(hashlib.file_digest(file, "sha256").digest())
        except OSError:
            return None
    return None if _EMPTY in digests else (digests[0], digests[1])


def other_days(visit: Visit, taken: Mapping[str, date]) -> tuple[Rejection, ...]:
    """Return one warning where photos say that they were `taken` (by station) on another day than the visit's.

    They count all the same: a camera's clock may be wrong, and only the user knows.
    """
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
        ),
    )
