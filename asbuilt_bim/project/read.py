"""The project: what the user wrote in its YAML file, checked, with every path made real."""

import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Literal

import numpy as np

from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.errors import NetworkError, ProjectError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.match.survey_trust import Shift
from asbuilt_bim.measure.depth_source import depth_method, missing_network
from asbuilt_bim.progress.tolerance import EN_13670_1, PlumbLimit, Tolerance
from asbuilt_bim.project.file import (
    BoardsFile,
    MarkersFile,
    NearFile,
    NetworksFile,
    PatternsFile,
    ProjectFile,
    RigFile,
    StationFile,
    SurveyShiftFile,
    TagsFile,
    TargetFile,
    ToleranceFile,
    ValuationFile,
    VideoFile,
    VisitFile,
)
from asbuilt_bim.project.networks import NetworkChoice
from asbuilt_bim.project.options import Options
from asbuilt_bim.project.paths import MAX_PAIRS, PathChecker, safe_name
from asbuilt_bim.project.stations import listed_stations, listed_visits
from asbuilt_bim.storage.plugins import PREFIX
from asbuilt_bim.storage.strict_yaml import read_yaml
from asbuilt_bim.storage.structure import Problem, Problems, structure
from asbuilt_bim.vision.networks.bundled import BUNDLED, bundled_card
from asbuilt_bim.vision.networks.card import Task

_OWN = Foreign()
YEARS = 1990, 2200  # of digital photographs; later ones than 9999 break every calendar
MAX_NAMED = 100
"""Rows that one message holds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """One photo pair of a visit. The photos may be missing: that rejects the station, not the project.

    Left and right are one path where the file holds both eyes side by side.
    """

    name: str
    left: Path
    right: Path
    near: NearFile | None = None  # where it stood, roughly

    @property
    def side_by_side(self) -> bool:
        """Say whether one file holds both eyes."""
        return self.left == self.right


@dataclass(frozen=True, slots=True, kw_only=True)
class Video:
    """A walk recorded as stereo video: `right` None where one file holds both eyes side by side."""

    left: Path
    right: Path | None

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the one file or the two."""
        return (self.left,) if self.right is None else (self.left, self.right)


@dataclass(frozen=True, slots=True, kw_only=True)
class Visit:
    """The stations of one date, in the file's order; those of its video are made of it when a run begins."""

    date: date
    stations: tuple[Station, ...]
    camera_clock_wrong: bool = False  # its photos' own days don't count
    video: Video | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RigSource:
    """Where the rig comes from: `file`, photos of `boards` or `tags` in pairs (left, right), or `control_points`.

    Left and right of a pair are one path where the file holds both eyes side by side.
    """

    file: Path | None
    boards: BoardsFile | None
    pairs: tuple[tuple[Path, Path], ...]
    file_right: Path | None = None
    file_pose: Path | None = None
    foreign: Foreign = _OWN  # what another program's file doesn't say
    tags: TagsFile | None = None
    control_points: Path | None = None
    photo_size_px: tuple[int, int] = (0, 0)  # of the photos that the control points were marked in
    refine: bool = False  # measure with the rig as the visit's photos show it, where it was knocked

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the rig's files: one, or left, right and how they stand."""
        return tuple(file for file in (self.file, self.file_right, self.file_pose) if file is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Project:
    """A checked project: every path absolute, visits in the order of their dates."""

    path: Path  # of the project file
    name: str
    ifc: tuple[Path, ...]  # one file, or several that are one design, the one that owns what they share first
    scope: str | None
    rig: RigSource
    target: TargetFile
    markers: MarkersFile
    survey: Path | None
    visits: tuple[Visit, ...]
    networks: NetworkChoice
    options: Options
    poses: Path | None = None
    poses_on_map: bool = False
    control_points: Path | None = None
    schedule: Path | None = None
    costs: Path | None = None
    observations: Path | None = None
    valuation: ValuationFile = field(default_factory=ValuationFile)
    last_workbook: Path | None = None
    history: tuple[Path, ...] = ()  # results of earlier runs
    tolerance: Tolerance | None = None
    pictures: Literal["elements", "whole"] = "elements"
    people: Path | None = None  # a table of outlines, to blur
    accept_moved: tuple[str, ...] = ()  # GlobalIds
    writers: tuple[str, ...] = ()
    accepted_shift: Shift | None = None  # of the survey, by a person
    files: Mapping[str, Path] = field(default_factory=dict)  # by key: all that are named but the photos

    @property
    def missing(self) -> dict[str, Path]:
        """Return the files, by key, that aren't there; a missing photo costs its station alone."""
        return {key: path for key, path in self.files.items() if not path.exists()}

    @property
    def folder(self) -> Path:
        """Return the folder that relative paths start from."""
        return self.path.parent

    @property
    def sources(self) -> tuple[Path, ...]:
        """Return every file that the project reads; none of them is ever written."""
        photos = [p for v in self.visits for s in v.stations for p in (s.left, s.right)]
        photos += [p for v in self.visits if v.video is not None for p in v.video.files]
        boards = [p for pair in self.rig.pairs for p in pair]
        rig = [*self.rig.files, *([self.rig.control_points] if self.rig.control_points is not None else [])]
        named = self.schedule, self.costs, self.observations, self.last_workbook, self.survey, self.poses
        tables = [file for file in (*named, self.control_points, self.people) if file is not None]
        return (self.path, *self.ifc, *self.history, *tables, *rig, *boards, *photos)

    def relative(self, path: Path) -> str:
        """Return a path as the reports show it: relative to the project folder with `/`, or its bare name."""
        try:
            return path.relative_to(self.folder).as_posix()
        except ValueError:
            return path.name


def read_project(path: Path | str, *, allow_outside: bool = False, visited: bool = True) -> Project:
    """Read and check a project file; paths that leave its folder need `allow_outside`.

    Without `visited` it may have no visits and no photos yet: what a visit is planned with, and checked by on site.

    Raises:
        ProjectError: with EVERY mistake: where, what was expected, what is there.
    """
    path = Path(path).absolute()
    document = read_yaml(path)
    problems = Problems()
    written: ProjectFile | None = structure(document.value, ProjectFile, problems)
    if written is None or problems.found:
        raise ProjectError(_message(path, problems.found, document.lines))
    checker = PathChecker(folder=path.parent, allow_outside=allow_outside, problems=problems)
    project = _resolve(path, written, checker, visited=visited)
    if problems.found:
        wrong = {problem.path for problem in problems.found}
        for where, file in project.missing.items():  # one message names all that is wrong
            if where not in wrong:
                problems.add(where, f"there is no {project.relative(file)}")
        raise ProjectError(_message(path, problems.found, document.lines))
    return project


def _resolve(path: Path, written: ProjectFile, checker: PathChecker, *, visited: bool) -> Project:
    if not visited:
        written = replace(written, visits=tuple(_with_photos(written, checker)))
    listed = listed_visits(written.visits, checker)
    visits = [_visit(visit, f"visits[{i}]", checker) for i, visit in enumerate(listed)]
    for index, name in enumerate(written.writers):
        if reason := safe_name(name):  # it becomes a folder's name
            checker.problems.add(f"writers[{index}]", reason)
    rig = _rig_source(written.rig, visits, checker)
    _check_dates(listed, checker.problems, visited=visited)
    _check_photos(visits, checker.problems)
    _check_places(written, checker.problems)
    return Project(
        path=path,
        name=written.name,
        ifc=_models(written.ifc, checker),
        scope=written.scope,
        rig=rig,
        target=written.target,
        markers=written.markers,
        survey=checker.file(written.markers.survey, "markers.survey") if written.markers.survey else None,
        poses=checker.file(written.poses.file, "poses.file") if written.poses else None,
        poses_on_map=written.poses is not None and written.poses.coordinates == "map",
        control_points=checker.file(written.control_points, "control_points") if written.control_points else None,
        visits=tuple(sorted(visits, key=lambda visit: visit.date)),
        options=written.options,
        schedule=checker.file(written.schedule, "schedule") if written.schedule else None,
        costs=checker.file(written.costs, "costs") if written.costs else None,
        observations=checker.file(written.observations, "observations") if written.observations else None,
        valuation=written.valuation,
        last_workbook=checker.file(written.valuation.last, "valuation.last") if written.valuation.last else None,
        history=tuple(checker.file(text, f"history[{i}]") for i, text in enumerate(written.history)),
        networks=_networks(written.networks, written.options, checker),
        tolerance=_tolerance(written.tolerance),
        pictures=written.pictures,
        people=checker.file(written.people, "people") if written.people else None,
        accept_moved=written.accept_moved,
        writers=tuple(dict.fromkeys(written.writers)),
        accepted_shift=_accepted(written.accept_survey_shift),
        files=checker.files,
    )


def _tolerance(written: ToleranceFile | None) -> Tolerance | None:
    """Return the limits that a project asks for."""
    if written is None or written.standard is not None:
        return None if written is None else EN_13670_1
    plumb = () if written.plumb_m is None else (PlumbLimit(least_m=written.plumb_m, height_share=written.plumb_share),)
    return Tolerance(name=written.name, offset_m=written.offset_m, plumb=plumb)


def _rig_source(written: RigFile, visits: list[Visit], checker: PathChecker) -> RigSource:
    boards, control = written.boards, written.control_points
    return RigSource(
        file=checker.file(written.file, "rig.file") if written.file else None,
        file_right=checker.file(written.file_right, "rig.file_right") if written.file_right else None,
        foreign=Foreign(
            size_px=written.photo_size_px,
            metres_per_unit=written.unit_m,
            fisheye=written.fisheye,
            cameras=written.cameras,
        ),
        file_pose=checker.file(written.file_pose, "rig.file_pose") if written.file_pose else None,
        control_points=checker.file(control.file, "rig.control_points.file") if control else None,
        photo_size_px=control.photo_size_px if control else (0, 0),
        boards=boards,
        tags=written.tags,
        pairs=_rig_pairs(written, visits, checker),
        refine=written.refine,
    )


def _rig_pairs(written: RigFile, visits: list[Visit], checker: PathChecker) -> tuple[tuple[Path, Path], ...]:
    """Return the pairs of photos that the rig is made from."""
    if written.tags is not None and not written.tags.has_photos:
        return _visit_pairs(written.tags.visit, visits, checker.problems)
    photos, where = (written.boards, "rig.boards") if written.boards is not None else (written.tags, "rig.tags")
    if photos is None:
        return ()
    if photos.both is not None:
        return tuple((path, path) for path in checker.several(photos.both, f"{where}.both"))
    return checker.pairs(photos.left or "", photos.right or "", where)


def _visit_pairs(day: date | None, visits: list[Visit], problems: Problems) -> tuple[tuple[Path, Path], ...]:
    chosen = [visit for visit in visits if day in (None, visit.date)]
    if day is not None and not chosen:
        problems.add("rig.tags.visit", f"there is no visit of {day}")
    if any(visit.video is not None for visit in chosen):
        problems.add("rig.tags", "takes photos: the frames of a video aren't there yet; name photos under rig.tags")
    pairs = [(station.left, station.right) for visit in chosen for station in visit.stations]
    if len(pairs) > MAX_PAIRS:
        problems.add("rig.tags", f"{len(pairs):,} pairs, limit {MAX_PAIRS}; name one visit: visit: {visits[0].date}")
    return tuple(pairs[:MAX_PAIRS])


def _accepted(written: SurveyShiftFile | None) -> Shift | None:
    if written is None:
        return None
    axis_m = written.about_m or (0.0, 0.0)
    turn_rad = float(np.radians(written.turn_deg))
    return Shift(move_m=frozen(written.move_m), turn_rad=turn_rad, about_m=frozen(axis_m))


def _models(written: tuple[str, ...] | str, checker: PathChecker) -> tuple[Path, ...]:
    if isinstance(written, str):
        return (checker.file(written, "ifc"),)
    paths = tuple(checker.file(text, f"ifc[{i}]") for i, text in enumerate(written))
    if not paths:
        checker.problems.add("ifc", "is empty: a project has at least one IFC file")
    seen: dict[Path, int] = {}
    for number, path in enumerate(paths):
        if path in seen:
            checker.problems.add(f"ifc[{number}]", f"is the same file as ifc[{seen[path]}]; name each once")
        seen.setdefault(path, number)
    return paths


def _visit(visit: VisitFile, where: str, checker: PathChecker) -> Visit:
    seen: dict[str, str] = {}
    stations = []
    listed = listed_stations(visit.stations, f"{where}.stations", checker)
    if not visit.stations and visit.video is None:
        checker.problems.add(f"{where}.stations", "is empty: a visit has at least one station, or a video")
    for index, station in enumerate(listed):
        at = f"{where}.stations[{index}]"
        if reason := safe_name(station.name):
            checker.problems.add(f"{at}.name", reason)
        key = unicodedata.normalize("NFC", station.name).casefold()
        if key in seen:
            checker.problems.add(f"{at}.name", f"'{station.name}' is the name of {seen[key]} too; names are unique")
        seen.setdefault(key, at)
        stations.append(replace(_station(station, at, checker), near=station.near or visit.near))
    video = _video(visit.video, f"{where}.video", checker) if visit.video is not None else None
    return Visit(
        date=visit.date, stations=tuple(stations), camera_clock_wrong=visit.camera_clock_wrong, video=video
    )  # fmt: skip


def _video(written: VideoFile, at: str, checker: PathChecker) -> Video:
    if written.both is not None:
        return Video(left=checker.file(written.both, f"{at}.both"), right=None)
    left, right = (checker.file(text or "", f"{at}.{side}") for side, text in
                   (("left", written.left), ("right", written.right)))  # fmt: skip
    if left == right:
        checker.problems.add(f"{at}.right", f"is the same file as left ({written.left}); one that holds both is `both`")
    return Video(left=left, right=right)


def _station(station: StationFile, at: str, checker: PathChecker) -> Station:
    if station.both is not None:
        both = checker.photo(station.both, f"{at}.both")
        return Station(name=station.name, left=both, right=both)
    left, right = checker.photo(station.left or "", f"{at}.left"), checker.photo(station.right or "", f"{at}.right")
    if left == right:
        checker.problems.add(f"{at}.right", f"is the same file as left ({station.left}); one that holds both is `both`")
    return Station(name=station.name, left=left, right=right)


def _networks(written: NetworksFile, options: Options, checker: PathChecker) -> NetworkChoice:
    def chosen(text: str | None, key: Task) -> str:
        if not text or text.startswith(PREFIX):
            return text or ""
        if text == BUNDLED:
            try:
                return str(bundled_card(key))
            except NetworkError as problem:
                checker.problems.add(f"networks.{key}", str(problem))
                return ""
        return str(checker.file(text, f"networks.{key}"))

    named = "named" if written.depth else None
    if missing := missing_network(options.measure.method, options.measure.depth, named):
        checker.problems.add("networks.depth", missing)
    if named and depth_method(options.measure.method, options.measure.depth) == "stereo":
        checker.problems.add(
            "networks.depth", "isn't used by depth: stereo; set options.measure.depth: fused, or drop it"
        )
    if written.stereo and written.stereo.startswith(PREFIX):
        checker.problems.add("networks.stereo", "takes a network's card; plugins segment or give relative depth")
    return NetworkChoice(
        segment=chosen(written.segment, "segment"),
        depth=chosen(written.depth, "depth"),
        stereo=chosen(written.stereo, "stereo"),
    )


def _with_photos(written: ProjectFile, checker: PathChecker) -> Iterator[VisitFile]:
    """Yield the visits that have stations: a pattern that no photo fits yet is of a visit to come.

    Videos are left out: what is planned and checked before a run needs no frame of them.
    """
    trial = replace(checker, problems=Problems(), files={})
    for visit in listed_visits(written.visits, trial):
        if listed_stations(visit.stations, "", trial):
            yield replace(visit, video=None)


def _check_places(written: ProjectFile, problems: Problems) -> None:
    """Something must say where stations stand: a survey, poses, points, or the markers of an earlier result."""
    known = written.markers.survey, written.poses, written.control_points, *written.history
    if not any(known) and not _any_near(written):
        problems.add(
            "markers",
            "is missing: stations are placed by markers.survey, by poses, by control_points, or by the design from a "
            "rough place (near)",
        )
    if written.rig.tags is not None and written.markers.size_m is None:
        problems.add("markers.size_m", "is missing: a rig is calibrated from tags of a known size")


def _any_near(written: ProjectFile) -> bool:
    """Say whether any station has a rough place."""
    for visit in () if isinstance(written.visits, PatternsFile) else written.visits:
        stations = () if isinstance(visit.stations, PatternsFile) else visit.stations
        if visit.near is not None or any(station.near is not None for station in stations):
            return True
    return False


def _check_dates(visits: tuple[VisitFile, ...], problems: Problems, *, visited: bool) -> None:
    if not visits and visited:
        problems.add("visits", "is empty: a project has at least one visit")
    seen: dict[date, int] = {}
    for index, visit in enumerate(visits):
        if visit.date in seen:
            problems.add(f"visits[{index}].date", f"{visit.date} is the date of visits[{seen[visit.date]}] too")
        seen.setdefault(visit.date, index)
        if not YEARS[0] <= visit.date.year <= YEARS[1]:
            problems.add(
                f"visits[{index}].date", f"expected a day of the years {YEARS[0]} to {YEARS[1]}, got {visit.date}"
            )


def _check_photos(visits: list[Visit], problems: Problems) -> None:
    """A photo belongs to one station; the same picture in two files is found by `flow/shown_again.py`."""
    seen: dict[Path, str] = {}
    for number, visit in enumerate(visits):
        for index, station in enumerate(visit.stations):
            for side, path in (("left", station.left), ("right", station.right)):
                at = f"visits[{number}].stations[{index}]"
                if seen.get(path, at) != at:
                    problems.add(f"{at}.{side}", f"is a photo of {seen[path]} too; a photo belongs to one station")
                seen.setdefault(path, at)


def _message(path: Path, found: list[Problem], lines: dict[str, int]) -> str:
    count = "one mistake" if len(found) == 1 else f"{len(found)} mistakes"
    rows = [f"{path}: {count}; nothing was run:"]
    for problem in sorted(found, key=lambda p: _line(p.path, lines)):
        rows.append(f"  line {_line(problem.path, lines)}: {problem.path or 'the file'}: {problem.text}")
    return "\n".join(first_rows(rows))


def first_rows(rows: list[str]) -> list[str]:
    """Return the rows of a message, the first ones where nobody would read them all."""
    return [*rows[:MAX_NAMED], f"  and {len(rows) - MAX_NAMED:,} more"] if len(rows) > MAX_NAMED else rows


def _line(where: str, lines: dict[str, int]) -> int:
    while where and where not in lines:  # a missing key has no line: its parent's
        cut = max(where.rfind("."), where.rfind("["))
        where = where[:cut] if cut > 0 else ""
    return lines.get(where, 1)
