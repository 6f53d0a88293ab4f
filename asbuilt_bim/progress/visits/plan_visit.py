"""The fewest stations that see what is due: a greedy choice among places to stand and ways to look."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.model import BimModel, Obstacle
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, frozen
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.progress.visits.places import StandingPlaces, standing_places
from asbuilt_bim.progress.visits.sights import (
    EITHER,
    TAKEN,
    RigFrames,
    framed_patches,
    rig_frames,
    sighted_patches,
    upright_pose,
)
from asbuilt_bim.progress.visits.squares import Squares, wanted_squares
from asbuilt_bim.progress.visits.surroundings import Surroundings, surroundings

BEARINGS = 16
"""Ways to look from a place: a frame is 60 to 70 degrees wide, so each thing stands well inside several."""
LEAST_GAIN_M2 = 1.0
"""A station that adds less is not worth the walk; what it would show is listed as unseen."""


Counts = Callable[[Surroundings, FloatArray], bool]
"""Says of a pose (4, 4) whether a station there will be placed: a photo that can't be counts for nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedStation:
    """A place to stand and a way to look, and which of the visit's patches it shows: all, and those first shown here.

    `patches` and `first` (P,) are of the visit's `wanted` squares.
    """

    number: int
    storey: str  # GlobalId
    world_from_left: FloatArray  # (4, 4), held upright
    patches: BoolArray
    first: BoolArray
    gain_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedVisit:
    """Stations by storey, in the order of a walk; what of `wanted` they see, and what no place on a floor shows."""

    wanted: Squares
    stations: tuple[PlannedStation, ...]
    seen: BoolArray  # (S,) squares that a station shows
    visible: BoolArray  # (S,) squares that some place on a floor shows
    by_hull: tuple[str, ...]  # storeys whose floor is not known from a slab
    around: Surroundings
    asked_m2: float  # what was wanted before today's stations were taken off
    limited: bool = False  # more stations would have been worth it than were allowed

    @property
    def seen_m2(self) -> float:
        """Return the area of the squares that the stations show."""
        return float(self.wanted.area_m2[self.seen].sum())

    def unseen_m2(self, *, hidden: bool) -> dict[str, float]:
        """Return what stays unseen of each element (GlobalId): what no place shows, or what is not worth a station."""
        left = ~self.visible if hidden else self.visible & ~self.seen
        areas = np.bincount(self.wanted.element[left], self.wanted.area_m2[left], minlength=len(self.wanted.elements))
        return {one.global_id: float(m2) for one, m2 in zip(self.wanted.elements, areas, strict=True) if m2 > 0.0}


def seen_from(frames: RigFrames, around: Surroundings, pose: FloatArray, squares: Squares) -> BoolArray:
    """Return which patches (P,) a station at a pose (4, 4) shows, by the design."""
    seen = framed_patches(frames, pose, squares)
    for eye in (pose[:3, 3], frames.right_eye(pose)):
        some = np.flatnonzero(seen)
        seen[some] = sighted_patches(around, eye, squares.part(seen), TAKEN)
    return seen


def of_squares(squares: Squares, patches: BoolArray) -> BoolArray:
    """Return which squares (S,) have one of the patches (P,)."""
    found = np.zeros(len(squares.area_m2), dtype=np.bool_)
    found[squares.square[patches]] = True
    return found


def plan_visit(
    design: BimModel,
    floors: Sequence[Obstacle],
    rig: StereoRig,
    wanted: Collection[str],
    known: Mapping[str, SurfaceState],
    *,
    most: int = 0,
    taken: Sequence[FloatArray] = (),
    first: Collection[str] = (),
    counts: Counts | None = None,
) -> PlannedVisit:
    """Choose stations for the wanted elements (GlobalIds), `most` of them at most where that isn't 0.

    Of `most` those come first that `counts` says will be placed, and of them what shows the elements `first`.

    `known` are states of faces from earlier visits, by face id: what was seen built isn't wanted again. `taken` are
    poses (4, 4) of today's stations: what they show isn't either. What is wanted is taken to stand, and to hide.
    """
    standing = {*wanted, *(state.element for state in known.values() if state.built_uv_m)}
    around = surroundings(design, standing, floors)
    squares = wanted_squares(design, wanted, known)
    asked_m2 = squares.total_m2
    whole = rig_frames(rig, margin=0.0)
    for pose in taken:
        squares = squares.without(of_squares(squares, seen_from(whole, around, pose, squares)))
    frames = rig_frames(rig)
    visible = np.zeros(len(squares.area_m2), dtype=np.bool_)
    left_m2 = squares.area_m2.copy()
    sure: list[_View] = []
    others: list[_View] = []
    by_hull: list[str] = []
    for storey in dict.fromkeys(one.storey for one in squares.elements):
        places = standing_places(design, storey, standing, floors)
        if places is None:
            continue
        by_hull += [storey] if places.by_hull else []
        views = _views(frames, around, squares, places)
        visible[_joined([view.squares for view in views])] = True
        if most and counts is not None:
            sure += _needed(_greedy(frames, around, squares, views, left_m2, counts), squares)
        others += _needed(_greedy(frames, around, squares, views, left_m2), squares)
    allowed = _best((sure, others), squares, most, first)
    seen, stations = _numbered(squares, allowed)
    return PlannedVisit(
        wanted=squares, stations=stations, seen=seen, visible=visible, by_hull=tuple(by_hull), around=around,
        asked_m2=asked_m2, limited=len(allowed) < len(sure) + len(others),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _View:
    storey: str
    pose: FloatArray
    patches: IntArray  # their numbers, as of the squares: thousands of views of thousands of patches fit the memory
    squares: IntArray

    def gain_m2(self, areas_m2: FloatArray) -> float:
        """Return the area that it shows, of areas (S,) that are 0 where nothing is wanted any more."""
        return float(areas_m2[self.squares].sum())


def _views(frames: RigFrames, around: Surroundings, squares: Squares, places: StandingPlaces) -> list[_View]:
    """Return what each place of a storey shows in each direction, of the storey's own elements alone."""
    own = np.array([one.storey == places.storey for one in squares.elements], dtype=np.bool_)
    mine = np.flatnonzero(own[squares.element][squares.square])
    part = squares.part(own[squares.element][squares.square])
    bearings = frozen(np.arange(BEARINGS) * (2.0 * np.pi / BEARINGS))
    views: list[_View] = []
    for eye in places.eyes_m:
        sighted = sighted_patches(around, eye, part)
        free, visible = mine[sighted], part.part(sighted)
        if not len(free):
            continue
        points = np.concatenate([visible.points_m[:, None], visible.corners_m], axis=1)
        framed: BoolArray = np.all(frames.show_upright(eye, bearings, points), axis=2)
        for bearing, shown in zip(bearings, framed, strict=True):
            if shown.any():
                views.append(_view(squares, places.storey, upright_pose(eye, float(bearing)), free[shown]))
    return views


def _view(squares: Squares, storey: str, pose: FloatArray, patches: NDArray[np.intp]) -> _View:
    found = np.unique(squares.square[patches]).astype(np.int32)
    return _View(storey=storey, pose=pose, patches=patches.astype(np.int32), squares=found)


def _needed(chosen: Sequence[_View], squares: Squares) -> list[_View]:
    """Return views less those whose squares the others show, too: a greedy choice begins with what it needs least."""
    kept = list(chosen)
    times = np.bincount(_joined([view.squares for view in kept]), minlength=len(squares.area_m2))
    while kept:
        alone = [view.gain_m2(np.where(times == 1, squares.area_m2, 0.0)) for view in kept]
        least = int(np.argmin(alone))
        if alone[least] >= LEAST_GAIN_M2:
            break
        times[kept.pop(least).squares] -= 1
    return kept


def _joined(parts: Sequence[IntArray]) -> IntArray:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int32)


def _greedy(
    frames: RigFrames,
    around: Surroundings,
    squares: Squares,
    views: Sequence[_View],
    left_m2: FloatArray,
    counts: Counts | None = None,
) -> list[_View]:
    """Return views, each the one that adds most, as long as one is worth it; what they show leaves `left_m2` (S,).

    With `counts` only those that count.

    A view never adds more than it did before, so only those at the top are reckoned anew. Places were looked from with
    the left eye, which doesn't move as the rig turns: of a view at the top, what the right eye doesn't see goes first.
    """
    waiting = [(-view.gain_m2(left_m2), number) for number, view in enumerate(views)]
    heapify(waiting)
    by_both: dict[int, _View] = {}
    chosen: list[_View] = []
    while waiting:
        before, number = heappop(waiting)
        if -before < LEAST_GAIN_M2:
            break
        view = by_both.get(number, views[number])
        gain = view.gain_m2(left_m2)
        if gain < -before:
            heappush(waiting, (-gain, number))
        elif number not in by_both:
            if counts is not None and not counts(around, view.pose):
                continue
            by_both[number] = _by_both(frames, around, squares, view)
            heappush(waiting, (-by_both[number].gain_m2(left_m2), number))
        else:
            chosen.append(view)
            left_m2[view.squares] = 0.0
    return chosen


def _by_both(frames: RigFrames, around: Surroundings, squares: Squares, view: _View) -> _View:
    """Return a view less the patches that the right eye doesn't see."""
    some = np.zeros(len(squares.square), dtype=np.bool_)
    some[view.patches] = True
    seen = sighted_patches(around, frames.right_eye(view.pose), squares.part(some), EITHER)
    return _view(squares, view.storey, view.pose, np.flatnonzero(some)[seen])


def _best(groups: Sequence[Sequence[_View]], squares: Squares, most: int, first: Collection[str] = ()) -> list[_View]:
    """Return the views that show most together, `most` of them at most, by storey in the order of a walk.

    Those of an earlier group go before; in a group those that show most of the elements `first`, if it is worth a walk.
    """
    left_m2 = squares.area_m2.copy()
    urgent = np.array([one.global_id in first for one in squares.elements], dtype=np.bool_)[squares.element]

    def worth(view: _View) -> tuple[float, float]:
        soon = view.gain_m2(np.where(urgent, left_m2, 0.0))
        return soon if soon >= LEAST_GAIN_M2 else 0.0, view.gain_m2(left_m2)

    kept: list[_View] = []
    for group in groups:
        rest = list(group)
        while rest and (not most or len(kept) < most):
            best = max(rest, key=worth)
            left_m2[best.squares] = 0.0
            rest.remove(best)
            kept.append(best)
    walk: list[_View] = []
    for storey in dict.fromkeys(view.storey for group in groups for view in group):
        walk += _walked([view for view in kept if view.storey == storey])
    return walk


def _walked(views: Sequence[_View]) -> list[_View]:
    """Return views in the order of a short walk: always on to the nearest, from the one that stands outermost."""
    rest = sorted(views, key=lambda view: (view.pose[0, 3], view.pose[1, 3]))
    walk = rest[:1]
    rest = rest[1:]
    while rest:
        here = walk[-1].pose[:2, 3]
        nearest = min(rest, key=lambda view: float(np.linalg.norm(view.pose[:2, 3] - here)))
        rest = [view for view in rest if view is not nearest]
        walk.append(nearest)
    return walk


def _numbered(squares: Squares, chosen: Sequence[_View]) -> tuple[BoolArray, tuple[PlannedStation, ...]]:
    """Return which squares (S,) the views show, and the views as stations in their order."""
    seen = np.zeros(len(squares.area_m2), dtype=np.bool_)
    stations: list[PlannedStation] = []
    for number, view in enumerate(chosen, start=1):
        shown, patches = np.zeros_like(seen), np.zeros(len(squares.square), dtype=np.bool_)
        shown[view.squares], patches[view.patches] = True, True
        new = shown & ~seen
        stations.append(
            PlannedStation(
                number=number,
                storey=view.storey,
                world_from_left=frozen(view.pose),
                patches=patches,
                first=patches & new[squares.square],
                gain_m2=float(squares.area_m2[new].sum()),
            )
        )
        seen |= shown
    return seen, tuple(stations)
