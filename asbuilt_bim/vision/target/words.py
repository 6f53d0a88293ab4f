"""What is said of the target: why there is none, why another disc isn't it, why the rig is in doubt."""

from __future__ import annotations

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.errors import Rejection
from asbuilt_bim.vision.target.disc import RedDisc
from asbuilt_bim.vision.target.pairing import PALE, Pairing, TargetOptions, in_doubt, is_clear


def place(disc: RedDisc) -> str:
    """Return where a disc stands in the photo."""
    return f"x {disc.ellipse.x_px:.0f}, y {disc.ellipse.y_px:.0f} px"


def expected(options: TargetOptions) -> str:
    """Return what diameters a target may have."""
    if options.diameter_m is None:
        return f"{options.smallest_m:g} to {options.largest_m:g} m"
    return f"{options.diameter_m:g} m +- {100 * options.diameter_tolerance:.0f} %"


def not_it(pair: RectifiedPair, found: Pairing, options: TargetOptions) -> Rejection:
    """Say that a red disc hasn't the target's diameter."""
    return Rejection(
        what=f"station {pair.name}, red disc at {place(found.left)}",
        reason="its diameter is not the target's",
        value=f"{2 * found.circle.radius_m:.3f} m",
        limit=expected(options),
        remedy="if it is the target, check the diameter that was told, the boards' square size (unit) and whether "
        "the rig was knocked",
    )


def twin(pair: RectifiedPair, found: Pairing, chosen: Pairing) -> Rejection:
    """Say why of several discs of the target's size this one was not taken."""
    why = "is further away" if found.circle.disparity_px < chosen.circle.disparity_px else "looks less like it"
    if found.left.redness <= PALE * chosen.left.redness:
        why = "is much paler: a reflection?"
    elif is_clear(chosen) and not is_clear(found):
        why = "is round only in part"
    near, far = (pair.camera.f_px * pair.camera.baseline_m / p.circle.disparity_px for p in (chosen, found))
    return Rejection(
        what=f"station {pair.name}, red disc at {place(found.left)}",
        reason=f"it has the size of the target too, and {why}; "
        f"taken was the one at {place(chosen.left)}, {near:.2f} m away",
        value=f"{far:.2f} m away",
        remedy="if this one is the target, cover the other and take the station again",
    )


def doubt(pair: RectifiedPair, found: Pairing, options: TargetOptions) -> tuple[Rejection, ...]:
    """Say where the target's diameter comes out wrong by more than measuring it does: the rig's scale is in doubt.

    A right camera turned by 0.2 degrees since the calibration shows here, at 5 m, as 7 % and nowhere else so plainly.
    """
    if options.diameter_m is None or not in_doubt(found.circle, options):
        return ()
    diameter = 2.0 * found.circle.radius_m
    off = diameter / options.diameter_m - 1.0
    return (
        Rejection(
            what=f"station {pair.name}, target's diameter",
            reason=f"it comes out {100 * off:+.1f} % wrong, so distances may be off by as much and areas by twice that",
            value=f"{diameter:.3f} m",
            limit=f"{options.diameter_m:g} m +- {100 * options.diameter_doubt:.0f} %",
            remedy="measure the disc; if it has its diameter, the rig was knocked: calibrate again",
        ),
    )


def several(pair: RectifiedPair, found: list[Pairing], options: TargetOptions) -> Rejection:
    """Say that nobody can tell which of several discs is the target."""
    places = "; ".join(f"{place(p.left)} (diameter {2 * p.circle.radius_m:.3f} m)" for p in found)
    remedy = "cover or remove all but one, and take the station again"
    if options.diameter_m is None:
        remedy = "tell the target's diameter if that tells them apart; else " + remedy
    return Rejection(
        what=f"station {pair.name}, target",
        reason=f"{len(found)} red discs could be the target: {places}",
        value=str(len(found)),
        limit="1",
        remedy=remedy,
    )


def off_row(pair: RectifiedPair, found: Pairing, options: TargetOptions) -> Rejection:
    """Say that the rows of the only disc differ."""
    rows = found.left.ellipse.y_px - found.right.ellipse.y_px
    return Rejection(
        what=f"station {pair.name}, target",
        reason="its rows in the left and right photo differ: the rig was knocked since its calibration",
        value=f"{rows:+.1f} px",
        limit=f"{options.row_limit_px:g} px",
        remedy="calibrate the rig again and take the station again",
    )


def absent(
    pair: RectifiedPair, lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], options: TargetOptions
) -> tuple[Rejection, ...]:
    """Say why there is no target: in one photo only, not the same in both, or nowhere."""
    what = f"station {pair.name}, target"
    remedy = "place the disc where both photos show it whole, 3 to 8 m away, and take the station again"
    for side, other, discs, others in (("left", "right", lefts, rights), ("right", "left", rights, lefts)):
        if discs and not others:
            places = "; ".join(place(disc) for disc in discs)
            reason = f"a red disc is in the {side} photo only, at {places}: the {other} photo shows no disc"
            return (Rejection(what=what, reason=reason, remedy=remedy),)
    if lefts and rights:
        reason = "no red disc in one photo is the same as one in the other (row, size, order)"
        return (Rejection(what=what, reason=reason, remedy=remedy),)
    if options.required:
        return (Rejection(what=what, reason="no red disc is in view", remedy=remedy),)
    return ()
