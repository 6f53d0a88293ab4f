"""Least squares that bear gross errors: lines and planes by reweighting, every other model by SciPy.

A problem keeps its own model and Jacobian. How far a point may be off and when to stop is set here, once for all.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, median

Model = Callable[[FloatArray], FloatArray]
"""What goes with parameters (P,): residuals (N,), or their Jacobian (N, P)."""
Loss = Callable[[FloatArray], FloatArray]
"""Weights (N,) in 0..1 that go with residuals (N,) in sigmas."""

MEDIAN_TO_SIGMA = 1.4826  # of Gaussian noise
TUKEY, CAUCHY = 4.0, 1.5
"""Sigmas: each keeps 95 % of the precision on Gaussian noise.

Reference: Holland & Welsch 1977, robust regression using iteratively reweighted least squares.
"""
_ROUNDS, _MOST_ROUNDS = 5, 25  # of a linear fit, of any other
_SETTLED = 1e-4  # of a weight, and of a scale
_STILL = 1e-10  # relative, of parameters, cost and gradient
_RIDGE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """Parameters (P,) at the least sum of squares; what is left over there (N,), its Jacobian (N, P), the weights (N,).

    `scale` is how many of the given sigmas the residuals scatter by, 1 where they aren't judged.
    """

    parameters: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    weights: FloatArray
    scale: float

    @property
    def cost(self) -> float:
        """Return the weighted sum of squares."""
        return float(self.weights @ np.square(self.residuals))

    @property
    def information(self) -> FloatArray:
        """Return the inverse of the covariance (P, P)."""
        result: FloatArray = (self.jacobian * self.weights[:, None]).T @ self.jacobian / self.scale**2
        return result

    @property
    def covariance(self) -> FloatArray:
        """Return the parameters' covariance (P, P), for points with independent errors."""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)


def robust_sigma(residuals: FloatArray) -> float:
    """Return the standard deviation of residuals (N,) by their median, so that up to half of them may be anything."""
    return MEDIAN_TO_SIGMA * median(np.abs(residuals))


def tukey(sigmas: FloatArray, reach: float = TUKEY) -> FloatArray:
    """Return Tukey's weights: none for what is far off."""
    result: FloatArray = np.square(np.maximum(1.0 - np.square(sigmas / reach), 0.0))
    return result


def cauchy(sigmas: FloatArray, reach: float = CAUCHY) -> FloatArray:
    """Return Cauchy's weights: less and less, and never none."""
    result: FloatArray = 1.0 / (1.0 + np.square(sigmas / reach))
    return result


def by_differences(model: Model, at: FloatArray, steps: FloatArray) -> FloatArray:
    """Return a model's Jacobian (N, P) by central differences, with a step for each parameter (P,)."""
    return np.stack([(model(at + step) - model(at - step)) / (2.0 * step.sum()) for step in np.diag(steps)], axis=-1)


def reweighted_linear(
    design: FloatArray,
    target: FloatArray,
    sigma: FloatArray | float,
    weights: FloatArray | None = None,
    loss: Loss = tukey,
    ridge: FloatArray | float = _RIDGE,
    rounds: int = _ROUNDS,
) -> Fit:
    """Fit `design @ parameters = target` (N, P), (N,), and weigh points by how far they are off, until that settles.

    It is left after `rounds`, settled or not.

    `sigma` is the least that a point errs by; the scale of all of them is estimated, and never under 1. `weights` (N,)
    say what points count before that, 1 / sigma^2 where they aren't given. `ridge`, for all parameters or for each
    (P,), draws them to zero by that share of the weights: what points leave open stays there.
    """
    least = np.asarray(sigma, dtype=np.float64)
    own = np.broadcast_to(1.0 / np.square(least), target.shape) if weights is None else weights
    trust = np.ones(len(target))
    for _ in range(rounds):  # asked for some five hundred lines a station: no detours
        counted = own * trust
        weighted = (design * counted[:, None]).T
        normal = weighted @ design
        normal.flat[:: len(normal) + 1] += ridge * max(float(counted.sum()), _RIDGE)
        parameters = np.linalg.solve(normal, weighted @ target)
        residuals = target - design @ parameters
        scale = max(1.0, robust_sigma(residuals / least))
        before, trust = trust, loss(residuals / (least * scale))
        if not len(trust) or np.abs(trust - before).max() < _SETTLED:
            break
    return Fit(
        parameters=np.asarray(parameters, dtype=np.float64), residuals=residuals, jacobian=design,
        weights=own * trust, scale=scale,
    )  # fmt: skip


def fit(residuals: Model, start: FloatArray, jacobian: Model | None = None) -> Fit:
    """Find the parameters (P,) at the least sum of squared residuals (N,), which are in sigmas.

    A step to where a residual isn't finite is taken back and halved, so that NaN fences a model in.

    Raises: ValueError where residuals aren't finite at the start.
    """
    from scipy.optimize import least_squares  # 0.4 s to load, for which no report need wait

    found = least_squares(residuals, start, jacobian or "2-point", x_scale="jac", ftol=_STILL, xtol=_STILL, gtol=_STILL)
    return Fit(
        parameters=found.x, residuals=found.fun, jacobian=found.jac, weights=np.ones(len(found.fun)), scale=1.0,
    )  # fmt: skip


def robust_fit(residuals: Model, start: FloatArray, steps: FloatArray, prior: FloatArray) -> Fit:
    """Find the parameters (P,) that most residuals (N,) agree on: foreign ones count less and less (Tukey).

    Residuals are in the least sigma of one. Their scale is estimated and only ever falls, so that it settles. `steps`
    (P,) are for `by_differences`; `prior` (P,) is 1 / sigma of each parameter about zero.
    """
    at, scale, trust = start, np.inf, np.full(len(residuals(start)), np.inf)
    for _ in range(_MOST_ROUNDS):
        left_over, before = residuals(at), trust
        scale = min(scale, max(1.0, robust_sigma(left_over)))
        trust = tukey(left_over / scale)
        if np.max(np.abs(trust - before)) < _SETTLED:
            break
        root = np.sqrt(trust) / scale

        def weighted(p: FloatArray, root: FloatArray = root) -> FloatArray:
            return np.append(root * residuals(p), prior * p)

        at = fit(weighted, at).parameters
    jacobian = by_differences(residuals, at, steps)
    return Fit(parameters=at, residuals=left_over, jacobian=jacobian, weights=trust, scale=scale)
