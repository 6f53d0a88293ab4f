"""Whether a station's scale can be trusted: by the target, or by markers seen in both photos."""

from __future__ import annotations

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.vision.markers.find import MarkerSighting
from asbuilt_bim.vision.target.find import TargetSighting


def without_scale(
    name: str,
    target: TargetSighting | None,
    reasons: tuple[Rejection, ...],
    markers: tuple[MarkerSighting, ...],
    *,
    required: bool,
    least: int,
) -> tuple[Rejection, ...]:
    """Return why a station without a target can't be used; empty where it can: `least` markers hold the scale too."""
    if target is not None:
        return ()
    if required:
        it = Subject(kind=SubjectKind.TARGET, station=name)
        return reasons or (Rejection(code=Reason.TARGET_ABSENT, subject=it),)
    both = sum(1 for marker in markers if marker.right_px is not None)
    if both >= least:
        return ()
    few = Rejection(
        code=Reason.SCALE_UNCHECKED,
        subject=Subject(kind=SubjectKind.STATION, name=name),
        values={"found": both, "needed": least},
    )
    return (*reasons, few)
