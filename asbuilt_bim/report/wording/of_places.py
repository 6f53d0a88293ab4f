"""Words for markers, control points and poses: where a station stood."""

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.values import odds
from asbuilt_bim.report.wording.words import Table, Values, Words, fill


def _too_few(values: Values) -> Words:
    if not values.get("surveyed", True):
        return Words(
            reason="no marker is surveyed, so none can place it",
            remedy="give its rough place (near) or its visit's storey, or survey markers",
        )
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


def _uncertain(values: Values) -> Words:
    """Say what would make a pose surer, by what it comes from."""
    reason, remedy = "its pose is too uncertain {ahead_m:.0f} m ahead", "show markers that are nearer, or further apart"
    if values.get("method") == "control_points":
        reason += "; its points miss by {residual_px:.1f} px"
        remedy = (
            "click more points, spread over the frame and over depth; x and y are pixels of the full-size photo, "
            "counted from its upper left corner, and coordinates are in metres"
        )
    elif values.get("method") == "given":
        remedy = "measure the pose that is given better, and give its sigma; or show surveyed markers"
    sigma = fill("{sigma_m:mm}" if float(str(values["sigma_m"])) < 1.0 else "{sigma_m:,.1f} m", values)
    return Words(reason=fill(reason, values), value=sigma, limit=fill("{limit_m:mm}", values), remedy=remedy)


def _control_point(values: Values) -> Words:
    return _contradicts("points", "click it again, or check its coordinates", values)


def _ambiguous(values: Values) -> Words:
    """Say how far off the place is that fits nearly as well."""
    other = " fits, too"
    if "away_m" in values:
        other = f" {{away_m:.2f}} m away fits, too (chance: {odds(float(str(values['other_chance'])))})"
    return Words(
        reason=fill(f"the design has more than one place for it: another one{other}", values),
        remedy="give its rough place more closely (near), or show what is there only once: a corner, a stair, markers",
    )


def _not_found(values: Values) -> Words:
    """Say whether too little fits, or all of it and still too little to be no chance."""
    more = "show more walls and columns that are built as designed, at an angle to each other, or markers"
    if values["fits"] == values["faces"]:
        return Words(
            reason=fill(
                "all its {faces} measured faces fit the design near its rough place, but so few faces, or so "
                "loose a fit, may be chance",
                values,
            ),
            remedy=f"{more}; or give its rough place more closely (near)",
        )
    return Words(
        reason=fill(
            "near its rough place nothing in the design fits well enough: at best {fits} of {faces} measured faces do",
            values,
        ),
        remedy=f"check the rough place, its storey and its bearing; {more}",
    )


PLACES: Table = {
    Reason.MARKER_NOT_SURVEYED: Words(
        reason="the survey has no such marker",
        remedy="survey its four corners, or leave it: it ties the stations that see it to each other",
    ),
    Reason.MARKER_CONTRADICTS: _marker,
    Reason.MARKER_FAR: Words(
        reason="its surveyed place is far from the building",
        value="{away_m:.0f} m",
        limit="{limit_m:.0f} m",
        remedy="check its row in the survey",
    ),
    Reason.MARKER_TWICE: Words(
        reason="a photo shows two prints of this number, so neither was used",
        remedy="take one down, or put up another number in its place; photos that show only one of them count",
    ),
    Reason.MARKERS_OF_OTHER_FAMILY: Words(
        reason="its markers are not of the family that the project names",
        value="{found} of {other}",
        limit="markers.family: {family}",
        remedy="write family: {other} under markers",
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
        remedy="check which point was clicked for which name, that x and y are pixels of the full-size photo counted "
        "from its upper left corner, and that coordinates are in metres",
    ),
    Reason.CONTROL_POINT_CONTRADICTS: _control_point,
    Reason.MARKER_MOVED: Words(
        reason="it doesn't stand where the survey has it, as the stations that see it agree; its survey was left out",
        value="{away_m:.3f} m off",
        remedy="survey it again: it was moved, or its row is mistaken",
    ),
    Reason.MARKER_MOVED_SINCE: Words(
        reason="it was moved since an earlier visit; its new place counts from now on",
        value="{away_m:.3f} m",
        remedy="fix it where it can stay",
    ),
    Reason.MARKERS_EXCHANGED: Words(
        reason="each stands where the other is known to stand: they were exchanged, on site or in the survey",
        value="{away_m:.2f} m apart",
        remedy="exchange the ids {one} and {other} in the survey",
    ),
    Reason.MARKER_IN_ANOTHER_PLACE: Words(
        reason="the other stations see it in another place, and it was left out here",
        remedy="see that no two prints on site have one id, and that none is moved while you take photos",
    ),
    Reason.STATION_NOT_LINKED: Words(
        reason="of the {seen} markers that it sees, too few are seen by a station that is placed",
        remedy="show two markers that another station shows, too, well apart in the frame; or half of what it shows",
    ),
    Reason.STATION_ON_ONE_MARKER: Words(
        reason="marker {marker} alone links it to what is known, and nothing checks that one",
        remedy="show one marker more that another station shows, too, or survey one more",
    ),
    Reason.DESIGN_TOO_LITTLE_SEEN: Words(
        reason="too few upright faces within 20 m were measured to place it by the design",
        value="{faces}",
        limit="at least 2, at an angle",
        remedy="show a corner, a column, or two walls at an angle",
    ),
    Reason.DESIGN_NOT_FOUND: _not_found,
    Reason.DESIGN_AMBIGUOUS: _ambiguous,
    Reason.DESIGN_HEIGHT_OPEN: Words(
        reason="its height over the design stays open: feet and heads of its {faces} faces don't agree on one",
        remedy="show where walls and columns meet the floor",
    ),
    Reason.DESIGN_POSE_CONTRADICTS: Words(
        reason="its place in the design contradicts its markers and was left out",
        value="{away_m:.2f} m, of these {up_m:.2f} m in height",
        remedy="check its rough place; something may be built beside its design",
    ),
    Reason.STATION_CONTRADICTS: Words(
        reason="it sees its markers where the other stations don't: {agree} of {seen} agree. It is of another site, or "
        "of another day on which they hung elsewhere",
        remedy="check which photos belong to this visit; give the markers of each site numbers of their own",
    ),
    Reason.SURVEY_CONTRADICTS: Words(
        reason="its markers don't stand to each other as it says: {agree} of {seen} known places agree with the "
        "photos, and nothing tells which are right",
        value="{agree}",
        limit="more than half",
        remedy="survey them again; no station that needs them is used",
    ),
    Reason.POSE_CONTRADICTS: Words(
        reason="its given pose contradicts its markers and was left out",
        value="{away_m:.2f} m, of these {up_m:.2f} m in height",
        remedy="check the pose's row: its station, its storey and its coordinates",
    ),
    Reason.POSE_RESIDUAL: Words(
        reason="its pose leaves too large a reprojection error",
        value="{residual_px:.1f} px",
        limit="{limit_px:.1f} px",
        remedy="check the survey and the rig's calibration",
    ),
    Reason.POSE_UNCERTAIN: _uncertain,
    Reason.SURVEY_MIRRORED: Words(
        reason="it is a mirror image of the site: of {seen} markers in view {agree_mirrored} agree in the mirror, "
        "{agree} as they are given. x and y are exchanged (easting and northing), or one axis counts the wrong way",
        remedy="correct the columns x_m, y_m and z_m (x east, y north, z up); no station of the visit is used",
    ),
    Reason.STATION_SURVEY_MIRRORED: Words(reason="the survey is a mirror image of the site"),
    Reason.STATION_SURVEY_REFUSED: Words(reason="placed so, nothing lies where it is designed"),
    Reason.STATION_VISIT_UNDOES: Words(reason="its visit would undo what earlier ones saw"),
    Reason.STATION_VISIT_CONTRADICTS: Words(reason="its visit and another one contradict each other"),
}
