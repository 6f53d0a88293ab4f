"""Which arc of an outline is not the circle's: a cover's blurred edge follows a disc's closely, and bends the fit.

Points err by whole arcs, so that no single one stands out; but without a foreign arc the others fit much better.
"""

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray
from asbuilt_bim.vision.target.ellipse import Ellipse

_ARCS = 12
_WIDTHS = (2, 3)
"""Of twelve arcs, next to each other: a cover of 30 % hides 40 % of an outline, and follows it along a quarter."""
_STRETCHES = np.array(
    [np.isin(np.arange(_ARCS), (first + np.arange(width)) % _ARCS) for width in _WIDTHS for first in range(_ARCS)]
)
"""Which arcs (24, 12) each stretch is made of."""
_STANDS_OUT = 6.0
"""How many times the others' mean square a stretch spoils. Ten points are one observation, so that a stretch is about
four and the rest twelve. With noise like that one good outline in seven loses a stretch, and a tenth of its
sharpness."""


def arcs_of(points: FloatArray, ellipse: Ellipse) -> IntArray:
    """Return which of the arcs (N,) round an ellipse points (N, 2) lie on, counted from the picture's x axis."""
    c, s = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    along, across = ((points - ellipse.centre) @ np.array([[c, -s], [s, c]])).T
    turn = np.arctan2(across / ellipse.minor_px, along / ellipse.major_px) + ellipse.angle_rad
    return np.asarray(np.floor(turn / (2.0 * np.pi) * _ARCS) % _ARCS, dtype=np.int32)


def without_foreign_arc(jacobian: FloatArray, residual: FloatArray, arcs: IntArray) -> BoolArray:
    """Return which points (N,) to keep: all, or all but those of the stretch of arcs that spoils the fit most.

    `jacobian` (N, P) and `residual` (N,) are weighted, at the least sum of squares.
    """
    each = [arcs == k for k in range(_ARCS)]
    normal = np.stack([jacobian[here].T @ jacobian[here] for here in each])
    slope = np.stack([jacobian[here].T @ residual[here] for here in each])
    square = np.bincount(arcs, weights=residual**2, minlength=_ARCS)
    count = np.bincount(arcs, minlength=_ARCS)
    lost, left = _STRETCHES @ count, count.sum() - _STRETCHES @ count
    hessian = np.tensordot(~_STRETCHES, normal, 1)
    gradient = ~_STRETCHES @ slope
    size = hessian.shape[-1]
    ridge = hessian * (1e-6 * np.eye(size)) + 1e-12 * np.eye(size)
    gained = np.sum(gradient * np.linalg.solve(hessian + ridge, gradient[..., None])[..., 0], axis=-1)
    better = ~_STRETCHES @ square - gained
    ratio = (square.sum() - better) / np.maximum(lost, 1) / np.maximum(better / np.maximum(left, 1), 1e-12)
    ratio[(lost < 4) | (left < 3 * lost // 2)] = 0.0
    worst = int(np.argmax(ratio))
    keep: BoolArray = ~_STRETCHES[worst][arcs] if ratio[worst] > _STANDS_OUT else np.ones(len(arcs), dtype=bool)
    return keep
