"""What every station says of every sample of an element's surface, put together: weights for built and for open."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.belief import OtherColour, weigh_colour
from asbuilt_bim.progress.states.colour import FaceTint
from asbuilt_bim.progress.states.evidence import NO_TINTS, StationView, Verdict, judge
from asbuilt_bim.progress.states.outlines import Speaking, outlined_samples, speaking, standing_off
from asbuilt_bim.progress.states.trust import WIDER_THAN_A_BAR, WIDER_THAN_A_COLUMN, large_enough, seen_through, trusted

SECOND_LOOK = 0.3
"""What is only seen open past bars counts less than what another station sees built, plainly and without bars."""
OVERRULES = 10.0
"""Times the weight: what is seen from a third of the distance. Less is a conflict, and a person is to look."""


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
    """What one station says: weights (N,) for built, for built by a measured outline, and for open; what is hidden."""

    built: FloatArray
    firm: FloatArray
    open: FloatArray
    hidden: BoolArray
    spoken: tuple[FaceMatch, ...]
    tinted: Mapping[str, FaceTint]


def gather(
    element: BimElement,
    samples: CellSamples,
    views: Sequence[StationView],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> Votes:
    """Ask every station about every sample; a side that is measured to be built overrules one hardly seen open."""
    nothing = np.zeros(len(samples.points_m))
    colours = {view.pose.station: view.colour for view in views if view.colour is not None}
    own = [match for face in element.faces for match in by_face.get(face.face_id, ())]
    other = weigh_colour(own, colours, options)
    tints = other.tints if other is not None and other.believed else NO_TINTS
    by_station = {view.pose.station: _asked(view, element, samples, by_face, tints, options) for view in views}
    built = sum((one.built for one in by_station.values()), nothing)
    firm = sum((one.firm for one in by_station.values()), nothing)
    opened = sum((one.open for one in by_station.values()), nothing)
    decided_by = {station: (one.built > 0.0) | (one.open > 0.0) for station, one in by_station.items()}
    return Votes(
        built=built,
        open=np.where(mistaken(samples, firm, opened), 0.0, opened),
        decided_by={station: decided for station, decided in decided_by.items() if decided.any()},
        before=np.any([nothing > 0.0, *(one.hidden for one in by_station.values())], axis=0),
        spoken=tuple(match for one in by_station.values() for match in one.spoken),
        other_colour=_other_colour(by_station.values(), other),
    )


def _asked(
    view: StationView,
    element: BimElement,
    samples: CellSamples,
    by_face: Mapping[str, Sequence[FaceMatch]],
    tints: FloatArray,
    options: ProgressOptions,
) -> _StationVotes:
    """Ask one station; a matched outline counts for its samples where depth doesn't contradict.

    Depth alone says that something is there, not that it is concrete. It counts where a measured face of this element
    backs it, or where it covers a patch too large for starter bars and clutter.
    """
    station = view.pose.station
    height = samples.points_m[:, 2] - element.vertices_m[:, 2].min(initial=np.inf)
    least_wide = WIDER_THAN_A_COLUMN if element.kind == "wall" else WIDER_THAN_A_BAR
    evidence = judge(view, samples.points_m, samples.normals, options, tints)
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
    weight = 1.0 / np.maximum(np.where(outlined, np.fmin(sigma, evidence.sigma_m), evidence.sigma_m), 1e-3) ** 2
    return _StationVotes(
        built=np.where(there, weight, 0.0),
        firm=np.where(there & outlined, weight, 0.0),
        open=np.where(behind, np.where(evidence.own == Verdict.BEHIND, 1.0, SECOND_LOOK) * weight, 0.0),
        hidden=hidden,
        spoken=tuple(match for match, covered in speak.matches if there[covered].any()),
        tinted=_tinted(view, speak),
    )


def _tinted(view: StationView, speak: Speaking) -> dict[str, FaceTint]:
    """Return a station's faces that were left out for their colour alone, by their id."""
    faces = view.colour.faces if view.colour is not None else {}
    known = {face_id: share for face_id, share in speak.tinted.items() if face_id in faces}
    return {face_id: replace(faces[face_id], other_share=share) for face_id, share in known.items()}


def _other_colour(stations: Iterable[_StationVotes], other: OtherColour | None) -> dict[str, FaceTint]:
    """Return the faces of another colour than concrete's, by id: those left out, and those counted all the same."""
    found: dict[str, FaceTint] = {}
    for one in stations:
        counted = {match.face_id for match in one.spoken}
        found |= {face_id: face for face_id, face in (other.faces if other else {}).items() if face_id in counted}
        found |= one.tinted
    return found


def mistaken(samples: CellSamples, firm: FloatArray, opened: FloatArray) -> BoolArray:
    """Say which samples (N,) are seen open while other faces of their cell are measured to be built.

    `firm` (N,) is the weight of built by measured outlines alone, `opened` that of open, both 1 / m2. A column stands
    on all of its sides or on none: past bars and rails from far off, stereo finds now and then what lies beyond it.
    """
    if not (firm.any() and opened.any()):
        return np.zeros(len(opened), dtype=bool)
    shape = (int(samples.face.max()) + 1, int(samples.cell.max()) + 1)
    by_side = [np.zeros(shape) for _ in range(2)]
    for weights, sums in zip((firm, opened), by_side, strict=True):
        np.add.at(sums, (samples.face, samples.cell), weights)
    standing, seen_open = by_side
    elsewhere = standing.sum(axis=0) - standing
    outweighed = elsewhere >= OVERRULES * seen_open.sum(axis=0)
    overruled: BoolArray = (opened > 0.0) & outweighed[samples.face, samples.cell]
    return overruled
