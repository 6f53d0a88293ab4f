"""What is known of how two stations stand to each other, as rows of the visit's adjustment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import inverse, skew, vector_from_rotation
from asbuilt_bim.register.point_links import PointLink

STATION = 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Between:
    """Two stations by their places in the adjustment, and `first_from_second` (4, 4) as it was measured.

    `root` (6, 6) whitens a small motion in the first's axes; `by_disparity` (6,) is what a pixel of the rig's
    disparity in common adds to it.
    """

    first: int
    second: int
    first_from_second: FloatArray
    root: FloatArray
    by_disparity: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BetweenRows:
    """T links: whitened residuals (T, 6), and slopes by the first (T, 6, 6), the second, and the disparity (T, 6)."""

    links: Sequence[Between]
    residual: FloatArray
    by_first: FloatArray
    by_second: FloatArray
    by_common: FloatArray

    @property
    def off(self) -> FloatArray:
        """Return how far each link (T,) is off: the root mean square of its rows."""
        root: FloatArray = np.sqrt(np.mean(np.square(self.residual), axis=1)) if len(self.links) else np.zeros(0)
        return root


def between(link: PointLink, first: int, second: int) -> Between:
    """Make rows of a link whose stations have these places."""
    return Between(
        first=first, second=second, first_from_second=link.first_from_second,
        root=frozen(np.linalg.inv(np.linalg.cholesky(link.covariance))), by_disparity=link.by_disparity,
    )  # fmt: skip


def between_rows(links: Sequence[Between], stations: FloatArray, disparity_px: float) -> BetweenRows:
    """Return the rows at poses (N, 4, 4)."""
    count = len(links)
    residual, by_common = np.zeros((count, STATION)), np.zeros((count, STATION))
    by_first, by_second = np.zeros((count, STATION, STATION)), np.zeros((count, STATION, STATION))
    for k, link in enumerate(links):
        a, b = stations[link.first], stations[link.second]
        now, seen = inverse(a) @ b, link.first_from_second
        off = np.concatenate([vector_from_rotation(now[:3, :3] @ seen[:3, :3].T), now[:3, 3] - seen[:3, 3]])
        back = a[:3, :3].T
        own, other = np.zeros((STATION, STATION)), np.zeros((STATION, STATION))
        own[:3, :3], own[3:, 3:], own[3:, :3] = -back, -back, back @ skew(b[:3, 3] - a[:3, 3])
        other[:3, :3], other[3:, 3:] = back, back
        residual[k] = link.root @ (off + link.by_disparity * disparity_px)
        by_first[k], by_second[k] = link.root @ own, link.root @ other
        by_common[k] = link.root @ link.by_disparity
    return BetweenRows(links=links, residual=residual, by_first=by_first, by_second=by_second, by_common=by_common)


def add_between(matrix: FloatArray, right: FloatArray, rows: BetweenRows, weights: FloatArray) -> None:
    """Add the rows' normal equations to those of all stations, the disparity in common last."""
    last = len(right) - 1
    for k, link in enumerate(rows.links):
        at = np.concatenate(
            [np.arange(STATION) + STATION * link.first, np.arange(STATION) + STATION * link.second, [last]]
        )
        slopes = np.concatenate([rows.by_first[k], rows.by_second[k], rows.by_common[k][:, None]], axis=1)
        matrix[np.ix_(at, at)] += weights[k] * slopes.T @ slopes
        right[at] -= weights[k] * slopes.T @ rows.residual[k]
