"""The target's circle where the lens is out of focus: two ways to place its outline, that err apart, and their mean.

`edge_model` takes what is behind a disc for one colour at each edge, `soft_edges` for unknown. Before what changes
within a blur's reach the first errs with it, the second by noise; each is as good as the other on average (rms 0.33 %
of the distance on 199 blurred development pairs), and their mean is better than either.

Both take it that light was blurred. A resampler, a noise filter or a viewer that saves a copy blurs grey levels: a disc
before something brighter then comes out too large. So a second look that is off the told size takes the blur for one of
grey levels too, and keeps what comes nearer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.circle import SpaceCircle, outlines_of
from asbuilt_bim.vision.disc import FIRST_SUPPORT, followed
from asbuilt_bim.vision.edge_model import COLOUR_BLUR_PX
from asbuilt_bim.vision.edges import DISPLAY_GAMMA
from asbuilt_bim.vision.target_odds import SURE_ODDS, log_odds
from asbuilt_bim.vision.target_pairing import Pairing, TargetOptions, circle_of, diameter_sigma, size_fits

_ROUNDS = 3
_SLACK = 2.0
"""Of the outline that was found: within less its own points are the only ones left, and it stays where it is."""
_GREY_LEVELS = 1.0  # gamma
_SIZE_SPREAD, _SCATTER_SHOWN = 0.0093, 0.5
"""Of the told diameter: what a second look's differs from it by, rms of 215 blurred development discs. It grows with
the size's own sigma, by half of it: 26 of which that is 1.5 % and more differ by 1.3 %, where it is 2.3."""
_MOST_OFF = 3.0  # of these spreads


def looked_at_again(found: Pairing, camera: RectifiedCamera, told_m: float | None) -> Pairing:
    """Return a pairing with its second look, where it is worth one and follows a circle; as it is where not.

    Of 44 development discs whose grey levels were blurred 28 are taken so, and 14 of 235 whose light was: of the first
    the distance errs by 0.26 % then (rms) and not 0.54, of the others by 0.43 and not 0.41.
    """
    if not _is_soft(found) or found.second is not None:
        return found
    light = _second_circle(found, camera, DISPLAY_GAMMA)
    if told_m is None or (light is not None and _off(light, told_m) <= _spread(light, told_m)):
        return replace(found, second=light)
    levels = _second_circle(found, camera, _GREY_LEVELS)
    if levels is not None and (light is None or _off(levels, told_m) < _off(light, told_m)):
        return replace(found, second=levels)
    return replace(found, second=light)


def refined(found: Pairing) -> Pairing:
    """Return a pairing with the mean of both looks' circles; as it is where there was no second one."""
    return found if found.second is None else replace(found, circle=_mean(found.circle, found.second))


def stands(found: Pairing, options: TargetOptions) -> bool:
    """Say whether a second look, where it is worth one, saw a circle of the target's size too.

    Each of 279 blurred development discs has it to 2.8 %; one that is covered and leans may leave its size open, and
    has it to 1.5 sigma. A jacket's or half a disc's outline is a circle only as the first way has it. What would surely
    be a disc but for its size may be off by more: so it is where the rig was knocked, or the diameter told wrong.
    """
    if not _is_soft(found):
        return True
    if found.second is None or not size_fits(found.second, options):
        return False
    if options.diameter_m is None or log_odds(found, None) > SURE_ODDS:
        return True
    return _off(found.second, options.diameter_m) <= _MOST_OFF * _spread(found.second, options.diameter_m)


def _second_circle(found: Pairing, camera: RectifiedCamera, gamma: float) -> SpaceCircle | None:
    """Return the circle of the second way; None where it follows none."""
    circle = found.circle
    for _ in range(_ROUNDS):
        guides = outlines_of(circle, camera)
        if guides[0] is None or guides[1] is None:
            return None
        left = followed(found.left.patch, guides[0], found.blur_px, _SLACK, FIRST_SUPPORT, gamma)
        right = followed(found.right.patch, guides[1], found.blur_px, _SLACK, FIRST_SUPPORT, gamma)
        again = None if left is None or right is None else circle_of(left, right, camera, start=circle)
        if again is None:
            return None
        circle = again
    return circle


def _off(circle: SpaceCircle, told_m: float) -> float:
    return abs(2.0 * circle.radius_m / told_m - 1.0)


def _spread(circle: SpaceCircle, told_m: float) -> float:
    """Return by how much of its size a disc's second circle is usually off it."""
    return max(_SIZE_SPREAD, _SCATTER_SHOWN * diameter_sigma(circle) / told_m)


def _is_soft(found: Pairing) -> bool:
    """Say whether what is behind bends an edge: where the lens blurs less than JPEG's halved colours do, these do."""
    return found.blur_px >= COLOUR_BLUR_PX


def _mean(one: SpaceCircle, other: SpaceCircle) -> SpaceCircle:
    """Return the circle between two of nearly the same place; it leans as the second one does.

    Both saw the same photos: their mean isn't taken for surer than they are.
    """
    return replace(
        other,
        centre_px=frozen(0.5 * (one.centre_px + other.centre_px)),
        disparity_px=0.5 * (one.disparity_px + other.disparity_px),
        radius_m=float(np.sqrt(one.radius_m * other.radius_m)),
        covariance=frozen(0.5 * (one.covariance + other.covariance)),
    )
