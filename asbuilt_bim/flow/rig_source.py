"""The rig of a project: read from its file, or calibrated from photos of boards (once, then from the cache)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.calibrate import Calibration, calibrate_stereo
from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.camera.calibration.control_rig import rig_from_control_points
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.photo.read import Photo, read_photo, side_by_side
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.reader import read_rig_files
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import CalibrationError, PhotoError, Rejection, rejected
from asbuilt_bim.flow.measure_visit import Progress
from asbuilt_bim.flow.tag_source import Tags, calibrate_tags
from asbuilt_bim.project.file import BoardsFile
from asbuilt_bim.project.model import Project
from asbuilt_bim.report.wording.reasons import reason_list
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.executor import one_thread
from asbuilt_bim.scale.fingerprint import library_versions, measuring_code_digest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProjectRig:
    """A project's rig, its calibration where it was made from boards, and what contradicts its files."""

    rig: StereoRig
    calibration: Calibration | None = None
    warnings: tuple[Rejection, ...] = ()


def rig_of(project: Project, cache: Cache, progress: Progress) -> ProjectRig:
    """Return the project's rig: what its files don't say of the photos' size, the photos do.

    Raises:
        RigError: the rig file can't be used.
        CalibrationError: the boards' photos can't be read or give no rig.
    """
    if project.rig.file is not None:
        foreign = replace(project.rig.foreign, photo_px=_photo_size(project))
        reading = read_rig_files(project.rig.files, foreign)
        return ProjectRig(rig=reading.rig, warnings=reading.warnings)
    calibration = calibrate(project, cache, progress)
    return ProjectRig(rig=calibration.rig, calibration=calibration)


def _photo_size(project: Project) -> tuple[int, int] | None:
    """Return the size of the first left photo that can be read, of one eye; None where none can."""
    for station in (station for visit in project.visits for station in visit.stations):
        try:
            photo = read_photo(station.left)
            return side_by_side(photo)[0].size_px if station.side_by_side else photo.size_px
        except PhotoError:  # it costs its station alone
            continue
    return None


def calibrate(project: Project, cache: Cache, progress: Progress) -> Calibration:
    """Calibrate from the project's photos of boards or tags, or its control points.

    Raises:
        CalibrationError: the project has none, they can't be read, or they give no rig.
    """
    boards = project.rig.boards
    if project.rig.control_points is not None:
        return rig_from_control_points(read_control_points(project.rig.control_points), project.rig.photo_size_px)
    if project.rig.tags is not None:
        return _from_tags(project, cache, progress)
    if boards is None:
        raise CalibrationError(
            f"{project.path}: rig.boards, rig.tags and rig.control_points are not given, so there is nothing to "
            "calibrate from"
        )
    return calibrate_pairs(_photos(project), project_board(boards), boards.distortion, cache, progress)


def _from_tags(project: Project, cache: Cache, progress: Progress) -> Calibration:
    """Calibrate from tags; of a visit's own photos one that can't be read costs its pair alone."""
    written = project.rig.tags
    assert written is not None and project.markers.size_m is not None  # asked for when the project was read
    tag = Tag(size_m=project.markers.size_m, flatness_m=written.flatness_m, print_share=written.print_share)
    tags = Tags(tag=tag, family=project.markers.family, lens=written.distortion)
    if written.has_photos:
        return calibrate_tags(_photos(project), tags, cache, progress)
    pairs: list[tuple[Photo, Photo]] = []
    left_out: list[Rejection] = []
    for left, right in project.rig.pairs:
        try:
            pairs.append(_pair(project, left, right))
        except PhotoError as problem:
            subject = about(SubjectKind.BOARD_PAIR, project.relative(left))
            left_out.append(rejected(Reason.PHOTO_UNUSABLE, subject, detail=str(problem)))
    return calibrate_tags(pairs, tags, cache, progress, left_out)


def project_board(boards: BoardsFile) -> Board:
    """Return the board that a project's calibration photos show."""
    return Board(
        kind=boards.kind,
        columns=boards.columns,
        rows=boards.rows,
        square_m=boards.square_m,
        marker_m=boards.marker_m or 0.0,
        dictionary=boards.dictionary or "",
        flatness_m=boards.flatness_m,
        print_share=boards.print_share,
    )


@one_thread()
def calibrate_pairs(
    pairs: Sequence[tuple[Photo, Photo]], board: Board, lens: LensModel, cache: Cache, progress: Progress
) -> Calibration:
    """Calibrate from pairs of board photos, once: the same photos and board come from the cache.

    Raises:
        CalibrationError: the boards give no rig.
    """
    libraries = [f"{name} {version}" for name, version in sorted(library_versions().items())]
    digests = [photo.digest for pair in pairs for photo in pair]
    names = [photo.name for pair in pairs for photo in pair]
    key = digest_of(["calibration", repr(board), lens, measuring_code_digest(), *libraries, *digests, *names])
    found = cache.get(key, Calibration)
    if found is not None:
        return found
    try:
        made = calibrate_stereo(pairs, board, lambda done, total: progress("calibrate", done, total), lens)
    except CalibrationError as problem:
        raise CalibrationError(f"{problem}{reason_list(problem)}", problem.rejections) from problem
    cache.put(key, made, Calibration)
    return made


def _photos(project: Project) -> list[tuple[Photo, Photo]]:
    try:
        return [_pair(project, left, right) for left, right in project.rig.pairs]
    except PhotoError as problem:
        raise CalibrationError(f"calibration: {problem}") from problem


def _pair(project: Project, left: Path, right: Path) -> tuple[Photo, Photo]:
    """Read a pair; one file named twice holds both eyes.

    Raises:
        PhotoError: one can't be read.
    """

    def named(path: Path) -> Photo:
        return replace(read_photo(path), name=project.relative(path))

    return side_by_side(named(left)) if left == right else (named(left), named(right))
