"""Words for markers, control points and poses: where a station stood."""

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill


def _too_few(values: Values) -> Words:
    more = "show more surveyed markers, spread over the frame"
    return Words(
        reason="too few surveyed markers in view",
        value=str(values["found"]),
        limit=f"at least {values['needed']}",
        remedy=more if values["any_read"] else f"where the photos do show some, check markers.family; else {more}",
    )


def _contradicts(what: str, remedy: str, values: Values) -> Words:
    return Words(
        reason=f"contradicts the other {what} and was left out",
        value=fill("{off_sigmas:.0f} sigma", values) if "off_sigmas" in values else "",
        limit=fill("{limit_sigmas:g} sigma", values),
        remedy=remedy,
    )


def _marker(values: Values) -> Words:
    return _contradicts("markers", "survey it again: it was moved, or its corners are mistaken", values)


def _control_point(values: Values) -> Words:
    return _contradicts("points", "click it again, or check its coordinates", values)


PLACES: Table = {
    Reason.MARKER_NOT_SURVEYED: Words(
        reason="the survey has no such marker", remedy="add its four corners to the survey, or take the print down"
    ),
    Reason.MARKER_CONTRADICTS: _marker,
    Reason.MARKER_FAR: Words(
        reason="its surveyed place is far from the building",
        value="{away_m:.0f} m",
        limit="{limit_m:.0f} m",
        remedy="check its row in the survey",
    ),
    Reason.MARKERS_TOO_FEW: _too_few,
    Reason.MARKERS_DISAGREE: Words(
        reason="no two of its {found} surveyed markers agree on one pose",
        remedy="check their ids, the corner order and the survey's unit and handedness (x east, y north, z up)",
    ),
    Reason.MARKERS_AMBIGUOUS: Words(
        reason="its markers give two different poses: {agree:all} say one, {others:all} another",
        remedy="survey these markers again, or show one more",
    ),
    Reason.CONTROL_POINTS_TOO_FEW: Words(
        reason="too few control points",
        value="{found}",
        limit="at least {needed}",
        remedy="click more points, spread over the frame and over depth",
    ),
    Reason.CONTROL_POINTS_DISAGREE: Words(
        reason="its control points don't agree on one pose",
        value="{agree} of {found} agree",
        limit="at least {needed}",
        remedy="check which point was clicked for which name",
    ),
    Reason.CONTROL_POINT_CONTRADICTS: _control_point,
    Reason.POSE_RESIDUAL: Words(
        reason="its pose leaves too large a reprojection error",
        value="{residual_px:.1f} px",
        limit="{limit_px:.1f} px",
        remedy="check the survey and the rig's calibration",
    ),
    Reason.POSE_UNCERTAIN: Words(
        reason="its pose is too uncertain {ahead_m:.0f} m ahead",
        value="{sigma_m:mm}",
        limit="{limit_m:mm}",
        remedy="show markers that are nearer, or further apart in the frame",
    ),
    Reason.SURVEY_MIRRORED: Words(
        reason="it is a mirror image of the site: of {seen} markers in view {agree_mirrored} agree in the mirror, "
        "{agree} as they are given. x and y are exchanged (easting and northing), or one axis counts the wrong way",
        remedy="correct the columns x_m, y_m and z_m (x east, y north, z up); no station of the visit is used",
    ),
    Reason.STATION_SURVEY_MIRRORED: Words(reason="the survey is a mirror image of the site"),
    Reason.STATION_SURVEY_REFUSED: Words(reason="by this survey nothing lies where it is designed"),
    Reason.STATION_VISIT_UNDOES: Words(reason="its visit would undo what earlier ones saw"),
}
