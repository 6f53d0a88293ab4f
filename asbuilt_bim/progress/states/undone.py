"""Does a visit undo what earlier ones saw built, on a broad front? Then its photos are older than theirs."""

from collections.abc import Mapping, Sequence
from datetime import date

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry import polygon
from asbuilt_bim.progress.history import VisitHistory
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.doubts import GONE_M2
from asbuilt_bim.progress.surface import SurfaceState

FEWEST_GONE = 3
"""Elements: now and then one wall is taken down again, and one is misread."""


def undone_front(
    surfaces: Sequence[SurfaceState], design: BimModel, history: VisitHistory, day: date, options: ProgressOptions
) -> tuple[Rejection, ...]:
    """Return one rejection, of the visit, where finished concrete would vanish on a broad front; empty where not.

    Sites grow. Of the elements that have changed since they were last seen nearly all have risen, where photos are in
    the order of their days. In the reverse order nearly all are gone. So the larger number tells the order.
    """
    if not history.visits:
        return ()
    states = {surface.face_id: surface for surface in surfaces}
    gone = [element for element in design.elements if _is_gone(element, states)]
    if len(gone) < FEWEST_GONE:
        return ()
    risen = sum(_has_risen(element, states, history, options) for element in design.elements)
    if len(gone) <= risen:
        return ()
    names = tuple(element.name or element.global_id for element in gone)
    ids = tuple(element.global_id for element in gone)
    subject = about(SubjectKind.VISIT, day.isoformat())
    return (rejected(Reason.VISIT_UNDOES, subject, elements=names, risen=risen, global_ids=ids),)


def _is_gone(element: BimElement, states: Mapping[str, SurfaceState]) -> bool:
    """Say whether a good piece of a side looks open that an earlier visit saw built."""
    return any(states[face.face_id].gone_area_m2 >= GONE_M2 for face in element.faces)


def _has_risen(
    element: BimElement, states: Mapping[str, SurfaceState], history: VisitHistory, options: ProgressOptions
) -> bool:
    """Say whether as good a piece is built now that was open when it was last seen."""
    for face in element.faces:
        was, built = history.earlier(element.global_id, face, options), states[face.face_id].built_uv_m
        if was is None or not built:
            continue
        if was.open_uv_m and polygon.area(polygon.intersection(was.open_uv_m, built)) >= GONE_M2:
            return True
    return False
