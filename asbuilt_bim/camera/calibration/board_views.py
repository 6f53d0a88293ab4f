"""Pairs of board photos, read and found: what a calibration is made from, and what it has to do without."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from asbuilt_bim.camera.calibration.boards import Board, find_board, same_way_round
from asbuilt_bim.camera.calibration.other_boards import refuse_other_board
from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.camera.photo.read import Photo, decode
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value, about
from asbuilt_bim.errors import CalibrationError, PhotoError, Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen

FEWEST_PAIRS = 6
"""Nine numbers a camera need three views; six let a bad one be found and leave a rest to check against."""

Progress = Callable[[int, int], None]
"""Called with how many pairs are done, and of how many."""


def read_views(
    pairs: Sequence[tuple[Photo, Photo]], board: Board, progress: Progress | None
) -> tuple[list[BoardView], tuple[int, int], list[Rejection]]:
    """Find the board in all pairs; returns the views, the photos' size, and the pairs left out with the reason.

    Raises: CalibrationError where the photos differ in size, or show a board that was declared wrongly.
    """
    views, size, left_out = read_pairs(pairs, lambda left, right: _view(left, right, board), progress)
    if not views and any(one.code is Reason.BOARD_NOT_FOUND for one in left_out):
        refuse_other_board(pairs, board)
    return views, size, left_out


Seen = TypeVar("Seen")


def read_pairs(
    pairs: Sequence[tuple[Photo, Photo]],
    look: Callable[[Photo, Photo], Seen | Rejection],
    progress: Progress | None,
) -> tuple[list[Seen], tuple[int, int], list[Rejection]]:
    """Look at all pairs of one rig; returns what is seen, the photos' size, and the pairs left out with the reason.

    A pair twice, one of a photo with itself, and one of another camera, is left out unseen.

    Raises: CalibrationError where the photos differ in size, or all left photos are the right ones.
    """
    seen: list[Seen] = []
    left_out: list[Rejection] = []
    size = _one_size([photo for pair in pairs for photo in pair])
    usual = [Counter(_camera(pair[side]) for pair in pairs).most_common(1)[0][0] for side in (0, 1)] if pairs else []
    if pairs and all(left.digest == right.digest for left, right in pairs):
        raise CalibrationError(
            f"calibration: left and right are the same photos ({len(pairs)} of {len(pairs)} pairs, first "
            f"{_name(*pairs[0])}); name the photos that the right camera took under right"
        )
    first: dict[tuple[str, str], int] = {}  # by index: photos of several folders may share a name
    for index, (left, right) in enumerate(pairs):
        earlier = first.setdefault((left.digest, right.digest), index)
        found: Seen | Rejection
        if left.digest == right.digest:
            found = rejected(Reason.BOARD_PAIR_OF_ONE_PHOTO, pair_subject(left, right))
        elif earlier != index:
            found = _copy(pairs[index], pairs[earlier])
        elif _is_other(_camera(left), usual[0]) or _is_other(_camera(right), usual[1]):
            found = _odd_camera(pair_subject(left, right), [_camera(left), _camera(right)], usual)
        else:
            found = look(left, right)
        if isinstance(found, Rejection):
            left_out.append(found)
        else:
            seen.append(found)
        if progress is not None:
            progress(index + 1, len(pairs))
    return seen, size, left_out


def _one_size(photos: Sequence[Photo]) -> tuple[int, int]:
    """Return the size (width, height) that all photos have; CalibrationError where one has another."""
    sizes = [photo.size_px for photo in photos]
    usual = Counter(sizes).most_common(1)[0][0] if sizes else (0, 0)
    for photo, size in zip(photos, sizes, strict=True):
        if size != usual:
            raise CalibrationError(
                f"photo {photo.name}: {size[0]} x {size[1]} px, the others {usual[0]} x {usual[1]} px; "
                "use photos of one rig as the cameras stored them"
            )
    return usual


Camera = tuple[str, str, float, int]


def _camera(photo: Photo) -> Camera:
    """Return what tells a camera, its zoom and how it was held: model, serial, focal length, orientation."""
    exif = photo.exif
    return exif.model, exif.serial, exif.focal_length_mm, exif.orientation


def _is_other(found: Camera, usual: Camera) -> bool:
    """Say whether two photos tell of different cameras; what one of them doesn't tell is no difference."""
    return any(a != b and bool(a) and bool(b) for a, b in zip(found, usual, strict=True))


def _odd_camera(pair: Subject, found: Sequence[Camera], usual: Sequence[Camera]) -> Rejection:
    values: dict[str, Value] = {}
    for owner, cameras in (("", found), ("usual_", usual)):
        models, serials, focals_mm, orientations = zip(*cameras, strict=True)
        values |= {f"{owner}models": models, f"{owner}serials": serials}
        values |= {f"{owner}focals_mm": focals_mm, f"{owner}orientations": orientations}
    return rejected(Reason.BOARD_PAIR_OF_OTHER_CAMERA, pair, **values)


def _copy(pair: tuple[Photo, Photo], earlier: tuple[Photo, Photo]) -> Rejection:
    return rejected(Reason.BOARD_PAIR_TWICE, pair_subject(*pair), other=_name(*earlier))


def _no_board(pair: Subject, board: Board) -> Rejection:
    return rejected(
        Reason.BOARD_NOT_FOUND,
        pair,
        board=board.kind,
        columns=board.columns,
        rows=board.rows,
        dictionary=board.dictionary,
    )


def _view(left: Photo, right: Photo, board: Board) -> BoardView | Rejection:
    pair = pair_subject(left, right)
    try:
        seen_left, seen_right = (find_board(decode(photo), board) for photo in (left, right))
    except PhotoError as error:
        return rejected(Reason.PHOTO_UNUSABLE, pair, detail=str(error))
    if seen_left is None or seen_right is None:
        return _no_board(pair, board)
    seen_right = same_way_round(seen_left, seen_right, board)
    points = board.points_m
    return BoardView(
        name=pair.name,
        left_points_m=frozen(points[seen_left.indices]),
        left_px=seen_left.pixels,
        right_points_m=frozen(points[seen_right.indices]),
        right_px=seen_right.pixels,
    )


def _name(left: Photo, right: Photo) -> str:
    return f"{left.name} + {right.name}"


def pair_subject(left: Photo, right: Photo) -> Subject:
    """Return a pair of photos as what a rejection is about."""
    return about(SubjectKind.BOARD_PAIR, _name(left, right))


def require_enough(views: Sequence[BoardView], left_out: Sequence[Rejection]) -> None:
    """Refuse to calibrate from fewer than `FEWEST_PAIRS`, or from pairs that show the board in fewer places.

    Raises: CalibrationError with what became of the others as its `rejections`.
    """
    if len(views) < FEWEST_PAIRS:
        raise CalibrationError(
            f"calibration: {len(views)} good pairs of board photos, at least {FEWEST_PAIRS} are needed; take more, "
            "with the board tilted every way and in every part of the frame",
            left_out,
        )
    if (places := _places(views)) < FEWEST_PAIRS:
        raise CalibrationError(
            f"calibration: {len(views)} pairs show the board in {places} place{'' if places == 1 else 's'} (in the "
            f"others no corner moved by half a square), at least {FEWEST_PAIRS} are needed; move and tilt the board "
            "between photos",
            left_out,
        )


def _places(views: Sequence[BoardView]) -> int:
    """Count the views that show the board elsewhere than each other one that counts, up to `FEWEST_PAIRS`."""
    kept: list[dict[tuple[float, ...], FloatArray]] = []
    for view in views:
        corners = {tuple(np.round(point, 6)): px for point, px in zip(view.left_points_m, view.left_px, strict=True)}
        beside = np.linalg.norm(view.left_px[:, None] - view.left_px[None], axis=-1)
        square_px = float(np.median(np.where(beside > 0.0, beside, np.inf).min(axis=1)))
        shared = ([(corners[key], one[key]) for key in corners.keys() & one.keys()] for one in kept)
        moved = (max((float(np.linalg.norm(a - b)) for a, b in pairs), default=np.inf) for pairs in shared)
        if all(far > 0.5 * square_px for far in moved):
            kept.append(corners)
        if len(kept) == FEWEST_PAIRS:
            break
    return len(kept)
