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
from asbuilt_bim.vision.target.blur_kind import GREY_LEVELS, share_of_levels
from asbuilt_bim.vision.target.circle import SpaceCircle, between, outlines_of
from asbuilt_bim.vision.target.disc import FIRST_SUPPORT, followed, some_profiles
from asbuilt_bim.vision.target.edge_model import likely_blur
from asbuilt_bim.vision.target.pairing import Pairing, circle_of

_ROUNDS = 3
_SLACK = 2.0
"""Of the outline that was found: within less its own points are the only ones left, and it stays where it is."""
_SECONDS_SHARE = 0.7


def refined(found: Pairing, camera: RectifiedCamera, nominal_m: float | None) -> Pairing | None:
    """Return a pairing with the mean of both looks' circles; as it is where sharp, None where no second look has one.

    Where no size is given nothing says which kind the blur is, and it is taken for light's.
    """
    if not found.is_soft:
        return found
    light = second_circle(found, found.circle, camera, DISPLAY_GAMMA)
    start = found.circle if light is None or found.gamma == GREY_LEVELS else light
    levels = None if nominal_m is None else second_circle(found, start, camera, GREY_LEVELS)
    if nominal_m is None or light is None or levels is None:
        only = light or levels
        return None if only is None else replace(found, circle=between(found.circle, only, _SECONDS_SHARE))
    share = share_of_levels(found, (light, levels), camera, nominal_m)
    # the first look took the blur for one kind, and speaks of that alone
    if found.gamma == GREY_LEVELS:
        levels = between(found.circle, levels, _SECONDS_SHARE)
    else:
        light = between(found.circle, light, _SECONDS_SHARE)
    return replace(found, circle=_either(light, levels, share))


def second_circle(found: Pairing, circle: SpaceCircle, camera: RectifiedCamera, gamma: float) -> SpaceCircle | None:
    """Return the circle of the second way, from another on; None where it follows none. `gamma` as in `linear_light`.

    How much grey levels were blurred isn't what light would be.
    """
    patches = (found.left.patch, found.right.patch)
    blur_px = found.blur_px
    for turn in range(_ROUNDS):
        guide, other = outlines_of(circle, camera)
        if guide is None or other is None:
            return None
        both = list(zip(patches, (guide, other), strict=True))
        if turn == 0 and gamma != found.gamma:
            blur_px = likely_blur([some_profiles(patch, e, blur_px) for patch, e in both], gamma)
        left, right = (followed(patch, e, blur_px, _SLACK, FIRST_SUPPORT, gamma, is_soft=True) for patch, e in both)
        again = None if left is None or right is None else circle_of(left, right, camera, start=circle)
        if again is None:
            return None
        circle = again
    return circle


def _either(light: SpaceCircle, levels: SpaceCircle, share: float) -> SpaceCircle:
    """Return the mean of the circles of both kinds of blur; that it isn't known which is right makes it less sure."""
    mean = between(light, levels, share)
    apart = np.array([*(levels.centre_px - light.centre_px), levels.disparity_px - light.disparity_px, 0.0])
    unknown = share * (1.0 - share) * np.outer(apart, apart)
    return replace(mean, covariance=frozen(mean.covariance + unknown))
