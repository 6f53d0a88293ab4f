"""Words for the red target and for other red discs."""

from asbuilt_bim.codes import Reason
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

_WHY = {
    "further": "is further away",
    "less like it": "looks less like it",
    "paler": "is much paler: a reflection?",
    "round in part": "is round only in part",
}


def _not_it(values: Values) -> Words:
    known = "target_m" in values
    return Words(
        reason="its diameter is not the target's",
        value=fill("{diameter_m:.3f} m", values),
        limit=fill("{target_m:g} m ± {tolerance_share:.0%}" if known else "{least_m:g} to {most_m:g} m", values),
        remedy="if it is the target, check target.diameter_m, the boards' square size (unit) and whether the rig was "
        "knocked",
    )


def _spare(values: Values) -> Words:
    why = _WHY[str(values["why"])]
    return Words(
        reason=fill(f"it has the size of the target too, and {why}; the one at {{taken}} was taken, "
                    "{taken_away_m:.2f} m away", values),
        value=fill("{away_m:.2f} m away", values),
        remedy="if this one is the target, cover the other and take the station again",
    )  # fmt: skip


def _several(values: Values) -> Words:
    places, diameters = values["places"], values["diameters_m"]
    assert isinstance(places, tuple) and isinstance(diameters, tuple)
    named = "; ".join(f"{place} (diameter {size:.3f} m)" for place, size in zip(places, diameters, strict=True))
    cover = "cover or remove all but one, and take the station again"
    return Words(
        reason=f"{len(places)} red discs could be the target: {named}",
        value=str(len(places)),
        limit="1",
        remedy=cover if values["diameter_known"] else f"give target.diameter_m if that tells them apart; else {cover}",
    )


def _in_one_photo(values: Values) -> Words:
    places = values["places"]
    assert isinstance(places, tuple)
    return Words(
        reason=f"a red disc is in the {values['side']} photo only, at {'; '.join(map(str, places))}: the "
        f"{values['other']} photo shows no disc",
        remedy=_PLACE_IT,
    )


_PLACE_IT = "place the disc where both photos show it whole, 3 to 8 m away, and take the station again"

TARGET: Table = {
    Reason.DISC_NOT_TARGET: _not_it,
    Reason.DISC_SPARE: _spare,
    Reason.TARGET_SIZE_DOUBTFUL: Words(
        part="target's diameter",
        reason="it comes out {off_share:+.1%} wrong: distances may be off by as much and areas by twice that",
        value="{diameter_m:.3f} m",
        limit="{target_m:g} m ± {limit_share:.0%}",
        remedy="measure the disc; if it has its diameter, the rig was knocked: calibrate again",
    ),
    Reason.TARGET_AMBIGUOUS: _several,
    Reason.TARGET_ROWS_APART: Words(
        reason="its rows in the left and right photo differ: the rig was knocked since its calibration",
        value="{rows_px:+.1f} px",
        limit="{limit_px:g} px",
        remedy="calibrate the rig again and take the station again",
    ),
    Reason.TARGET_IN_ONE_PHOTO: _in_one_photo,
    Reason.TARGET_UNPAIRED: Words(
        reason="no red disc in one photo is the same as one in the other (row, size, order)", remedy=_PLACE_IT
    ),
    Reason.TARGET_ABSENT: Words(
        reason="no red disc is in view",
        remedy=f"{_PLACE_IT}; or measure without one (--no-target, in a project file target.required: false)",
    ),
    Reason.SCALE_UNCHECKED: Words(
        reason="neither the target nor enough markers in view of both photos",
        value="{found} markers",
        limit="{needed} markers",
        remedy="place the red target, or move so that both photos show two surveyed markers; where there are none, "
        "least_markers_without_target: 0 under options: measure lets the station count with nothing to check its scale",
    ),
}
