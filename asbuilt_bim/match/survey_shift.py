"""Does all that was measured lie beside the design, the same way? Then the survey's origin is wrong, or the design.

A survey that is moved changes no distance between markers, and no area: only the elements that faces are held against.
The measured planes are a pattern. It is looked for near where it lies, on every storey, then anywhere in the design at
any turn, and its feet and heads at any height. The score of a place is how many planes lie on the design there.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.depth_on_design import elements_shown
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.match.upright_planes import (
    PARALLEL_COS,
    Indices,
    Placing,
    at_height,
    design_planes,
    level_pairs,
    lying,
    measured_planes,
    side_by_side,
)
from asbuilt_bim.register.by_design.planes import Upright

BAND_M = 0.02
"""A plane within it lies on its face: good formwork errs by one to two centimetres, a pose by one. So no smaller move
makes one fit that did not: it is a building's own tolerance."""
COARSE_M, COARSE_RAD = 3.0 * BAND_M, float(np.radians(0.5))
"""How near a place is found at first.

Elements built some centimetres off, each its own way, lie this NEAR the design in many places. So more must lie on it
than near it here, or on it most of those near it.
"""
ON_OF_NEAR = 0.75
NEAR_M, FAR_M, RISE_M = 0.6, 30.0, 2.0
"""Moves looked for: near by, where one column of a grid isn't yet taken for the next; anywhere; and in height.

Whole storeys are known by what stands on them.
"""
LEAST_MORE, LEAST_MORE_SHARE = 3, 0.25
"""So many planes more, and so large a share of all, on as many elements, lie on the design there. So do feet and heads.
"""
FREE_PLANES = 2
"""So many planes any two walls at an angle lay on the design, where turn and move are free: they are no evidence."""
SURE_SHARE, SURE_OF_RIVAL = 0.5, 2.0
"""Far off most of all planes fit, or twice as many as anywhere else: by chance neither comes about."""
HARDLY_M, HARDLY_SHARE, HARDLY_COUNT = 0.10, 0.25, 12
"""Of another building's faces up to a fifth, by number and area, lie within 10 cm of the design by chance. Of a site's
own it is half and more: by area where clutter, many and small, is among them. Of under a dozen a few say nothing.
What is near by chance is anywhere in these 10 cm, a fifth of it within 2 cm: most of it, on as many elements, is none.
"""
BY_CHANCE = 0.05
"""Where half of a site's own faces fit, none of three fits in one case of eight: that says nothing yet."""
TURNS, PEAKS, REFINED = 6, 16, 25  # looked at, the likeliest first


def survey_shift(matched: MatchResult, design: BimModel) -> tuple[Rejection, ...]:
    """Return one rejection, of the survey, where everything lies beside the design; empty where not.

    The same way: with the move. Each its own way, so that not one face fits: photos, survey and design of two sites.
    """
    seen, origin = measured_planes(matched.stations)
    furthest = np.max(np.linalg.norm(seen.middles_m, axis=1) + seen.halves_m, initial=0.0)
    walls = design_planes(design, origin, FAR_M + float(furthest))
    heights = [storey.elevation_m for storey in design.storeys]
    rises = sorted({0.0, *(round(a - b, 2) for a in heights for b in heights)}, key=abs)
    place = find_placing(seen, walls, rises)
    rise, ends = _rise(place.back(seen), walls)
    place = replace(place, rise_m=place.rise_m + rise)
    methods = {station.pose.method for station in matched.stations}
    given: dict[str, Value] = {} if "markers" in methods or methods <= {"linked"} else {"given": True}
    if place.turn_rad or place.rise_m or place.move_m.any():
        on, on_here = (int(lying(at.back(seen), walls, BAND_M)[0].sum()) for at in (place, Placing()))
        if on > on_here:
            fits: dict[str, Value] = {"fits": on, "faces": len(seen.halves_m), "fits_unmoved": on_here}
            return (_of_survey(Reason.SURVEY_SHIFTED, _moved(place, origin) | fits | given),)
        return (_of_survey(Reason.SURVEY_SHIFTED_IN_HEIGHT, _moved(place, origin) | {"more": ends} | given),)
    return _nothing_fits(matched, design, seen, walls)


def _of_survey(code: Reason, values: dict[str, Value]) -> Rejection:
    return rejected(code, about(SubjectKind.SURVEY), **values)


def find_placing(seen: Upright, walls: Upright, rises_m: Sequence[float]) -> Placing:
    """Return where the measured planes lie, if clearly more of them fit the design there than where they should be."""
    if not len(seen.halves_m) or not len(walls.halves_m):
        return Placing()
    axes = _chief_axes(seen.normals)
    near = _moves(seen, walls, Placing(), axes, (0.0,), NEAR_M, BAND_M)
    here = _judged(_likeliest(near, seen, walls), seen, walls, Placing())
    here = _judged([replace(here, rise_m=rise) for rise in rises_m], seen, walls, here)
    if len(axes) < 2:
        return here  # along walls of one direction no move is made up
    far = (found for turn in _turns(seen, walls) for found in _moves(seen, walls, turn, axes, rises_m, FAR_M, COARSE_M))
    return _judged(_likeliest(far, seen, walls, turns=True), seen, walls, here, free=FREE_PLANES)


def _likeliest(
    found: Iterable[tuple[int, Placing]], seen: Upright, walls: Upright, turns: bool = False
) -> list[Placing]:
    """Return the places that most planes fit coarsely, brought to fit finely."""
    ranked = sorted(found, key=lambda one: -one[0])[:REFINED]
    return [_refined(seen, walls, place, turns) for _, place in ranked]


def _judged(places: Sequence[Placing], seen: Upright, walls: Upright, here: Placing, free: int = 0) -> Placing:
    """Return the place that most planes fit, `here` where that isn't clearly better."""
    fitting = [lying(place.back(seen), walls, BAND_M) for place in places]
    counts = [int(lies.sum()) for lies, _ in fitting]
    if not counts:
        return here
    best = max(range(len(places)), key=lambda n: (counts[n], -float(np.linalg.norm(places[n].move_m))))
    place, count, (lies, on) = places[best], counts[best], fitting[best]
    least = max(LEAST_MORE + free, LEAST_MORE_SHARE * count)
    lies_here, near_here = (lying(here.back(seen), walls, band)[0] for band in (BAND_M, COARSE_M))
    elements = {walls.elements[face] for face in on[lies & ~lies_here]}
    if count - lies_here.sum() < least or len(elements) < LEAST_MORE:
        return here
    if count - near_here.sum() < least:
        near = lying(place.back(seen), walls, COARSE_M)[0]
        is_one_move = not (free and place.rise_m)  # a turn, or a storey: both together would be made up
        return place if is_one_move and count >= ON_OF_NEAR * near.sum() else here
    rivals = [n for other, n in zip(places, counts, strict=True) if free and _is_apart(other, place)]
    return place if count >= min(SURE_SHARE * len(lies), SURE_OF_RIVAL * max(rivals, default=0)) else here


def _rise(seen: Upright, walls: Upright) -> tuple[float, int]:
    """Return the upward move in metres, 0 where none is clearly better, and how many feet and heads more it suits.

    Feet are hidden and walls are poured in part: only where both ends of faces say the same is it a move.
    """
    one, other, _ = level_pairs(seen, walls, BAND_M)
    ends = seen.heights_m[one] - walls.heights_m[other]  # (K, 2) feet and heads
    votes = [_votes(column, one, BAND_M, RISE_M) for column in ends.T]
    rises, suited = votes[0][0], np.stack([counts for _, counts in votes], axis=-1)
    best = np.lexsort((np.abs(rises), -suited.sum(axis=1)))[0]
    more = suited[best] - suited[np.argmin(np.abs(rises))]
    if more.min() < LEAST_MORE or more.sum() < LEAST_MORE_SHARE * 2 * len(np.unique(one)):
        return 0.0, 0
    return float(np.mean(ends[np.abs(ends - rises[best]) < BAND_M])), int(more.sum())


def _turns(seen: Upright, walls: Upright) -> Iterator[Placing]:
    """Give the turns that make most measured planes parallel to one of the design."""
    designed = np.unique(np.round(walls.normals, 4), axis=0)
    angles = [np.arctan2(normals[:, 1], normals[:, 0]) for normals in (seen.normals, designed)]
    turns = np.subtract.outer(*angles)[..., None] + np.array([-2.0, 0.0, 2.0]) * np.pi
    voters = np.repeat(np.arange(len(turns)), turns[0].size)
    for turn, _ in _peaks(turns.ravel(), voters, COARSE_RAD, np.pi, TURNS):
        yield Placing(turn_rad=turn)


def _moves(
    seen: Upright,
    walls: Upright,
    turn: Placing,
    axes: FloatArray,
    rises_m: Sequence[float],
    reach_m: float,
    band_m: float,
) -> Iterator[tuple[int, Placing]]:
    """Give places after a turn, each made of a move along each axis, with how many planes across these fit coarsely."""
    turned, axes = turn.back(seen), axes @ turn.turn
    one, other = np.nonzero(turned.normals @ walls.normals.T > PARALLEL_COS)
    peaks = []
    for axis in axes:
        is_across = np.abs(walls.normals[other] @ axis) > PARALLEL_COS
        pairs = np.stack([one[is_across], other[is_across]])
        moves = (turned.middles_m[pairs[0]] - walls.middles_m[pairs[1]]) @ axis
        peaks.append([(m, pairs[:, near]) for m, near in _peaks(moves, pairs[0], band_m, reach_m, PEAKS)])
    across = np.linalg.pinv(axes)
    for found in itertools.product(*peaks):
        place = replace(turn, move_m=across @ np.array([move for move, _ in found]))
        back = place.back(seen)
        pairs = np.concatenate([pairs for _, pairs in found], axis=1)
        seen_on, on = pairs[:, side_by_side(back, walls, *pairs)]
        for rise in rises_m:
            count = len(np.unique(seen_on[at_height(back, walls, seen_on, on, rise)]))
            if count >= LEAST_MORE:
                yield count, replace(place, rise_m=rise)


def _chief_axes(normals: FloatArray) -> FloatArray:
    """Return the directions (1 or 2, 2) that most normals lie along, at 30 degrees and more."""
    angles = np.arctan2(normals[:, 1], normals[:, 0]) % np.pi
    around = np.sort(np.concatenate([angles - np.pi, angles, angles + np.pi]))
    near = np.arccos(PARALLEL_COS)
    votes = np.searchsorted(around, angles + near, "left") - np.searchsorted(around, angles - near, "right")
    first = int(np.argmax(votes))
    others = np.where(np.abs(normals @ normals[first]) < np.cos(np.radians(30.0)), votes, 0)
    second = int(np.argmax(others))
    return normals[[first, second]] if others[second] else normals[[first]]


def _peaks(
    values: FloatArray, voters: Indices, band: float, reach: float, most: int
) -> Iterator[tuple[float, BoolArray]]:
    """Give the shifts near which most voters have a value (K,), the likeliest first, with which values these are."""
    shifts, counts = _votes(values, voters, band, reach)
    for _ in range(most):
        top = int(np.lexsort((np.abs(shifts), -counts))[0])
        if not counts[top]:
            return
        near = np.abs(values - shifts[top]) < band
        yield float(np.median(values[near])), near
        counts[np.abs(shifts - shifts[top]) < 1.5 * band] = 0


def _votes(values: FloatArray, voters: Indices, band: float, reach: float) -> tuple[FloatArray, Indices]:
    """Return shifts (S,) half a band apart, and how many of the voters have a value (K,) in the band of each."""
    step = 0.5 * band
    last = round(reach / step)
    places = np.rint(values / step).astype(np.intp)[:, None] + np.arange(-2, 3)
    is_vote = (np.abs(places * step - values[:, None]) < band) & (np.abs(places) <= last)
    one_each = np.unique((voters[:, None] * (2 * last + 1) + places + last)[is_vote])
    shifts = step * np.arange(-last, last + 1, dtype=np.float64)
    return shifts, np.bincount(one_each % len(shifts), minlength=len(shifts))


def _refined(seen: Upright, walls: Upright, place: Placing, turns: bool) -> Placing:
    """Return the move, and the turn, that lay the planes which fit on their faces: least squares, ever more closely."""
    for band in (COARSE_M, COARSE_M, 1.5 * BAND_M, BAND_M)[0 if turns else 2 :]:
        back = place.back(seen)
        lies, on = lying(back, walls, band)
        if lies.sum() < LEAST_MORE:
            break
        normals, arms = walls.normals[on[lies]], back.middles_m[lies] + place.move_m
        off = np.einsum("nk,nk->n", normals, back.middles_m[lies] - walls.middles_m[on[lies]])
        by_turn = np.einsum("nk,nk->n", normals, np.stack([arms[:, 1], -arms[:, 0]], axis=-1))
        reach = max(float(np.sqrt(np.mean(by_turn**2))), BAND_M)  # turns weigh as much as moves
        step = np.linalg.lstsq(np.column_stack([turns * by_turn / reach, -normals]), -off, rcond=0.1)[0]
        place = replace(place, turn_rad=place.turn_rad + float(step[0]) / reach, move_m=place.move_m + step[1:])
    return place


def _is_apart(one: Placing, other: Placing) -> bool:
    parallel = np.cos(one.turn_rad - other.turn_rad) >= PARALLEL_COS
    return bool(np.linalg.norm(one.move_m - other.move_m) > NEAR_M or not parallel)


def _moved(place: Placing, origin: FloatArray) -> dict[str, Value]:
    """Return the turn of all that was measured, where the turn's axis stands in the world, and the move after it."""
    move = np.append(place.turn @ place.move_m, place.rise_m)
    named: dict[str, Value] = {f"move_{axis}_m": float(part) for axis, part in zip("xyz", move, strict=True)}
    axis = {"about_x_m": float(origin[0]), "about_y_m": float(origin[1])}
    return named | {"turn_rad": float(place.turn_rad)} | axis


def _nothing_fits(matched: MatchResult, design: BimModel, seen: Upright, walls: Upright) -> tuple[Rejection, ...]:
    """Return a rejection where hardly one of the measured faces fits the design, and depth doesn't show it either.

    On a site with much else in view no measured face may be an element's. But elements that stand lie in the depth.
    """
    fault = _hardly_alike(matched, seen, walls)
    if fault is None:
        return ()
    shown = elements_shown(matched.stations, design, FAR_M, HARDLY_M, SURE_SHARE)
    return () if len(shown) >= LEAST_MORE else (fault,)


def _hardly_alike(matched: MatchResult, seen: Upright, walls: Upright) -> Rejection | None:
    count = sum(len(placed.measurement.faces) for placed in matched.stations)
    if not matched.matches and (1.0 - SURE_SHARE) ** count < BY_CHANCE:
        return _of_survey(Reason.DESIGN_UNLIKE, {"faces": count})
    near, on = (lying(seen, walls, band) for band in (HARDLY_M, BAND_M))
    fits, areas = near[0], seen.halves_m * np.ptp(seen.heights_m, axis=1)  # half areas
    if len(fits) < HARDLY_COUNT or max(np.mean(fits), areas[fits].sum() / areas.sum()) >= HARDLY_SHARE:
        return None
    elements = {walls.elements[face] for face in on[1][on[0]]}
    if len(elements) >= LEAST_MORE and on[0].sum() >= SURE_SHARE * fits.sum():
        return None
    return _of_survey(Reason.DESIGN_HARDLY_ALIKE, {"fits": int(fits.sum()), "faces": len(fits)})
