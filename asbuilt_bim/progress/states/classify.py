"""Each design face after a visit: what of it is built, what is open, and what is unknown."""

from collections.abc import Collection

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.match.result import FaceMatch, MatchResult
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.decide import decide_element
from asbuilt_bim.progress.states.evidence import view_of
from asbuilt_bim.progress.states.learn_colour import visit_colours
from asbuilt_bim.progress.surface import SurfaceState, knows_anything, unseen


def classify_surface(
    matched: MatchResult,
    design: BimModel,
    history: VisitHistory,
    options: ProgressOptions,
    displaced: Collection[str] = (),
) -> tuple[SurfaceState, ...]:
    """Say of each design face what of its exposed surface is built, what is open, and what is unknown.

    What an earlier visit saw built stays built. What it saw open, and this visit doesn't see, is unknown: it may have
    been built since. Of `displaced` elements, by GlobalId, nothing is known: their own place says nothing of them.
    """
    colours = visit_colours(matched, options)
    views = [view_of(placed, colours.get(placed.pose.station)) for placed in matched.stations]
    by_face: dict[str, list[FaceMatch]] = {}
    for match in matched.matches:
        by_face.setdefault(match.design_face, []).append(match)
    unobserved = set(matched.unobserved)
    states: list[SurfaceState] = []
    for element in design.elements:
        earlier = [history.earlier(element.global_id, face, options) for face in element.faces]
        if element.global_id in displaced:
            states.extend(unseen(face) for face in element.faces)
            continue
        if all(face.face_id in unobserved for face in element.faces) and not any(map(knows_anything, earlier)):
            states.extend(unseen(face, again=any(earlier)) for face in element.faces)
            continue
        states.extend(decide_element(element, views, by_face, earlier, options))
    return tuple(states)
