"""The largest board, marker and target that one sheet of paper holds."""

import math
from itertools import count

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.report.sheets.drawings import rim_of_tag, target_drawing
from asbuilt_bim.report.sheets.pdf import Paper

_COLUMNS, _ROWS = 7, 9
_MARKER_SHARE = 0.75  # of a square, as OpenCV's documentation has it


def largest_board(paper: Paper) -> Board:
    """Return a ChArUco board that fills the sheet, its squares a whole number of millimetres."""
    width_m, height_m = paper.room_m
    square_mm = math.floor(1000.0 * min(width_m / (_COLUMNS + 1), height_m / (_ROWS + 1)))
    marker_mm = round(_MARKER_SHARE * square_mm)
    return Board(kind="charuco", columns=_COLUMNS, rows=_ROWS, square_m=square_mm / 1000.0, marker_m=marker_mm / 1000.0)


def largest_tag_m(paper: Paper, family: str) -> float:
    """Return the side of the largest marker that fits on the sheet, in whole centimetres."""
    sizes = (centimetres / 100.0 for centimetres in count(30, -1))
    return next(size_m for size_m in sizes if size_m + 2.0 * rim_of_tag(family, size_m) <= min(paper.room_m))


def largest_target_m(paper: Paper) -> float:
    """Return the diameter of the largest target that fits on the sheet, in whole centimetres."""
    sizes = (centimetres / 100.0 for centimetres in count(60, -1))
    return next(size_m for size_m in sizes if target_drawing(size_m).width_m <= min(paper.room_m))
