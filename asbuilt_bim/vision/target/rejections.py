"""Why there is no target, why another disc isn't it, why the rig is in doubt: codes with their values."""

from __future__ import annotations

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value
from asbuilt_bim.errors import Rejection
from asbuilt_bim.vision.target.disc import RedDisc
from asbuilt_bim.vision.target.pairing import PALE, Pairing, TargetOptions, in_doubt, is_clear


def not_it(pair: RectifiedPair, found: Pairing, options: TargetOptions) -> Rejection:
    """Return that a red disc hasn't the target's diameter."""
    limits: dict[str, Value] = {"least_m": options.smallest_m, "most_m": options.largest_m}
    if options.diameter_m is not None:
        limits = {"target_m": options.diameter_m, "tolerance_share": options.diameter_tolerance}
    values = limits | {"diameter_m": 2.0 * found.circle.radius_m}
    return Rejection(code=Reason.DISC_NOT_TARGET, subject=_disc(pair, found.left), values=values)


def twin(pair: RectifiedPair, found: Pairing, chosen: Pairing) -> Rejection:
    """Return why of several discs of the target's size this one was not taken."""
    why = "further" if found.circle.disparity_px < chosen.circle.disparity_px else "less like it"
    if found.left.redness <= PALE * chosen.left.redness:
        why = "paler"
    elif is_clear(chosen) and not is_clear(found):
        why = "round in part"
    near, far = (pair.camera.f_px * pair.camera.baseline_m / p.circle.disparity_px for p in (chosen, found))
    values: dict[str, Value] = {"why": why, "away_m": far, "taken": _place(chosen.left), "taken_away_m": near}
    return Rejection(code=Reason.DISC_SPARE, subject=_disc(pair, found.left), values=values)


def doubt(pair: RectifiedPair, target: Pairing, options: TargetOptions) -> tuple[Rejection, ...]:
    """Return a warning where the target's diameter comes out wrong by more than measuring it does: the scale is off.

    A right camera turned by 0.2 degrees since the calibration shows here, at 5 m, as 7 % and nowhere else so plainly.
    """
    if options.diameter_m is None or not in_doubt(target.circle, options):
        return ()
    diameter = 2.0 * target.circle.radius_m
    values: dict[str, Value] = {
        "diameter_m": diameter,
        "target_m": options.diameter_m,
        "off_share": diameter / options.diameter_m - 1.0,
        "limit_share": options.diameter_doubt,
    }
    return (Rejection(code=Reason.TARGET_SIZE_DOUBTFUL, subject=_target(pair), values=values),)


def several(pair: RectifiedPair, found: list[Pairing], options: TargetOptions) -> Rejection:
    """Return that it isn't known which of several discs is the target."""
    values: dict[str, Value] = {
        "places": tuple(_place(p.left) for p in found),
        "diameters_m": tuple(2.0 * p.circle.radius_m for p in found),
        "diameter_known": options.diameter_m is not None,
    }
    return Rejection(code=Reason.TARGET_AMBIGUOUS, subject=_target(pair), values=values)


def off_row(pair: RectifiedPair, found: Pairing, options: TargetOptions) -> Rejection:
    """Return that the rows of the only disc differ."""
    rows = found.left.ellipse.y_px - found.right.ellipse.y_px
    values: dict[str, Value] = {"rows_px": rows, "limit_px": options.row_limit_px}
    return Rejection(code=Reason.TARGET_ROWS_APART, subject=_target(pair), values=values)


def absent(
    pair: RectifiedPair, lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], options: TargetOptions
) -> tuple[Rejection, ...]:
    """Return why there is no target: in one photo only, not the same in both, or nowhere."""
    for side, other, discs, others in (("left", "right", lefts, rights), ("right", "left", rights, lefts)):
        if discs and not others:
            values: dict[str, Value] = {"side": side, "other": other, "places": tuple(map(_place, discs))}
            return (Rejection(code=Reason.TARGET_IN_ONE_PHOTO, subject=_target(pair), values=values),)
    if lefts and rights:
        return (Rejection(code=Reason.TARGET_UNPAIRED, subject=_target(pair)),)
    return (Rejection(code=Reason.TARGET_ABSENT, subject=_target(pair)),) if options.required else ()


def _place(disc: RedDisc) -> str:
    """Return where a disc stands in the photo."""
    return f"x {disc.ellipse.x_px:.0f}, y {disc.ellipse.y_px:.0f} px"


def _disc(pair: RectifiedPair, disc: RedDisc) -> Subject:
    return Subject(kind=SubjectKind.DISC, name=_place(disc), station=pair.name)


def _target(pair: RectifiedPair) -> Subject:
    return Subject(kind=SubjectKind.TARGET, station=pair.name)
