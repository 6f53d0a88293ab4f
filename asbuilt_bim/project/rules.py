"""What must hold between the parts of a project file: dates, photos, and what places the stations."""

from datetime import date
from pathlib import Path

from asbuilt_bim.project.file import (
    ProjectFile,
    VisitFile,
    VisitsFile,
)
from asbuilt_bim.project.model import Visit
from asbuilt_bim.storage.structure import Problems

YEARS = 1990, 2200  # of digital photographs; later ones than 9999 break every calendar


def check_places(written: ProjectFile, problems: Problems, *, visited: bool) -> None:
    """Something must say where stations stand: a survey, poses, points, or the markers of an earlier result.

    A project that needn't be `visited`, and has no station yet, needs none of them either.
    """
    known = written.markers.survey, written.poses, written.control_points, *written.history
    if (visited or written.visits) and not any(known) and not _any_near(written):
        problems.add(
            "markers",
            "is missing: stations are placed by markers.survey, by poses, by control_points, or by the design from a "
            "rough place (near)",
        )
    if written.rig.tags is not None and written.markers.size_m is None:
        problems.add("markers.size_m", "is missing: a rig is calibrated from tags of a known size")


def _any_near(written: ProjectFile) -> bool:
    """Say whether any station has a rough place."""
    for visit in (written.visits,) if isinstance(written.visits, VisitsFile) else written.visits:
        stations = visit.stations if isinstance(visit, VisitFile) and isinstance(visit.stations, tuple) else ()
        if visit.near is not None or visit.near_stations or any(station.near is not None for station in stations):
            return True
    return False


def check_dates(visits: tuple[VisitFile, ...], problems: Problems, *, visited: bool) -> None:
    """There is a visit (of a project that was `visited`), each has a date of its own, and it is one of photographs."""
    if not visits and visited:
        problems.add("visits", "is empty: a project has at least one visit")
    seen: dict[date, int] = {}
    for index, visit in enumerate(visits):
        if visit.date in seen:
            remedy = "a visit may hold several videos, and stations beside them"
            twice = f"{visit.date} is the date of visits[{seen[visit.date]}] too"
            problems.add(
                f"visits[{index}].date",
                f"{twice}; {remedy}" if visit.video or visits[seen[visit.date]].video else twice,
            )
        seen.setdefault(visit.date, index)
        if not YEARS[0] <= visit.date.year <= YEARS[1]:
            problems.add(
                f"visits[{index}].date", f"expected a day of the years {YEARS[0]} to {YEARS[1]}, got {visit.date}"
            )


def check_photos(visits: list[Visit], problems: Problems) -> None:
    """A photo belongs to one station; the same picture in two files is found by `flow/shown_again.py`."""
    seen: dict[Path, str] = {}
    for number, visit in enumerate(visits):
        for index, station in enumerate(visit.stations):
            for side, path in (("left", station.left), ("right", station.right)):
                at = f"visits[{number}].stations[{index}]"
                if seen.get(path, at) != at:
                    problems.add(f"{at}.{side}", f"is a photo of {seen[path]} too; a photo belongs to one station")
                seen.setdefault(path, at)
