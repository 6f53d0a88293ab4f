"""Whether a station's scale can be trusted: by the target, or by markers seen in both photos."""

from __future__ import annotations

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
        return reasons or (Rejection(what=f"station {name}", reason="the target is not in view"),)
    both = sum(1 for marker in markers if marker.right_px is not None)
    if both >= least:
        return ()
    few = Rejection(
        what=f"station {name}", reason="neither the target nor enough markers in view of both photos",
        value=f"{both} markers", limit=f"{least} markers",
        remedy="place the red target, or move so that both photos show two surveyed markers",
    )  # fmt: skip
    return (*reasons, few)
