"""Round columns in the plan drawing: the part of a chain that an arc explains better than straight pieces."""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, median
from asbuilt_bim.geometry.polyline import fit_circle, fit_line
from asbuilt_bim.geometry.robust_least_squares import robust_sigma, tukey

LEAST_RADIUS_M, MOST_RADIUS_M = 0.09, 0.65
"""Round concrete columns are cast from 0.2 to 1.2 m; beyond, a surface is a curved wall."""
LEAST_POINTS = 8
SMEAR_PX = 1.0
"""How well the matcher's window knows where across a slope its answer lies."""
WINDOW_PX = 5.0
"""Half its window and a bit: that far beyond a silhouette it still answers with the edge."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Circle:
    """A round column in the level plan: axis at (x right, z forward) in metres, radius; with f and b to draw it."""

    x_m: float
    z_m: float
    radius_m: float
    f_px: float
    baseline_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arc:
    """Points [start, stop) of a chain that a circle explains."""

    start: int
    stop: int
    circle: Circle


def disparity_of_circle(circle: Circle, x_px: FloatArray) -> FloatArray:
    """Return the level disparity at level x (...) of the circle's near side; NaN where the ray misses it."""
    t = np.asarray(x_px, dtype=np.float64) / circle.f_px
    a = 1.0 + t * t
    b = t * circle.x_m + circle.z_m
    c = circle.x_m**2 + circle.z_m**2 - circle.radius_m**2
    with np.errstate(invalid="ignore"):
        depth = (b - np.sqrt(b * b - a * c)) / a
    disparity: FloatArray = circle.f_px * circle.baseline_m / depth
    return disparity


def circle_between(circle: Circle, x0_px: float, x1_px: float) -> Circle:
    """Return the circle whose silhouettes stand at two level x, its nearest point as far away as the given one's."""
    left, right = np.arctan(np.array([x0_px, x1_px]) / circle.f_px)
    middle, sine = 0.5 * (left + right), float(np.sin(0.5 * (right - left)))
    away = (float(np.hypot(circle.x_m, circle.z_m)) - circle.radius_m) / (1.0 - sine)
    return replace(
        circle, x_m=away * float(np.sin(middle)), z_m=away * float(np.cos(middle)), radius_m=away * sine
    )  # fmt: skip


def fit_round(
    x_px: FloatArray,
    d_px: FloatArray,
    sigma_px: FloatArray,
    runs: list[tuple[int, int]],
    penalty: float,
    f_px: float,
    baseline_m: float,
) -> Arc | None:
    """Find the consecutive straight pieces that one circle replaces with the largest gain; None where none gains.

    A circle costs its chi-square and 1.5 penalties (3 numbers, a line has 2).
    """
    line_cost = [_line_cost(x_px[a:b], d_px[a:b], sigma_px[a:b]) + penalty for a, b in runs]
    best: Arc | None = None
    best_gain = 0.0
    for first in range(len(runs)):
        for last in range(first, len(runs)):
            start, stop = runs[first][0], runs[last][1]
            straight = sum(line_cost[first : last + 1]) - 1.5 * penalty
            if stop - start < LEAST_POINTS or straight <= best_gain:  # not even a perfect circle would gain
                continue
            found = _circle(x_px[start:stop], d_px[start:stop], sigma_px[start:stop], f_px, baseline_m)
            if found is None:
                continue
            circle, cost = found
            if straight - cost > best_gain:
                best_gain, best = straight - cost, Arc(start=start, stop=stop, circle=circle)
    return best


def _line_cost(x: FloatArray, d: FloatArray, sigma: FloatArray) -> float:
    slope, offset = fit_line(x, d, sigma)
    return float(np.sum(np.minimum(np.square((d - slope * x - offset) / sigma), 9.0)))


def _circle(
    x: FloatArray, d: FloatArray, sigma: FloatArray, f_px: float, baseline_m: float
) -> tuple[Circle, float] | None:
    depth = f_px * baseline_m / d
    weight = np.square(d**2 / sigma)  # sigma of depth goes with 1 / d^2
    weight = weight / weight.max()
    for _ in range(3):
        centre_x, centre_z, radius = fit_circle(x * depth / f_px, depth, weight)
        circle = Circle(x_m=centre_x, z_m=centre_z, radius_m=radius, f_px=f_px, baseline_m=baseline_m)
        residual = np.nan_to_num(d - disparity_of_circle(circle, x), nan=1.0)
        smeared = _smeared_sigma(circle, x, sigma)
        scale = max(1.0, robust_sigma(residual / smeared))
        weight = np.square(d**2 / smeared) * tukey(residual / (scale * smeared))
        weight = weight / weight.max()
    if not LEAST_RADIUS_M < radius < MOST_RADIUS_M or centre_z < median(depth):
        return None
    width = (float(x[-1]) - float(x[0])) * median(depth) / f_px
    if width < 1.1 * radius:  # under a third of the half circle doesn't fix a radius
        return None
    cost = float(np.sum(np.minimum(np.square(residual / smeared), 9.0)))
    return circle, cost


def _smeared_sigma(circle: Circle, x: FloatArray, sigma: FloatArray) -> FloatArray:
    """Return the points' sigma, with the smear of the matcher's window near a silhouette added.

    There the surface turns away, and a pixel across is several in disparity. Just past the silhouette the window still
    answers with the column's edge. Such points say nothing against a circle.
    """
    across = (disparity_of_circle(circle, x + SMEAR_PX) - disparity_of_circle(circle, x - SMEAR_PX)) / (2.0 * SMEAR_PX)
    distance = float(np.hypot(circle.x_m, circle.z_m))
    half = float(np.arcsin(min(circle.radius_m / distance, 0.99)))
    away_px = circle.f_px * (np.abs(np.arctan(x / circle.f_px) - np.arctan2(circle.x_m, circle.z_m)) - half)
    steep = np.where(np.isfinite(across), np.abs(across), np.where(np.abs(away_px) < WINDOW_PX, 1.0, 0.0))
    smeared: FloatArray = np.hypot(sigma, SMEAR_PX * steep)
    return smeared
