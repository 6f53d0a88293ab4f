"""The target's circle where the lens is out of focus: two ways to place its outline, that err apart, and their mean.

`edge_model` takes what is behind a disc for one colour at each edge, `soft_edges` for unknown. Before what changes
within a blur's reach the first errs with it, the second by noise. On 218 development discs whose light was blurred they
err by 0.35 and 0.28 % of the distance (rms, correlation 0.5). Of their mean the second makes 70 %.

Both take it that light was blurred. A resampler, a noise filter or a viewer that saves a copy blurs grey levels: a disc
before something brighter then comes out too large, or too near. So the second look takes the blur for either kind, and
each circle counts by how likely its kind is (`blur_kind`).
"""

from dataclasses import replace

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.edges import DISPLAY_GAMMA
from asbuilt_bim.vision.target.blur_kind import GREY_LEVELS, off, share_of_levels, spread
from asbuilt_bim.vision.target.circle import SpaceCircle, between, outlines_of
from asbuilt_bim.vision.target.disc import FIRST_SUPPORT, followed, some_profiles
from asbuilt_bim.vision.target.edge_model import COLOUR_BLUR_PX, likely_blur
from asbuilt_bim.vision.target.odds import SURE_ODDS, log_odds
from asbuilt_bim.vision.target.pairing import Pairing, TargetOptions, circle_of, follow, size_fits

_ROUNDS = 3
_SLACK = 2.0
"""Of the outline that was found: within less its own points are the only ones left, and it stays where it is."""
_SECONDS_SHARE = 0.7
_MOST_OFF = 3.0  # of a second look's usual spreads
_MAY_BE_OFF = 0.15  # of the given diameter: no outline that is taken for the other kind's leans by more


def of_grey_levels(found: list[Pairing], camera: RectifiedCamera, nominal_m: float) -> list[Pairing]:
    """Return blurred discs of the given diameter as their outlines lie where grey levels were blurred, and not light.

    Followed as light's, a dark disc before something bright looks larger, by another amount at each stretch of its
    outline, and may be no disc at all. One look at a place: along the likeliest circle there.
    """
    again: list[Pairing] = []
    tried: list[Pairing] = []
    for one in sorted(found, key=lambda p: -log_odds(p, nominal_m)):
        if not _is_soft(one) or off(one.circle, nominal_m) > _MAY_BE_OFF:
            continue
        if any(np.hypot(*(one.circle.centre_px - p.circle.centre_px)) < p.left.ellipse.major_px for p in tried):
            continue
        guess, patches = replace(one.circle, radius_m=0.5 * nominal_m), (one.left.patch, one.right.patch)
        other = follow(patches, guess, camera, 0.5 * nominal_m, GREY_LEVELS)
        if other is not None:
            tried.append(one)
            as_lights_px = _blur_px(other, other.circle, camera, DISPLAY_GAMMA)
            again.append(replace(other, blur_px=as_lights_px, is_of_levels=True))
    return again


def looked_at_again(found: Pairing, camera: RectifiedCamera, nominal_m: float | None) -> Pairing:
    """Return a pairing with its second look, where it is worth one and follows a circle; as it is where not.

    A look that is off the given size by more than its usual spread takes the blur for one of grey levels, too.
    """
    if not _is_soft(found) or found.second is not None or found.levels is not None:
        return found
    light = _second_circle(found, camera, DISPLAY_GAMMA)
    is_lights = light is not None and nominal_m is not None and off(light, nominal_m) <= spread(light, nominal_m)
    if nominal_m is None or (is_lights and not found.is_of_levels):
        return replace(found, second=light)
    return replace(found, second=light, levels=_of_levels(found, light, camera))


def refined(found: Pairing, camera: RectifiedCamera, nominal_m: float | None) -> Pairing:
    """Return a pairing with the mean of both looks' circles; as it is where there was no second one.

    Where no size is given nothing says which kind the blur is, and it is taken for light's.
    """
    light, levels = found.second, found.levels
    if light is None:
        share = _SECONDS_SHARE if found.is_of_levels else 0.5
        return found if levels is None else replace(found, circle=between(found.circle, levels, share))
    of_light = light if found.is_of_levels else between(found.circle, light, _SECONDS_SHARE)
    if nominal_m is not None and levels is None:
        levels = _of_levels(found, light, camera)
    if nominal_m is None or levels is None:
        return replace(found, circle=of_light)
    of_levels = between(found.circle, levels, _SECONDS_SHARE) if found.is_of_levels else levels
    share = share_of_levels(found, light, levels, camera, nominal_m)
    return replace(found, circle=_either(of_light, of_levels, share))


def stands(found: Pairing, options: TargetOptions) -> bool:
    """Say whether a second look, where it is worth one, saw a circle of the target's size too.

    Each of 279 blurred development discs has it to 2.8 %; one that is covered and leans may leave its size open, and
    has it to 1.5 sigma. A jacket's or half a disc's outline is a circle only as the first way has it. What would surely
    be a disc but for its size may be off by more: so it is where the rig was knocked, or a wrong diameter was given.
    """
    if not _is_soft(found):
        return True
    second = _nearer(found, options.diameter_m)
    if second is None or not size_fits(second, options):
        return False
    if options.diameter_m is None or log_odds(found, None) > SURE_ODDS:
        return True
    return off(second, options.diameter_m) <= _MOST_OFF * spread(second, options.diameter_m)


def _of_levels(found: Pairing, light: SpaceCircle | None, camera: RectifiedCamera) -> SpaceCircle | None:
    """Return the second look's circle where grey levels were blurred; how much they were isn't what light would be."""
    start = found.circle if light is None or found.is_of_levels else light
    blur_px = _blur_px(found, start, camera, GREY_LEVELS)
    return _second_circle(replace(found, blur_px=blur_px), camera, GREY_LEVELS) if blur_px else None


def _blur_px(found: Pairing, circle: SpaceCircle, camera: RectifiedCamera, gamma: float) -> float:
    """Return how much either kind was blurred, as profiles across a circle's outlines tell it; 0 where none do."""
    patches = (found.left.patch, found.right.patch)
    guides = outlines_of(circle, camera)
    profiles = [some_profiles(patch, e, found.blur_px) for patch, e in zip(patches, guides, strict=True) if e]
    return likely_blur(profiles, gamma) if len(profiles) == len(patches) else 0.0


def _second_circle(found: Pairing, camera: RectifiedCamera, gamma: float) -> SpaceCircle | None:
    """Return the circle of the second way; None where it follows none. `gamma` is as in `place_soft_edges`."""
    circle = found.circle
    for _ in range(_ROUNDS):
        guides = outlines_of(circle, camera)
        if guides[0] is None or guides[1] is None:
            return None
        left = followed(found.left.patch, guides[0], found.blur_px, _SLACK, FIRST_SUPPORT, gamma, is_soft=True)
        right = followed(found.right.patch, guides[1], found.blur_px, _SLACK, FIRST_SUPPORT, gamma, is_soft=True)
        again = None if left is None or right is None else circle_of(left, right, camera, start=circle)
        if again is None:
            return None
        circle = again
    return circle


def _nearer(found: Pairing, nominal_m: float | None) -> SpaceCircle | None:
    """Return the second look's circle that comes nearer the given size, of those kinds of blur that were looked at."""
    light, levels = found.second, found.levels
    if light is None or levels is None or nominal_m is None:
        return light or levels
    return levels if off(levels, nominal_m) < off(light, nominal_m) else light


def _either(light: SpaceCircle, levels: SpaceCircle, share: float) -> SpaceCircle:
    """Return the mean of the circles of both kinds of blur; that it isn't known which is right makes it less sure."""
    mean = between(light, levels, share)
    apart = np.array([*(levels.centre_px - light.centre_px), levels.disparity_px - light.disparity_px, 0.0])
    unknown = share * (1.0 - share) * np.outer(apart, apart)
    return replace(mean, covariance=frozen(mean.covariance + unknown))


def _is_soft(found: Pairing) -> bool:
    """Say whether what is behind bends an edge: where the lens blurs less than JPEG's halved colours do, these do."""
    return found.blur_px >= COLOUR_BLUR_PX
