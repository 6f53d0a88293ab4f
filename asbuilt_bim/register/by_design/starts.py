"""Places that a station may have stood at: where two of its faces, or one with its ends, lie on the design's."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.transform import wrapped
from asbuilt_bim.register.by_design.fitting import Prior, turned
from asbuilt_bim.register.by_design.planes import Seen, Upright
from asbuilt_bim.register.options import PAST_M

REACH = 4.0
"""Sigmas of the rough place that are looked at: two say 1.5 m, four say 3 m."""
TURN_BAND_RAD, PARALLEL_RAD = float(np.radians(1.0)), float(np.radians(3.0))
SHORTEST_WAY_M = 1.0
"""Two middles that are centimetres off show a turn to two degrees over it."""
NEAR_M = 0.15
"""How near a start is to the place: faces err by centimetres, and a turn by a degree moves one 6 m off by ten."""
MOST_WAYS = 1_000_000
"""From one like face to another: a thousand columns alike tell no place apart, and would fill the memory."""
MOST_TURNS, MOST_STARTS, MOST_SEGMENTS, MOST_POINTS = 12, 24, 3000, 60_000


def starts(seen: Seen, design: Upright, may: BoolArray, prior: Prior) -> Iterator[tuple[float, FloatArray]]:
    """Give turns and places (2,), for each turn those on which most faces agree."""
    for turn in _turns(seen, design, may, prior):
        points, lines = _points(seen, design, may, prior, turn)
        if len(points):
            yield from ((turn, place) for place in _best(points, lines, seen))


def _turns(seen: Seen, design: Upright, may: BoolArray, prior: Prior) -> list[float]:
    """Return the turns that most of what is seen agrees on, the likeliest first.

    A face of some width lies parallel to one of the design. Narrow ones don't show a turn, but two with both their ends
    do, by the way from one to the other.
    """
    use = ~seen.faces.round & (seen.angle_sigma_rad < TURN_BAND_RAD)
    one, other = np.nonzero(may & use[:, None] & ~design.round[None])
    turns = wrapped(design.angles_rad[other] - seen.faces.angles_rad[one])
    weight = (np.minimum(2.0 * seen.faces.halves_m, 2.0) + 0.5)[one]
    ways, ways_weight, ways_turn = _ways(seen, design, may)
    one, turns = np.concatenate([one, ways + len(use)]), np.concatenate([turns, ways_turn])
    weight = np.concatenate([weight, ways_weight])
    if prior.sigma_rad is not None:
        off = wrapped(turns - prior.turn_rad)
        near = np.abs(off) <= REACH * prior.sigma_rad
        one, weight, turns = one[near], weight[near], prior.turn_rad + off[near]
    found: list[float] = []
    free = np.ones(len(turns), dtype=bool)
    while free.any() and len(found) < MOST_TURNS:
        bins = np.round(turns[free] / TURN_BAND_RAD).astype(np.intp)
        pairs, first = np.unique(np.stack([bins, one[free]]), axis=1, return_index=True)
        values, where = np.unique(pairs[0], return_inverse=True)
        votes = np.bincount(where, weights=weight[free][first])
        middle = values[int(np.argmax(votes))] * TURN_BAND_RAD
        near = free & (np.abs(turns - middle) <= TURN_BAND_RAD)
        found.append(float(np.median(turns[near])))
        free &= np.abs(turns - found[-1]) > 1.5 * TURN_BAND_RAD
    return found


def _ways(seen: Seen, design: Upright, may: BoolArray) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Return turns (K,) that lay the way between two seen faces along one between two of the design, and their pairs.

    Each pair has a number, and less weight the more pairs there are: a face speaks once.
    """
    ended = np.flatnonzero((seen.whole > 0.5) | seen.faces.round)
    like = may & (np.abs(seen.faces.halves_m[:, None] - design.halves_m[None]) < 0.5 * PAST_M)
    numbers, weights, turns = [], [], []
    for number, (a, b) in enumerate(combinations(ended, 2)):
        way = seen.faces.middles_m[b] - seen.faces.middles_m[a]
        long = float(np.linalg.norm(way))
        first, second = np.flatnonzero(like[a]), np.flatnonzero(like[b])
        if long < SHORTEST_WAY_M or not 0 < len(first) * len(second) <= MOST_WAYS:
            continue
        there = design.middles_m[second][None] - design.middles_m[first][:, None]
        fits = np.abs(np.linalg.norm(there, axis=-1) - long) < PAST_M
        angles = np.arctan2(there[fits][:, 1], there[fits][:, 0]) - np.arctan2(way[1], way[0])
        turns.append(wrapped(angles))
        numbers.append(np.full(len(angles), number, dtype=np.intp))
        weights.append(np.full(len(angles), 1.0 / (len(ended) - 1)))
    if not turns:
        return np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0)
    return np.concatenate(numbers), np.concatenate(weights), np.concatenate(turns)


class _Lines:
    """Pairs of a seen and a design face after a turn: the camera lies on a line (K,), within its ends."""

    def __init__(self, seen: Seen, design: Upright, may: BoolArray, prior: Prior, turn: float) -> None:
        faces = seen.faces
        angle = faces.angles_rad[:, None] + turn - design.angles_rad[None]
        parallel = np.abs(wrapped(angle)) <= np.maximum(PARALLEL_RAD, 3.0 * seen.angle_sigma_rad)[:, None]
        one, other = np.nonzero(may & (parallel | design.round[None]))
        arms = (faces.middles_m @ turned(turn).T)[one]
        target = design.middles_m[other] - arms  # where the camera is, were the middles one
        slack = np.where(
            design.round[other], 0.0, np.maximum(design.halves_m[other] - faces.halves_m[one], 0.0) + PAST_M
        )
        if prior.sigma_m is not None:
            away = target - prior.level_m
            side = np.abs(np.einsum("kn,kn->k", away, design.normals[other]))
            length = np.abs(np.einsum("kn,kn->k", away, design.along[other]))
            reach = REACH * prior.sigma_m
            near = (side <= reach) & (length <= reach + slack)
            one, other, target, slack = one[near], other[near], target[near], slack[near]
        if len(one) > MOST_SEGMENTS:  # those of the faces that say most
            best = np.argsort(-np.minimum(faces.halves_m, 1.0) - seen.whole, kind="stable")
            rank = np.empty(len(best), dtype=np.intp)
            rank[best] = np.arange(len(best))
            keep = np.sort(np.argsort(rank[one], kind="stable")[:MOST_SEGMENTS])
            one, other, target, slack = one[keep], other[keep], target[keep], slack[keep]
        self.one, self.target_m, self.slack_m = one, target, slack
        self.normals, self.along = design.normals[other], design.along[other]
        self.known = design.round[other] | (seen.whole[one] > 0.5) & (
            np.abs(design.halves_m[other] - faces.halves_m[one]) < PAST_M
        )


def _points(seen: Seen, design: Upright, may: BoolArray, prior: Prior, turn: float) -> tuple[FloatArray, _Lines]:
    lines = _Lines(seen, design, may, prior, turn)
    found = [lines.target_m[lines.known]]
    k = len(lines.one)
    for first in range(k):
        rest = np.arange(first + 1, k)
        rest = rest[lines.one[rest] != lines.one[first]]
        sine = lines.normals[first] @ lines.along[rest].T
        rest, sine = rest[np.abs(sine) > 0.5], sine[np.abs(sine) > 0.5]
        if not len(rest):
            continue
        # along the second's line until the first's: a point within both
        step = ((lines.target_m[first] - lines.target_m[rest]) @ lines.normals[first]) / sine
        points = lines.target_m[rest] + step[:, None] * lines.along[rest]
        own = np.abs((points - lines.target_m[first]) @ lines.along[first])
        found.append(points[(np.abs(step) <= lines.slack_m[rest]) & (own <= lines.slack_m[first])])
    points = np.concatenate(found)
    if prior.sigma_m is not None:
        points = points[np.linalg.norm(points - prior.level_m, axis=1) <= REACH * prior.sigma_m]
    return points, lines


def _best(points: FloatArray, lines: _Lines, seen: Seen) -> Iterator[FloatArray]:
    """Give the points on whose lines most faces lie, none of them near another."""
    cells, where = np.unique(np.round(points / NEAR_M).astype(np.int64), axis=0, return_inverse=True)
    votes = np.bincount(where.ravel(), minlength=len(cells))
    order = np.argsort(-votes, kind="stable")[:MOST_POINTS]
    middles = np.stack([np.bincount(where.ravel(), weights=points[:, k]) for k in (0, 1)], axis=-1) / votes[:, None]
    middles = middles[order]
    score = np.zeros(len(middles))
    weight = 1.0 + seen.whole
    for face in np.unique(lines.one):
        mine = lines.one == face
        way = middles[:, None] - lines.target_m[mine][None]
        across = np.abs(np.einsum("pkn,kn->pk", way, lines.normals[mine]))
        along = np.abs(np.einsum("pkn,kn->pk", way, lines.along[mine]))
        score += weight[face] * ((across < NEAR_M) & (along < lines.slack_m[mine] + NEAR_M)).any(axis=1)
    for _ in range(MOST_STARTS):
        top = int(np.argmax(score))
        if score[top] <= 1.0:
            return
        yield middles[top]
        score[np.linalg.norm(middles - middles[top], axis=1) < 2.0 * NEAR_M] = 0.0
