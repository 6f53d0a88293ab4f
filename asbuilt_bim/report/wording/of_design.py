"""Words for measured faces that fit no design face, and for a survey that lies beside the design."""

import math
from collections.abc import Sequence
from dataclasses import replace

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

MOST_NAMED = 5
LEAST_TURN_DEG, LEAST_MOVE_M = 0.1, 0.005  # less isn't worth a word
_NEAREST = "fits no design face; the nearest, of {nearest}: it "
_GIVEN = "the places that are given"
_GIVEN_WRONG = "correct near, poses or control_points in the project file, the storey too: this visit decides nothing"
_SURVEY = (
    "check the survey's control points, origin, north and height, and whether a revision has moved the building in the "
    "IFC file: this visit decides nothing"
)
_SITES = "check that photos, survey and IFC file are of one site; this visit decides nothing"


def _by_places(words: Words, values: Values) -> Words:
    """Return the words where no survey places the visit: its places are given, in words or in numbers."""
    return replace(words, what=_GIVEN, part=_GIVEN, remedy=_GIVEN_WRONG) if values.get("given") else words


def _shifted(values: Values) -> Words:
    words = Words(
        reason=f"all measured faces are off the design by the same move: {_move(values)}; "
        + fill("{fits} of {faces} faces fit when moved back, {fits_unmoved} as they are", values),
        remedy=_SURVEY + _accept(values),
    )
    return _by_places(words, values)


def _shifted_in_height(values: Values) -> Words:
    words = Words(
        reason=f"all measured faces are off the design by the same move: {_move(values)}; "
        + fill("{more} more tops and bottoms of faces fit when moved back", values),
        remedy=_SURVEY + _accept(values),
    )
    return _by_places(words, values)


def _accept(values: Values) -> str:
    """Return what those write into the project file who have looked and let the shift stand."""
    if "scale_share" in values:
        return ". Clear the rig's scale first: a wrong one moves all faces, too"
    if "about_x_m" not in values:  # in results of before
        return ""
    moves = (round(float(str(values[f"move_{axis}_m"])), 3) + 0.0 for axis in "xyz")  # no -0.000
    keys = [f"move_m: [{', '.join(f'{move:.3f}' for move in moves)}]"]
    turn_deg = math.degrees(float(str(values["turn_rad"])))
    if turn_deg:
        keys += [f"turn_deg: {turn_deg:.3f}", fill("about_m: [{about_x_m:.2f}, {about_y_m:.2f}]", values)]
    return f". To accept the shift, write accept_survey_shift with {', '.join(keys)}"


def _contradict(values: Values) -> Words:
    others = values["others"]
    days = ", ".join(str(day) for day in others) if isinstance(others, tuple) else ""
    count, named = _elements(values)
    return Words(
        reason=f"it and the visit of {days} contradict each other: the earlier saw {count} elements built that look "
        f"open at the later: {named}. Concrete doesn't vanish, so their photos may be exchanged",
        remedy="correct the dates (where dates: exif tells them, list the visits, each with its date), or copy the "
        "photos again: until then neither decides anything",
    )


def _elements(values: Values) -> tuple[int, str]:
    """Return how many elements are named, and the first few of their names."""
    elements = values["elements"]
    names = [str(name) for name in elements] if isinstance(elements, tuple) else []
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return len(names), f"{', '.join(names[:MOST_NAMED])}{more}"


def _undoes(values: Values) -> Words:
    count, named = _elements(values)
    return Words(
        reason=f"{count} elements look open that earlier visits saw built: {named}; only {values['risen']} have risen",
        remedy="check whether visits were exchanged, and whether the survey and the IFC file are of this site: this "
        "visit decides nothing",
    )


def _move(values: Values) -> str:
    move_m = [float(str(values[f"move_{axis}_m"])) for axis in "xyz"]
    return shift_words(move_m, float(str(values["turn_rad"])))


def _accepted_other(values: Values) -> Words:
    return Words(
        reason=f"another shift is accepted in the project file: {accepted_words(values)}",
        remedy="correct accept_survey_shift, or take it out",
    )


def accepted_words(values: Values) -> str:
    """Return an accepted shift as people say it."""
    move_m = values["move_m"]
    assert isinstance(move_m, tuple)
    return shift_words([float(part) for part in move_m], float(str(values["turned_rad"])))


def shift_words(move_m: Sequence[float], turn_rad: float) -> str:
    """Return a shift as people say it: `by +0.20 m in x`, with its turn before it."""
    turn = math.degrees(turn_rad)
    moves = zip("xyz", move_m, strict=True)
    by = ", ".join(f"{move:+.2f} m in {axis}" for axis, move in moves if abs(move) >= LEAST_MOVE_M)
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
    Reason.SHIFT_OTHER_THAN_ACCEPTED: _accepted_other,
    Reason.VISIT_UNDOES: _undoes,
    Reason.VISITS_CONTRADICT: _contradict,
    Reason.DESIGN_UNLIKE: Words(reason="none of {faces} measured faces fits the design", remedy=_SITES),
    Reason.DESIGN_HARDLY_ALIKE: Words(
        reason="only {fits} of {faces} measured plane faces fit the design", remedy=_SITES
    ),
}
