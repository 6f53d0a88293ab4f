"""How likely it is that an outline which two photos agree on is the target's and no other red thing's.

These are asked: how much of the outline is where the circle says, how much is further in or out, and how closely it
keeps to the circle. Also how evenly red the inside is, how red it is, how near the given diameter it comes and how sure
that is. What a cover hides counts neither way. A cover's own edge lies further in. Only something as red behind puts an
edge further out, so that this counts for more. Each answer has a weight, their sum is the logarithm of the odds, and
one limit decides, so that no single answer refuses a disc. The weights are counted, by regression on what discs and
other red things answer in development pairs (benchmarks/target/odds.py).
Reference: Cox 1958, the regression of binary sequences.
"""

import math

import numpy as np

from asbuilt_bim.vision.target.circle import POINTS_PER_OBSERVATION
from asbuilt_bim.vision.target.disc import RedDisc
from asbuilt_bim.vision.target.disc_sides import points_round
from asbuilt_bim.vision.target.pairing import Pairing, diameter_sigma

LEAST_ODDS = 0.0
"""Natural logarithm: likelier the target than not, were there as many other things as targets."""
SURE_ODDS = 3.0
"""Where nothing is as likely as that, the given size is looked for too: a jacket's back may hide a disc elsewhere."""
ANSWERS = (
    "outline seen",
    "edge further in",
    "edge further out",
    "as red beyond",
    "misfit, ln px",
    "unevenness, ln",
    "redness",
    "size off",
    "size unsure, ln",
)
WEIGHTS = (0.32, -0.5, -1.3, -1.5, -1.2, -1.1, 12.5, -0.85, -1.0)
"""Those of edges elsewhere were set on some 800 pairs (seeds 60 to 64, 80, 82 and 1300). Counted, they are -0.3 to -0.9
and -0.9 to -2.0. Between them the fewest were missed or wrong. The few recorded things (seeds 70, 71) alone say -1.0
and -0.5: it isn't settled. A size that is sure says more than one that isn't: were all sizes as likely for other
things, just by this logarithm (counted -1.1 to -1.6)."""
BASE = -14.0
"""The logarithm of the odds of what answers nothing. Counted it was -16.3. Edges that are placed in two passes answer
more strictly: discs' odds fell by about 1, other things' by 3 (some 50 of the same pairs). The limit lies between."""
_MOST_ELSEWHERE = 6.0  # observations
_MOST_OVERRUN = 2.0  # observations: a disc before something as red, rare as it is, loses much of its outline
_LEAST_RMS_PX, _LEAST_UNEVEN = 0.03, 0.01  # noise and JPEG leave no less
_RED = 0.57  # red paint in dusk and noise; in good light it is redder still
_MADE_TO = 0.008  # of the diameter: a disc's spread
_MOST_OFF = 8.0  # the rig may be knocked
_MOST_UNSURE = 10.0  # times a disc's spread


def log_odds(found: Pairing, nominal_m: float | None) -> float:
    """Return the natural logarithm of the odds that a pairing is a red disc, of the given diameter if there is one."""
    return BASE + sum(weight * answer for weight, answer in zip(WEIGHTS, answers(found, nominal_m), strict=True))


def answers(found: Pairing, nominal_m: float | None) -> tuple[float, ...]:
    """Return what a pairing answers, in the order of `ANSWERS`."""
    sides = (found.left, found.right)
    off, unsure = 0.0, 1.0
    if nominal_m is not None:
        spread = math.hypot(_MADE_TO, diameter_sigma(found.circle) / nominal_m)
        unsure = min(spread / _MADE_TO, _MOST_UNSURE)
        off = min(((2.0 * found.circle.radius_m / nominal_m - 1.0) / spread) ** 2, _MOST_OFF)
    return (
        sum(_observations(side) * side.support for side in sides),
        min(sum(_observations(side) * side.astray for side in sides), _MOST_ELSEWHERE),
        min(sum(_observations(side) * side.further for side in sides), _MOST_ELSEWHERE),
        min(sum(_observations(side) * side.overrun for side in sides), _MOST_OVERRUN),
        math.log(max(found.circle.rms_px, _LEAST_RMS_PX)),
        math.log(max(float(np.mean([side.uneven for side in sides])), _LEAST_UNEVEN)),
        min(float(np.mean([side.redness for side in sides])), _RED),
        off,
        math.log(unsure),
    )


def _observations(disc: RedDisc) -> float:
    return points_round(disc.ellipse) / POINTS_PER_OBSERVATION
