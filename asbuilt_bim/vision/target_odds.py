"""How likely it is that an outline which two photos agree on is the target's and no other red thing's.

Four things are asked, each by how often discs and other red things answer so: whether the outline is where the circle
says, how evenly red the inside is, how red it is, and how near the told diameter it comes. What a cover hides counts
neither way. The logarithms of the odds are added, and one limit decides, so that no single answer refuses a disc.
Reference: Good 1950, weights of evidence. The numbers were set by hand on some 25 development pairs and the stations of
eleven development sites (benchmarks/target.py); shares in the comments are of those few. `benchmarks/target_odds.py`
counts over other pairs what discs and other things answer, and how far the limit parts them.
"""

from __future__ import annotations

import math

import numpy as np

from asbuilt_bim.vision.disc import RedDisc, points_round
from asbuilt_bim.vision.target_pairing import Pairing, diameter_sigma

LEAST_ODDS = 4.5
"""Natural logarithm: of things with odds like that one in 90 is no target. Discs have 7 and more, others -7 to 3."""
_POINTS_PER_OBSERVATION = 10.0  # neighbours on an outline err together
_SEEN = 0.35  # of each observation: a disc's edge is on the circle for 90 % of what isn't covered, others' for 63 %
_ASTRAY = (
    0.10  # one sigma of the share that has its edge further in, or none, in each photo: covers and noise make some
)
_OVERRUN = (
    2.2  # of each observation that has no edge here because what is beyond is as red: 2 % of a disc's, others' 17 %
)
_BEFORE_RED = 5.0  # but a disc before something as red, rare as it is, loses much of its outline: no more than this
_EVEN, _UNEVEN = (math.log(0.03), 0.6), (math.log(0.10), 0.7)
"""What the redness inside differs by, as a logarithm: a disc's by noise and dirt, other things' by what they are."""
_RED, _RED_SPREAD, _REDS = 0.57, 0.08, 0.6
"""Redness of red paint in dusk and noise (in good light it is redder still); other red things have any of `_REDS`."""
_MADE_TO, _SIZES = 0.008, 0.18  # of the diameter: a disc's spread; a thing of about the size has any of `_SIZES`
_MOST_AGAINST = 4.0
"""No answer but the outline's counts for more: the light or the lens may be odd, the rig knocked."""


def log_odds(found: Pairing, told_m: float | None) -> float:
    """Return the natural logarithm of the odds that a pairing is a red disc, of the told diameter if there is one."""
    sides = (found.left, found.right)
    odds = sum(_SEEN * _observations(side) * side.support - 0.5 * (side.astray / _ASTRAY) ** 2 for side in sides)
    odds -= min(sum(_OVERRUN * _observations(side) * side.overrun for side in sides), _BEFORE_RED)
    odds += _capped(float(np.mean([_evenness(side) for side in sides])))
    red = min(float(np.mean([side.redness for side in sides])), _RED)
    odds += _capped(_bell(red, _RED, _RED_SPREAD) + math.log(_REDS))
    if told_m is not None:
        off = 2.0 * found.circle.radius_m / told_m - 1.0
        spread = math.hypot(_MADE_TO, diameter_sigma(found.circle) / told_m)
        odds += _capped(_bell(off, 0.0, spread) + math.log(_SIZES))
    return odds


def _observations(disc: RedDisc) -> float:
    return points_round(disc.ellipse) / _POINTS_PER_OBSERVATION


def _evenness(disc: RedDisc) -> float:
    spread = math.log(max(disc.uneven, 1e-3))
    return _bell(max(spread, _EVEN[0]), *_EVEN) - _bell(max(spread, _EVEN[0]), *_UNEVEN)


def _bell(value: float, middle: float, spread: float) -> float:
    """Return the logarithm of a normal density."""
    return -0.5 * ((value - middle) / spread) ** 2 - math.log(spread * math.sqrt(2.0 * math.pi))


def _capped(odds: float) -> float:
    return max(odds, -_MOST_AGAINST)
