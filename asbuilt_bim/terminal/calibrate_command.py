"""`asbuilt-bim calibrate`: boards or tags in, a rig file and a page out, nothing where a known length is off."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import area_effect
from asbuilt_bim.camera.calibration.boards import Board, board_of
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.calibration.check_length import LengthCheck, check_board, check_points, refuse_wrong_scale
from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.camera.calibration.control_rig import rig_from_control_points
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.camera.lens import LensModel
from asbuilt_bim.camera.photo.read import Photo, read_photo, side_by_side
from asbuilt_bim.camera.rig_formats.reader import RigFormat, rig_contents, rig_files
from asbuilt_bim.errors import CalibrationError, OptionError, OutputError
from asbuilt_bim.flow.measure_visit import Progress
from asbuilt_bim.flow.rig_source import calibrate, calibrate_pairs, project_board
from asbuilt_bim.flow.tag_source import Tags, calibrate_tags
from asbuilt_bim.project.paths import PathChecker
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.page.calibration import calibration_page, more_to_take, verdict
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.storage.atomic_write import place_problem, replace_all
from asbuilt_bim.storage.structure import Problems
from asbuilt_bim.terminal.open_cache import open_cache
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.terminal.summary_table import calibration_lines


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateRequest:
    """The command line of `calibrate`, as given: a project, photos with their board or tags, or control points."""

    out: Path
    project: Path | None = None
    report: Path | None = None
    form: RigFormat = "rig"
    left: str = ""
    right: str = ""
    both: str = ""
    board: str = ""
    tags: float | None = None  # the size of the tags that the photos show, in metres
    family: str = "apriltag_36h11"
    lens: LensModel = "five"
    control_points: Path | None = None
    photo_size: tuple[int, int] = (0, 0)
    check_length: float | None = None
    check_points: str = ""
    check_board: str = ""
    check_left: Path | None = None
    check_right: Path | None = None
    check_both: Path | None = None
    allow_outside: bool = False
    replace: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Made:
    """A calibration, the files that it was made from, and the board that they show (None: tags or control points)."""

    calibration: Calibration
    sources: list[Path]
    board: Board | None


def calibrate_command(request: CalibrateRequest, screen: Screen) -> int:
    """Calibrate, hold the rig against the known lengths, and write it with its page.

    Raises:
        AsBuiltError: the boards give no rig, its scale is off (nothing is written then), it isn't fit to measure with
            (the page alone is), or a file can't be written.
    """
    _check_places(request)
    cache = open_cache(screen)
    with screen.steps() as progress:
        found = _calibrated(request, cache, progress)
    made, sources = found.calibration, found.sources
    checks = _checks(request, found)
    for check in checks:
        refuse_wrong_scale(check)
    second = request.check_left, request.check_right, request.check_both
    sources += [path for path in second if path is not None]
    if taken := {path.resolve() for path in _outputs(request)} & {source.resolve() for source in sources}:
        raise OutputError(f"{min(taken)}: is read for this calibration; write to another place")
    judged = verdict(made, area_effect(made.rig, made.by_source), checks)
    fit = judged.grade != "doubtful"
    written = _write(request, made, checks, fit=fit)
    for line in calibration_lines(made, checks):
        screen.say(line)
    for check in checks:
        screen.say(
            f"Known length: {check.what}: {check.measured_m:.4f} m, {100 * check.off:+.2f} % off {check.known_m:.4f} m"
        )
    if request.report is not None:
        screen.say(f"What to make of it: {request.report}")
    if not fit:
        raise CalibrationError(f"{request.out}: no rig is written. {judged.sentence} {more_to_take(made)}")
    names = " and ".join(str(file) for file in written)
    key = ", file_right: ".join(file.name for file in written)
    screen.say(f"The rig is in {names}; name it in the project file: rig: {{file: {key}}}")
    return 0


def _outputs(request: CalibrateRequest) -> tuple[Path, ...]:
    """Return the files that are going to be written: the rig's, and the page."""
    return (*rig_files(request.out, request.form), *([request.report] if request.report is not None else []))


def _check_places(request: CalibrateRequest) -> None:
    """Refuse places that can't be written, or hold what nobody gave leave to write over, before anything is done."""
    outputs = _outputs(request)
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise OutputError(f"{request.report}: the page and the rig can't be one file; name two")
    for path in outputs:
        if problem := place_problem(path):
            raise OutputError(problem)
        if path.exists() and not request.replace:
            what = "a page or another file" if path == request.report else "a rig"
            stake = "" if path == request.report else ", and past visits may rest on it"
            raise OutputError(f"{path}: {what} is there already{stake}; name another, or --replace")


def _write(
    request: CalibrateRequest, made: Calibration, checks: tuple[LengthCheck, ...], *, fit: bool
) -> tuple[Path, ...]:
    """Write the files of a rig that is fit to measure with and the page, all or none, and return the rig's."""
    rigs = rig_contents(made.rig, request.out, request.form) if fit else {}
    pages = {} if request.report is None else {request.report: calibration_page(made, checks)}
    try:
        replace_all({path.resolve(): data for path, data in (rigs | pages).items()})  # a link stays one
    except OSError as problem:
        names = " and ".join(map(str, rigs | pages))
        raise OutputError(
            f"{names}: can't be written ({problem.strerror or problem}); what was there stands. Free space, close it "
            "in other programs, or name another place"
        ) from problem
    return tuple(rigs)


def _calibrated(request: CalibrateRequest, cache: Cache, progress: Progress) -> _Made:
    if request.project is not None:
        project = read_project(request.project, allow_outside=request.allow_outside)
        boards = project.rig.boards
        return _Made(
            calibration=calibrate(project, cache, progress),
            sources=list(project.sources),
            board=None if boards is None else project_board(boards),
        )
    if request.control_points is not None:
        made = rig_from_control_points(read_control_points(request.control_points), request.photo_size)
        return _Made(calibration=made, sources=[request.control_points], board=None)
    problems = Problems()
    checker = PathChecker(folder=Path.cwd(), allow_outside=True, problems=problems)
    if request.both:
        pairs = tuple((path, path) for path in checker.several(request.both, "photos"))
    else:
        pairs = checker.pairs(request.left, request.right, "photos")
    if problems.found:
        raise CalibrationError("\n".join(f"{problem.path}: {problem.text}" for problem in problems.found))
    board = board_of(request.board) if request.tags is None else None
    photos = [_pair(left, right) for left, right in pairs]
    if board is None:
        tags = Tags(tag=Tag(size_m=request.tags or 0.0), family=request.family, lens=request.lens)
        made = calibrate_tags(photos, tags, cache, progress)
    else:
        made = calibrate_pairs(photos, board, request.lens, cache, progress)
    return _Made(calibration=made, sources=[path for pair in pairs for path in pair], board=board)


def _pair(left: Path, right: Path) -> tuple[Photo, Photo]:
    """Read a pair of board photos, named by their bare names; one file named twice holds both eyes."""
    one = replace(read_photo(left), name=left.name)
    return side_by_side(one) if right == left else (one, replace(read_photo(right), name=right.name))


def _checks(request: CalibrateRequest, made: _Made) -> tuple[LengthCheck, ...]:
    checks = []
    rig = made.calibration.rig
    if request.check_points and request.check_length is not None:
        checks.append(check_points(rig, _marks(request.check_points), request.check_length))
    left, right = request.check_both or request.check_left, request.check_both or request.check_right
    if request.check_board and left is not None and right is not None:
        board = board_of(request.check_board)
        if board == made.board and left.resolve() in {path.resolve() for path in made.sources}:
            raise CalibrationError(
                f"check board {left}: the rig was calibrated with this photo and these squares, so it "
                "fits whatever they are. Show another board, or measure the squares on the print and give that"
            )
        checks.append(check_board(rig, _pair(left, right), board))
    return tuple(checks)


def _marks(text: str) -> np.ndarray:
    """Read "xl,yl xr,yr xl,yl xr,yr" as (4, 2) pixels: left and right of one end, then of the other."""
    try:
        marks = np.array([[float(number) for number in word.split(",")] for word in text.split()])
    except ValueError:
        marks = np.zeros(0)
    if marks.shape != (4, 2) or not np.all(np.isfinite(marks)):
        raise OptionError(
            f'--check-points "{text[:80]}": expected "xl,yl xr,yr xl,yl xr,yr", pixels of the first end in the left '
            "and the right photo, then of the second"
        )
    return marks
