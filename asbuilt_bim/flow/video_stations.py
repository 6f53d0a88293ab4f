"""Walks recorded as video made into stations, once for each video: their frames are kept in the cache's folder."""

import contextlib
import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date
from pathlib import Path

from asbuilt_bim.camera.video.container import check_container
from asbuilt_bim.camera.video.frames import PROGRESS, TakenFrame, station_names, take_frames
from asbuilt_bim.camera.video.recorded import made_on
from asbuilt_bim.errors import PhotoError, ProjectError
from asbuilt_bim.flow.measure_visit import Progress
from asbuilt_bim.project.check import NEAR, refuse_missing
from asbuilt_bim.project.model import Project, Station, Video, Visit
from asbuilt_bim.project.paths import composed, safe_name
from asbuilt_bim.project.stations import named_wrongly
from asbuilt_bim.scale.apart import Ended, Limits, run_apart
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.fingerprint import library_versions

_VIDEO = Limits(seconds=7200.0, memory_bytes=8e9)
"""An hour of both eyes takes half an hour to look through; two decoders and some frames are a gigabyte."""
MAX_BYTES = 10_000_000_000
"""Of frames that are kept: some ten walks."""
_INDEX = "frames.json"
_METHOD = "2026-12"  # how frames are chosen, and films refused: done otherwise, another name
_SIDE = re.compile(r"[_\-. ]?(left|links|cam0|L)$", re.IGNORECASE)
_BLOCK = 1 << 22


@contextmanager
def with_video_stations(project: Project, cache: Cache, progress: Progress) -> Iterator[Project]:
    """Give a project whose visits have the stations of their videos; without a cache their frames go afterwards.

    Raises:
        PhotoError: a video can't be used; the text says why and what to do.
        ProjectError: a station of a video has the name of one that is listed, a rough place that of none, or a file of
            the project is missing.
    """
    if not any(visit.videos for visit in project.visits):
        yield project
        return
    refuse_missing(project)  # before minutes are spent on looking through videos
    with contextlib.ExitStack() as after:
        if cache.folder is None:
            place = Path(after.enter_context(tempfile.TemporaryDirectory(prefix="asbuilt-bim-")))
        else:
            place = cache.folder / "frames"
        visits = tuple(_with_stations(visit, project, place, progress) for visit in project.visits)
        _prune(place, {station.left.parent for visit in visits for station in visit.stations})
        yield replace(project, visits=visits)


def _with_stations(visit: Visit, project: Project, place: Path, progress: Progress) -> Visit:
    stations = list(visit.stations)
    for video in visit.videos:
        folder, names = _frames(video, project, place, progress, visit.date)
        there = {station.name.casefold() for station in stations}
        if twice := next((name for name in names if name.casefold() in there), ""):
            raise ProjectError(
                f"{project.path}: '{twice}' is a station of the video {project.relative(video.left)}, and listed too "
                "or another video's; rename the listed one, or the video"
            )
        stations += [
            Station(
                name=name,
                left=folder / f"{name}_left.png",
                right=folder / f"{name}_right.png",
                near=visit.near_stations.get(name) or visit.near,
                of_video=True,
            )
            for name in names
        ]
    made = [station.name for station in stations]
    for name, wrong in named_wrongly(visit.near_stations, made).items():
        raise ProjectError(f"{project.path}: near_stations.{name} of {visit.date} {wrong}")
    return replace(visit, stations=tuple(stations))


def _frames(video: Video, project: Project, place: Path, progress: Progress, day: date) -> tuple[Path, list[str]]:
    """Return the folder of a video's frames and the stations' names, made now or found from before."""
    for file in video.files:
        check_container(file)
    step, made = f"frames {day.isoformat()}", _recorded_by(video, day)
    name = _SIDE.sub("", composed(video.left.stem)) or "video"
    name = "video" if safe_name(f"{name}_0001") else name
    progress(step, 0, 1)
    libraries = [f"{one} {version}" for one, version in sorted(library_versions().items())]
    key = digest_of([_METHOD, name, str(made), *(_digest(file) for file in video.files), *libraries])
    folder = place / key[:32]
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        index = json.loads((folder / _INDEX).read_text(encoding="utf-8"))
        names = [str(one) for one in index["stations"]]
        if names and all((folder / f"{one}_{side}.png").is_file() for one in names for side in ("left", "right")):
            folder.touch()
            progress(step, 1, 1)
            return folder, names
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=place, prefix="part-", ignore_cleanup_errors=True) as part:
            names = station_names(_taken(video, Path(part), name, made, progress, step))
            (Path(part) / PROGRESS).unlink(missing_ok=True)
            (Path(part) / _INDEX).write_text(json.dumps({"stations": names}), encoding="utf-8")
            shutil.rmtree(folder, ignore_errors=True)
            Path(part).replace(folder)
    except OSError as problem:
        raise PhotoError(
            f"video {project.relative(video.left)}: its frames can't be written to {place} "
            f"({problem.strerror or problem}); free space there, or name another folder in ASBUILT_BIM_CACHE"
        ) from problem
    progress(step, 1, 1, f"{len(names)} stations")
    return folder, names


def _recorded_by(video: Video, day: date) -> date | None:
    """Return the day that the files say the walk was recorded on; None where they don't, or were exported later."""
    made = [one for file in video.files if (one := made_on(file)) is not None and one - day <= NEAR]
    return min(made, default=None)


def _taken(
    video: Video, part: Path, name: str, made: date | None, progress: Progress, step: str
) -> tuple[TakenFrame, ...]:
    """Choose the frames in a process apart, telling how far it is."""

    def meanwhile() -> None:
        with contextlib.suppress(OSError, ValueError):
            done, count = map(int, (part / PROGRESS).read_text(encoding="ascii").split())
            if 0 < done < count:
                progress(step, done, count)

    right = "" if video.right is None else str(video.right)
    found = run_apart(
        take_frames, str(video.left), right, str(part), name, made, limits=_VIDEO.raised(), meanwhile=meanwhile
    )  # fmt: skip
    if isinstance(found, Ended):
        raise PhotoError(
            f"video {video.left}: looking through it ended ({found.detail}); export it to MP4 again, or cut it into "
            "walks of some minutes"
        )
    return found


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _prune(place: Path, used: set[Path]) -> None:
    """Remove the frames used longest ago, until they are within their bound."""
    with contextlib.suppress(OSError):
        folders = sorted((one for one in place.iterdir() if one.is_dir()), key=lambda one: -one.stat().st_mtime)
        total = 0
        for folder in folders:
            total += sum(file.stat().st_size for file in folder.iterdir())
            if total > MAX_BYTES and folder not in used:
                shutil.rmtree(folder, ignore_errors=True)
