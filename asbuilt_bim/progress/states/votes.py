"""What every station says of every sample of an element's surface, put together: log-odds of built against open."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.cells import CellSamples, cell_samples
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.match.result import FaceMatch
from asbuilt_bim.match.score import WorldFace, in_world
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
from asbuilt_bim.progress.states.features import shown
from asbuilt_bim.progress.states.likelihood import decided, log_odds, no_surer_than_learned
from asbuilt_bim.progress.states.outlines import Covered, before_ends, covered, marked, may_be_concrete, stands_off
from asbuilt_bim.progress.states.sample_grid import patches

NEARLY_M = 1e-3
"""What is no further off than this past a station's reach is asked sample by sample: a box is rounded, too."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Votes:
    """Which of an element's samples (N,) are built, and which open; who decided what (station -> bool (N,))."""

    built: BoolArray
    open: BoolArray
    log_odds: FloatArray  # (N,) of all stations together that it is built; 0 of what none shows
    contradicted: BoolArray  # one station alone would call it built, and another one open
    decided_by: dict[str, BoolArray]
    before: BoolArray  # something stands before it, at one station at least
    spoken: tuple[FaceMatch, ...]  # the matches that were taken for concrete
    other_colour: Mapping[str, FaceTint]  # faces of another colour than concrete's, by id: counted, or left out for it


@dataclass(slots=True, kw_only=True, eq=False)
class _Asked:
    """What the stations so far say of one element, each for itself, in their order."""

    element: BimElement
    samples: CellSamples
    other: OtherColour | None
    odds: dict[str, FloatArray]
    before: BoolArray
    covered: list[tuple[Covered, float]]  # with the share of its samples that hasn't the colour of concrete
    tints: dict[str, FaceTint]

    def votes(self, options: ProgressOptions) -> Votes:
        """Put what they say together: what each is likely for adds up, since each looks from a place of its own."""
        total = np.sum([np.zeros(len(self.before)), *self.odds.values()], axis=0)
        built, opened = decided(total)
        label = patches(self.samples, opened)  # of bare paint stereo mistakes small pieces, and is sure of them
        opened &= np.bincount(label, weights=self.samples.area_m2)[label] >= options.min_face_m2
        alone = [decided(odds) for odds in self.odds.values()]
        contradicted = [np.any([one[kind] for one in alone], axis=0) for kind in (0, 1)] if alone else [built, opened]
        known, mean = built | opened, total / max(len(self.odds), 1)
        by = {name: known & (odds * np.sign(total) >= np.abs(mean)) for name, odds in self.odds.items()}
        spoken = tuple(face.match for face, _ in self.covered if np.mean(built[face.samples]) > 0.5)
        left_out = {
            face.match.face_id
            for face, tinted in self.covered
            if face.match not in spoken and tinted > options.tinted_share
        }
        counted = {match.face_id for match in spoken} & (self.other.faces.keys() if self.other else set())
        return Votes(
            built=built,
            open=opened,
            log_odds=no_surer_than_learned(total),
            contradicted=contradicted[0] & contradicted[1],
            decided_by={name: own for name, own in by.items() if own.any()},
            before=self.before,
            spoken=spoken,
            other_colour={name: tint for name, tint in self.tints.items() if name in left_out | counted},
        )


def gather(
    elements: Sequence[BimElement],
    views: Sequence[StationView],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> list[Votes]:
    """Ask every station about every sample of some elements; a station's pictures are opened once for all of them."""
    colours = {view.pose.station: view.colour for view in views if view.colour is not None}
    asked = [_nothing_yet(element, colours, by_face, options) for element in elements]
    matched = {match.face_id for matches in by_face.values() for match in matches}
    for view in views:
        faces = view.placed.measurement.faces
        unmatched = [in_world(face, view.pose) for face in faces if face.face_id not in matched]
        for one in asked:
            samples = one.samples
            seen = faced(view, samples.points_m, samples.normals, options) if _in_reach(view, one, options) else None
            if seen is not None and len(seen.asked):  # of what it doesn't face a station says nothing
                _ask(open_view(view), seen, one, by_face, unmatched, options)
    return [one.votes(options) for one in asked]


def _nothing_yet(
    element: BimElement,
    colours: Mapping[str, ConcreteColour],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
) -> _Asked:
    samples = cell_samples(element, options.spacing_m)
    matches = [match for face in element.faces for match in by_face.get(face.face_id, ())]
    return _Asked(
        element=element, samples=samples, other=weigh_colour(matches, colours, options), odds={},
        before=np.zeros(len(samples.points_m), dtype=bool), covered=[], tints={},
    )  # fmt: skip


def _in_reach(view: StationView, one: _Asked, options: ProgressOptions) -> bool:
    """Say whether the box round an element's samples is as near a station as it sees: most of a building isn't."""
    points = one.samples.points_m
    if not len(points):
        return False
    eye = view.pose.world_from_left[:3, 3]
    off = np.maximum(np.maximum(points.min(axis=0) - eye, eye - points.max(axis=0)), 0.0)
    return float(off @ off) <= (options.max_distance_m + NEARLY_M) ** 2


def _ask(
    view: OpenView,
    seen: Faced,
    one: _Asked,
    by_face: Mapping[str, Sequence[FaceMatch]],
    unmatched: Sequence[WorldFace],
    options: ProgressOptions,
) -> None:
    """Ask one station, and keep what it says."""
    samples, other, station = one.samples, one.other, view.pose.station
    tints = other.tints if other is not None and other.believed else NO_TINTS
    evidence = judge(view, samples.points_m, samples.normals, seen, options, tints)
    end = (evidence.verdict == Verdict.NEAR) & before_ends(one.element, samples, seen.asked, unmatched)
    evidence = replace(evidence, verdict=np.where(end, np.uint8(Verdict.NOT_MEASURED), evidence.verdict))
    matched = covered(one.element, samples, station, by_face)
    own = [face for face in matched if may_be_concrete(face.match, options) and len(face.samples)]
    count = len(samples.face)
    off = marked((face for face in matched if face.flat and stands_off(face.match, options)), count)
    asked = np.zeros(count, dtype=bool)
    asked[seen.asked] = True
    height_m = samples.points_m[:, 2] - one.element.vertices_m[:, 2].min(initial=np.inf)
    eye_m = view.pose.world_from_left[:3, 3]
    of_all = shown(station, eye_m, samples, evidence, asked, marked(own, count), off, height_m, options)
    one.odds[station] = log_odds(of_all)
    one.before |= (evidence.verdict == Verdict.BEFORE) | ((evidence.verdict == Verdict.NEAR) & evidence.tinted)
    kept = [(face, float(np.mean(evidence.tinted[face.samples]))) for face in own]
    one.covered += kept
    told = {face.match.face_id for face, share in kept if share > options.tinted_share}
    one.tints |= _tints(view, told | (other.faces.keys() if other else set()))


def _tints(view: OpenView, ids: Collection[str]) -> dict[str, FaceTint]:
    """Return the tints of some of a station's faces, by their id, with the share of each that isn't concrete's."""
    if view.colour is None or view.picture is None:
        return {}
    tints, palette = view.colour.faces, view.colour.palette
    known = [face for face in view.faces if face.face_id in ids and face.face_id in tints]
    return {
        face.face_id: FaceTint(tint=tints[face.face_id], other_share=view.picture.other_share(palette, face))
        for face in sorted(known, key=lambda face: face.face_id)
    }
