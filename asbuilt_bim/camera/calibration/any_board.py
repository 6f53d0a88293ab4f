"""Whether a photo shows a calibration board of whatever size, and which: nobody has said yet what is printed on it."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import Board, find_board
from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import ByteImage

_WIDE_PX = 1600
"""A board fills a good part of its photo: half the resolution of most cameras shows it."""
_DICTIONARIES = ("DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL")
"""Those of ChArUco boards, each with all smaller ones of its size in it; a site's AprilTags are in none of them."""
_FEWEST_MARKERS = 6
"""Half of those on the smallest usual board (5 x 5 squares). A site's own markers of such a kind stand far apart."""
_ANY_SHARE = 0.5
"""Of a marker in its square: which squares hold which marker doesn't rest on it."""
_SMALLEST = (5, 4)
"""Inner corners of the smallest chessboard looked for: bricks and tiles make small grids, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenBoard:
    """What a photo shows of a board: inner corners of a chessboard, squares of a ChArUco board; no lengths."""

    kind: Literal["chessboard", "charuco"]
    columns: int
    rows: int
    dictionary: str  # "" of a chessboard


def shows_board(image: ByteImage) -> bool:
    """Say whether a photo (BGR or grey) shows a chessboard or a ChArUco board."""
    grey = _small(image)
    return bool(_markers(grey)[0]) or _grid(grey) is not None


def board_shown(image: ByteImage) -> SeenBoard | None:
    """Return the board that a photo (BGR or grey) shows whole; None where there is none, or more than one fits."""
    grey = _small(image)
    name, last = _markers(grey)
    if not name:
        grid = _grid(grey)
        return None if grid is None else SeenBoard(kind="chessboard", columns=grid[0], rows=grid[1], dictionary="")
    fitting = [(columns, rows) for columns, rows in _sizes(last + 1) if _fits(grey, columns, rows, name)]
    if len(fitting) != 1:
        return None
    ((columns, rows),) = fitting
    usual = name.removesuffix("0")  # of a hundred markers, as `print board` has it, the same as the first of a thousand
    dictionary = usual if _fits(grey, columns, rows, usual) else name
    return SeenBoard(kind="charuco", columns=columns, rows=rows, dictionary=dictionary)


def _sizes(markers: int) -> list[tuple[int, int]]:
    """Return the columns and rows of the boards that hold so many markers, one on every other square."""
    squares = 2 * markers, 2 * markers + 1
    return [(columns, of // columns) for of in squares for columns in range(1, of + 1) if of % columns == 0]


def _fits(grey: ByteImage, columns: int, rows: int, dictionary: str) -> bool:
    try:
        board = Board(
            kind="charuco", columns=columns, rows=rows, square_m=1.0, marker_m=_ANY_SHARE, dictionary=dictionary
        )
    except CalibrationError:
        return False  # no such board is printed
    return find_board(grey, board) is not None


def _small(image: ByteImage) -> ByteImage:
    grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if grey.shape[1] <= _WIDE_PX:
        return grey
    scale = _WIDE_PX / grey.shape[1]
    return np.asarray(cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _markers(grey: ByteImage) -> tuple[str, int]:
    """Return the dictionary of a ChArUco board's markers and the last number seen; "" and -1 where there is none."""
    for name in _DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(grey)
        if ids is not None and len(np.unique(ids)) >= _FEWEST_MARKERS:
            return name, int(ids.max())
    return "", -1


def _grid(grey: ByteImage) -> tuple[int, int] | None:
    """Return the inner corners across and down, as the photo shows it, of the largest chessboard in sight."""
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners, meta = cv2.findChessboardCornersSBWithMeta(grey, _SMALLEST, flags)
    if not found:
        return None
    rows, columns = (int(number) for number in meta.shape[:2])
    across, down = np.abs(corners[columns - 1].ravel() - corners[0].ravel())
    return (columns, rows) if across >= down else (rows, columns)
