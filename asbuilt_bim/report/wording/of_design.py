"""Words for measured faces that fit no design face, and for a survey that lies beside the design."""

import math

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

LEAST_TURN_DEG, LEAST_MOVE_M = 0.1, 0.005  # less isn't worth a word
_NEAREST = "fits no design face; the nearest, of {nearest}: it "
_SURVEY = (
    "check the survey's control points, origin, north and height, and whether a revision has moved the building in the "
    "IFC file, before anyone is paid by these numbers"
)
_SITES = "check that photos, survey and IFC file are of one site; what was counted as built is something else"


def _shifted(values: Values) -> Words:
    return Words(
        reason=f"all measured faces are off the design by the same move: {_move(values)}; "
        + fill("{fits} of {faces} faces fit when moved back, {fits_unmoved} as they are", values),
        remedy=_SURVEY,
    )


def _shifted_in_height(values: Values) -> Words:
    return Words(
        reason=f"all measured faces are off the design by the same move: {_move(values)}; "
        + fill("{more} more tops and bottoms of faces fit when moved back", values),
        remedy=_SURVEY,
    )


def _move(values: Values) -> str:
    turn = math.degrees(float(str(values["turn_rad"])))
    moves = {axis: float(str(values[f"move_{axis}_m"])) for axis in "xyz"}
    by = ", ".join(f"{move:+.2f} m in {axis}" for axis, move in moves.items() if abs(move) >= LEAST_MOVE_M)
    turned = [f"turned by {turn:+.1f} deg (counter-clockwise, seen from above)"] if abs(turn) >= LEAST_TURN_DEG else []
    return " and ".join([*turned, *([f"by {by}"] if by else [])])


DESIGN: Table = {
    Reason.FACE_WITHOUT_DESIGN: Words(reason="no design face in view has its shape and direction"),
    Reason.FACE_TURNED: Words(
        reason=f"{_NEAREST}is turned against it", value="{angle_rad:.0fdeg}", limit="{limit_rad:.0fdeg}"
    ),
    Reason.FACE_APART: Words(reason=f"{_NEAREST}doesn't overlap it", value="{overlap_m2:m2}", limit="{limit_m2:m2}"),
    Reason.FACE_OF_OTHER_RADIUS: Words(
        reason=f"{_NEAREST}has another radius", value="{off_share:.0%} off", limit="{limit_share:.0%}"
    ),
    Reason.FACE_BEFORE: Words(reason=f"{_NEAREST}stands before it", value="{offset_m:.2f} m", limit="{limit_m:.2f} m"),
    Reason.FACE_BEHIND: Words(reason=f"{_NEAREST}lies behind it", value="{offset_m:.2f} m", limit="{limit_m:.2f} m"),
    Reason.FACE_PAST_DESIGN: Words(
        reason="matched, but {past_m2:m2} of its {area_m2:m2} lie on no design face",
        remedy="look at its outline in the overlay",
    ),
    Reason.SURVEY_SHIFTED: _shifted,
    Reason.SURVEY_SHIFTED_IN_HEIGHT: _shifted_in_height,
    Reason.DESIGN_UNLIKE: Words(reason="none of {faces} measured faces fits the design", remedy=_SITES),
    Reason.DESIGN_HARDLY_ALIKE: Words(
        reason="only {fits} of {faces} measured plane faces fit the design", remedy=_SITES
    ),
}
