"""Words for a rig that no longer stands as it was calibrated, and for one whose scale is off."""

import math
from collections.abc import Iterator

from asbuilt_bim.codes import Reason
from asbuilt_bim.register.print_shape import SHAPE_SHARE, UNIT_MISTAKES
from asbuilt_bim.report.wording.words import Table, Values, Words, fill

MEANINGLESS = 1.0
"""An area that errs by as much as itself: a figure for its error no longer says anything."""
_RECALIBRATE = (
    "see that both photos are of one moment and calibrate the rig again, boards in every corner of the frame, or pass "
    "--refine-rig (the baseline's length stays)"
)
_LENGTHS = {
    "target's diameter": "target.diameter_m",
    "markers' size": "markers.size_m",
    "markers' distances": "the survey (markers.survey)",
}
"""Each known length, and where it is given."""


def turn_text(values: Values) -> str:
    """Return the right camera's turn with its sigma: `pitch +0.001° ± 0.003°, yaw ...`."""
    axes = zip(("pitch", "yaw", "roll"), _numbers(values, "turn_rad"), _numbers(values, "turn_sigma_rad"), strict=True)
    return ", ".join(f"{axis} {math.degrees(turn):+.3f}° ± {math.degrees(sigma):.3f}°" for axis, turn, sigma in axes)


def effect_text(values: Values) -> str:
    """Return what the turn does: `an area at 5 m comes out +17.8 % ± 0.8 % wrong, rows lie 0.2 px apart`."""
    if abs(_number(values, "area_effect")) >= MEANINGLESS:
        return fill(
            "an area could come out as anything: these photos and this rig don't belong together, rows lie "
            "{rows_px:.1f} px apart",
            values,
        )
    return fill(
        "an area at {area_distance_m:g} m comes out {area_effect:+.1%} ± {area_sigma:.1%} wrong, rows lie "
        "{rows_px:.1f} px apart",
        values,
    )


def _effect(values: Values) -> str:
    if abs(_number(values, "area_effect")) < MEANINGLESS:
        return fill("{area_effect:+.1%}", values)
    return f"over {100 * MEANINGLESS:.0f} %"


def _part(values: Values) -> str:
    """Return the rig with its stations: `rig, stations A1 to A9`; "" where a station is spoken of."""
    names = values["stations"]
    if not isinstance(names, tuple) or not names:
        return ""
    where = f"stations {names[0]} to {names[-1]}" if len(names) > 1 else f"station {names[0]}"
    return f"rig refined, {where}" if values["refined"] else f"rig, {where}"


def _knocked(values: Values) -> Words:
    by_rows = not values["by_area"] and _number(values, "rows_px") > _number(values, "limit_px")
    return Words(
        part=_part(values),
        reason=f"the rig was knocked since its calibration: its right camera is turned by {turn_text(values)}; "
        f"{effect_text(values)}",
        value=fill("{rows_px:.1f} px", values) if by_rows else _effect(values),
        limit=fill("{limit_px:g} px", values) if by_rows else _share_limit(values),
        remedy=f"{_RECALIBRATE}. If these are another camera's photos, or its SDK has rectified them, this rig file "
        "isn't theirs: give that camera's file, or photos as they were stored",
    )


def _refined(values: Values) -> Words:
    return Words(
        part=_part(values),
        reason=f"refined from {values['matches']} matches: {turn_text(values)}; unrefined, {effect_text(values)}",
    )


def _moved(values: Values) -> Words:
    return Words(
        part=_part(values),
        reason="the rig has moved a little since its calibration (it was used all the same): its right camera is "
        f"turned by {turn_text(values)}; {effect_text(values)}",
        value=_effect(values),
        limit=_share_limit(values),
        remedy=_RECALIBRATE,
    )


def _undetermined(values: Values) -> Words:
    """Say what leaves a rig open, with advice for the rig that it is; results of before don't say which."""
    remedy = "trust no area to better than that; take stations with near and far things all over the frame"
    if values.get("lens_known") is False:
        remedy += ". A rig file of another program doesn't say how well its lenses are known: calibrate the rig with "
        remedy += "asbuilt-bim calibrate"
    effect = _number(values, "area_effect")
    off = f"{100 * abs(effect):.1f} % too {'large' if effect > 0.0 else 'small'}"
    off = off if abs(effect) < MEANINGLESS else "wrong by as much as itself"
    return Words(
        part=_part(values),
        reason="the photos say too little of how the rig stands (it was used all the same): by their "
        f"{values['matches']} matches an area at {_number(values, 'area_distance_m'):g} m would be {off}, but "
        "they can't tell that closely enough",
        value=fill("± {area_sigma:.1%}", values),
        limit=_share_limit(values),
        remedy=remedy,
    )


def _share_limit(values: Values) -> str:
    return f"{100 * _number(values, 'limit_share'):g} %"


def _scale_wrong(values: Values) -> Words:
    return Words(
        reason=f"the rig's scale is wrong: {_cause(values)}; known lengths come out "
        + fill("{ratio:.3f} times as long as they are: ", values)
        + ", ".join(_each(values)),
        value=f"{100 * (_number(values, 'ratio') - 1):+.1f} %",
        limit=_share_limit(values),
        remedy="correct that number; no new photos are needed",
    )


def _together(values: Values) -> Words:
    ratio = _number(values, "ratio")
    than = "large" if ratio > 1.0 else "small"
    return Words(
        part="rig's scale",
        reason=f"known lengths together come out {100 * abs(ratio - 1):.2f} % too {than} "
        f"(± {100 * _number(values, 'sigma'):.2f} %; {', '.join(_each(values))}), and so every area "
        f"{100 * abs(ratio**2 - 1):.1f} % too {than}, more than the calibration's own sigma; {_cause(values)}",
        value=f"{100 * (ratio - 1):+.2f} %",
        limit=fill("{limit_share:.2%}", values),
        remedy="if that is right, measure the disc and the prints, and check the survey's scale",
    )


def _lengths(values: Values) -> Words:
    """One kind alone against others that contradict it was given wrong; where none does, the rig may be wrong."""
    kinds, wrong = _names(values, "kinds"), _names(values, "wrong")
    sigmas, limits = _numbers(values, "sigmas"), _numbers(values, "limit_shares")
    each = dict(zip(kinds, _each(values), strict=True))
    units = ["" if "asked_baseline_m" in values else _in_unit(ratio) for ratio in _numbers(values, "ratios")]
    told = zip(kinds, sigmas, units, strict=True)
    off = [f"{each[kind]} (± {100 * sigma:.1f} %){unit}" for kind, sigma, unit in told if kind in wrong]
    others = ", ".join(text for kind, text in each.items() if kind not in wrong)
    remedy, beside = "measure the disc and the prints; if they are right, calibrate the rig again", "others don't"
    if "asked_baseline_m" in values:
        remedy, beside = f"{_cause(values)}. If that number is right, {remedy}", "others, within their limits"
    elif len(wrong) == 1 and len(kinds) > 1:
        remedy = f"the rig is right by the others: measure again and correct {_LENGTHS.get(wrong[0], wrong[0])}"
    return Words(
        part="rig's scale",
        reason=f"known lengths come out wrong: {', '.join(off)}" + (f"; {beside}: {others}" if others else ""),
        limit=", ".join(f"{100 * limit:.1f} %" for kind, limit in zip(kinds, limits, strict=True) if kind in wrong),
        remedy=remedy,
    )


def _each(values: Values) -> Iterator[str]:
    for kind, ratio in zip(_names(values, "kinds"), _numbers(values, "ratios"), strict=True):
        yield f"{kind} {100 * (ratio - 1):+.1f} %"


def _in_unit(ratio: float) -> str:
    """Say which unit lengths were given in that come out so many times as long, "" where none fits."""
    units = [unit for factor, unit in UNIT_MISTAKES.items() if abs(ratio * factor - 1.0) < SHAPE_SHARE]
    return f", as numbers in {units[0]} do" if units else ""


def _cause(values: Values) -> str:
    """Say what mistake a ratio looks like: a unit, a board's square, or a baseline."""
    if "unit" in values:
        return fill(
            "its baseline of {baseline_m:.4g} m looks like {unit}: it would be {asked_baseline_m:.4g} m", values
        )
    if "square_m" in values:
        return fill(
            "measure the board's squares: rig.boards.square_m is {square_m:g} m, and known lengths ask for "
            "{asked_square_m:.4g} m",
            values,
        )
    return fill("its baseline is {baseline_m:.4g} m, and known lengths ask for {asked_baseline_m:.4g} m", values)


def _number(values: Values, key: str) -> float:
    value = values[key]
    assert isinstance(value, int | float)
    return float(value)


def _numbers(values: Values, key: str) -> tuple[float, ...]:
    value = values[key]
    assert isinstance(value, tuple)
    return tuple(float(one) for one in value)


def _names(values: Values, key: str) -> tuple[str, ...]:
    value = values[key]
    assert isinstance(value, tuple)
    return tuple(str(one) for one in value)


def _size(values: Values) -> Words:
    said, likely = (" x ".join(f"{side:.0f}" for side in _numbers(values, key)) for key in ("size_px", "likely_px"))
    return Words(
        part="rig's file",
        reason=f"its numbers are of photos of about {likely} px, and it says {said} px",
        remedy="correct the size, or take the camera's own file",
    )


def _projections(values: Values) -> Words:
    return Words(
        part="rig's file",
        reason="the two projection matrices aren't of one rectified pair: their rows lie apart by",
        value=fill("{rows_px:.1f} px", values),
        remedy="take the files of a stereo calibration, or the camera's own",
    )


def _baseline(values: Values) -> Words:
    return Words(
        part="rig's file",
        reason=fill("its eyes stand {baseline_m:.4f} m apart, and a {camera} has {nominal_m:.3f} m", values)
        + f" (it was used all the same, and every area's sigma holds {200 * abs(_number(values, 'share')):.0f} %)",
        value=fill("{share:+.1%}", values),
        remedy="measure a known length with it (the disc, tags), or calibrate it with asbuilt-bim calibrate",
    )


def _files(values: Values) -> Words:
    return Words(
        part="rig's file",
        reason=fill("says a baseline of {baseline_m:.4f} m, and {file} of the same camera {other_m:.4f} m", values)
        + f" (it was used all the same, and every area's sigma holds {200 * abs(_number(values, 'share')):.0f} %)",
        value=fill("{share:+.1%}", values),
        remedy="find out which is right by a known length (the disc, tags), and take the other out of the folder",
    )


RIG: Table = {
    Reason.RIG_SIZE_CONTRADICTED: _size,
    Reason.RIG_PROJECTIONS_CONTRADICT: _projections,
    Reason.RIG_BASELINE_NOT_OF_TYPE: _baseline,
    Reason.RIG_FILES_CONTRADICT: _files,
    Reason.RIG_KNOCKED: _knocked,
    Reason.RIG_MOVED: _moved,
    Reason.RIG_UNDETERMINED: _undetermined,
    Reason.RIG_REFINED: _refined,
    Reason.SCALE_WRONG: _scale_wrong,
    Reason.LENGTHS_DOUBTFUL: _lengths,
    Reason.LENGTHS_DOUBTFUL_TOGETHER: _together,
}
