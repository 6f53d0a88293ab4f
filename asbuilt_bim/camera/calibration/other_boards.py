"""A board that was declared other than it was printed: what the photos show instead."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from asbuilt_bim.camera.calibration.boards import Board, find_board
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.errors import CalibrationError, PhotoError

_TRIED = 2
"""Photos looked at again: all are of one board, and a search for what isn't there is slow."""


def refuse_other_board(pairs: Sequence[tuple[Photo, Photo]], board: Board) -> None:
    """Refuse a board of which no photo shows anything, where photos show one that was declared wrongly.

    Raises: CalibrationError with what to write instead.
    """
    for left, _ in pairs[:_TRIED]:
        try:
            picture = decode(left)
        except PhotoError:
            continue
        for other, why in _others(board):
            if find_board(picture, other) is not None:
                raise CalibrationError(
                    f"boards: no pair of photos shows a board of {board.columns} x {board.rows}, but {left.name} shows "
                    f"one of {other.columns} x {other.rows}: {why}. Write columns: {other.columns}, rows: {other.rows}"
                )


def _others(board: Board) -> Iterator[tuple[Board, str]]:
    """Yield what a board may have been meant as, and the mistake: columns and rows exchanged, squares for corners."""
    exchanged, less = "columns and rows are exchanged", -1 if board.kind == "chessboard" else 1
    counted = "it has so many squares, and a chessboard's INNER corners are counted"
    if board.kind == "charuco":
        counted = "it has so many inner corners, and a ChArUco board's squares are counted"
    for step, why in ((0, ""), (less, counted)):
        for columns, rows in ((board.columns, board.rows), (board.rows, board.columns)):
            turned = (columns, rows) != (board.columns, board.rows)
            said = [why] * bool(why) + [exchanged] * turned
            if not said:
                continue
            try:
                yield replace(board, columns=columns + step, rows=rows + step), ", and ".join(said)
            except CalibrationError:
                continue  # no such board is printed
