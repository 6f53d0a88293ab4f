"""`asbuilt-bim print`: boards, markers and the target as PDF files, to scale."""

from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.camera.calibration.boards import board_of
from asbuilt_bim.errors import OptionError, OutputError
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.report.sheets.drawings import board_drawing, tag_drawing, target_drawing
from asbuilt_bim.report.sheets.fitting import largest_board, largest_tag_m, largest_target_m
from asbuilt_bim.report.sheets.pdf import MAX_PAGES, PAPERS, sheets_needed, sheets_pdf
from asbuilt_bim.report.sheets.shapes import Drawing
from asbuilt_bim.report.wording.of_sheets import board_yaml
from asbuilt_bim.storage.atomic_write import place_problem, replace_bytes
from asbuilt_bim.terminal.screen import Screen


def print_board(out: Path, screen: Screen, *, paper: str, board: str, replace: bool) -> int:
    """Write a calibration board, and say what the project file has to hold for it.

    Raises:
        AsBuiltError: it is no board, or the file can't be written.
    """
    chosen = board_of(board) if board else largest_board(PAPERS[paper])
    _write(out, [board_drawing(chosen)], paper, screen, replace=replace)
    screen.say("In the project file, with a square's side as you measure it on the print:")
    screen.say(f"  rig: {{boards: {board_yaml(chosen)[:-1]}, left: ..., right: ...}}}}")
    return 0


def print_tags(
    out: Path, screen: Screen, *, paper: str, ids: str, family: str, size_m: float | None, replace: bool
) -> int:
    """Write markers, one a sheet.

    Raises:
        AsBuiltError: there are no such markers, or the file can't be written.
    """
    size_m = size_m or largest_tag_m(PAPERS[paper], family)
    _write(out, [tag_drawing(family, one, size_m) for one in ids_of(ids)], paper, screen, replace=replace)
    screen.say("In the project file, with the black square's side as you measure it on the print:")
    screen.say(f"  markers: {{survey: markers.csv, family: {family}, size_m: {size_m:g}}}")
    return 0


def print_target(out: Path, screen: Screen, *, paper: str, diameter_m: float | None, replace: bool) -> int:
    """Write the red disc.

    Raises:
        AsBuiltError: the file can't be written.
    """
    diameter_m = diameter_m or largest_target_m(PAPERS[paper])
    _write(out, [target_drawing(diameter_m)], paper, screen, replace=replace)
    screen.say("In the project file, with the diameter as you measure it on the print:")
    screen.say(f"  target: {{diameter_m: {diameter_m:g}}}")
    return 0


def ids_of(text: str) -> tuple[int, ...]:
    """Read numbers of markers: `0-11`, `3`, `0-3,8`.

    Raises:
        OptionError: it is neither, or more than a file of sheets holds.
    """
    found: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        last = last if dash else first
        if not (first.isdecimal() and last.isdecimal() and len(first) < 7 and len(last) < 7):
            raise OptionError(f"--ids {text[:40]!r}: expected numbers such as 0-11 or 0-3,8")
        found += range(int(first), min(int(last), int(first) + MAX_PAGES) + 1)
    if not found or len(found) > MAX_PAGES:
        raise OptionError(f"--ids {text[:40]!r}: names {len(found) or 'no'} markers; a file holds 1 to {MAX_PAGES}")
    return tuple(dict.fromkeys(found))


def _write(out: Path, drawings: Sequence[Drawing], paper: str, screen: Screen, *, replace: bool) -> None:
    if problem := place_problem(out):
        raise OutputError(problem)
    if out.exists() and not replace:
        raise OutputError(f"{out}: is there already; name another file, or pass --replace")
    data = sheets_pdf(drawings, PAPERS[paper])
    try:
        replace_bytes(out.resolve(), data)  # a link stays one
    except OSError as fault:
        raise output_error(out, fault, stands="what was there stands") from fault
    sheets, most = sheets_needed(drawings, PAPERS[paper])
    count = f"{sheets} sheet{'' if sheets == 1 else 's'} of {paper}"
    screen.say(f"{out}: {count}. Print at 100 %, and check the 100 mm line with a tape.")
    if most > 1:
        screen.say(
            f"No {paper} holds one whole: each goes in {most} tiles. Cut them along their grey frames and join them."
        )
