"""What a project is once it is read: its files, rig, markers and visits, every path absolute."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Literal

from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.match.survey_trust import Shift
from asbuilt_bim.progress.tolerance import Tolerance
from asbuilt_bim.project.file import (
    BoardsFile,
    MarkersFile,
    NearFile,
    TagsFile,
    TargetFile,
    ValuationFile,
)
from asbuilt_bim.project.mistakes import shown_path
from asbuilt_bim.project.networks import NetworkChoice
from asbuilt_bim.project.options import Options

_OWN = Foreign()


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """One photo pair of a visit. The photos may be missing: that rejects the station, not the project.

    Left and right are one path where the file holds both eyes side by side.
    """

    name: str
    left: Path
    right: Path
    near: NearFile | None = None  # where it stood, roughly
    of_video: bool = False  # its photos are frames in the cache's folder, which nobody should rename

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
    """The stations of one date, in the file's order; those of its videos are made of them when a run begins."""

    date: date
    stations: tuple[Station, ...]
    camera_clock_wrong: bool = False  # its photos' own days don't count
    videos: tuple[Video, ...] = ()
    near: NearFile | None = None  # roughly where the videos' stations stood
    near_stations: Mapping[str, NearFile] = field(default_factory=dict)  # by name, of those that aren't listed


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
    csv: Literal["comma", "semicolon"] = "comma"
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
        photos += [p for v in self.visits for video in v.videos for p in video.files]
        boards = [p for pair in self.rig.pairs for p in pair]
        rig = [*self.rig.files, *([self.rig.control_points] if self.rig.control_points is not None else [])]
        named = self.schedule, self.costs, self.observations, self.last_workbook, self.survey, self.poses
        tables = [file for file in (*named, self.control_points, self.people) if file is not None]
        return (self.path, *self.ifc, *self.history, *tables, *rig, *boards, *photos)

    def relative(self, path: Path) -> str:
        """Return a path as the reports show it: relative to the project folder with `/`, or its bare name."""
        return shown_path(path, self.folder)
