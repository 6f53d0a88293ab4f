"""Whether a disc's light was blurred or its grey levels: what its size says of it, and the shape of its edges.

A lens blurs light; a resampler, a noise filter or a viewer that saves a copy blurs grey levels. Taken for the other
kind, a disc before something brighter or darker comes out some 2 % too large or small. But what is behind may hide that
or look like it, so neither kind is ever sure: it is asked how likely each is.

Reference: Cox 1958, the regression of binary sequences.
"""

import math

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.vision.edges import DISPLAY_GAMMA
from asbuilt_bim.vision.target.circle import SpaceCircle, between, outlines_of
from asbuilt_bim.vision.target.disc_sides import outline_of
from asbuilt_bim.vision.target.edge_model import COLOUR_BLUR_PX, misfits, profiles_across
from asbuilt_bim.vision.target.pairing import Pairing, diameter_sigma

GREY_LEVELS = 1.0  # gamma
SIZE_SPREAD, SCATTER_SHOWN = 0.0093, 0.5
"""Of the given diameter: what a second look's differs from it by, rms of 215 blurred development discs. It grows with
the size's own sigma, by half of it: 26 of which that is 1.5 % and more differ by 1.3 %, where it is 2.3."""
_WEIGHTS, _BASE = (0.35, 5.0), -1.2
"""Of what size and shape say, and of nothing. Counted by regression they are 0.85, 12 and -1.7 (445 discs, 74 of them
blurred as grey levels). But what is behind misleads both answers at once, and where they mislead, so do the circles.
Less than half of that errs least in the distance, on each of four seeds."""
_NO_DISC_AS_LIGHTS = 2.0
"""What it says for grey levels that a disc's outline is likelier a disc's as blurred grey levels show it.

It was found only so with one of twenty discs whose grey levels were blurred, and with few of the others.
"""
_MOST_OFF = 2.0  # of these spreads: what is further off says no more
_REACH = 2.5  # blurs: an edge's shape is known as far as it reaches
_BLURS = (0.87, 1.0, 1.15, 1.32)  # of the lens's: taken for the other kind an edge looks as much sharper
_FITTED = 0.75  # of the profiles: before another thing's edge nothing fits
_LEAST_MISFIT = 1e-9  # of full scale, squared
_SOME = 2  # every second edge point


def off(circle: SpaceCircle, nominal_m: float) -> float:
    """Return by how much, of the given diameter, a circle's differs from it."""
    return abs(2.0 * circle.radius_m / nominal_m - 1.0)


def spread(circle: SpaceCircle, nominal_m: float) -> float:
    """Return by how much of its size a disc's second circle is usually off it."""
    return max(SIZE_SPREAD, SCATTER_SHOWN * diameter_sigma(circle) / nominal_m)


def share_of_levels(
    found: Pairing, kinds: tuple[SpaceCircle, SpaceCircle], camera: RectifiedCamera, nominal_m: float
) -> float:
    """Return how likely it is, 0..1, that grey levels were blurred, by the second looks' circles of both kinds."""
    answered = answers(found, kinds, camera, nominal_m)
    odds = _BASE + sum(weight * answer for weight, answer in zip(_WEIGHTS, answered, strict=True))
    if found.gamma == GREY_LEVELS:
        odds += _NO_DISC_AS_LIGHTS
    return 1.0 / (1.0 + math.exp(-odds))


def answers(
    found: Pairing, kinds: tuple[SpaceCircle, SpaceCircle], camera: RectifiedCamera, nominal_m: float
) -> tuple[float, float]:
    """Return the evidence for grey levels: how many squared spreads they come nearer the given size and the shape."""
    of_light, of_levels = (min(off(c, nominal_m) / spread(c, nominal_m), _MOST_OFF) ** 2 for c in kinds)
    return of_light - of_levels, _shape(found, between(*kinds, 0.5), camera)


def _shape(found: Pairing, circle: SpaceCircle, camera: RectifiedCamera) -> float:
    """Return the logarithm of how much worse edges of blurred light fit than edges of blurred grey levels.

    Each kind fits best along its own circle, so that both are asked along one between them.
    """
    reach = _REACH * math.hypot(found.blur_px, COLOUR_BLUR_PX)
    profiles = []
    for disc, ellipse in zip((found.left, found.right), outlines_of(circle, camera), strict=True):
        if ellipse is None:
            return 0.0
        points, outward = outline_of(ellipse)
        at = points - disc.patch.corner
        profiles.append(profiles_across(disc.patch.planes, at[::_SOME], outward[::_SOME], reach))
    return math.log(_misfit(profiles, found.blur_px, DISPLAY_GAMMA) / _misfit(profiles, found.blur_px, GREY_LEVELS))


def _misfit(profiles: list[FloatArray], blur_px: float, gamma: float) -> float:
    """Return by how much most of the profiles miss an edge of the blur that fits them best."""
    means = []
    for times in _BLURS:
        each = np.concatenate([misfits(some, times * blur_px, gamma) for some in profiles])
        each = np.sort(each[np.isfinite(each)])
        means.append(float(each[: max(1, int(_FITTED * len(each)))].mean()) if len(each) else 1.0)
    return max(min(means), _LEAST_MISFIT)
