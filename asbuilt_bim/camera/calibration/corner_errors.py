"""How a board's corners err: each by itself, and all of a photo together, estimated from the residuals.

What a photo's corners share (a hand that moves between two exposures, blur to one side, a board that bends, what the
lens model leaves there) is a low trend over the board. It is a random effect: one variance a camera for each degree
of the trend, from all photos together, and a variance of the corners' own for each photo.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.calibration.parameters import BoardView
from asbuilt_bim.geometry.arrays import FloatArray

_CAMERAS, _DEGREES, _TRENDS = 2, 3, 6  # shift, two slopes, three bends


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewSystem:
    """One view's linear system, its own pose taken out.

    `residual` (R,) in pixels, left first; `design` (R, S) the free shared parameters' part that the pose can't take up;
    `project` (R, R) takes the pose out; `trends` one (R, K) a camera and degree, each column of unit length per corner.
    """

    residual: FloatArray
    design: FloatArray
    project: FloatArray
    split: int
    trends: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CornerErrors:
    """Variances in px2: of single corners by view and camera (V, 2), and of trends by camera and degree (2 D,)."""

    single: FloatArray
    trend: FloatArray

    def covariance(self, view: int, seen: BoardView) -> FloatArray:
        """Return the covariance (R, R) of the corners that are seen, as those of the view of a number err."""
        rows, split = 2 * (len(seen.left_px) + len(seen.right_px)), 2 * len(seen.left_px)
        left, right = self.single[view]
        whole: FloatArray = np.diag(np.where(np.arange(rows) < split, left, right))
        for variance, trend in zip(self.trend, trends_of(seen), strict=True):
            whole = whole + variance * trend @ trend.T
        return whole

    @property
    def typical(self) -> "CornerErrors":
        """Return what a photo of the same kind would have, as one view: the median of the corners' own."""
        return CornerErrors(single=np.median(self.single, axis=0)[None], trend=self.trend)


def view_system(residual: FloatArray, by_shared: FloatArray, by_pose: FloatArray, view: BoardView) -> ViewSystem:
    """Take a view's pose out of its residual and its Jacobians."""
    q, _ = np.linalg.qr(by_pose)
    project = np.eye(len(residual)) - q @ q.T
    return ViewSystem(
        residual=residual, design=project @ by_shared, project=project, split=2 * len(view.left_px),
        trends=trends_of(view),
    )  # fmt: skip


def corner_errors(
    systems: list[ViewSystem],
    inverse: FloatArray,
    *,
    shapes: Sequence[FloatArray] | None = None,
    each_photo: bool = True,
) -> CornerErrors:
    """Estimate the variances from the residuals of an adjustment with the inverse normal matrix (S, S).

    `each_photo` gives each its own variance of single corners: for boards, whose pose takes little out of the residual.

    Quadratic forms of the residuals are set equal to what the variances make of them (MINQUE; Rao 1971): all that the
    adjustment took out of the residuals is counted. `shapes`, (R, K) a view, is what the board's own shape and print
    add to the residuals, one sigma each. It counts by itself, and so not as an error of the photos, too.
    """
    count = _CAMERAS * (1 + _DEGREES)
    expected, found = np.zeros((count, count)), np.zeros(count)
    kinds = [_kinds(system) for system in systems]
    spread = np.zeros((count, *inverse.shape))
    for system, (roots, starts) in zip(systems, kinds, strict=True):
        drawn = system.design.T @ roots
        for j, part in enumerate(np.split(drawn, starts[1:], axis=1)):
            spread[j] += part @ part.T
    bent = [np.zeros((len(system.residual), 1)) for system in systems] if shapes is None else list(shapes)
    moved = inverse @ sum(system.design.T @ shape for system, shape in zip(systems, bent, strict=True))
    for system, (roots, starts), shape in zip(systems, kinds, bent, strict=True):
        found += np.add.reduceat((roots.T @ system.residual) ** 2, starts)
        left = roots.T @ (system.project @ shape - system.design @ moved)
        found -= np.add.reduceat(np.sum(left**2, axis=1), starts)
        drawn = roots.T @ system.design @ inverse
        straight = roots.T @ system.project @ roots
        own = straight * (straight - 2.0 * drawn @ system.design.T @ roots)
        expected += np.add.reduceat(np.add.reduceat(own, starts, axis=0), starts, axis=1)
        for j in range(count):
            expected[:, j] += np.add.reduceat(np.sum((drawn @ spread[j]) * drawn, axis=1), starts)
    variances = _not_negative(expected, found)
    pooled = variances[:_CAMERAS]
    single = np.array([_own(system, pooled) if each_photo else pooled for system in systems])
    return CornerErrors(single=single, trend=variances[_CAMERAS:])


def _kinds(system: ViewSystem) -> tuple[FloatArray, np.ndarray]:
    """Return the square roots of the variances' matrices side by side (R, R + ...), and where each begins.

    First each camera's corners, then the trends by camera and degree.
    """
    sizes = [system.split, len(system.residual) - system.split, *(trend.shape[1] for trend in system.trends)]
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    return np.concatenate([np.eye(len(system.residual)), *system.trends], axis=1), starts


def _not_negative(expected: FloatArray, found: FloatArray) -> FloatArray:
    """Solve for the variances; one that comes out negative is none, and the others are solved again."""
    used = np.ones(len(found), dtype=bool)
    while True:
        variances = np.zeros(len(found))
        variances[used] = np.linalg.lstsq(expected[np.ix_(used, used)], found[used], rcond=None)[0]
        if np.all(variances >= 0.0):
            return variances
        used &= variances > 0.0


def _own(system: ViewSystem, pooled: FloatArray) -> tuple[float, ...]:
    """Return the variance of a view's own corners by camera, from what its trends leave; pooled where few are left."""
    own = []
    for camera, rows in enumerate((slice(0, system.split), slice(system.split, None))):
        trends = np.concatenate([t[rows] for t in system.trends[camera * _DEGREES : (camera + 1) * _DEGREES]], axis=1)
        q, _ = np.linalg.qr(trends)
        left = system.residual[rows] - q @ (q.T @ system.residual[rows])
        freedom = len(left) - q.shape[1]
        own.append(float(left @ left) / freedom if freedom >= q.shape[1] else float(pooled[camera]))
    return tuple(own)


def trends_of(view: BoardView) -> tuple[FloatArray, ...]:
    """Return the trends of a view's corners: the left camera's shift, slope and bend, then the right's."""
    n, m = 2 * len(view.left_px), 2 * len(view.right_px)
    trends = []
    for points, before, after in ((view.left_points_m, 0, m), (view.right_points_m, n, 0)):
        for columns in _by_degree(points):
            both = np.kron(columns, np.eye(2))  # x and y, each by itself
            trends.append(np.pad(both, ((before, after), (0, 0))))
    return tuple(trends)


def _by_degree(points_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return trends over a board's corners, rms 1 and orthogonal: a shift (N, 1), slopes (N, 2), bends (N, 3)."""
    padded = np.zeros((len(points_m), _TRENDS))
    if len(points_m) >= _TRENDS:  # a tag's four corners can't tell a trend from errors of their own
        xy = points_m[:, :2] - points_m[:, :2].mean(axis=0)
        u, v = (xy / max(float(np.abs(xy).max()), 1e-12)).T
        q, r = np.linalg.qr(np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1))
        padded = q * np.sqrt(len(u)) * (np.abs(np.diag(r)) > 1e-6 * np.sqrt(len(u)))
    return padded[:, :1], padded[:, 1:3], padded[:, 3:]
