"""The red disc: its centres in both photos, and its distance by triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.vision.circle import SpaceCircle, fit_circle, outlines_of
from asbuilt_bim.vision.disc import RedDisc, find_discs, followed

_CLEAR_SUPPORT = 0.85
_FOLLOWED = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetOptions:
    """What the target looks like and how strictly it is asked for."""

    required: bool = True  # the paper's method needs it at every station
    diameter_m: float | None = None  # None: not told; then any plausible disc is taken, if it is the only one
    diameter_tolerance: float = 0.06  # relative; discs are made to 1 % and measured to 1 %; 6 % off is 12 % of area
    diameter_doubt: float = 0.03  # relative; taken, but said: depth is likely off by as much, area by twice as much
    smallest_m: float = 0.05  # where the diameter isn't told: smaller is a button or a lamp
    largest_m: float = 1.0  # and larger is a sign or a tank
    row_limit_px: float = 1.5  # both centres lie on one row; calibrated rigs keep to a few tenths
    bias_sigma_px: float = 0.05  # of disparity: interpolation and edges' tone curve, which no residual shows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetSighting:
    """The target in both rectified photos: centres (2,) sub-pixel, `depth_m` is Z of eq. 3 along the rectified axis.

    `range_m` is the distance from the left camera's centre: what a tape shows. `diameter_m` is what the
    picture says of the disc's diameter. The centres are pictures of the disc's own centre, not of the ellipses'.
    `depth_sigma_m` is the photos' part; what the rig's calibration adds comes on top.
    """

    left_px: FloatArray  # (2,)
    right_px: FloatArray  # (2,)
    radius_px: float  # semi-major axis in the left photo
    ellipse_left: tuple[float, float, float, float, float]  # cx, cy, full major, full minor, angle (rad)
    disparity_px: float
    depth_m: float
    depth_sigma_m: float
    range_m: float
    diameter_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pairing:
    """A disc seen in both photos, and the circle in space that makes both."""

    left: RedDisc
    right: RedDisc
    circle: SpaceCircle


def find_target(pair: RectifiedPair, options: TargetOptions) -> tuple[TargetSighting | None, tuple[Rejection, ...]]:
    """Find the red disc in both rectified photos and triangulate its centre.

    Of several discs the told diameter decides; of several that have it the nearest is taken, because a reflection lies
    behind what it shows, and the nearest is measured best. Without a told diameter several discs are refused.

    Returns the sighting, or None with the reasons. With `required` off, a target that is simply not there gives no
    reason; two discs, or one in a single photo, still do. A sighting may come with reasons why other discs aren't it.

    Reference: Perez & Tah 2023, eq. 2 (D = u_L - u_R) and eq. 3 (Z = f b / D).
    """
    lefts, rights = find_discs(pair.left), find_discs(pair.right)
    pairings = _pairings(lefts, rights, pair.camera)
    level = [p for p in pairings if abs(p.left.ellipse.y_px - p.right.ellipse.y_px) <= options.row_limit_px]
    right_size = [p for p in level if _size_fits(p.circle, options)]
    if options.diameter_m is None and any(_is_clear(p) for p in right_size):
        right_size = [p for p in right_size if _is_clear(p)]  # a whole disc goes before what is round only in part
    if len(right_size) > 1 and options.diameter_m is None:
        return None, (_several(pair, right_size, options),)
    if right_size:
        chosen = max(right_size, key=lambda p: p.circle.disparity_px)
        twins = tuple(_further_away(pair, p, chosen) for p in right_size if p is not chosen)
        others = tuple(_not_it(pair, p, options) for p in level if p not in right_size and _is_clear(p))
        return _sighting(chosen, pair.camera, options), (*_doubt(pair, chosen, options), *twins, *others)
    if level:
        return None, tuple(_not_it(pair, p, options) for p in level)
    if pairings:
        return None, (_off_row(pair, pairings[0], options),)
    return None, _absent(pair, _clear(lefts), _clear(rights), options)


def _pairings(lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], camera: RectifiedCamera) -> list[_Pairing]:
    """Return the discs that can be one disc seen twice: near one row, of one size, in front of the cameras."""
    found: list[_Pairing] = []
    for left in lefts:
        for right in rights:
            a, b = left.ellipse, right.ellipse
            near_row = abs(a.y_px - b.y_px) < 2.0 + 0.1 * a.major_px
            alike = abs(np.log(a.minor_px / b.minor_px)) < 0.3 and abs(np.log(a.major_px / b.major_px)) < 0.2
            if near_row and alike and a.x_px - b.x_px > 1.0 and (pairing := _paired(left, right, camera)) is not None:
                found.append(pairing)
    return found


def _paired(left: RedDisc, right: RedDisc, camera: RectifiedCamera) -> _Pairing | None:
    """Fit one circle to a disc of each photo; follow both outlines again where it lies, and fit again.

    A disc that is covered in part is a poor ellipse in each photo; the circle that both share is a better guide.
    """
    circle = fit_circle(left.edge, right.edge, left.ellipse, right.ellipse, camera)
    best: _Pairing | None = None
    for _ in range(_FOLLOWED + 1):
        if circle is None or circle.rms_px > 1.5 + 0.04 * left.ellipse.major_px:
            break
        if best is None or circle.rms_px < best.circle.rms_px:
            best = _Pairing(left=left, right=right, circle=circle)
        guides = outlines_of(circle, camera)
        again = [followed(disc, guide) for disc, guide in zip((left, right), guides, strict=True) if guide is not None]
        if len(again) < 2 or again[0] is None or again[1] is None:
            break
        left, right = again[0], again[1]
        circle = fit_circle(left.edge, right.edge, left.ellipse, right.ellipse, camera)
    return best if best is not None and best.circle.rms_px < 0.5 + 0.02 * best.left.ellipse.major_px else None


def _size_fits(circle: SpaceCircle, options: TargetOptions) -> bool:
    diameter = 2.0 * circle.radius_m
    if options.diameter_m is None:
        return options.smallest_m <= diameter <= options.largest_m
    sigma = _diameter_sigma(circle)
    return abs(diameter - options.diameter_m) <= options.diameter_tolerance * options.diameter_m + 2.0 * sigma


def _is_clear(found: _Pairing) -> bool:
    """Say whether both photos show nearly the whole outline: worth a word even where it isn't the target."""
    return bool(_clear((found.left,)) and _clear((found.right,)))


def _clear(discs: tuple[RedDisc, ...]) -> tuple[RedDisc, ...]:
    """Return the discs whose outline is nearly whole: others may be any red thing with a round side."""
    return tuple(disc for disc in discs if disc.support > _CLEAR_SUPPORT)


def _diameter_sigma(circle: SpaceCircle) -> float:
    """Return the diameter's standard deviation in metres."""
    return 2.0 * circle.radius_m * float(np.sqrt(circle.covariance[3, 3]))


def _sighting(found: _Pairing, camera: RectifiedCamera, options: TargetOptions) -> TargetSighting:
    circle, ellipse = found.circle, found.left.ellipse
    disparity = circle.disparity_px
    depth = camera.f_px * camera.baseline_m / disparity
    sigma_px = float(np.hypot(np.sqrt(circle.covariance[2, 2]), options.bias_sigma_px))
    ray = np.array([*(circle.centre_px - [camera.cx_px, camera.cy_px]), camera.f_px]) / camera.f_px
    return TargetSighting(
        left_px=circle.centre_px,
        right_px=frozen(circle.centre_px - [disparity, 0.0]),
        radius_px=ellipse.major_px,
        ellipse_left=(ellipse.x_px, ellipse.y_px, 2 * ellipse.major_px, 2 * ellipse.minor_px, ellipse.angle_rad),
        disparity_px=disparity,
        depth_m=depth,
        depth_sigma_m=depth / disparity * sigma_px,
        range_m=float(depth * np.linalg.norm(ray)),
        diameter_m=2.0 * circle.radius_m,
    )


def _place(disc: RedDisc) -> str:
    return f"x {disc.ellipse.x_px:.0f}, y {disc.ellipse.y_px:.0f} px"


def _expected(options: TargetOptions) -> str:
    if options.diameter_m is None:
        return f"{options.smallest_m:g} to {options.largest_m:g} m"
    return f"{options.diameter_m:g} m +- {100 * options.diameter_tolerance:.0f} %"


def _not_it(pair: RectifiedPair, found: _Pairing, options: TargetOptions) -> Rejection:
    return Rejection(
        what=f"station {pair.name}, red disc at {_place(found.left)}",
        reason="its diameter is not the target's",
        value=f"{2 * found.circle.radius_m:.3f} m",
        limit=_expected(options),
        remedy="if it is the target, check target.diameter_m, the boards' square size (unit) and whether the rig "
        "was knocked",
    )


def _further_away(pair: RectifiedPair, found: _Pairing, chosen: _Pairing) -> Rejection:
    """Say why of two discs of the target's size this one was not taken."""
    near, far = (pair.camera.f_px * pair.camera.baseline_m / p.circle.disparity_px for p in (chosen, found))
    return Rejection(
        what=f"station {pair.name}, red disc at {_place(found.left)}",
        reason=f"it has the target's diameter too, and the nearest one was taken, at {_place(chosen.left)}",
        value=f"{far:.2f} m away",
        limit=f"{near:.2f} m",
        remedy="if this one is the target, cover the other and take the station again",
    )


def _doubt(pair: RectifiedPair, found: _Pairing, options: TargetOptions) -> tuple[Rejection, ...]:
    """Say where the target's diameter comes out wrong by more than measuring it does: the rig's scale is in doubt.

    A right camera turned by 0.2 degrees since the calibration shows here, at 5 m, as 7 % and nowhere else so plainly.
    """
    if options.diameter_m is None:
        return ()
    diameter = 2.0 * found.circle.radius_m
    off = diameter / options.diameter_m - 1.0
    if abs(off) <= options.diameter_doubt + 2.0 * _diameter_sigma(found.circle) / options.diameter_m:
        return ()
    return (
        Rejection(
            what=f"station {pair.name}, target's diameter",
            reason=f"it comes out {100 * off:+.1f} % wrong, so distances may be off by as much and areas by twice that",
            value=f"{diameter:.3f} m",
            limit=f"{options.diameter_m:g} m +- {100 * options.diameter_doubt:.0f} %",
            remedy="measure the disc; if it has its diameter, the rig was knocked: calibrate again",
        ),
    )


def _several(pair: RectifiedPair, found: list[_Pairing], options: TargetOptions) -> Rejection:
    places = "; ".join(f"{_place(p.left)} (diameter {2 * p.circle.radius_m:.3f} m)" for p in found)
    remedy = "cover or remove all but one, and take the station again"
    if options.diameter_m is None:
        remedy = "give target.diameter_m in the project file if it tells them apart; else " + remedy
    return Rejection(
        what=f"station {pair.name}, target",
        reason=f"{len(found)} red discs could be the target: {places}",
        value=str(len(found)),
        limit="1",
        remedy=remedy,
    )


def _off_row(pair: RectifiedPair, found: _Pairing, options: TargetOptions) -> Rejection:
    rows = found.left.ellipse.y_px - found.right.ellipse.y_px
    return Rejection(
        what=f"station {pair.name}, target",
        reason="its rows in the left and right photo differ: the rig was knocked since its calibration",
        value=f"{rows:+.1f} px",
        limit=f"{options.row_limit_px:g} px",
        remedy="calibrate the rig again and take the station again",
    )


def _absent(
    pair: RectifiedPair, lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], options: TargetOptions
) -> tuple[Rejection, ...]:
    what = f"station {pair.name}, target"
    remedy = "place the disc where both photos show it whole, 3 to 8 m away, and take the station again"
    for side, other, discs, others in (("left", "right", lefts, rights), ("right", "left", rights, lefts)):
        if discs and not others:
            places = "; ".join(_place(disc) for disc in discs)
            reason = f"a red disc is in the {side} photo only, at {places}: the {other} photo shows no disc"
            return (Rejection(what=what, reason=reason, remedy=remedy),)
    if lefts and rights:
        reason = "no red disc in one photo is the same as one in the other (row, size, order)"
        return (Rejection(what=what, reason=reason, remedy=remedy),)
    if options.required:
        return (Rejection(what=what, reason="no red disc is in view", remedy=remedy),)
    return ()
