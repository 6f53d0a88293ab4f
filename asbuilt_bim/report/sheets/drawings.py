"""Boards, markers and the target as drawings, by the same patterns that our finders look for."""

from collections.abc import Iterator

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.errors import OptionError
from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.report.sheets.shapes import Box, Disc, Drawing, Stroke
from asbuilt_bim.report.wording.of_sheets import board_words, tag_words, target_words
from asbuilt_bim.vision.markers.find import FAMILIES

BORDER = 1
"""Modules of black around a marker's bits, and of white around the black: without the white no finder sees it."""
_TICK_M = 0.012


def board_drawing(board: Board) -> Drawing:
    """Return a board with a white rim of half a square, so that the outer corners can be found, too."""
    rim_m = board.square_m / 2.0
    shapes = [_moved(box, rim_m) for box in (_chessboard(board) if board.kind == "chessboard" else _charuco(board))]
    more = 1 if board.kind == "chessboard" else 0
    return Drawing(
        width_m=(board.columns + more) * board.square_m + 2.0 * rim_m,
        height_m=(board.rows + more) * board.square_m + 2.0 * rim_m,
        shapes=tuple(shapes),
        words=board_words(board),
    )


def _chessboard(board: Board) -> Iterator[Box]:
    for row in range(board.rows + 1):
        for column in range(board.columns + 1):
            if (row + column) % 2 == 0:
                yield _square(column * board.square_m, row * board.square_m, board.square_m)


def _charuco(board: Board) -> Iterator[Box]:
    """Black squares where OpenCV's pattern of today has them, and a marker in each white one."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    printed = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
    white = set()
    for marker_id, corners in zip(np.ravel(printed.getIds()), printed.getObjPoints(), strict=True):
        left_m, top_m = (float(value) for value in np.asarray(corners)[:, :2].min(axis=0))
        white.add((int(top_m // board.square_m), int(left_m // board.square_m)))
        for box in _marker(_modules(dictionary, int(marker_id)), board.marker_m):
            yield _moved(box, left_m, top_m)
    for row in range(board.rows):
        for column in range(board.columns):
            if (row, column) not in white:
                yield _square(column * board.square_m, row * board.square_m, board.square_m)


def tag_drawing(family: str, tag_id: int, size_m: float) -> Drawing:
    """Return a marker whose black square has the side `size_m`, with its white rim and strokes at its corners.

    Raises:
        OptionError: the family has no marker of that number.
    """
    dictionary = cv2.aruco.getPredefinedDictionary(FAMILIES[family])
    count = int(dictionary.bytesList.shape[0])
    if not 0 <= tag_id < count:
        raise OptionError(f"{family} has markers 0 to {count - 1}, not {tag_id}")
    modules = _modules(dictionary, tag_id)
    rim_m = rim_of_tag(family, size_m)
    shapes = [_moved(box, rim_m) for box in _marker(modules, size_m)]
    return Drawing(
        width_m=size_m + 2.0 * rim_m,
        height_m=size_m + 2.0 * rim_m,
        shapes=(*shapes, *_corner_strokes(rim_m, size_m)),
        words=tag_words(family, tag_id, size_m),
    )


def rim_of_tag(family: str, size_m: float) -> float:
    """Return how wide the white around a marker is, in metres: one module and the strokes beside it."""
    side = cv2.aruco.getPredefinedDictionary(FAMILIES[family]).markerSize + 2 * BORDER
    return size_m / side * BORDER + _TICK_M


def _corner_strokes(rim_m: float, size_m: float) -> Iterator[Stroke]:
    """Yield strokes outside the white rim that point at the corners, which the total station aims at."""
    for edge_m in (rim_m, rim_m + size_m):
        for near_m, far_m in ((0.0, _TICK_M), (2.0 * rim_m + size_m - _TICK_M, 2.0 * rim_m + size_m)):
            yield Stroke(start_m=(edge_m, near_m), end_m=(edge_m, far_m))
            yield Stroke(start_m=(near_m, edge_m), end_m=(far_m, edge_m))


def target_drawing(diameter_m: float) -> Drawing:
    """Return the red disc on white, with a rim of a tenth of its diameter."""
    side_m = 1.2 * diameter_m
    disc = Disc(x_m=side_m / 2.0, y_m=side_m / 2.0, radius_m=diameter_m / 2.0)
    return Drawing(width_m=side_m, height_m=side_m, shapes=(disc,), words=target_words(diameter_m))


def _modules(dictionary: cv2.aruco.Dictionary, marker_id: int) -> BoolArray:
    """Return a marker's black modules (N, N), its black border among them."""
    side = dictionary.markerSize + 2 * BORDER
    picture = np.asarray(cv2.aruco.generateImageMarker(dictionary, marker_id, side, borderBits=BORDER), dtype=np.uint8)
    black: BoolArray = picture == 0
    return black


def _marker(modules: BoolArray, size_m: float) -> Iterator[Box]:
    """Yield a marker's black, one box a run of modules in a row: seams within a row would show as hairlines."""
    step_m = size_m / len(modules)
    for row, blacks in enumerate(modules):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], blacks, [False]]).astype(np.int8)))
        for start, end in edges.reshape(-1, 2):
            yield Box(left_m=start * step_m, top_m=row * step_m, width_m=(end - start) * step_m, height_m=step_m)


def _square(left_m: float, top_m: float, side_m: float) -> Box:
    return Box(left_m=left_m, top_m=top_m, width_m=side_m, height_m=side_m)


def _moved(box: Box, right_m: float, down_m: float | None = None) -> Box:
    down_m = right_m if down_m is None else down_m
    return Box(
        left_m=box.left_m + right_m,
        top_m=box.top_m + down_m,
        width_m=box.width_m,
        height_m=box.height_m,
        colour=box.colour,
    )
