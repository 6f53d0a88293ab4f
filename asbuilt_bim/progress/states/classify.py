"""Each design face after a visit: what of it is built, what is open, and what is unknown."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.decide import decide_element
from asbuilt_bim.progress.states.evidence import StationView
from asbuilt_bim.progress.states.learn_colour import visit_colours
from asbuilt_bim.progress.states.votes import gather
from asbuilt_bim.progress.surface import SurfaceState, knows_anything, unseen
from asbuilt_bim.register.scale import ScaleDoubt
from asbuilt_bim.scale.share import Share, in_turn

TOGETHER = 64
"""Elements for which a station's pictures are opened once: a storey's part, whose samples take some 20 MB."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Question:
    """An element by its number in the design, and what earlier visits made of each of its faces."""

    number: int
    element: BimElement
    earlier: Sequence[SurfaceState | None]


def classify_surface(
    matched: MatchResult,
    design: BimModel,
    history: VisitHistory,
    options: ProgressOptions,
    displaced: Collection[str] = (),
    share: Share = in_turn,
    doubt: ScaleDoubt | None = None,
) -> tuple[SurfaceState, ...]:
    """Say of each design face what of its exposed surface is built, what is open, and what is unknown.

    What an earlier visit saw built stays built. What it saw open, and this visit doesn't see, is unknown: it may have
    been built since. Of `displaced` elements, by GlobalId, nothing is known: their own place says nothing of them. The
    others are decided each on its own, in as many processes as `share` has. With a `doubt` of lengths each state holds
    how far its borders may lie elsewhere.
    """
    unobserved = set(matched.unobserved)
    states: list[list[SurfaceState]] = []
    asked: list[_Question] = []
    for number, element in enumerate(design.elements):
        earlier = [history.earlier(element.global_id, face, options) for face in element.faces]
        states.append([])
        if element.global_id in displaced:
            states[-1] = [unseen(face) for face in element.faces]
        elif all(face.face_id in unobserved for face in element.faces) and not any(map(knows_anything, earlier)):
            states[-1] = [unseen(face, again=any(earlier)) for face in element.faces]
        else:
            asked.append(_Question(number=number, element=element, earlier=earlier))
    for one, decided in zip(asked, _decided(asked, matched, options, share, doubt), strict=True):
        states[one.number] = decided
    return tuple(state for of_element in states for state in of_element)


def _decided(
    asked: Sequence[_Question],
    matched: MatchResult,
    options: ProgressOptions,
    share: Share,
    doubt: ScaleDoubt | None,
) -> Sequence[list[SurfaceState]]:
    colours = visit_colours(matched, options, share)
    views = [
        StationView(placed=placed, colour=colours.get(placed.pose.station), doubt=doubt) for placed in matched.stations
    ]
    by_face: dict[str, list[FaceMatch]] = {}
    for match in matched.matches:
        by_face.setdefault(match.design_face, []).append(match)
    return share(partial(_decide, views, by_face, options, doubt), asked)


def _decide(
    views: Sequence[StationView],
    by_face: Mapping[str, Sequence[FaceMatch]],
    options: ProgressOptions,
    doubt: ScaleDoubt | None,
    asked: Sequence[_Question],
) -> list[list[SurfaceState]]:
    """Decide elements, a few at a time; named in the module, so that a process can be given it."""
    states: list[list[SurfaceState]] = []
    for start in range(0, len(asked), TOGETHER):
        some = asked[start : start + TOGETHER]
        votes = gather([one.element for one in some], views, by_face, options)
        states += [
            decide_element(one.element, own, by_face, one.earlier, options, doubt)
            for one, own in zip(some, votes, strict=True)
        ]
    return states
