"""Reads a project file: every mistake is named at once, and every path made real."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np

from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.errors import NetworkError, ProjectError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.match.survey_trust import Shift
from asbuilt_bim.measure.depth_source import depth_method, missing_network
from asbuilt_bim.progress.tolerance import EN_13670_1, PlumbLimit, Tolerance
from asbuilt_bim.project.file import (
    NetworksFile,
    ProjectFile,
    RigFile,
    StationFile,
    SurveyShiftFile,
    ToleranceFile,
    VideoFile,
    VisitFile,
)
from asbuilt_bim.project.mistakes import further_mistakes, message
from asbuilt_bim.project.model import Project, RigSource, Station, Video, Visit
from asbuilt_bim.project.networks import NetworkChoice
from asbuilt_bim.project.options import Options
from asbuilt_bim.project.paths import MAX_PAIRS, PathChecker, composed, safe_name
from asbuilt_bim.project.rules import check_dates, check_photos, check_places
from asbuilt_bim.project.stations import check_names, listed_stations, listed_visits
from asbuilt_bim.storage.plugins import PREFIX
from asbuilt_bim.storage.regular_file import file_alike, path_of
from asbuilt_bim.storage.strict_yaml import read_yaml
from asbuilt_bim.storage.structure import Problems, structure
from asbuilt_bim.vision.networks.bundled import BUNDLED, bundled_card
from asbuilt_bim.vision.networks.card import Task


def read_project(path: Path | str, *, allow_outside: bool = False, visited: bool = True) -> Project:
    """Read and check a project file; paths that leave its folder need `allow_outside`.

    Without `visited` it may have no visits and no photos yet: what a visit is planned with, and checked by on site.

    Raises:
        ProjectError: with EVERY mistake: where, what was expected, what is there.
    """
    path = path_of(path, "project").absolute()
    document = read_yaml(path)
    problems = Problems()
    written: ProjectFile | None = structure(document.value, ProjectFile, problems)
    checker = PathChecker(folder=path.parent, allow_outside=allow_outside, problems=problems)
    if written is None or problems.found:
        more = further_mistakes(
            document.value,
            problems.found,
            replace(checker, problems=Problems()),
            lambda rest, own: _resolve(path, rest, own, visited=visited),
        )
        raise ProjectError(message(path, [*problems.found, *more], document))
    project = _resolve(path, written, checker, visited=visited)
    if problems.found:
        wrong = {problem.path for problem in problems.found}
        for where, file in project.missing.items():  # one message names all that is wrong
            if where not in wrong:
                problems.add(where, f"there is no {project.relative(file)}{file_alike(file)}")
        raise ProjectError(message(path, problems.found, document))
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
    check_dates(listed, checker.problems, visited=visited)
    check_photos(visits, checker.problems)
    check_places(written, checker.problems, visited=visited)
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
        csv=written.csv,
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
    if any(visit.videos for visit in chosen):
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
    if not visit.stations and not visit.video:
        checker.problems.add(f"{where}.stations", "is empty: a visit has at least one station, or a video")
    for index, station in enumerate(listed):
        at = f"{where}.stations[{index}]"
        if reason := safe_name(station.name):
            checker.problems.add(f"{at}.name", reason)
        key = composed(station.name).casefold()
        if key in seen:
            checker.problems.add(f"{at}.name", f"'{station.name}' is the name of {seen[key]} too; names are unique")
        seen.setdefault(key, at)
        near = station.near or visit.near_stations.get(station.name) or visit.near
        stations.append(replace(_station(station, at, checker), near=near))
    if not visit.video:
        check_names(visit.near_stations, listed, where, checker)
    names = {station.name for station in listed}
    return Visit(
        date=visit.date,
        stations=tuple(stations),
        camera_clock_wrong=visit.camera_clock_wrong,
        videos=_videos(visit.video, f"{where}.video", checker),
        near=visit.near,
        near_stations={name: near for name, near in visit.near_stations.items() if name not in names},
    )


def _videos(written: tuple[VideoFile, ...] | VideoFile, at: str, checker: PathChecker) -> tuple[Video, ...]:
    if isinstance(written, VideoFile):
        return (_video(written, at, checker),)
    return tuple(_video(one, f"{at}[{number}]", checker) for number, one in enumerate(written))


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
        return Station(name=composed(station.name), left=both, right=both)
    left, right = checker.photo(station.left or "", f"{at}.left"), checker.photo(station.right or "", f"{at}.right")
    if left == right:
        checker.problems.add(f"{at}.right", f"is the same file as left ({station.left}); one that holds both is `both`")
    return Station(name=composed(station.name), left=left, right=right)


def _networks(written: NetworksFile, options: Options, checker: PathChecker) -> NetworkChoice:
    def chosen(text: str | None, key: Task) -> str:
        if not text or text.startswith(PREFIX):
            return text or ""
        if text == BUNDLED:
            try:
                bundled_card(key)
            except NetworkError as problem:
                checker.problems.add(f"networks.{key}", str(problem))
            return text
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
            yield replace(visit, video=())
