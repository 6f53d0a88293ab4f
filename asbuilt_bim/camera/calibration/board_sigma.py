"""The covariance of a calibration as real boards are, by what it comes from.

The adjustment weighs all corners alike, and takes the board as it was drawn. What that leaves open of the rig has four
sources: corners that err by themselves, photos whose corners err together, a board that isn't flat, and a print that
isn't to scale. The last two are common to all photos: more photos don't take them off.
"""

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment
from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.calibration.corner_errors import CornerErrors, ViewSystem, corner_errors, view_system
from asbuilt_bim.camera.calibration.parameters import CORNER_SIGMA_PX, BoardView, layout_of, view_residual
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.geometry.arrays import FloatArray, frozen

SOURCES = ("corners", "photos", "flatness", "print")
"""Corners each by itself; photos each as a whole; the board's shape; its scale."""
_BENDS = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Knowledge:
    """What views say of the shared parameters (S,), and by how much they may err; those of more views add up.

    `normal` (S, S) in px-2; `single`, `trend` (S, S): the covariance of the normal equations' right side by the
    corners' own errors and by those of whole photos; `board` (S, 5): what one sigma of each bend of the board, of the
    print's scale and of its stretch adds to the right side.
    """

    normal: FloatArray
    single: FloatArray
    trend: FloatArray
    board: FloatArray

    def plus(self, other: "Knowledge") -> "Knowledge":
        """Return what both say together."""
        return Knowledge(
            normal=self.normal + other.normal, single=self.single + other.single, trend=self.trend + other.trend,
            board=self.board + other.board,
        )  # fmt: skip

    def times(self, count: int) -> "Knowledge":
        """Return what so many alike say together."""
        return Knowledge(
            normal=count * self.normal, single=count * self.single, trend=count * self.trend, board=count * self.board
        )

    def covariances(self) -> FloatArray:
        """Return the covariances (4, S, S) of the shared parameters by `SOURCES`; they add up."""
        inverse = inverse_of(self.normal)
        board = inverse @ self.board
        bends, scales = board[:, :_BENDS], board[:, _BENDS:]
        return np.stack(
            [inverse @ self.single @ inverse, inverse @ self.trend @ inverse, bends @ bends.T, scales @ scales.T]
        )


def inverse_of(normal: FloatArray) -> FloatArray:
    """Invert a normal matrix whose numbers differ by many digits, such as focal lengths and k3.

    Raises: numpy.linalg.LinAlgError where it leaves a number open.
    """
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    inverse: FloatArray = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return inverse


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoardSigma:
    """What the views of a calibration say together, how their corners err, and `by_source` (4, P, P), rig numbers."""

    knowledge: Knowledge
    errors: CornerErrors
    by_source: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Return the covariance (P, P) of `StereoRig.covariance`."""
        return frozen(self.by_source.sum(axis=0))


def board_sigma(adjusted: Adjustment, views: list[BoardView], board: Board) -> BoardSigma:
    """Say how well views of a board hold the rig that was adjusted to them."""
    layout = layout_of(adjusted.shared)
    prior = layout.prior_weight()
    systems = [
        view_system(*view_residual(adjusted.shared, pose, view), view)
        for pose, view in zip(adjusted.poses, views, strict=True)
    ]
    normal = np.diag(prior) + sum((s.design.T @ s.design for s in systems), np.zeros((len(prior), len(prior))))
    shapes = [
        view_shapes(adjusted.shared, pose, view, system, board)
        for system, pose, view in zip(systems, adjusted.poses, views, strict=True)
    ]
    errors = corner_errors(systems, inverse_of(normal), shapes=shapes)
    # the prior is a measurement of the lens, too, whose sigma it was weighed by
    whole = Knowledge(
        normal=np.diag(prior), single=np.diag(prior) * CORNER_SIGMA_PX**2, trend=np.zeros((len(prior), len(prior))),
        board=np.zeros((len(prior), _BENDS + 2)),
    )  # fmt: skip
    for k, (system, shape) in enumerate(zip(systems, shapes, strict=True)):
        whole = whole.plus(view_knowledge(system, shape, errors, k))
    rows = layout.rig_rows
    return BoardSigma(
        knowledge=whole,
        errors=errors,
        by_source=frozen(whole.covariances()[np.ix_(np.arange(len(SOURCES)), np.asarray(rows), np.asarray(rows))]),
    )


def rig_covariance(adjusted: Adjustment) -> FloatArray:
    """Return the covariance (P, P) of `StereoRig.covariance` by the adjustment: each corner errs by itself."""
    rows = layout_of(adjusted.shared).rig_rows
    return frozen(adjusted.covariance[np.ix_(rows, rows)])


def view_shapes(
    shared: FloatArray, pose: FloatArray, view: BoardView, system: ViewSystem, board: Board | Tag
) -> FloatArray:
    """Return what a sigma of each bend of a board, of its scale and of its stretch adds to a view's residual (R, 5)."""
    bent = zip(shapes_of(view.left_points_m, board), shapes_of(view.right_points_m, board), strict=True)
    return np.stack(
        [
            view_residual(shared, pose, replace(view, left_points_m=left, right_points_m=right))[0] - system.residual
            for left, right in bent
        ],
        axis=1,
    )


def view_knowledge(system: ViewSystem, shapes: FloatArray, errors: CornerErrors, k: int) -> Knowledge:
    """Return what one view says, whose corners err as the k-th of `errors`; `shapes` (R, 5) as of `view_shapes`."""
    design, rows = system.design, len(system.residual)
    own = np.where(np.arange(rows) < system.split, errors.single[k, 0], errors.single[k, 1])
    trends = np.concatenate(
        [np.sqrt(variance) * trend for variance, trend in zip(errors.trend, system.trends, strict=True)], axis=1
    )
    drawn = design.T @ trends
    return Knowledge(
        normal=design.T @ design, single=(design.T * own) @ design, trend=drawn @ drawn.T, board=design.T @ shapes
    )


def shapes_of(points_m: FloatArray, board: Board | Tag) -> list[FloatArray]:
    """Return the corners (N, 3) of a board that is bent in each way, of another scale, and stretched: a sigma each."""
    every = board.points_m[:, :2]
    middle, half = 0.5 * (every.min(axis=0) + every.max(axis=0)), 0.5 * np.ptp(every, axis=0)
    u, v = ((points_m[:, :2] - middle) / half).T
    bent = []
    for bend in (u * u, u * v, v * v):
        moved = np.array(points_m)
        moved[:, 2] += board.flatness_m * bend
        bent.append(moved)
    scaled = [points_m * (1.0 + board.print_share * np.array(way)) for way in ((1.0, 1.0, 0.0), (0.5, -0.5, 0.0))]
    return bent + scaled
