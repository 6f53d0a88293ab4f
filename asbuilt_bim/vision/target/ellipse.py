"""Ellipses in the picture: fitted to edge points, some of which don't belong to them."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray

_HYPOTHESES = 160
"""With 40 % of the points foreign, one sample of five in thirteen is clean: 160 miss it once in a million."""
_ROUNDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Ellipse:
    """Centre, half axes and the major axis' angle against x, in pixels and radians."""

    x_px: float
    y_px: float
    major_px: float
    minor_px: float
    angle_rad: float

    @property
    def centre(self) -> FloatArray:
        """Return the centre (2,)."""
        return np.array([self.x_px, self.y_px])

    @property
    def perimeter_px(self) -> float:
        """Return the length of the outline.

        Reference: Ramanujan 1914, first approximation.
        """
        a, b = self.major_px, self.minor_px
        return float(np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b))))

    @property
    def conic(self) -> FloatArray:
        """Return the symmetric matrix C (3, 3) with x C x = 0 on the outline, negative inside."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        turn = np.array([[c, -s], [s, c]])
        core = turn @ np.diag([self.major_px**-2, self.minor_px**-2]) @ turn.T
        tail = -core @ self.centre
        matrix = np.empty((3, 3))
        matrix[:2, :2], matrix[:2, 2], matrix[2, :2] = core, tail, tail
        matrix[2, 2] = self.centre @ core @ self.centre - 1.0
        return matrix

    def outline(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Return `count` points (count, 2) round the outline and their outward unit normals (count, 2)."""
        turn = np.arange(count) * (2 * np.pi / count)
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        axes = np.array([[c, s], [-s, c]])
        points = self.centre + np.stack([self.major_px * np.cos(turn), self.minor_px * np.sin(turn)], axis=-1) @ axes
        normals = np.stack([self.minor_px * np.cos(turn), self.major_px * np.sin(turn)], axis=-1) @ axes
        return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    def bend(self, count: int) -> FloatArray:
        """Return the curvature (count,) in 1/px at the points of `outline`: most at the major axis' ends."""
        turn = np.arange(count) * (2 * np.pi / count)
        speed = np.hypot(self.major_px * np.sin(turn), self.minor_px * np.cos(turn))
        curvature: FloatArray = self.major_px * self.minor_px / speed**3
        return curvature

    def distance_px(self, points: FloatArray) -> FloatArray:
        """Return how far points (N, 2) lie outside the outline, to first order."""
        return conic_distance(self.conic, points)


def conic_distance(conic: FloatArray, points: FloatArray) -> FloatArray:
    """Return the signed distance (..., N) in pixels of points (N, 2) from conics (..., 3, 3), positive outside.

    Reference: Sampson 1982.
    """
    product = points @ conic[..., :2, :] + conic[..., 2:, :]
    value = product[..., 0] * points[:, 0] + product[..., 1] * points[:, 1] + product[..., 2]
    slope = 2.0 * np.sqrt(product[..., 0] ** 2 + product[..., 1] ** 2)
    distance: FloatArray = value / np.maximum(slope, 1e-12)
    return distance


def fit_ellipse(points: FloatArray, weights: FloatArray | None = None) -> Ellipse | None:
    """Fit an ellipse to points (N, 2), N >= 5, by least distance; None where the best conic is no ellipse."""
    if len(points) < 5:
        return None
    middle = points.mean(axis=0)
    scale = max(float(np.sqrt(np.mean((points - middle) ** 2))), 1e-9)
    local = (points - middle) / scale
    rows = _design(local)
    squared = np.ones(len(points)) if weights is None else weights
    conic, by_slope = np.zeros((3, 3)), np.ones(len(points))
    for _ in range(_ROUNDS):
        _, vectors = np.linalg.eigh(rows.T @ (rows * (squared * by_slope)[:, None]))
        conic = _conic(vectors[:, 0])
        slope = local @ conic[:2, :2] + conic[2, :2]
        by_slope = 1.0 / np.maximum(slope[:, 0] ** 2 + slope[:, 1] ** 2, 1e-12)
    found = ellipse_of(conic)
    if found is None:
        return None
    x, y = (found.centre * scale + middle).tolist()
    return replace(found, x_px=x, y_px=y, major_px=found.major_px * scale, minor_px=found.minor_px * scale)


def robust_ellipse(points: FloatArray, tolerance_px: float) -> tuple[Ellipse, BoolArray] | None:
    """Fit the ellipse that most of the points (N, 2) lie on; returns it with its points (N,), None where there is none.

    The points are in order along the outline, so that samples of five can be drawn from arcs of it. A disc that has
    grown together with something else still has a clean arc. A fixed sequence: the same points, the same ellipse.
    """
    if len(points) < 8:
        return None
    middle = points.mean(axis=0)
    scale = max(float(np.sqrt(np.mean((points - middle) ** 2))), 1e-9)
    local = (points - middle) / scale
    distance = _distances(_through_five(_design(local)[_draw(len(points))]), local) * scale
    if not len(distance):
        return None
    cost = np.minimum(distance / tolerance_px, 1.0).sum(axis=1)
    belongs: BoolArray = distance[int(np.argmin(cost))] < tolerance_px
    best: Ellipse | None = None
    for _ in range(_ROUNDS):
        best, fitted = fit_ellipse(points[belongs]), belongs
        if best is None:
            return None
        belongs = np.abs(best.distance_px(points)) < tolerance_px
        if np.array_equal(belongs, fitted):
            break
    return (best, belongs) if best is not None else None


def _through_five(rows: FloatArray) -> FloatArray:
    """Return the conics (M, 6) through five points each, as rows (M, 5, 6), that are ellipses."""
    complement, _ = np.linalg.qr(np.swapaxes(rows, -1, -2), mode="complete")
    six: FloatArray = complement[..., -1]
    return six[six[:, 0] * six[:, 2] - six[:, 1] ** 2 / 4.0 > 1e-9]


def _distances(six: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far (M, N) points (N, 2) lie off each of the conics (M, 6), to first order."""
    a, b, c, d, e, _ = six.T
    design = _design(points).T
    across = np.stack([2.0 * a, b, d], axis=-1) @ design[3:]
    down = np.stack([b, 2.0 * c, e], axis=-1) @ design[3:]
    slope = np.sqrt(across * across + down * down)
    distance: FloatArray = np.abs(six @ design) / np.maximum(slope, 1e-12)
    return distance


@lru_cache(maxsize=1024)
def _draw(count: int) -> IntArray:
    """Draw five of `count` points (_HYPOTHESES, 5), one from each fifth of an arc of 30 to 100 % of the outline."""
    random = np.random.default_rng(count)
    arc = np.repeat([0.3, 0.45, 0.7, 1.0], _HYPOTHESES // 4)[:, None]
    start = random.random((len(arc), 1))
    place = start + arc * (np.arange(5) + random.random((len(arc), 5))) / 5.0
    drawn = (np.floor(place * count) % count).astype(np.int32)
    drawn.setflags(write=False)
    return drawn


def _design(xy: FloatArray) -> FloatArray:
    x, y = xy[..., 0], xy[..., 1]
    rows = np.ones((*x.shape, 6))
    rows[..., 0], rows[..., 1], rows[..., 2], rows[..., 3], rows[..., 4] = x * x, x * y, y * y, x, y
    return rows


def _conic(six: FloatArray) -> FloatArray:
    a, b, c, d, e, f = six.tolist()
    return np.array([[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]])


def ellipse_of(conic: FloatArray) -> Ellipse | None:
    """Return the ellipse of a symmetric matrix (3, 3); None for any other conic."""
    (a, b, d), (_, c, e), (_, _, f) = conic.tolist()
    determinant = a * c - b * b
    if determinant <= 1e-12 * (a * a + 2.0 * b * b + c * c):
        return None
    x, y = (b * e - c * d) / determinant, (b * d - a * e) / determinant
    level = -(f + d * x + e * y) or 1.0
    a, b, c = a / level, b / level, c / level
    mean, half = 0.5 * (a + c), math.hypot(0.5 * (a - c), b)
    least, most = mean - half, mean + half
    if least <= 0.0:
        return None
    angle = 0.5 * math.atan2(-2.0 * b, c - a)
    return Ellipse(x_px=x, y_px=y, major_px=least**-0.5, minor_px=most**-0.5, angle_rad=angle)
