"""A red disc in the left photo and one in the right that one circle in space makes: which could be the target."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.edges import DISPLAY_GAMMA
from asbuilt_bim.vision.target.circle import SpaceCircle, fit_circle, mirrored, outlines_of
from asbuilt_bim.vision.target.disc import FIRST_SUPPORT, MIN_SUPPORT, MOST_COVERED, RedDisc, followed, some_profiles
from asbuilt_bim.vision.target.disc_patch import Patch
from asbuilt_bim.vision.target.edge_model import COLOUR_BLUR_PX, likely_blur
from asbuilt_bim.vision.target.ellipse import Ellipse

_CLEAR_SUPPORT = 0.85
PALE = 0.66
"""Of the reddest disc's redness: light cancels out of it; what is seen through glass or on water falls below."""
_SMALLEST, _LARGEST = 0.55, 1.35
"""Of the given diameter: with 30 % covered no less is left, and nothing makes a disc larger."""
_MOST_UNSURE = 0.02  # of the diameter; a disc whose size is less sure isn't known from other things by its size
_MADE_TO = 0.006  # of the diameter, one sigma: discs are made to 1 %, and an outline leans by 0.1 px all round
_MOST_UNSURE_DEPTH = 0.012  # relative: the distance is asked to 1 %, and discs within 10 m give it to 0.5 %
_OFF_ROW_PX = 1.5  # no circle makes such a pair: it is kept to say that the rig was knocked
_OF_ANOTHER_SIZE = 0.15  # of the given diameter: so far off, and not to be held at it, it needn't be known closer
_HELD_FAIRLY = 0.04  # of the given diameter: where it comes out further off, it was wrong to hold it
_ROUNDS = ((3.0, 0.35), (2.0, 0.4), (2.0, 0.45), (2.0, 0.45), (1.0, 0.45), (1.0, 0.45))
"""Slack and least support: the first outlines lean where what is behind is dark or bright, or where something covers
them. They must not choose what is seen next, or the circle stays near where it began."""
_SETTLED_PX = 0.2  # a circle that moves and turns by less needs no further round of the same slack


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetOptions:
    """What the target looks like and how strictly it is asked for."""

    required: bool = True  # the paper's method needs it at every station
    diameter_m: float | None = None  # None: not given; then any plausible disc is taken, if it is the only one
    diameter_tolerance: float = 0.06  # relative; discs are made to 1 % and measured to 1 %; 6 % off is 12 % of area
    diameter_doubt: float = 0.03  # relative; taken, but reported: depth is likely off by as much, area by twice as much
    smallest_m: float = 0.05  # where no diameter is given: smaller is a button or a lamp
    largest_m: float = 1.0  # and larger is a sign or a tank
    row_limit_px: float = 1.5  # both centres lie on one row; calibrated rigs keep to a few tenths
    bias_sigma_px: float = 0.05  # of disparity: interpolation and edges' tone curve, which no residual shows
    blur_bias_per_px: float = (
        0.04  # of disparity, by blur squared: what is behind leans on a blurred edge; see `Pairing`
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pairing:
    """A disc seen in both photos, and the circle in space that makes both.

    `blur_px` is the lens's, as a bell's sigma; 0 where it wasn't asked. Blur bends an edge with its square, by what is
    behind and where the edge is round. Both photos differ in that: on 37 blurred development pairs (seeds 40, 60; 2 px)
    by 0.16 px more than residuals show. Up to 1.2 px of blur they don't.
    """

    left: RedDisc
    right: RedDisc
    circle: SpaceCircle
    blur_px: float = 0.0
    gamma: float = DISPLAY_GAMMA  # of the kind of blur that the outlines were followed with, as in `linear_light`

    @property
    def is_soft(self) -> bool:
        """Say whether what is behind bends an edge: where the lens blurs less than JPEG's halved colours, these do."""
        return self.blur_px >= COLOUR_BLUR_PX

    def disparity_sigma_px(self, circle: SpaceCircle, options: TargetOptions) -> float:
        """Return how sure a circle's disparity is: its outlines' scatter, and what no scatter shows."""
        return float(np.sqrt(circle.covariance[2, 2] + options.bias_sigma_px**2 + self.lean_px(options) ** 2))

    def lean_px(self, options: TargetOptions) -> float:
        """Return by how much what is behind leans on the outlines, which no scatter shows."""
        return options.blur_bias_per_px * self.blur_px**2

    def has_about(self, left: Ellipse, right: Ellipse) -> bool:
        """Say whether both outlines are nearly these: followed, they would lead here."""
        near = 0.1 * self.left.ellipse.major_px
        return all(
            np.abs([*(mine.ellipse.centre - other.centre), mine.ellipse.minor_px - other.minor_px]).max() < near
            for mine, other in ((self.left, left), (self.right, right))
        )


def pairings(
    lefts: tuple[RedDisc, ...],
    rights: tuple[RedDisc, ...],
    camera: RectifiedCamera,
    nominal_m: float | None = None,
    gamma: float = DISPLAY_GAMMA,
) -> list[Pairing]:
    """Return the discs that can be one disc seen twice: near one row, of one size, in front of the cameras.

    `gamma` is as in `linear_light`: the kind of blur that is looked for.
    """
    found: list[Pairing] = []
    for left in lefts:
        for right in rights:
            a, b = left.ellipse, right.ellipse
            near_row = abs(a.y_px - b.y_px) < 2.0 + 0.1 * a.major_px
            alike = abs(np.log(a.minor_px / b.minor_px)) < 0.3 and abs(np.log(a.major_px / b.major_px)) < 0.2
            is_known = any(p.has_about(a, b) for p in found)
            if near_row and alike and a.x_px - b.x_px > 1.0 and not is_known:
                found.extend(_paired(left, right, camera, nominal_m, gamma))
    return found


def _paired(
    left: RedDisc, right: RedDisc, camera: RectifiedCamera, nominal_m: float | None, gamma: float
) -> list[Pairing]:
    """Fit one circle to a disc of each photo; follow both outlines again where it lies, and fit again.

    A disc that is covered in part is a poor ellipse in each photo. The circle that both share is a better guide.
    Mostly, a circle of the given size about the same place is better still. Where that doesn't show a clear disc both
    are tried, and the one that leans the other way, since covered outlines hide which it is; all are weighed later.
    """
    circle = circle_of(left, right, camera)
    if circle is None:
        return []
    diameter_m = 2.0 * circle.radius_m
    off_row = abs(left.ellipse.y_px - right.ellipse.y_px) > _OFF_ROW_PX
    if off_row or (nominal_m is not None and not _SMALLEST * nominal_m < diameter_m < _LARGEST * nominal_m):
        return _as_found(left, right, circle)
    patches = (left.patch, right.patch)
    found: list[Pairing] = []
    if nominal_m is not None:
        nominal = follow(patches, replace(circle, radius_m=0.5 * nominal_m), camera, 0.5 * nominal_m, gamma)
        if nominal is not None and abs(2.0 * nominal.circle.radius_m / nominal_m - 1.0) < _HELD_FAIRLY:
            if is_clear(nominal):
                return [nominal]
            other = follow(patches, mirrored(nominal.circle, camera), camera, 0.5 * nominal_m, gamma)
            found.extend([nominal] if other is None else [nominal, other])
        elif abs(diameter_m / nominal_m - 1.0) > _OF_ANOTHER_SIZE:
            return _as_found(left, right, circle)
    free = follow(patches, circle, camera, gamma=gamma)
    return [*found, free] if free is not None else found


def follow(
    patches: tuple[Patch, Patch],
    circle: SpaceCircle,
    camera: RectifiedCamera,
    held_m: float | None = None,
    gamma: float = DISPLAY_GAMMA,
) -> Pairing | None:
    """Follow both outlines along a circle's pictures and fit again, a few times; None where they aren't there.

    While the outlines are followed the radius may be `held_m`, so that a cover's edge can't shrink the circle; what is
    returned is fitted without that. `gamma` is as in `linear_light`: the kind of blur that is looked for.
    """
    blur_px, about_px, asked_at, settled_at = COLOUR_BLUR_PX, 0.0, _ROUNDS[0][0], 0.0
    left = right = None
    for slack, least in _ROUNDS:
        if slack == settled_at:
            continue
        guide, other = outlines_of(circle, camera)
        if guide is None or other is None:
            return None
        if slack < asked_at:
            # the same lens at the same distance: one blur for both photos; beside the outline it can't be measured
            profiles = [some_profiles(patch, e, about_px) for patch, e in zip(patches, (guide, other), strict=True)]
            blur_px = about_px = likely_blur(profiles, gamma)
            asked_at = slack
        left = followed(patches[0], guide, blur_px, slack, least, gamma)
        right = followed(patches[1], other, blur_px, slack, least, gamma)
        if left is None or right is None:
            return None
        # both tilts are asked while the outlines are not sure
        fitted = circle_of(left, right, camera, held_m, circle if slack < _ROUNDS[0][0] else None)
        if fitted is None:
            return None
        moved = np.hypot(*(fitted.centre_px - circle.centre_px)) + abs(fitted.disparity_px - circle.disparity_px)
        turned = left.ellipse.major_px * float(np.abs(fitted.normal - circle.normal).max())
        settled_at = slack if moved + turned < _SETTLED_PX else 0.0
        circle = fitted
    if left is None or right is None or min(left.support, right.support) < FIRST_SUPPORT:
        return None
    free = circle if held_m is None else circle_of(left, right, camera, start=circle)
    if free is None:
        return None
    found = Pairing(left=left, right=right, circle=free, blur_px=blur_px, gamma=gamma)
    return found if _fits(found) else None


def _as_found(left: RedDisc, right: RedDisc, circle: SpaceCircle) -> list[Pairing]:
    """Return what is no target, but may be worth a word."""
    found = Pairing(left=left, right=right, circle=circle)
    is_one = circle.rms_px < 0.5 + 0.02 * left.ellipse.major_px
    return [found] if is_one and min(left.support, right.support) >= MIN_SUPPORT else []


def _fits(found: Pairing) -> bool:
    """Say whether both outlines are one circle's: discs keep to 0.3 px and less, jackets and squares don't."""
    circle = found.circle
    if found.left.covered + found.right.covered > 2.0 * MOST_COVERED:
        return False
    unsure = float(np.sqrt(circle.covariance[2, 2])) / circle.disparity_px
    return circle.rms_px < 0.25 + 0.01 * found.left.ellipse.major_px and unsure < _MOST_UNSURE_DEPTH


def circle_of(
    left: RedDisc,
    right: RedDisc,
    camera: RectifiedCamera,
    held_m: float | None = None,
    start: SpaceCircle | None = None,
) -> SpaceCircle | None:
    """Return the circle in space that makes both outlines; its radius stays where it is `held_m`."""
    sigma = np.concatenate([left.sigma_px, right.sigma_px])
    return fit_circle(left.edge, right.edge, left.ellipse, right.ellipse, camera, sigma, held_m, start)


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
    """Say whether a circle has the target's diameter: the given one, or any plausible one."""
    diameter = 2.0 * circle.radius_m
    if options.diameter_m is None:
        return options.smallest_m <= diameter <= options.largest_m
    unsure = min(2.0 * diameter_sigma(circle), _MOST_UNSURE * options.diameter_m)
    return abs(diameter - options.diameter_m) <= options.diameter_tolerance * options.diameter_m + unsure


def sharpened(circle: SpaceCircle, options: TargetOptions, lean: float = 0.0) -> SpaceCircle:
    """Return a circle that takes the given diameter for what it is: one more observation of what the outlines show.

    It weighs little where they are sharp; in dusk or far away it halves what the distance errs by. A diameter that is
    in doubt isn't used: then the disc is another, or the rig was knocked, and only the photos count. An outline that
    may `lean` all round, relative to the radius, says as much less of how far away that size is.
    Reference: Kalman 1960, for one observation.
    """
    if options.diameter_m is None or in_doubt(circle, options):
        return circle
    spread = circle.covariance[:, 3]
    gain = spread / (spread[3] + _MADE_TO**2 + lean**2)
    change = gain * np.log(0.5 * options.diameter_m / circle.radius_m)
    return replace(
        circle,
        centre_px=frozen(circle.centre_px + change[:2]),
        disparity_px=circle.disparity_px + float(change[2]),
        radius_m=circle.radius_m * float(np.exp(change[3])),
        covariance=frozen(circle.covariance - np.outer(gain, spread)),
    )


def in_doubt(circle: SpaceCircle, options: TargetOptions) -> bool:
    """Say whether the given diameter comes out wrong by more than measuring it does."""
    if options.diameter_m is None:
        return False
    off = abs(2.0 * circle.radius_m / options.diameter_m - 1.0)
    return off > options.diameter_doubt + 2.0 * diameter_sigma(circle) / options.diameter_m


def likeliest(found: list[Pairing]) -> list[Pairing]:
    """Leave out what is much paler than the reddest."""
    reddest = max(pairing.left.redness for pairing in found)
    return [pairing for pairing in found if pairing.left.redness > PALE * reddest]
