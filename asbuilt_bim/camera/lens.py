"""Lenses: how each bends a ray, how a bent one is made straight again, and how far out that can be undone."""

from typing import Literal, get_args

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray

LensModel = Literal["five", "rational", "fisheye"]
"""five: k1 k2 p1 p2 k3. rational: k1 k2 p1 p2 k3 k4 k5 k6. fisheye: k1 k2 k3 k4 of the angle (equidistant)."""
LENS_MODELS: tuple[LensModel, ...] = get_args(LensModel)
COEFFICIENT_NAMES: dict[LensModel, tuple[str, ...]] = {
    "five": ("k1", "k2", "p1", "p2", "k3"),
    "rational": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}
COEFFICIENTS: dict[LensModel, int] = {model: len(names) for model, names in COEFFICIENT_NAMES.items()}
_MODEL_OF = {count: model for model, count in COEFFICIENTS.items()}

WIDEST_RAD = np.deg2rad(88.0)
"""Directions are kept as x/z and y/z; at 90 degrees there are none."""
_REACH_STEPS = 2000
_NEWTON_STEPS = 30
_STILL = 1e-13  # of a focal length: under 1e-9 px


def lens_of(distortion: FloatArray) -> LensModel:
    """Return the model that a lens's coefficients (4,), (5,) or (8,) belong to.

    Raises: ValueError for another number or shape of them.
    """
    if np.ndim(distortion) != 1:  # OpenCV's own are (1, 5)
        raise ValueError(f"distortion has the shape {np.shape(distortion)}; give its numbers flat: distortion.ravel()")
    model = _MODEL_OF.get(len(distortion))
    if model is None:
        raise ValueError(f"a lens has 4 (fisheye), 5 or 8 (rational) coefficients, not {len(distortion)}")
    return model


def bend(distortion: FloatArray, xy: FloatArray) -> FloatArray:
    """Bend ideal coordinates (..., 2), x/z and y/z, as the lens does.

    Reference: Brown 1966 and OpenCV's rational form; Kannala & Brandt 2006 for the fisheye.
    """
    return _bent(distortion, xy)[0]


def straighten(distortion: FloatArray, bent: FloatArray) -> FloatArray:
    """Return the ideal coordinates (..., 2) that the lens bends to `bent`; NaN where there are none within its reach.

    Newton's method: a lens has no closed inverse. Beyond the reach the polynomial folds back and answers are chance.
    """
    limit = reach(distortion)
    if len(distortion) == COEFFICIENTS["fisheye"]:
        return _straight_fisheye(distortion, bent, limit)
    flat = np.array(bent, dtype=np.float64).reshape(-1, 2)
    xy = flat * np.minimum(1.0, limit / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12))
    step = np.full_like(xy, np.inf)
    for _ in range(_NEWTON_STEPS):
        here, jacobian = _bent(distortion, xy)
        a, b, c = jacobian[:, 0], jacobian[:, 1], jacobian[:, 2]
        dx, dy = (flat - here).T
        determinant = np.maximum(a * c - b * b, 1e-3)  # on the fold there is no inverse: creep instead of leaping
        step = np.stack([(c * dx - b * dy) / determinant, (a * dy - b * dx) / determinant], axis=-1)
        length = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1.0, 0.25 / np.maximum(length, 1e-300))
        xy = xy + step
        if not len(xy) or float(np.abs(step).max()) < _STILL:
            break
    lost = (np.abs(step).max(axis=1) > 1e-9) | (np.linalg.norm(xy, axis=1) > limit) if len(xy) else np.zeros(0, bool)
    xy[lost] = np.nan
    straight: FloatArray = xy.reshape(bent.shape)
    return straight


def reach(distortion: FloatArray) -> float:
    """Return the tangent of the angle off the axis up to which the lens can be undone: where it folds back, or 88."""
    if len(distortion) == COEFFICIENTS["fisheye"]:
        angle = np.linspace(0.0, WIDEST_RAD, _REACH_STEPS)
        return float(np.tan(_until_it_turns(angle, angle * _angle_scale(distortion, angle * angle))))
    # Steps finest near the axis, where site lenses end.
    radius = np.tan(np.linspace(0.0, WIDEST_RAD, _REACH_STEPS))
    with np.errstate(divide="ignore", invalid="ignore"):
        return _until_it_turns(radius, radius * _radial(distortion, radius * radius)[0])


def _until_it_turns(outward: FloatArray, bent: FloatArray) -> float:
    back = np.nonzero(~(np.diff(bent) > 0.0))[0]
    return float(outward[back[0]] if len(back) else outward[-1])


def _radial(distortion: FloatArray, r2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the radial scale (...) at squared radii, and its derivative by the squared radius."""
    k1, k2, _, _, k3 = distortion[:5]
    above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    above_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
    if len(distortion) == COEFFICIENTS["five"]:
        return above, above_slope
    k4, k5, k6 = distortion[5:8]
    below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    below_slope = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6)
    return above / below, (above_slope * below - above * below_slope) / (below * below)


def _angle_scale(distortion: FloatArray, squared: FloatArray) -> FloatArray:
    """Return bent angle over true angle at squared angles (...)."""
    k1, k2, k3, k4 = distortion
    scale: FloatArray = 1.0 + squared * (k1 + squared * (k2 + squared * (k3 + squared * k4)))
    return scale


def _bent(distortion: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the bent coordinates (..., 2) and the Jacobian (..., 3): dx'/dx, dx'/dy = dy'/dx, dy'/dy (not fisheye)."""
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    if len(distortion) == COEFFICIENTS["fisheye"]:
        radius = np.sqrt(r2)
        angle = np.arctan(radius)
        scale = np.where(radius > 1e-9, angle / np.maximum(radius, 1e-9), 1.0)
        return xy * (scale * _angle_scale(distortion, angle * angle))[..., None], np.empty((*r2.shape, 0))
    p1, p2 = distortion[2:4]
    scale, slope = _radial(distortion, r2)
    bent = np.stack(
        [
            x * scale + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * scale + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )
    jacobian = np.stack(
        [
            scale + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y,
            scale + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        ],
        axis=-1,
    )
    return bent, jacobian


def _straight_fisheye(distortion: FloatArray, bent: FloatArray, limit: float) -> FloatArray:
    """Undo a fisheye: bent angles are inverted by a table, then by Newton's method."""
    k1, k2, k3, k4 = distortion
    widest = float(np.arctan(limit))
    table = np.linspace(0.0, widest, _REACH_STEPS)
    length = np.linalg.norm(bent, axis=-1)
    angle = np.interp(length, table * _angle_scale(distortion, table * table), table, right=np.nan)
    for _ in range(3):  # the table is good to 1e-6: two steps suffice
        a2 = angle * angle
        slope = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)))
        angle = angle - (angle * _angle_scale(distortion, a2) - length) / np.maximum(slope, 1e-3)
    ratio = np.where(length > 1e-9, np.tan(angle) / np.maximum(length, 1e-9), 1.0)
    straight: FloatArray = bent * ratio[..., None]
    return straight
