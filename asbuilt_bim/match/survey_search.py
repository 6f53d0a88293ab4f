"""Does what was measured lie on the design, but elsewhere: turned, metres away, a storey too high or too low?

`beside` looks for moves of decimetres. Further off most faces fit nothing and are left out, those behind them are
called not built, and on the storey above the same walls are called built: wrong, and nobody is told. But the walls and
columns in view are a pattern, and it is looked for in the whole design.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.match.upright_lines import PARALLEL_COS, Indices, Placing, Upright, lying

BAND_M = 0.02  # as in `beside`: what good formwork and a pose err by
REACH_M = 30.0
"""Further off hardly one of the elements in view is in the design's view: none fits, which is told."""
LEAST_MORE, LEAST_MORE_SHARE, LEAST_ELEMENTS = 3, 0.25, 3
"""So many faces more, and so large a share of those that then fit, on so many elements, lie on the design there."""
FREE_PLANES = 2
"""So many faces any two walls at an angle lay on the design, since a level move is free: they are no evidence."""
SURE_SHARE, SURE_OF_RIVAL = 0.5, 2.0
"""Most of all faces fit there, or twice as many as anywhere else: by chance neither comes about."""
NEAR_M, ON_OF_NEAR = 0.06, 0.75
"""Elements that were built some centimetres off, each its own way, lie NEAR the design here as there. So there must be
more on it than near it here, or, of a small turn and of storeys with nearly one plan, on it most of those near it."""
_COARSE_M, _COARSE_RAD = NEAR_M, float(np.radians(0.25))  # a quarter of a degree is 6 cm over the 15 m of a site
_TURNS, _PEAKS, _REFINED = 6, 16, 25  # looked at, the likeliest first
_APART_M, _APART_RAD = 0.6, float(np.radians(5.0))  # nearer, two places are one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Elsewhere:
    """Where what was measured fits the design: how many of its `count` faces there, and how many as they are."""

    placing: Placing
    fits: int
    fits_unmoved: int
    count: int


def find_elsewhere(seen: Upright, walls: Upright, rises_m: Sequence[float], near: FloatArray) -> Elsewhere | None:
    """Return where in the design the measured planes lie, if clearly more of them than where they are.

    `near` (2,) is a level move that is known already, 0 where there is none: it is counted from there.
    """
    if len(seen.halves_m) < LEAST_MORE or not len(walls.halves_m):
        return None
    walls = _within_reach(seen, walls)
    here = Placing(move_m=near)
    storeys = [Placing(move_m=near, rise_m=rise) for rise in rises_m if rise]
    found = _judged(storeys, seen, walls, here, free=0)
    found = found or _judged(_likeliest(seen, walls, rises_m), seen, walls, here, free=FREE_PLANES)
    if found is None:
        return None
    unmoved = int(lying(seen, walls, BAND_M)[0].sum())
    return Elsewhere(placing=found[0], fits=found[1], fits_unmoved=unmoved, count=len(seen.halves_m))


def storey_rises(design: BimModel) -> list[float]:
    """Return the differences in height of a design's storeys in metres, 0 first."""
    heights = [storey.elevation_m for storey in design.storeys]
    return sorted({0.0, *(round(a - b, 2) for a in heights for b in heights)}, key=abs)


def _within_reach(seen: Upright, walls: Upright) -> Upright:
    """Return the walls that any turn and move that is looked for can bring to what was measured."""
    radius = REACH_M + float(np.max(np.linalg.norm(seen.middles_m, axis=1) + seen.halves_m))
    return walls.chosen(np.linalg.norm(walls.middles_m, axis=1) < radius + walls.halves_m)


def _judged(
    places: Sequence[Placing], seen: Upright, walls: Upright, here: Placing, free: int
) -> tuple[Placing, int] | None:
    """Return the place that most faces fit, and how many; None where they are not clearly more than here."""
    fitting = [lying(place.back(seen), walls, BAND_M) for place in places]
    if not fitting:
        return None
    counts = np.array([int(lies.sum()) for lies, _ in fitting])
    best = int(np.argmax(counts))
    lies, on = fitting[best]
    least = max(LEAST_MORE + free, LEAST_MORE_SHARE * counts[best])
    lies_here, near_here = (lying(here.back(seen), walls, band)[0] for band in (BAND_M, NEAR_M))
    elements = {walls.elements[face] for face in on[lies & ~lies_here]}
    if counts[best] - lies_here.sum() < least or len(elements) < LEAST_ELEMENTS:
        return None
    if counts[best] - near_here.sum() < least:
        near = lying(places[best].back(seen), walls, NEAR_M)[0]
        is_one_move = not (free and places[best].rise_m)  # a turn, or a storey: both together would be made up
        return (places[best], int(counts[best])) if is_one_move and counts[best] >= ON_OF_NEAR * near.sum() else None
    rivals = [n for place, n in zip(places, counts, strict=True) if free and _is_apart(place, places[best])]
    is_sure = counts[best] >= SURE_SHARE * len(lies) or counts[best] >= SURE_OF_RIVAL * max(rivals, default=0)
    return (places[best], int(counts[best])) if is_sure else None


def _likeliest(seen: Upright, walls: Upright, rises: Sequence[float]) -> list[Placing]:
    """Return places that many faces fit coarsely, brought to fit finely."""
    found: list[tuple[int, Placing]] = []
    for turn in _turns(seen, walls):
        turned = Placing(turn_rad=turn).back(seen)
        for move, counts in _moves(turned, walls, rises):
            found += [
                (int(n), Placing(turn_rad=turn, move_m=move, rise_m=rise))
                for n, rise in zip(counts, rises, strict=True)
                if n >= LEAST_MORE
            ]
    found.sort(key=lambda one: -one[0])
    return [_refined(seen, walls, place) for _, place in found[:_REFINED]]


def _turns(seen: Upright, walls: Upright) -> list[float]:
    """Return the turns in radians that make most measured planes parallel to one of the design."""
    designed = np.unique(np.round(walls.normals, 4), axis=0)
    angles = [np.arctan2(normals[:, 1], normals[:, 0]) for normals in (seen.normals, designed)]
    differences = _wrapped(np.subtract.outer(angles[0], angles[1]))
    bins = round(2.0 * np.pi / _COARSE_RAD)
    votes = np.zeros(bins)
    for row in ((differences + np.pi) / _COARSE_RAD).astype(int):
        votes[np.unique((row[:, None] + np.arange(-2, 3)) % bins)] += 1
    turns = []
    for _ in range(_TURNS):
        turn = (int(np.argmax(votes)) + 0.5) * _COARSE_RAD - np.pi
        near = _wrapped(differences - turn)
        turns.append(turn + float(np.median(near[np.abs(near) < 4.0 * _COARSE_RAD])))
        away = np.abs(_wrapped(np.arange(bins) * _COARSE_RAD - np.pi - turn))
        votes[away < _APART_RAD] = 0.0
        if votes.max() < LEAST_MORE:
            break
    return turns


def _moves(seen: Upright, walls: Upright, rises: Sequence[float]) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Give level moves (2,) made of two, each across one of the two chief directions of the planes.

    With each move how many planes of these directions lie on the design after it, for each of the rises.
    """
    axes = _chief_axes(seen.normals)
    if axes is None:
        return
    peaks = [_peaks(seen, walls, axis) for axis in axes]
    for a, across_a in peaks[0]:
        for b, across_b in peaks[1]:
            move = np.linalg.solve(axes, np.array([a, b]))
            one, other = np.concatenate([across_a, across_b]).T
            arm = np.einsum("nk,nk->n", seen.middles_m[one] - move - walls.middles_m[other], walls.along[other])
            half = seen.halves_m[one]
            length = np.minimum(arm + half, walls.halves_m[other]) - np.maximum(arm - half, -walls.halves_m[other])
            one, other = one[length >= half], other[length >= half]
            yield move, np.array([_standing(seen, walls, one, other, rise) for rise in rises])


def _standing(seen: Upright, walls: Upright, one: Indices, other: Indices, rise_m: float) -> int:
    """Return how many planes stand at the height of one that they are paired with, after so high a rise."""
    (low, high), (foot, head) = (seen.heights_m[one] - rise_m).T, walls.heights_m[other].T
    return len(np.unique(one[np.minimum(high, head) - np.maximum(low, foot) >= 0.5 * (high - low)]))


def _chief_axes(normals: FloatArray) -> FloatArray | None:
    """Return the directions (2, 2) that most normals lie along, at 30 degrees and more; None where there is one."""
    along = np.abs(normals @ normals.T)
    votes = (along > PARALLEL_COS).sum(axis=1)
    first = int(np.argmax(votes))
    others = np.where(along[first] < np.cos(np.radians(30.0)), votes, 0)
    second = int(np.argmax(others))
    return normals[[first, second]] if others[second] >= 2 else None


def _peaks(seen: Upright, walls: Upright, axis: FloatArray) -> list[tuple[float, Indices]]:
    """Return the moves along `axis` that lay most planes across it on the design's, with the pairs (K, 2) of each."""
    moves = np.subtract.outer(seen.middles_m @ axis, walls.middles_m @ axis)
    may = (seen.normals @ walls.normals.T > PARALLEL_COS) & (np.abs(walls.normals @ axis) > PARALLEL_COS)
    pairs = np.argwhere(may & (np.abs(moves) < REACH_M))
    moves = moves[pairs[:, 0], pairs[:, 1]]
    step = 0.5 * _COARSE_M
    places = ((moves + REACH_M) / step).astype(int)[:, None] + np.arange(-1, 2)
    bins = round(2.0 * REACH_M / step) + 3
    votes = np.bincount(np.unique(pairs[:, :1] * bins + places) % bins, minlength=bins)  # one a plane
    peaks = []
    for _ in range(_PEAKS):
        top = int(np.argmax(votes))
        if not votes[top]:
            break
        move = (top + 0.5) * step - REACH_M
        peaks.append((move, pairs[np.abs(moves - move) < _COARSE_M]))
        votes[max(0, top - 3) : top + 4] = 0
    return peaks


def _refined(seen: Upright, walls: Upright, place: Placing) -> Placing:
    """Return the turn and move that lay the planes which fit on their faces, by least squares, ever more closely."""
    for band in (_COARSE_M, _COARSE_M, 1.5 * BAND_M, BAND_M):
        back = place.back(seen)
        lies, on = lying(back, walls, band)
        if lies.sum() < LEAST_MORE:
            break
        normals, arms = walls.normals[on[lies]], back.middles_m[lies] + place.move_m
        off = np.einsum("nk,nk->n", normals, back.middles_m[lies] - walls.middles_m[on[lies]])
        by_turn = np.einsum("nk,nk->n", normals, np.stack([arms[:, 1], -arms[:, 0]], axis=-1))
        step = np.linalg.lstsq(np.column_stack([by_turn, -normals]), -off, rcond=1e-3)[0]
        place = Placing(turn_rad=place.turn_rad + float(step[0]), move_m=place.move_m + step[1:], rise_m=place.rise_m)
    return place


def _is_apart(one: Placing, other: Placing) -> bool:
    moved = float(np.linalg.norm(one.move_m - other.move_m))
    return moved > _APART_M or abs(float(_wrapped(one.turn_rad - other.turn_rad))) > _APART_RAD


def _wrapped(angles_rad: ArrayLike) -> FloatArray:
    wrapped: FloatArray = (np.asarray(angles_rad, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped
