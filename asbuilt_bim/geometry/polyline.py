"""A chain of points as the fewest straight pieces that explain it, or as the arc of a round column."""

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.robust_least_squares import reweighted_linear


def straight_pieces(
    x: FloatArray, y: FloatArray, sigma: FloatArray, penalty: float, least_points: int = 4
) -> list[tuple[int, int]]:
    """Cut points (N,) into runs [start, stop) fitted by lines, at least total chi-square + penalty per piece.

    Exact, by dynamic programming over all cuts. Residuals count up to 3 sigma, so a stray point doesn't force a cut.
    """
    count = len(x)
    if count < 2 * least_points:
        return [(0, count)]
    cost = _costs(x, y, sigma)
    best = np.full(count + 1, np.inf)
    best[0] = 0.0
    origin = np.zeros(count + 1, dtype=np.int64)
    for stop in range(least_points, count + 1):
        starts = np.arange(0, stop - least_points + 1)
        totals = best[starts] + cost[starts, stop - 1] + penalty
        pick = int(np.argmin(totals))
        best[stop], origin[stop] = totals[pick], starts[pick]
    pieces: list[tuple[int, int]] = []
    stop = count
    while stop > 0:
        pieces.append((int(origin[stop]), stop))
        stop = int(origin[stop])
    return pieces[::-1]


def _costs(x: FloatArray, y: FloatArray, sigma: FloatArray) -> FloatArray:
    """Return the chi-square (N, N) of the least-squares line through points i..j, by running sums."""
    weight = 1.0 / np.square(sigma)
    x = x - x.mean()
    y = y - y.mean()
    sums = [np.concatenate([[0.0], np.cumsum(weight * term)]) for term in (np.ones_like(x), x, y, x * x, x * y, y * y)]
    s, sx, sy, sxx, sxy, syy = (total[None, 1:] - total[:-1, None] for total in sums)
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy, dxy = sxx - sx**2 / s, syy - sy**2 / s, sxy - sx * sy / s
        chi = np.where(dx > 1e-9, dy - dxy**2 / np.where(dx > 1e-9, dx, 1.0), 0.0)
    cost: FloatArray = np.where(s > 0, np.maximum(chi, 0.0), np.inf)
    return cost


def fit_line(x: FloatArray, y: FloatArray, sigma: FloatArray | float) -> tuple[float, float]:
    """Fit y = slope x + offset robustly; returns slope and offset."""
    middle = float(x.mean())
    fit = reweighted_linear(np.stack([x - middle, np.ones_like(x)], axis=-1), y, sigma)
    slope, level = fit.parameters.tolist()
    return slope, level - slope * middle


def fit_circle(x: FloatArray, z: FloatArray, weight: FloatArray) -> tuple[float, float, float]:
    """Fit a circle to points (N,) by the algebraic method (Kasa); returns centre x, z and radius."""
    mean_x, mean_z = np.average(x, weights=weight), np.average(z, weights=weight)
    u, v = x - mean_x, z - mean_z
    design = np.stack([u, v, np.ones_like(u)], axis=1)
    root = np.sqrt(weight)[:, None]
    solution, *_ = np.linalg.lstsq(design * root, (u * u + v * v) * root[:, 0], rcond=None)
    centre_u, centre_v = solution[0] / 2.0, solution[1] / 2.0
    radius = float(np.sqrt(max(solution[2] + centre_u**2 + centre_v**2, 0.0)))
    return float(mean_x + centre_u), float(mean_z + centre_v), radius
