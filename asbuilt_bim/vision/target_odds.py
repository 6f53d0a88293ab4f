"""How likely it is that an outline which two photos agree on is the target's and no other red thing's.

Five things are asked: how much of the outline is where the circle says and how much isn't, how closely it keeps to the
circle, how evenly red the inside is, how red it is, and how near the told diameter it comes. What a cover hides counts
neither way. Each answer has a weight, their sum is the logarithm of the odds, and one limit decides, so that no single
answer refuses a disc. The weights are counted, by regression on what discs and other red things answer in development
pairs (benchmarks/target_odds.py).
Reference: Cox 1958, the regression of binary sequences.
"""

from __future__ import annotations

import math

import numpy as np

from asbuilt_bim.vision.disc import RedDisc
from asbuilt_bim.vision.disc_sides import points_round
from asbuilt_bim.vision.target_pairing import Pairing, diameter_sigma

LEAST_ODDS = 0.0
"""Natural logarithm: likelier the target than not, were there as many other things as targets."""
SURE_ODDS = 3.0
"""Where nothing is as likely as that, the told size is looked for too: a jacket's back may hide a disc elsewhere."""
ANSWERS = (
    "outline seen",
    "outline elsewhere",
    "as red beyond",
    "misfit, ln px",
    "unevenness, ln",
    "redness",
    "size off",
)
WEIGHTS = (0.32, -0.77, -1.5, -1.2, -1.1, 12.5, -0.85)
BASE = -14.7
"""The logarithm of the odds of what answers nothing. Counted it was -16.3; edges that are placed in two passes answer
more strictly: discs' odds fell by about 1, other things' by 3 (some 50 of the same pairs), and the limit lies between.
"""
_POINTS_PER_OBSERVATION = 10.0  # neighbours on an outline err together
_MOST_ELSEWHERE = 6.0  # observations
_MOST_BEYOND = 2.0  # observations: a disc before something as red, rare as it is, loses much of its outline
_LEAST_RMS_PX, _LEAST_UNEVEN = 0.03, 0.01  # noise and JPEG leave no less
_SEARCHED_PX = 1.2  # to both sides, over the root of 2 pi e
_RED = 0.57  # red paint in dusk and noise; in good light it is redder still
_MADE_TO = 0.008  # of the diameter: a disc's spread
_MOST_OFF = 8.0  # the rig may be knocked


def log_odds(found: Pairing, told_m: float | None) -> float:
    """Return the natural logarithm of the odds that a pairing is a red disc, of the told diameter if there is one."""
    return BASE + sum(weight * answer for weight, answer in zip(WEIGHTS, answers(found, told_m), strict=True))


def answers(found: Pairing, told_m: float | None) -> tuple[float, ...]:
    """Return what a pairing answers, in the order of `ANSWERS`."""
    sides = (found.left, found.right)
    elsewhere = sum(_observations(side) * (side.astray + side.further) for side in sides)
    off = 0.0
    if told_m is not None:
        spread = math.hypot(_MADE_TO, diameter_sigma(found.circle) / told_m)
        off = min(((2.0 * found.circle.radius_m / told_m - 1.0) / spread) ** 2, _MOST_OFF)
    return (
        sum(_observations(side) * side.support for side in sides),
        min(elsewhere, _MOST_ELSEWHERE),
        min(sum(_observations(side) * side.overrun for side in sides), _MOST_BEYOND),
        math.log(max(found.circle.rms_px, _LEAST_RMS_PX)),
        math.log(max(float(np.mean([side.uneven for side in sides])), _LEAST_UNEVEN)),
        min(float(np.mean([side.redness for side in sides])), _RED),
        off,
    )


def sharpness(found: Pairing) -> float:
    """Return the logarithm of how well a circle explains its outlines, against others about the same place.

    A point that is on the outline keeps to the circle as all do, one that isn't may lie anywhere within the search.
    """
    spread = max(found.circle.rms_px, _LEAST_RMS_PX) / _SEARCHED_PX
    return -math.log(spread) * sum(_observations(side) * side.support for side in (found.left, found.right))


def _observations(disc: RedDisc) -> float:
    return points_round(disc.ellipse) / _POINTS_PER_OBSERVATION
