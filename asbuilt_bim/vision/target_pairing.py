"""A red disc in the left photo and one in the right that one circle in space makes: which could be the target."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.vision.circle import SpaceCircle, fit_circle, outlines_of
from asbuilt_bim.vision.disc import MIN_SUPPORT, RedDisc, followed, some_profiles
from asbuilt_bim.vision.edge_model import likely_blur

_CLEAR_SUPPORT = 0.85
PALE = 0.66
"""Of the reddest disc's redness: light cancels out of it; what is seen through glass or on water falls below."""
_SMALLEST, _LARGEST = 0.55, 1.35
"""Of the told diameter: with 30 % covered no less is left, and nothing makes a disc larger."""
_MOST_UNSURE = 0.02  # of the diameter; a disc whose size is less sure can't be told from other things by its size
_MOST_UNSURE_DEPTH = 0.012  # relative: the distance is asked to 1 %, and discs within 10 m give it to 0.5 %
_OFF_ROW_PX = 1.5  # no circle makes such a pair: it is kept to say that the rig was knocked
_SHRUNK = 0.04  # of the told diameter: less and it may be the target's as it is
_SLACK = (2.0, 2.0, 1.0, 1.0)
"""The first outlines lean by a pixel where what is behind is dark or bright; they must not choose what is seen next."""


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
class Pairing:
    """A disc seen in both photos, and the circle in space that makes both."""

    left: RedDisc
    right: RedDisc
    circle: SpaceCircle


def pairings(
    lefts: tuple[RedDisc, ...], rights: tuple[RedDisc, ...], camera: RectifiedCamera, told_m: float | None = None
) -> list[Pairing]:
    """Return the discs that can be one disc seen twice: near one row, of one size, in front of the cameras."""
    found: list[Pairing] = []
    for left in lefts:
        for right in rights:
            a, b = left.ellipse, right.ellipse
            near_row = abs(a.y_px - b.y_px) < 2.0 + 0.1 * a.major_px
            alike = abs(np.log(a.minor_px / b.minor_px)) < 0.3 and abs(np.log(a.major_px / b.major_px)) < 0.2
            if (
                near_row
                and alike
                and a.x_px - b.x_px > 1.0
                and (pairing := _paired(left, right, camera, told_m)) is not None
            ):
                found.append(pairing)
    return found


def _paired(left: RedDisc, right: RedDisc, camera: RectifiedCamera, told_m: float | None) -> Pairing | None:
    """Fit one circle to a disc of each photo; follow both outlines again where it lies, and fit again.

    A disc that is covered in part is a poor ellipse in each photo; the circle that both share is a better guide. The
    cover's own edge may bound a smaller ellipse: then one of the told size about the same place is tried as a guide,
    and what is fitted from there on is free to come out as it likes.
    """
    circle = _circle(left, right, camera)
    if circle is None:
        return None
    diameter_m = 2.0 * circle.radius_m
    off_row = abs(left.ellipse.y_px - right.ellipse.y_px) > _OFF_ROW_PX
    if off_row or (told_m is not None and not _SMALLEST * told_m < diameter_m < _LARGEST * told_m):
        return _as_found(left, right, circle)
    best = _followed(left, right, circle, camera)
    if told_m is None or diameter_m > (1.0 - _SHRUNK) * told_m:
        return best
    again = _followed(left, right, replace(circle, radius_m=0.5 * told_m), camera)
    return again if again is not None and abs(2.0 * again.circle.radius_m / told_m - 1.0) < _SHRUNK else best


def _followed(left: RedDisc, right: RedDisc, circle: SpaceCircle, camera: RectifiedCamera) -> Pairing | None:
    """Follow both outlines along a circle's pictures and fit again, a few times; None where they aren't there."""
    best: Pairing | None = None
    blur_px: float | None = None
    for slack in _SLACK:
        guides = outlines_of(circle, camera)
        if guides[0] is None or guides[1] is None:
            break
        if blur_px is None:
            # the same lens at the same distance: one blur for both photos
            blur_px = likely_blur([some_profiles(left, guides[0]), some_profiles(right, guides[1])])
        again = followed(left, guides[0], blur_px, slack), followed(right, guides[1], blur_px, slack)
        if again[0] is None or again[1] is None:
            break
        left, right = again[0], again[1]
        fitted = _circle(left, right, camera)
        if fitted is None:
            break
        circle = fitted
        best = Pairing(left=left, right=right, circle=circle)
    return best if best is not None and _fits(best) else None


def _as_found(left: RedDisc, right: RedDisc, circle: SpaceCircle) -> Pairing | None:
    """Return what is no target, but worth a word."""
    found = Pairing(left=left, right=right, circle=circle)
    is_one = circle.rms_px < 0.5 + 0.02 * left.ellipse.major_px
    return found if is_one and min(left.support, right.support) >= MIN_SUPPORT else None


def _fits(found: Pairing) -> bool:
    """Say whether both outlines are one circle's: discs keep to 0.3 px and less, jackets and squares don't."""
    circle = found.circle
    unsure = float(np.sqrt(circle.covariance[2, 2])) / circle.disparity_px
    return circle.rms_px < 0.25 + 0.01 * found.left.ellipse.major_px and unsure < _MOST_UNSURE_DEPTH


def _circle(left: RedDisc, right: RedDisc, camera: RectifiedCamera) -> SpaceCircle | None:
    sigma = np.concatenate([left.sigma_px, right.sigma_px])
    return fit_circle(left.edge, right.edge, left.ellipse, right.ellipse, camera, sigma)


def is_clear(found: Pairing) -> bool:
    """Say whether both photos show nearly the whole outline: worth a word even where it isn't the target."""
    return bool(clear_ones((found.left,)) and clear_ones((found.right,)))


def clear_ones(discs: tuple[RedDisc, ...]) -> tuple[RedDisc, ...]:
    """Return the discs whose outline is nearly whole: others may be any red thing with a round side."""
    return tuple(disc for disc in discs if disc.support > _CLEAR_SUPPORT)


def diameter_sigma(circle: SpaceCircle) -> float:
    """Return the diameter's standard deviation in metres."""
    return 2.0 * circle.radius_m * float(np.sqrt(circle.covariance[3, 3]))


def size_fits(circle: SpaceCircle, options: TargetOptions) -> bool:
    """Say whether a circle has the target's diameter: the told one, or any plausible one."""
    diameter = 2.0 * circle.radius_m
    if options.diameter_m is None:
        return options.smallest_m <= diameter <= options.largest_m
    unsure = min(2.0 * diameter_sigma(circle), _MOST_UNSURE * options.diameter_m)
    return abs(diameter - options.diameter_m) <= options.diameter_tolerance * options.diameter_m + unsure


def likeliest(found: list[Pairing]) -> list[Pairing]:
    """Leave out what is much paler than the reddest; then what is round only in part, where one is whole."""
    reddest = max(pairing.left.redness for pairing in found)
    red = [pairing for pairing in found if pairing.left.redness > PALE * reddest]
    return [pairing for pairing in red if is_clear(pairing)] or red
