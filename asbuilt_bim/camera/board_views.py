"""Pairs of board photos, read and found: what a calibration is made from, and what it has to do without."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from asbuilt_bim.camera.adjust import BoardView
from asbuilt_bim.camera.board import Board, find_board, same_way_round
from asbuilt_bim.camera.photo import Photo, decode
from asbuilt_bim.errors import CalibrationError, PhotoError, Rejection
from asbuilt_bim.geometry.arrays import frozen

FEWEST_PAIRS = 6
"""Nine numbers a camera need three views; six let a bad one be found and leave a rest to check against."""

Progress = Callable[[int, int], None]
"""Is told how many pairs are done, and of how many."""


def read_views(
    pairs: Sequence[tuple[Photo, Photo]], board: Board, progress: Progress | None
) -> tuple[list[BoardView], tuple[int, int], list[Rejection]]:
    """Find the board in all pairs; returns the views, the photos' size, and the pairs left out with the reason.

    Raises: CalibrationError where the photos differ in size.
    """
    views: list[BoardView] = []
    left_out: list[Rejection] = []
    size: tuple[int, int] | None = None
    for index, (left, right) in enumerate(pairs):
        name = f"{left.name} + {right.name}"
        for photo in (left, right):
            found = (photo.exif.width_px, photo.exif.height_px)
            size = size or found
            if found != size:
                raise CalibrationError(
                    f"board photo {photo.name}: {found[0]} x {found[1]} px, the others {size[0]} x {size[1]} px; "
                    "use photos of one rig as the cameras stored them"
                )
        try:
            view = _view(name, left, right, board)
        except PhotoError as error:
            left_out.append(Rejection(what=f"board pair {name}", reason=str(error)))
            view = None
        else:
            if view is None:
                left_out.append(_no_board(name, board))
        if view is not None:
            views.append(view)
        if progress is not None:
            progress(index + 1, len(pairs))
    return views, size or (0, 0), left_out


def _no_board(name: str, board: Board) -> Rejection:
    kind = "inner corners" if board.kind == "chessboard" else "ChArUco squares"
    return Rejection(
        what=f"board pair {name}",
        reason="the board was not found in both photos",
        remedy=f"check that the board has {board.columns} x {board.rows} {kind}, and that both photos show it sharply",
    )


def _view(name: str, left: Photo, right: Photo, board: Board) -> BoardView | None:
    seen_left = find_board(decode(left), board)
    seen_right = find_board(decode(right), board) if seen_left is not None else None
    if seen_left is None or seen_right is None:
        return None
    seen_right = same_way_round(seen_left, seen_right, board)
    points = board.points_m
    return BoardView(
        name=name,
        left_points_m=frozen(points[seen_left.indices]),
        left_px=seen_left.pixels,
        right_points_m=frozen(points[seen_right.indices]),
        right_px=seen_right.pixels,
    )


def require_enough(views: Sequence[BoardView], left_out: Sequence[Rejection]) -> None:
    """Refuse to calibrate from fewer than `FEWEST_PAIRS`.

    Raises: CalibrationError with what became of the others.
    """
    if len(views) < FEWEST_PAIRS:
        reasons = "".join(f"\n  {rejection}" for rejection in left_out)
        raise CalibrationError(
            f"calibration: {len(views)} good pairs of board photos, at least {FEWEST_PAIRS} are needed; take more, "
            f"with the board tilted every way and in every part of the frame{reasons}"
        )
