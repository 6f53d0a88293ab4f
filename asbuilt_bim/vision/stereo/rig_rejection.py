"""What a verdict of the rig leaves out, or warns of: the turn, its sigma and what it costs, as values of a code."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.calibration.area_effect import DISTANCE_M
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.vision.stereo.rig_health import AREA_LIMIT, ROWS_LIMIT_PX, SIGNIFICANT, RigVerdict

RIG = about(SubjectKind.RIG)


def rig_rejection(
    code: Reason, subject: Subject, verdict: RigVerdict, stations: Sequence[str] = (), *, refined: bool = False
) -> Rejection:
    """Return what a verdict means for `subject`: it can't be measured with this rig, or is in doubt.

    `stations` are those that the rig is spoken of at, in their order; `refined`: of the rig as their photos show it.
    """
    values = turn_values(verdict) | {
        "area_effect": verdict.area_effect,
        "area_sigma": verdict.area_sigma,
        "area_distance_m": DISTANCE_M,
        "rows_px": verdict.rows_px,
        "matches": verdict.matches,
        "limit_share": AREA_LIMIT,
        "limit_px": ROWS_LIMIT_PX,
        "stations": tuple(stations),
        "refined": refined,
        "by_area": bool(abs(verdict.area_effect) > max(AREA_LIMIT, SIGNIFICANT * verdict.area_sigma)),
    }
    return rejected(code, subject, **values)


def rig_doubt(
    verdict: RigVerdict, stations: Sequence[str], rig: StereoRig, *, refined: bool = False
) -> Rejection | None:
    """Return the warning on a rig that was used all the same; None where it is sound, or knocked."""
    if verdict.state == "doubtful" and not refined:  # a refined rig has been moved to where its photos show it
        return rig_rejection(Reason.RIG_MOVED, RIG, verdict, stations)
    if verdict.state == "undetermined":
        found = rig_rejection(Reason.RIG_UNDETERMINED, RIG, verdict, stations, refined=refined)
        return replace(found, values={**found.values, "lens_known": bool(rig.covariance.any())})
    return None


def turn_values(verdict: RigVerdict) -> dict[str, Value]:
    """Return the right camera's turn about x, y and z with its sigmas."""
    sigma = np.sqrt(np.diag(verdict.covariance)[:3])
    return {
        "turn_rad": tuple(float(angle) for angle in verdict.correction_rad[:3]),
        "turn_sigma_rad": tuple(float(one) for one in sigma),
    }
