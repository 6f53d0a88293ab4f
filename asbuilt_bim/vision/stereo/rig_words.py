"""What is said of a rig that no longer stands as it was calibrated: the turn, its sigma, what it costs, what to do."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M
from asbuilt_bim.errors import Rejection
from asbuilt_bim.vision.stereo.rig_health import AREA_LIMIT, ROWS_LIMIT_PX, SIGNIFICANT, RigVerdict

BEYOND_MEANING = 1.0
"""An area that errs by as much as itself: what is told of its error no longer says anything."""
RECALIBRATE = (
    "see that both photos are of one moment and calibrate the rig again, boards in every corner of the frame, or pass "
    "--refine-rig (the baseline's length stays)"
)


def turn_in_words(verdict: RigVerdict) -> str:
    """Return the right camera's turn with its sigma: `pitch +0.00, yaw +0.20, roll -0.01 degrees (each +- 0.01)`."""
    turn = np.rad2deg(verdict.correction_rad[:3])
    sigma = np.rad2deg(np.sqrt(np.diag(verdict.covariance)[:3]))
    parts = [
        f"{name} {angle:+.3f}° ± {open_:.3f}°"
        for name, angle, open_ in zip(("pitch", "yaw", "roll"), turn, sigma, strict=True)
    ]
    return ", ".join(parts)


def effect_in_words(verdict: RigVerdict) -> str:
    """Return what the turn does: `an area at 5 m comes out +17.8 % ± 0.8 % wrong, rows lie 0.2 px apart`."""
    rows = f"rows lie {verdict.rows_px:.1f} px apart"
    if not abs(verdict.area_effect) < BEYOND_MEANING:
        return f"an area could come out as anything: these photos and this rig don't belong together, {rows}"
    return (
        f"an area at {DISTANCE_M:g} m comes out {100 * verdict.area_effect:+.1f} % ± "
        f"{100 * verdict.area_sigma:.1f} % wrong, {rows}"
    )


def _percent(effect: float) -> str:
    return f"{100 * effect:+.1f} %" if abs(effect) < BEYOND_MEANING else f"over {100 * BEYOND_MEANING:.0f} %"


def knock_rejection(what: str, verdict: RigVerdict) -> Rejection:
    """Return why nothing that `what` names can be measured with this rig."""
    by_area = abs(verdict.area_effect) > max(AREA_LIMIT, SIGNIFICANT * verdict.area_sigma)
    by_rows = verdict.rows_px > ROWS_LIMIT_PX and not by_area
    return Rejection(
        what=what,
        reason=f"the rig was knocked since its calibration: its right camera is turned by {turn_in_words(verdict)}; "
        f"{effect_in_words(verdict)}",
        value=f"{verdict.rows_px:.1f} px" if by_rows else _percent(verdict.area_effect),
        limit=f"{ROWS_LIMIT_PX:g} px" if by_rows else f"{100 * AREA_LIMIT:g} %",
        remedy=RECALIBRATE,
    )


def refined_note(what: str, verdict: RigVerdict) -> Rejection:
    """Return what is said of a rig that was measured with as its photos show it."""
    return Rejection(
        what=what,
        reason=f"refined from {verdict.matches} matches: {turn_in_words(verdict)}; unrefined, "
        f"{effect_in_words(verdict)}",
    )


def doubt_rejection(what: str, verdict: RigVerdict) -> Rejection:
    """Return the warning for a rig that has moved, by less than the limit."""
    return Rejection(
        what=what,
        reason=f"the rig has moved a little since its calibration (it was measured with it all the same): its right "
        f"camera is turned by {turn_in_words(verdict)}; {effect_in_words(verdict)}",
        value=_percent(verdict.area_effect),
        limit=f"{100 * AREA_LIMIT:g} %",
        remedy=RECALIBRATE,
    )


def undetermined_rejection(what: str, verdict: RigVerdict) -> Rejection:
    """Return the warning where the matches leave the rig's turn open."""
    return Rejection(
        what=what,
        reason=f"the photos say too little of how the rig stands (it was measured with it all the same): by "
        f"{verdict.matches} matches {effect_in_words(verdict)}; that leaves it open by",
        value=f"{100 * verdict.area_sigma:.1f} %",
        limit=f"{100 * AREA_LIMIT:g} %",
        remedy="take stations with near and far things all over the frame; a rig file of another program doesn't say "
        "how well its lenses are known: calibrate the rig with asbuilt-bim calibrate",
    )
