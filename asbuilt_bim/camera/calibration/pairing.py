"""Do the left and the right photo of each pair belong together? The board tells, where each camera knows its lens."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import CalibrationError, Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import inverse, rigid, vector_from_rotation

MOVED_M, MOVED_RAD = 0.05, 0.05
"""The rig is stiff: a pair that says otherwise was not taken at one moment."""
_MOST = 60  # pairs: each left photo is held against each right one; the first ones tell enough
_NAMED = 3

Poses = list[tuple[FloatArray, FloatArray]]
"""left_from_board and right_from_board (4, 4) of each view."""


def median_relative(poses: Poses) -> FloatArray:
    """Return the median right_from_left (4, 4) of all views."""
    relative = _as_paired(poses)
    turns = np.stack([vector_from_rotation(one[:3, :3]) for one in relative])
    return rigid(np.median(turns, axis=0), np.median(relative[:, :3, 3], axis=0))


def moved(poses: Poses) -> BoolArray:
    """Say which views' relative pose of the cameras lies far off the median one."""
    distance_m, turn_rad = _apart(_as_paired(poses), median_relative(poses))
    far: BoolArray = (distance_m > max(MOVED_M, 4.0 * float(np.median(distance_m)))) | (
        turn_rad > max(MOVED_RAD, 4.0 * float(np.median(turn_rad)))
    )
    return far


def why_moved(views: Sequence[BoardView], poses: Poses, bad: BoolArray) -> list[Rejection]:
    """Return the rejections of the pairs that are `bad`: exchanged, of two moments, or moved in between."""
    middle = median_relative(poses)
    found = []
    for index in np.flatnonzero(bad).tolist():
        pair = about(SubjectKind.BOARD_PAIR, views[index].name)
        left, right = poses[index]
        if _near(left @ inverse(right)[None], middle)[0]:
            found.append(rejected(Reason.BOARD_PAIR_EXCHANGED, pair))
        elif (partner := _partner(left, poses, middle)) is not None:
            one, other = _names(views[index])[0], _names(views[partner])[1]
            found.append(rejected(Reason.BOARD_PAIR_MIXED, pair, left=one, right=other))
        else:
            found.append(rejected(Reason.BOARD_PAIR_MOVED, pair))
    return found


def refuse_mixed(views: Sequence[BoardView], poses: Poses) -> None:
    """Refuse pairs most of which don't belong together, with those that do.

    Raises: CalibrationError.
    """
    relative, middle = _as_paired(poses), median_relative(poses)
    if 2 * np.count_nonzero(_near(relative, middle)) > len(poses):
        return
    poses, relative = poses[:_MOST], relative[:_MOST]
    count = len(poses)
    if exchanged := _exchanged(relative):
        raise CalibrationError(
            f"calibration: left and right are exchanged in {len(exchanged)} of {count} pairs: "
            f"{_some([views[row].name for row in exchanged])}. Exchange them"
        )
    if together := _best_pairing(poses):
        told = [f"{_names(views[a])[0]} with {_names(views[b])[1]}" for a, b in together]
        raise CalibrationError(
            f"calibration: left and right photos are not of the same moment, in {len(told)} of {count} pairs: they are "
            f"shifted or mixed. By the board these belong together: {_some(told)}. Name those alike"
        )
    distance_m, _ = _apart(relative, middle)
    baseline_m = float(np.linalg.norm(middle[:3, 3]))
    if np.median(distance_m) > max(baseline_m, MOVED_M):
        raise CalibrationError(
            "calibration: left and right photos are not of the same moment. Each camera fits its own photos, but the "
            f"right one's place differs by {np.median(distance_m):.2g} m from pair to pair (limit {MOVED_M:g} m). "
            "Check which photos were taken together"
        )


def _exchanged(relative: FloatArray) -> list[int]:
    """Return the views whose right camera stands to the left, where most say one place once these are turned round."""
    swapped = relative[:, 0, 3] > 0.0
    righted = np.stack([inverse(one) if back else one for one, back in zip(relative, swapped, strict=True)])
    agree = max(np.count_nonzero(_near(righted, one)) for one in righted)
    return np.flatnonzero(swapped).tolist() if 0 < swapped.sum() < len(relative) < 2 * agree else []


def _best_pairing(poses: Poses) -> list[tuple[int, int]]:
    """Return which left photo goes with which right one, where it isn't its own; none where half of them don't agree.

    Right is the place of the right camera on which most left photos agree, each with some right photo.
    """
    count = len(poses)
    every = np.stack([right @ inverse(left) for left, _ in poses for _, right in poses])
    support = [np.count_nonzero(_near(every, one).reshape(count, count).any(axis=1)) for one in every]
    middle = every[int(np.argmax(support))]
    partners = [_partner(left, poses, middle) for left, _ in poses]
    if 2 * sum(partner is not None for partner in partners) <= count:
        return []
    own = _near(_as_paired(poses), middle)
    return [(k, partner) for k, partner in enumerate(partners) if partner is not None and not own[k]]


def _partner(left: FloatArray, poses: Poses, middle: FloatArray) -> int | None:
    """Return the view whose right photo shows the board where a left one has it (left_from_board); None: no one's."""
    relative = np.stack([right @ inverse(left) for _, right in poses])
    near = _near(relative, middle)
    return int(np.argmin(np.where(near, _apart(relative, middle)[0], np.inf))) if near.any() else None


def _as_paired(poses: Poses) -> FloatArray:
    return np.stack([right @ inverse(left) for left, right in poses])


def _near(relative: FloatArray, middle: FloatArray) -> BoolArray:
    distance_m, turn_rad = _apart(relative, middle)
    near: BoolArray = (distance_m < MOVED_M) & (turn_rad < MOVED_RAD)
    return near


def _apart(relative: FloatArray, middle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far poses (N, 4, 4) lie off another, in metres and radians."""
    traces = np.einsum("nij,ij->n", relative[:, :3, :3], middle[:3, :3])
    distance_m: FloatArray = np.linalg.norm(relative[:, :3, 3] - middle[:3, 3], axis=1)
    return distance_m, np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0))


def _names(view: BoardView) -> tuple[str, str]:
    left, _, right = view.name.partition(" + ")
    return left, right


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"
