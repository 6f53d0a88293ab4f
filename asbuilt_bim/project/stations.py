"""Stations and visits by patterns of file names: nobody types two hundred photos into a file."""

import difflib
import re
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path, PurePosixPath

from asbuilt_bim.camera.photo.read import read_photo
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.project.file import NearFile, PatternsFile, StationFile, VisitFile, VisitsFile
from asbuilt_bim.project.paths import PathChecker, stars_of

MAX_STATIONS = 10_000
_NUMBERS = re.compile(r"(\d+)")


def listed_visits(written: tuple[VisitFile, ...] | VisitsFile, checker: PathChecker) -> tuple[VisitFile, ...]:
    """Return the visits in a list: as they were written, or one for each day that the photos tell."""
    if isinstance(written, VisitsFile):
        stations = listed_stations(written, "visits", checker)
        check_names(written.near_stations, stations, "visits", checker)
        return _by_day(stations, written, checker)
    return written


def check_names(
    near: Mapping[str, NearFile], stations: Sequence[StationFile], where: str, checker: PathChecker
) -> None:
    """Name each rough place that no station has, with the station that is meant most likely, or those there are."""
    for name, wrong in named_wrongly(near, [station.name for station in stations]).items():
        checker.problems.add(f"{where}.near_stations.{name}", wrong)


def named_wrongly(near: Mapping[str, NearFile], names: Sequence[str]) -> dict[str, str]:
    """Return what is wrong with each rough place that none of a visit's stations by name has."""
    wrong = {}
    for name in sorted(near.keys() - set(names)):
        alike = difflib.get_close_matches(name, names, n=1)
        there = f"did you mean {alike[0]}?" if alike else f"its stations are {', '.join(names[:5])}"
        more = " and more" if not alike and len(names) > 5 else ""
        wrong[name] = f"names no station of this visit; {there}{more}"
    return wrong


def listed_stations(
    written: tuple[StationFile, ...] | PatternsFile, where: str, checker: PathChecker
) -> tuple[StationFile, ...]:
    """Return the stations in a list: as they were written, or by their patterns in the order that people count in.

    A photo without its partner stays a station, whose other photo is missing: that costs this station alone.
    """
    if not isinstance(written, PatternsFile):
        return written
    if written.both is not None:
        found = checker.matches(written.both, f"{where}.both")
        stations = [StationFile(name=_name(written.both, one), both=_text(one, checker)) for one in found.values()]
    else:
        stations = _pairs(written.left or "", written.right or "", where, checker)
    if len(stations) > MAX_STATIONS:
        checker.problems.add(where, f"{len(stations):,} stations, limit {MAX_STATIONS:,}; name the folder of one visit")
    return tuple(sorted(stations, key=lambda one: counted(one.name))[:MAX_STATIONS])


def _pairs(left: str, right: str, where: str, checker: PathChecker) -> list[StationFile]:
    lefts = checker.matches(left, f"{where}.left", may_be_none=True)
    rights = checker.matches(right, f"{where}.right", may_be_none=bool(lefts))
    stations = []
    for key in dict.fromkeys([*lefts, *rights]):
        one, other = lefts.get(key), rights.get(key)
        pattern, there = (left, one) if one else (right, rights[key])
        stars = stars_of(pattern, there.name)
        stations.append(
            StationFile(
                name=_name(pattern, there),
                left=_text(one, checker) if one else _filled(left, stars),
                right=_text(other, checker) if other else _filled(right, stars),
            )
        )
    return stations


def _name(pattern: str, path: Path) -> str:
    """Return a station's name: what stands for the `*`, without what only separates it from the rest."""
    return "_".join(part for part in (one.strip(" _-.") for one in stars_of(pattern, path.name)) if part) or path.stem


def _filled(pattern: str, stars: Sequence[str]) -> str:
    """Return the path that a pattern means for what stands for its `*`."""
    folder, name = PurePosixPath(pattern.replace("\\", "/")).parent, PurePosixPath(pattern.replace("\\", "/")).name
    parts = name.split("*")
    return str(folder / "".join(text + star for text, star in zip(parts, (*stars, ""), strict=True)))


def _text(path: Path, checker: PathChecker) -> str:
    """Return a path as a project file would have it."""
    return path.relative_to(checker.folder).as_posix() if path.is_relative_to(checker.folder) else str(path)


def counted(name: str) -> list[tuple[int, str]]:
    """Return what sorts A2 before A10."""
    return [(int(part), "") if part.isdecimal() else (-1, part.casefold()) for part in _NUMBERS.split(name)]


def _by_day(stations: Sequence[StationFile], written: VisitsFile, checker: PathChecker) -> tuple[VisitFile, ...]:
    """Return a visit for each day that photos say they were taken on."""
    days: dict[date, list[StationFile]] = {}
    silent: list[str] = []
    for station in stations:
        day = _taken(station, checker)
        if day is None:
            silent.append(station.name)
        else:
            days.setdefault(day, []).append(station)
    if silent:
        names = ", ".join(silent[:5]) + (f" and {len(silent) - 5} more" if len(silent) > 5 else "")
        checker.problems.add(
            "visits.dates",
            f"no photo of {names} says in its EXIF when it was taken; list the visits, each with its date",
        )
    return tuple(
        VisitFile(
            date=day,
            stations=tuple(days[day]),
            near=written.near,
            near_stations={one.name: near for one in days[day] if (near := written.near_stations.get(one.name))},
        )
        for day in sorted(days)
    )


def _taken(station: StationFile, checker: PathChecker) -> date | None:
    """Return the day that a station's photos say, the left one first; None where none says one."""
    for text in (station.both, station.left, station.right):
        if text is None:
            continue
        try:
            day = read_photo(checker.folder / text).exif.taken
        except PhotoError:
            continue  # it costs its station, later and by name
        if day is not None:
            return day
    return None
