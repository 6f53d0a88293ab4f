"""What every station says of every sample of an element's surface, put together: weights for built and for open."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.cells import CellSamples, cell_samples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.belief import OtherColour, weigh_colour
from asbuilt_bim.progress.states.colour import ConcreteColour, FaceTint
from asbuilt_bim.progress.states.evidence import (
    NO_TINTS,
    Faced,
    OpenView,
    StationView,
    Verdict,
    faced,
    judge,
    open_view,
)
from asbuilt_bim.progress.states.outlines import Speaking, outlined_samples, speaking, standing_off
from asbuilt_bim.progress.states.trust import WIDER_THAN_A_BAR, WIDER_THAN_A_COLUMN, large_enough, seen_through, trusted

SECOND_LOOK = 0.3
"""What is only seen open past bars counts less than what another station sees built, plainly and without bars."""
NEARLY_M = 1e-3
"""What is no further off than this past a station's reach is asked sample by sample: a box is rounded, too."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Votes:
    """Weights (N,) for built and for open of an element's samples, and who decided what (station -> bool (N,))."""

    built: FloatArray
    open: FloatArray
    decided_by: dict[str, BoolArray]
    before: BoolArray  # something stands before it, at one station at least
    spoken: tuple[FaceMatch, ...]  # the matches that were taken for concrete
    other_colour: Mapping[str, FaceTint]  # faces of another colour than concrete's, by id: counted, or left out for it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _StationVotes:
    """What one station says: weights (N,) for built and for open; what is hidden."""

    built: FloatArray
    open: FloatArray
    hidden: BoolArray
    spoken: tuple[FaceMatch, ...]
    tinted: Mapping[str, FaceTint]


@dataclass(slots=True, kw_only=True, eq=False)
class _Sums:
    """What the stations so far say of one element, added up in their order."""

    element: BimElement
    samples: CellSamples
    other: OtherColour | None
    built: FloatArray
    open: FloatArray
    before: BoolArray
    decided_by: dict[str, BoolArray]
    spoken: list[FaceMatch]
    other_colour: dict[str, FaceTint]

    def add(self, station: str, one: _StationVotes) -> None:
        """Add what one more station says."""
        self.built += one.built
        self.open += one.open
        self.before |= one.hidden
        decided = (one.built > 0.0) | (one.open > 0.0)
        if decided.any():
            self.decided_by[station] = decided
        self.spoken += one.spoken
        self.other_colour |= one.tinted


def gather(
    elements: Sequence[BimElement],
    views: Sequence[StationView],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> list[Votes]:
    """Ask every station about every sample of some elements; a station's pictures are opened once for all of them."""
    colours = {view.pose.station: view.colour for view in views if view.colour is not None}
    sums = [_nothing_yet(element, colours, by_face, options) for element in elements]
    for view in views:
        for one in sums:
            samples = one.samples
            seen = faced(view, samples.points_m, samples.normals, options) if _in_reach(view, one, options) else None
            if seen is not None and len(seen.asked):  # of what it doesn't face a station says nothing
                one.add(view.pose.station, _asked(open_view(view), seen, one, by_face, options))
    return [
        Votes(
            built=one.built,
            open=one.open,
            decided_by=one.decided_by,
            before=one.before,
            spoken=tuple(one.spoken),
            other_colour=one.other_colour,
        )
        for one in sums
    ]


def _nothing_yet(
    element: BimElement,
    colours: Mapping[str, ConcreteColour],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> _Sums:
    samples = cell_samples(element, options.spacing_m)
    built, opened = (np.zeros(len(samples.points_m)) for _ in range(2))
    matches = [match for face in element.faces for match in by_face.get(face.face_id, ())]
    return _Sums(
        element=element, samples=samples, other=weigh_colour(matches, colours, options), built=built,
        open=opened, before=np.zeros(len(built), dtype=bool), decided_by={}, spoken=[], other_colour={},
    )  # fmt: skip


def _in_reach(view: StationView, one: _Sums, options: ProgressOptions) -> bool:
    """Say whether the box round an element's samples is as near a station as it sees: most of a building isn't."""
    points = one.samples.points_m
    if not len(points):
        return False
    eye = view.pose.world_from_left[:3, 3]
    off = np.maximum(np.maximum(points.min(axis=0) - eye, eye - points.max(axis=0)), 0.0)
    return float(off @ off) <= (options.max_distance_m + NEARLY_M) ** 2


def _asked(
    view: OpenView,
    seen: Faced,
    sums: _Sums,
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> _StationVotes:
    """Ask one station; a matched outline counts for its samples where depth doesn't contradict.

    Depth alone says that something is there, not that it is concrete. It counts where a measured face of this element
    backs it, or where it covers a patch too large for starter bars and clutter.
    """
    element, samples, other = sums.element, sums.samples, sums.other
    tints = other.tints if other is not None and other.believed else NO_TINTS
    station = view.pose.station
    height = samples.points_m[:, 2] - element.vertices_m[:, 2].min(initial=np.inf)
    least_wide = WIDER_THAN_A_COLUMN if element.kind == "wall" else WIDER_THAN_A_BAR
    evidence = judge(view, samples.points_m, samples.normals, seen, options, tints)
    speak = speaking(element, samples, station, evidence, by_face, options)
    outlined, sigma = outlined_samples(samples, speak.matches, evidence, options)
    near, before_it = trusted(samples, evidence, height, bool(outlined.any()), options, least_wide)
    near &= ~standing_off(element, samples, station, by_face, options)
    hidden = (evidence.verdict == Verdict.BEFORE) | (evidence.verdict == Verdict.OTHER) | before_it
    behind = evidence.verdict == Verdict.BEHIND
    behind |= seen_through(samples, evidence, outlined | near, options) | evidence.through
    near, outlined = near & ~evidence.through, outlined & ~evidence.through
    passed = (evidence.own == Verdict.BEHIND) | evidence.surely_through
    bars = (passed | (evidence.own == Verdict.NEAR)) & ~(outlined | near | hidden)
    rails = hidden | (evidence.own == Verdict.BEFORE)
    behind = large_enough(samples, behind, passed, options.min_face_m2, bars, rails)
    there = near | (outlined & ~behind & ~hidden & ~evidence.tinted)
    spoken = tuple(match for match, covered in speak.matches if there[covered].any())
    weight = 1.0 / np.maximum(np.where(outlined, np.fmin(sigma, evidence.sigma_m), evidence.sigma_m), 1e-3) ** 2
    return _StationVotes(
        built=np.where(there, weight, 0.0),
        open=np.where(behind, np.where(evidence.own == Verdict.BEHIND, 1.0, SECOND_LOOK) * weight, 0.0),
        hidden=hidden,
        spoken=spoken,
        tinted=_counted_all_the_same(view, other, spoken) | _tinted(view, speak),
    )


def _tinted(view: OpenView, speak: Speaking) -> dict[str, FaceTint]:
    """Return a station's faces that were left out for their colour alone, by their id."""
    faces = view.colour.faces if view.colour is not None else {}
    known = {face_id: share for face_id, share in speak.tinted.items() if face_id in faces}
    return {face_id: FaceTint(tint=faces[face_id], other_share=share) for face_id, share in known.items()}


def _counted_all_the_same(
    view: OpenView, other: OtherColour | None, spoken: Sequence[FaceMatch]
) -> dict[str, FaceTint]:
    """Return a station's faces of another colour than concrete's that count as concrete where they lie, by their id."""
    counted = {match.face_id for match in spoken}
    of_other_colour = {face_id: tint for face_id, tint in (other.faces if other else {}).items() if face_id in counted}
    if not of_other_colour or view.colour is None or view.picture is None:
        return {}
    faces, palette = {face.face_id: face for face in view.faces}, view.colour.palette
    shares = {face_id: view.picture.other_share(palette, faces[face_id]) for face_id in of_other_colour}
    return {face_id: FaceTint(tint=tint, other_share=shares[face_id]) for face_id, tint in of_other_colour.items()}
