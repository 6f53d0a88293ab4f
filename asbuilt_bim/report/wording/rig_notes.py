"""Sentences on the rig and on its calibration."""

from collections.abc import Mapping

import numpy as np

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.report.wording.template import Template, filled

NO_MEANING = 1.0
"""An area that errs by as much as itself: its error says nothing more."""


def _turn(note: Note, key: str) -> str:
    """Return a turn with its sigma: `pitch +0.000° ± 0.010°, yaw +0.200° ± 0.010°, roll ...`.

    What photos say nothing of was held, and has no sigma.
    """
    turn, sigma = (np.rad2deg(np.asarray(note.values[f"{key}{end}"], dtype=float)) for end in ("_rad", "_sigma_rad"))
    parts = zip(("pitch", "yaw", "roll"), turn, sigma, strict=True)
    return ", ".join(
        f"{name} {angle:+.3f}° ± {one:.3f}°" if one > 0.0 else f"{name} as calibrated" for name, angle, one in parts
    )


def _refined(note: Note) -> str:
    stations = note.values["stations"]
    names = [str(name) for name in stations] if isinstance(stations, tuple) else []
    which = f"stations {names[0]} to {names[-1]}" if len(names) > 1 else f"station {''.join(names)}"
    effect = float(str(note.values["area_effect"]))
    wrong = f"an area at 5 m would be {100 * effect:+.1f} % ± {{area_effect_sigma:tenth %}} wrong"
    if not abs(effect) < NO_MEANING:
        wrong = "no area could be trusted"
    text = f"Rig, {which}: refined from {{matches}} matches. Its right camera is turned by {_turn(note, 'turn')}. "
    return filled(text + f"Unrefined, {wrong}, and rows would lie {{rows_px:.1f}} px apart", note)


def _knocked(note: Note) -> str:
    where = "The rig was knocked between stations {last_before} and {first_after}. "
    return filled(f"{where}Before: {_turn(note, 'turn_before')}. After: {_turn(note, 'turn_after')}", note)


def _rows_apart(note: Note) -> str:
    stations, rows_px = note.values["stations"], note.values["pair_rows_px"]
    pairs = zip(stations, rows_px, strict=True) if isinstance(stations, tuple) and isinstance(rows_px, tuple) else ()
    each = ", ".join(f"{station} {float(str(rows)):.2f}" for station, rows in pairs)
    return f"Rows of the photo pairs lie apart, in px: {each}. --refine-rig (rig.refine: true) mends it"


def _by_lengths(note: Note) -> str:
    stations = note.values["stations"]
    names = [str(name) for name in stations] if isinstance(stations, tuple) else []
    which = f"stations {names[0]} to {names[-1]}" if len(names) > 1 else f"station {''.join(names)}"
    yaw, yaw_sigma = (np.rad2deg(float(str(note.values[key]))) for key in ("yaw_rad", "yaw_sigma_rad"))
    text = (
        f"Rig, {which}: moved to where {{lengths}} known lengths show it. Yaw {yaw:+.3f}° ± {yaw_sigma:.3f}°, baseline "
        f"{100.0 * float(str(note.values['scale'])):+.2f} % ± {{scale_sigma:hundredth %}}. An area at 5 m is known to "
        "±{area_sigma:hundredth %}, before to ±{area_sigma_before:hundredth %}"
    )
    return filled(text, note)


RIG_NOTES: Mapping[Reason, Template] = {
    Reason.RIG_USED_REFINED: _refined,
    Reason.RIG_REFINED_BY_LENGTHS: _by_lengths,
    Reason.RIG_KNOCKED_BETWEEN: _knocked,
    Reason.RIG_ROWS_APART: _rows_apart,
    Reason.AREAS_WIDENED: "Known lengths contradict the rig's scale. By all of them together areas may be "
    "{share:hundredth %} wrong, and lengths half as much. So each area has a larger sigma, and at least and possibly "
    "lie further apart",
    Reason.CALIBRATION_COVERAGE: "the boards cover only {share:%} of the frame",
    Reason.CALIBRATION_HOLD_OUT: "views kept back miss by {hold_out_px:px}, the others by {rms_px:px}",
    Reason.CALIBRATION_LENGTH: "the boards' diagonals come out {share:hundredth %} wrong",
    Reason.CALIBRATION_SCALE: "focal length and baseline are known only to {share:hundredth %}",
    Reason.CALIBRATION_LENS: "another lens model fits {left_px:px} better. Calibrate with --lens {model} "
    "(rig.boards.distortion: {model})",
    Reason.TAGS_COVERAGE: "the tags cover only {share:%} of the frame",
    Reason.TAGS_LENGTH: "the tags' sides come out {share:hundredth %} wrong",
    Reason.CONTROL_POINTS_FEW: "fewer than {fewest} points in a photo: the lens was taken to be straight",
    Reason.CONTROL_POINTS_REACH: "the points reach over only {share:%} of a photo. Outside them the lens is a guess",
    Reason.CONTROL_POINTS_HOLD_OUT: "points kept back miss by {hold_out_px:px}, the others by {rms_px:px}",
}
