"""Does all that was measured lie beside the design, the same way? Then the survey's origin is wrong, or the design.

A survey that is moved changes no distance between markers, and no area: only the elements that faces are held against.
Each measured plane votes for the moves that lay it on a parallel face of the design; where one move suits clearly more
of them than none does, the survey is doubted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.model import BimModel, DesignFace
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.level_shift import find_rise
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.match.score import in_world
from asbuilt_bim.match.survey_search import Elsewhere, find_elsewhere, storey_rises
from asbuilt_bim.match.upright_lines import (
    PARALLEL_COS,
    UPRIGHT,
    Placing,
    Upright,
    design_planes,
    lying,
    measured_planes,
)
from asbuilt_bim.register.pose import PlacedStation

REACH_M = 0.6
"""Moves looked for. Further off, columns of one grid are taken for each other."""
BAND_M = 0.02
"""A plane within it lies on its face: good formwork errs by one to two centimetres, a pose by one. So no smaller move
makes one fit that did not: it is a building's own tolerance."""
LEAST_MORE, LEAST_MORE_SHARE, LEAST_ELEMENTS = 3, 0.25, 3
"""So many faces more, and so large a share of all, on so many elements, lie on the design after the move."""
HARDLY_M, HARDLY_SHARE, HARDLY_COUNT = 0.10, 0.25, 12
"""Of another building's faces up to a fifth lie within 10 cm of the design by chance; of a site's own, formwork and
clutter among them, half and more. Of under a dozen a few say nothing."""
_STEP_M = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Votes:
    """One measured plane against the design faces that it may be, K of them."""

    normals: FloatArray  # (K, 2) level
    offsets_m: FloatArray  # (K,) measured minus design, along the design's normal
    elements: tuple[str, ...]

    def nearest(self, move_m: FloatArray) -> int:
        """Return which of the faces it lies on best after a move back by `move_m` (2,)."""
        return int(np.argmin(np.abs(self.offsets_m - self.normals @ move_m)))


def beside_design(matched: MatchResult, design: BimModel) -> tuple[Rejection, ...]:
    """Return one rejection, of the survey, where everything lies beside the design; empty where not.

    The same way: with the move. Each its own way, so that not one face fits: photos, survey and design of two sites.
    """
    votes = _votes(matched.stations, design)
    level, fit, fit_unmoved = _level_move(votes) if votes else (np.zeros(2), 0, 0)
    seen, origin = measured_planes(matched.stations)
    walls = design_planes(design, origin)
    far = find_elsewhere(seen, walls, storey_rises(design), level)
    place = Placing(move_m=level) if far is None else far.placing
    rise, more = find_rise(place.back(seen), walls)
    if far is not None:
        return (_elsewhere(far, rise),)
    if not level.any() and not rise:
        return _nothing_fits(matched, seen, walls)
    if not level.any():
        return (_of_survey(Reason.SURVEY_SHIFTED_IN_HEIGHT, {"rise_m": float(rise), "more": more}),)
    return (
        _of_survey(
            Reason.SURVEY_SHIFTED,
            _moved(np.append(level, rise)) | {"fits": fit, "faces": len(votes), "fits_unmoved": fit_unmoved},
        ),
    )


def _elsewhere(far: Elsewhere, rise_m: float) -> Rejection:
    cos, sin = np.cos(far.placing.turn_rad), np.sin(far.placing.turn_rad)
    moved = np.append(np.array([[cos, -sin], [sin, cos]]) @ far.placing.move_m, far.placing.rise_m + rise_m)
    fits: dict[str, Value] = {"fits": far.fits, "faces": far.count, "fits_unmoved": far.fits_unmoved}
    values = _moved(moved) | {"turn_rad": float(far.placing.turn_rad)} | fits
    return _of_survey(Reason.SURVEY_ELSEWHERE, values)


def _moved(by_m: FloatArray) -> dict[str, Value]:
    return {f"move_{axis}_m": float(part) for axis, part in zip("xyz", by_m, strict=True)}


def _of_survey(code: Reason, values: dict[str, Value]) -> Rejection:
    return Rejection(code=code, subject=Subject(kind=SubjectKind.SURVEY), values=values)


def _nothing_fits(matched: MatchResult, seen: Upright, walls: Upright) -> tuple[Rejection, ...]:
    count = sum(len(placed.measurement.faces) for placed in matched.stations)
    if not matched.matches and count >= LEAST_MORE:
        return (_of_survey(Reason.DESIGN_UNLIKE, {"faces": count}),)
    fitting, count = int(lying(seen, walls, HARDLY_M)[0].sum()), len(seen.halves_m)
    if count < HARDLY_COUNT or fitting >= HARDLY_SHARE * count:
        return ()
    return (_of_survey(Reason.DESIGN_HARDLY_ALIKE, {"fits": fitting, "faces": count}),)


def _votes(stations: Sequence[PlacedStation], design: BimModel) -> list[_Votes]:
    faces = [face for element in design.elements for face in element.faces if _is_upright(face)]
    if not faces:
        return []
    frames = [face.frame for face in faces if isinstance(face.frame, PlaneFrame)]
    normals, origins = (np.array([getattr(f, name) for f in frames]) for name in ("normal", "origin_m"))
    axes = np.array([[f.u, f.v] for f in frames])
    rings = [np.concatenate([ring for region in face.rings_uv_m for ring in region]) for face in faces]
    low, high = (np.array([getattr(ring, end)(axis=0) for ring in rings]) for end in ("min", "max"))
    votes = []
    for placed in stations:
        for measured in placed.measurement.faces:
            seen = in_world(measured, placed.pose)
            if not isinstance(seen.frame, PlaneFrame) or abs(seen.frame.normal[2]) > UPRIGHT or not seen.outline:
                continue
            arms = seen.centroid_m - origins
            offsets = np.einsum("fi,fi->f", arms, normals)
            at = np.einsum("fki,fi->fk", axes, arms)
            inside = ((at > low - REACH_M) & (at < high + REACH_M)).all(axis=1)
            may = np.flatnonzero(inside & (normals @ seen.frame.normal > PARALLEL_COS) & (np.abs(offsets) < REACH_M))
            if len(may):
                votes.append(
                    _Votes(
                        normals=normals[may, :2],
                        offsets_m=offsets[may],
                        elements=tuple(faces[one].element for one in may),
                    )
                )
    return votes


def _level_move(votes: Sequence[_Votes]) -> tuple[FloatArray, int, int]:
    """Return the level move (2,), 0 where none is clearly better, and how many planes fit with and without it."""
    steps = np.arange(-REACH_M, REACH_M + 0.5 * _STEP_M, _STEP_M)
    moves = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    count = np.zeros(len(moves))
    for vote in votes:
        off = np.abs(vote.offsets_m[:, None] - vote.normals @ moves.T)
        count += (off < BAND_M).any(axis=0)
    best = moves[np.lexsort((np.hypot(*moves.T), -count))[0]]
    move = _refined(votes, best)
    fits, unmoved = (_fitting(votes, at) for at in (move, np.zeros(2)))
    more = [one for one in fits if one not in unmoved]
    elements = {votes[one].elements[votes[one].nearest(move)] for one in more}
    gained = len(fits) - len(unmoved)
    is_clear = gained >= max(LEAST_MORE, LEAST_MORE_SHARE * len(votes)) and len(elements) >= LEAST_ELEMENTS
    return (move if is_clear else np.zeros(2)), len(fits), len(unmoved)


def _refined(votes: Sequence[_Votes], move: FloatArray) -> FloatArray:
    """Return the least-squares move of the planes that lie on a face after `move`: nought where no plane tells it."""
    fits = _fitting(votes, move)
    chosen = [(votes[one], votes[one].nearest(move)) for one in fits]
    normals = np.array([vote.normals[face] for vote, face in chosen]).reshape(-1, 2)
    offsets = np.array([vote.offsets_m[face] for vote, face in chosen])
    found: FloatArray = np.linalg.lstsq(normals, offsets, rcond=0.1)[0]
    return found


def _fitting(votes: Sequence[_Votes], move: FloatArray) -> list[int]:
    """Return which planes lie on a face after a move back by `move`."""
    return [n for n, v in enumerate(votes) if float(np.min(np.abs(v.offsets_m - v.normals @ move))) < BAND_M]


def _is_upright(face: DesignFace) -> bool:
    return isinstance(face.frame, PlaneFrame) and abs(float(face.frame.normal[2])) < UPRIGHT
