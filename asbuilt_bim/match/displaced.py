"""Does an element stand beside its design? Its faces are looked for near by, all of them moved the same way.

A column that stands 0.3 m off leaves its design's place open. Without this look it would be "not started".
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.border_boxes import grid_of
from asbuilt_bim.bim.mesh import Mesh, inside
from asbuilt_bim.bim.model import BimElement, BimModel, DesignFace
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.geometry.transform import rigid
from asbuilt_bim.match.assign import WHOLE_SHARE, match_faces
from asbuilt_bim.match.depth_on_design import seen_past_m2
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.match.regions import to_frame
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.match.score import WorldFace, in_world, plane_offset_sigma_m, point_sigma_m
from asbuilt_bim.match.survey_shift import BAND_M, COARSE_M, LEAST_MORE, NEAR_M
from asbuilt_bim.match.upright_planes import PARALLEL_COS
from asbuilt_bim.register.pose import PlacedStation, Placement

LEAST_M2 = 0.35
"""So much of its surface has to stand there: less may be a board, a prop, a stack."""
_Near = tuple[BimElement, list[WorldFace]]  # an element, and the measured faces near it
MOST_HERE = 0.75
"""In its own place lies at most so much of it: a face may run on past its element by a quarter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Displaced:
    """An element that stands beside its design: by `move_m` (3,), level, in the world."""

    element: str
    move_m: FloatArray
    area_m2: float  # of its faces that were found there; 0 where only others of its storey, or an earlier visit, say so
    stations: tuple[str, ...] = ()
    accepted: bool = False  # by a person: it is judged where it stands

    @property
    def distance_m(self) -> float:
        """Return how far off it stands."""
        return float(np.linalg.norm(self.move_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pair:
    """A measured face and a face of the element that it may be, were that moved.

    `off_m`: the way from the design's plane along its normal (1,), or of the axis across itself (3,). `outline` is in
    the design face's (u, v).
    """

    seen: WorldFace
    design: DesignFace
    off_m: FloatArray
    sigma_m: float
    outline: Region
    left: float  # share of the measured face that has no other element's body alone behind it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Seen:
    """What may be faces of an element, and how much of them (m2) lies in its place."""

    pairs: Sequence[_Pair]
    here_m2: float

    def stays(self, move_m: FloatArray) -> bool:
        """Say whether its faces contradict that it has moved so: enough of them lies in its place, and not there."""
        return self.here_m2 - _standing(self.pairs, move_m, BAND_M)[0] >= LEAST_M2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Standing:
    """A visit's matches with the design as it stands: elements that a person accepts beside their design lie there."""

    matched: MatchResult
    design: BimModel
    displaced: Mapping[str, Displaced]  # by GlobalId, the accepted ones too

    @property
    def not_accepted(self) -> set[str]:
        """Return the GlobalIds of elements that nobody has accepted where they stand."""
        return {key for key, one in self.displaced.items() if not one.accepted}


def where_they_stand(
    matched: MatchResult,
    design: BimModel,
    options: MatchOptions,
    before: Mapping[str, FloatArray],
    accept: Collection[str],
) -> Standing:
    """Find what stands beside its design. Those of it that `accept` names are moved there, and matched once more."""
    beside = displaced(matched, design, before)
    taken = {key: replace(one, accepted=True) for key, one in beside.items() if key in accept}
    if not taken:
        return Standing(matched=matched, design=design, displaced=beside)
    there = moved_design(design, {key: one.move_m for key, one in taken.items()})
    again = match_faces(Placement(stations=matched.stations, rejections=()), there, options)
    return Standing(matched=again, design=there, displaced=beside | taken)


def displaced(matched: MatchResult, design: BimModel, before: Mapping[str, FloatArray]) -> dict[str, Displaced]:
    """Return the elements that stand beside their design, by GlobalId; `before` is what earlier visits found.

    An element counts as displaced where its faces, all moved alike, lie on more measured surface than in its place, and
    photos don't look past them. Where most of a storey's elements have moved alike, so have those of which nothing was
    measured, and those whose faces lie there as well as in their place: a wall that was moved along itself.
    """
    every = (in_world(face, placed.pose) for placed in matched.stations for face in placed.measurement.faces)
    faces = [seen for seen in every if seen.outline]
    nearby = list(_nearby(design, faces))
    bodies = _bodies(nearby, faces)
    seen_of: dict[str, _Seen] = {}
    found: dict[str, Displaced] = {}
    for element, near in nearby:
        pairs = []
        for seen in near:
            in_bodies = bodies[id(seen)]
            left = 1.0 - float(np.mean(np.any(list(in_bodies.values()), axis=0) & ~in_bodies[element.global_id]))
            pairs += [pair for face in element.faces if (pair := _pair(seen, face, left)) is not None]
        one = _Seen(pairs=pairs, here_m2=_standing(pairs, np.zeros(3), COARSE_M)[0])
        best = _best_move(pairs, element)
        if best is not None and _is_there(best, one, element, matched.stations):
            found[element.global_id] = best
        elif one.here_m2 >= LEAST_M2:
            seen_of[element.global_id] = one
    found |= _with_their_storey(design, found, seen_of)
    known = {e.global_id for e in design.elements}
    seen_here = seen_of.keys() | {match.element for match in matched.matches}
    for key in sorted(before.keys() & known - found.keys() - seen_here):
        found[key] = Displaced(element=key, move_m=before[key], area_m2=0.0)
    return found


def moved_design(design: BimModel, moves_m: Mapping[str, FloatArray]) -> BimModel:
    """Return the design with elements moved to where they stand, by GlobalId."""
    elements = (_moved(e, moves_m[e.global_id]) if e.global_id in moves_m else e for e in design.elements)
    return replace(design, elements=tuple(elements))


def _moved(element: BimElement, move_m: FloatArray) -> BimElement:
    there, back = (rigid(np.eye(3), way_m) for way_m in (move_m, -move_m))
    return replace(
        element,
        faces=tuple(replace(face, frame=face.frame.moved(there)) for face in element.faces),
        vertices_m=frozen(element.vertices_m + move_m),
        axis_from_world=frozen(element.axis_from_world @ back),
    )


def _bodies(nearby: Sequence[_Near], faces: Sequence[WorldFace]) -> dict[int, dict[str, BoolArray]]:
    """Say of points (P,) behind each measured face (by its `id`) whether they lie in an element's body, by GlobalId.

    That explains it also where it is no face of the design: a wall's end that a column will cover, or a pour's end.
    """
    behind = {id(seen): _behind_m(seen) for seen in faces}
    found: dict[int, dict[str, BoolArray]] = {key: {} for key in behind}
    for element, near in nearby:
        body = Mesh(vertices_m=element.vertices_m, triangles=element.triangles)
        for seen in near:
            found[id(seen)][element.global_id] = inside(body, behind[id(seen)])
    return found


def _behind_m(seen: WorldFace) -> FloatArray:
    """Return points (P, 3), one at least, of the concrete behind a measured face, as far in as its place is unsure."""
    frame, grid = seen.frame, grid_of(seen.outline, np.full(2, 2.0 * COARSE_M))
    uv = np.concatenate([grid[polygon.contains(seen.outline, grid)], frame.to_uv(seen.centroid_m)[None]])
    out = np.tile(frame.normal, (len(uv), 1)) if isinstance(frame, PlaneFrame) else frame.outward(uv)
    return frame.from_uv(uv) - (COARSE_M + 2.0 * _place_sigma_m(seen, out[-1])) * out


def _place_sigma_m(seen: WorldFace, way: FloatArray) -> float:
    """Return how far off a measured face's middle may be along a direction (3,), its station's place included."""
    return float(np.hypot(point_sigma_m(seen.pose, seen.centroid_m, way), plane_offset_sigma_m(seen, seen.centroid_m)))


def _nearby(design: BimModel, faces: Sequence[WorldFace]) -> Iterator[_Near]:
    """Yield the elements with the measured faces whose middles lie within `NEAR_M` of their boxes."""
    if not faces or not design.elements:
        return
    low = np.array([element.vertices_m.min(axis=0) for element in design.elements]) - NEAR_M
    high = np.array([element.vertices_m.max(axis=0) for element in design.elements]) + NEAR_M
    middles = np.array([seen.centroid_m for seen in faces])
    is_near = np.all((middles >= low[:, None]) & (middles <= high[:, None]), axis=2)
    for index in np.flatnonzero(is_near.any(axis=1)):
        yield design.elements[index], [faces[int(face)] for face in np.flatnonzero(is_near[index])]


def _pair(seen: WorldFace, design: DesignFace, left: float) -> _Pair | None:
    if left <= 1.0 - WHOLE_SHARE or design.role == "reveal":
        return None
    if isinstance(seen.frame, PlaneFrame) and isinstance(design.frame, PlaneFrame):
        normal = design.frame.normal
        if seen.frame.normal @ normal < PARALLEL_COS:
            return None
        off_m = np.atleast_1d(design.frame.plane.distance_m(seen.centroid_m))
        outline = to_frame(seen.outline, seen.frame, design.frame)
    elif isinstance(seen.frame, CylinderFrame) and isinstance(design.frame, CylinderFrame):
        normal = design.frame.axis
        off_m = seen.frame.origin_m - design.frame.origin_m
        off_m = off_m - (off_m @ normal) * normal
        outline = seen.outline
        if abs(seen.frame.radius_m - design.frame.radius_m) > COARSE_M:
            return None
    else:
        return None
    if np.linalg.norm(off_m) > NEAR_M or not outline:
        return None
    sigma_m = _place_sigma_m(seen, normal)
    return _Pair(seen=seen, design=design, off_m=off_m, sigma_m=sigma_m, outline=outline, left=left)


def _best_move(pairs: Sequence[_Pair], element: BimElement) -> Displaced | None:
    """Return the shortest of the moves on which nearly as much measured surface lies as on any."""
    moves = (move_m for move_m in _moves(_asking(pairs)) if COARSE_M < np.linalg.norm(move_m) <= NEAR_M)
    places = [_at(element.global_id, move_m, pairs) for move_m in moves]
    most_m2 = max((place.area_m2 for place in places), default=0.0)
    enough = [place for place in places if place.area_m2 >= max(WHOLE_SHARE * most_m2, LEAST_M2)]
    return min(enough, key=lambda place: place.distance_m, default=None)


def _asking(pairs: Sequence[_Pair]) -> Sequence[_Pair]:
    """Return the pairs that ask for moves of their own: of those that lie alike to a millimetre one asks for all."""
    asking: dict[tuple[object, ...], _Pair] = {}
    for pair in pairs:
        lies = (*pair.off_m, *polygon.bounds(pair.outline))
        asking.setdefault((id(pair.design), *np.round(lies, 3).tolist()), pair)
    return tuple(asking.values())


def _moves(pairs: Sequence[_Pair]) -> Iterator[FloatArray]:
    """Yield moves that one measured face asks for, with one of its ends at the design's; or two across one another."""
    for pair in pairs:
        frame = pair.design.frame
        if isinstance(frame, CylinderFrame):
            yield pair.off_m
            continue
        along = frame.u
        base_m = pair.off_m[0] * frame.normal
        yield base_m
        seen, designed = polygon.bounds(pair.outline), polygon.bounds(pair.design.rings_uv_m)
        yield base_m + (seen[0] - designed[0]) * along
        yield base_m + (seen[2] - designed[2]) * along
        for other in pairs:
            across = other.design.frame
            if isinstance(across, PlaneFrame) and abs(across.normal @ frame.normal) < 1.0 - PARALLEL_COS:
                yield base_m + other.off_m[0] * across.normal


def _standing(pairs: Iterable[_Pair], move_m: FloatArray, band_m: float) -> tuple[float, list[_Pair]]:
    """Return how much measured surface (m2) lies on an element that is moved, and what does.

    In its own place every part counts; beside it faces that lie there whole: part of a face lies on anything.
    """
    total_m2, standing = 0.0, []
    for pair in pairs:
        frame, face = pair.design.frame, pair.seen.face
        wanted = move_m @ frame.normal if isinstance(frame, PlaneFrame) else move_m
        if np.linalg.norm(pair.off_m - wanted) > band_m + 2.0 * pair.sigma_m:
            continue
        share = pair.left
        if isinstance(frame, PlaneFrame):
            shift = np.array([move_m @ frame.u, move_m @ frame.v])
            place: Region = tuple(tuple(ring + shift for ring in rings) for rings in pair.design.rings_uv_m)
            on_it = polygon.intersection(pair.outline, polygon.grown(place, COARSE_M))
            share = min(share, polygon.area(on_it) / max(polygon.area(pair.outline), 1e-9))
        if move_m.any() and share < WHOLE_SHARE * pair.left:
            continue
        total_m2 += share * face.area_m2
        standing.append(pair)
    return total_m2, standing


def _at(element: str, move_m: FloatArray, pairs: Iterable[_Pair]) -> Displaced:
    area_m2, standing = _standing(pairs, move_m, BAND_M)
    stations = tuple(sorted({pair.seen.pose.station for pair in standing}))
    return Displaced(element=element, move_m=move_m, area_m2=area_m2, stations=stations)


def _is_there(found: Displaced, seen: _Seen, element: BimElement, stations: Sequence[PlacedStation]) -> bool:
    """Say whether it stands there, not in its place, and photos look past no more of its faces than was measured there.

    A stud of formwork before a wall lies on such a face as well, but beside the stud photos look past it. Those count
    that show what was measured, up to its top: a wall may be poured in part.
    """
    if seen.here_m2 > MOST_HERE * found.area_m2:
        return False
    _, standing = _standing(seen.pairs, found.move_m, BAND_M)
    tops_m = [pair.seen.frame.from_uv(ring)[:, 2].max() for pair in standing for ring, *_ in pair.seen.outline]
    showing = [placed for placed in stations if placed.pose.station in found.stations]
    return seen_past_m2(showing, element, found.move_m, max(tops_m), COARSE_M) <= found.area_m2


def _with_their_storey(
    design: BimModel, found: Mapping[str, Displaced], seen_of: Mapping[str, _Seen]
) -> dict[str, Displaced]:
    """Return the elements that nothing says otherwise of, where most of those of their storey have moved alike."""
    added: dict[str, Displaced] = {}
    for storey in {element.storey for element in design.elements}:
        members = [element.global_id for element in design.elements if element.storey == storey]
        moves = [found[key].move_m for key in members if key in found]
        alike = max(([m for m in moves if np.linalg.norm(m - one) < COARSE_M] for one in moves), key=len, default=[])
        if len(alike) < LEAST_MORE:
            continue
        move_m = np.median(alike, axis=0)
        in_place = {key for key in members if key in seen_of and seen_of[key].stays(move_m)}
        if len(alike) <= len(in_place):
            continue
        left = [key for key in members if key not in found and key not in in_place]
        added |= {key: _at(key, move_m, seen_of[key].pairs if key in seen_of else ()) for key in left}
    return added
