"""Which arc of an outline is not the circle's: a cover's blurred edge follows a disc's closely, and bends the fit.

Points err by whole arcs, so that no single one stands out; but without a foreign arc the others fit much better.
"""

from __future__ import annotations

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray
from asbuilt_bim.vision.ellipse import Ellipse

_ARCS = 12
_WIDTHS = (2, 3)
"""Of twelve arcs, next to each other: a cover of 30 % hides 40 % of an outline, and follows it along a quarter."""
_STANDS_OUT = 6.0
"""How many times the others' mean square a stretch spoils. Ten points are one observation, so that a stretch is about
four and the rest twelve: with noise like that one good outline in seven loses a stretch, and a tenth of its sharpness.
"""


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
    normal = np.stack([jacobian[arcs == k].T @ jacobian[arcs == k] for k in range(_ARCS)])
    slope = np.stack([jacobian[arcs == k].T @ residual[arcs == k] for k in range(_ARCS)])
    square = np.bincount(arcs, weights=residual**2, minlength=_ARCS)
    count = np.bincount(arcs, minlength=_ARCS)
    keep, most = np.ones(len(arcs), dtype=bool), _STANDS_OUT
    for width in _WIDTHS:
        for first in range(_ARCS):
            out = (np.arange(first, first + width)) % _ARCS
            kept = np.setdiff1d(np.arange(_ARCS), out)
            lost, left = int(count[out].sum()), int(count[kept].sum())
            if lost < 4 or left < 3 * lost // 2:
                continue
            hessian, gradient = normal[kept].sum(axis=0), slope[kept].sum(axis=0)
            ridge = 1e-6 * np.diag(np.diag(hessian)) + 1e-12 * np.eye(len(hessian))
            better = float(square[kept].sum() - gradient @ np.linalg.solve(hessian + ridge, gradient))
            ratio = (float(square.sum()) - better) / lost / max(better / left, 1e-12)
            if ratio > most:
                keep, most = ~np.isin(arcs, out), ratio
    return keep
