"""The covariance of a rig made from tags: as a board's, but what errs together is a photo, and not a tag.

All tags of a photo share what moved between the two exposures and what the lens model leaves. Their edges share how
far light spreads: black squares then all look smaller by as many pixels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment
from asbuilt_bim.camera.calibration.board_sigma import (
    SOURCES,
    BoardSigma,
    Knowledge,
    inverse_of,
    shapes_of,
)
from asbuilt_bim.camera.calibration.corner_errors import ViewSystem, corner_errors
from asbuilt_bim.camera.calibration.parameters import CORNER_SIGMA_PX, BoardView, layout_of, view_residual
from asbuilt_bim.camera.calibration.tags import Tag
from asbuilt_bim.geometry.arrays import FloatArray, frozen

EDGE_SIGMA_PX = 0.03
"""How far every tag's edges may lie outside or inside, all alike: what `vision.markers.corners` keeps as its floor."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pair:
    """All tags of a photo pair as one linear system, and what moves their corners alike (R, K)."""

    system: ViewSystem
    alike: FloatArray  # edges outwards; then by the tags' shape and scale


def tag_sigma(
    adjusted: Adjustment, views: list[BoardView], pairs: Sequence[str], tag: Tag, size: tuple[int, int]
) -> BoardSigma:
    """Say how well views of tags, each of one of `pairs`, hold the rig that was adjusted to them."""
    layout = layout_of(adjusted.shared)
    prior = layout.prior_weight()
    groups = [_pair(adjusted, views, [k for k, one in enumerate(pairs) if one == pair], tag, size)
              for pair in dict.fromkeys(pairs)]  # fmt: skip
    systems = [group.system for group in groups]
    normal = np.diag(prior) + sum((s.design.T @ s.design for s in systems), np.zeros((len(prior), len(prior))))
    errors = corner_errors(systems, inverse_of(normal), each_photo=False)
    single, trend = np.diag(prior) * CORNER_SIGMA_PX**2, np.zeros((len(prior), len(prior)))
    moved = np.zeros((len(prior), groups[0].alike.shape[1]))
    for k, group in enumerate(groups):
        design, rows = group.system.design, np.arange(len(group.system.residual))
        own = np.where(rows < group.system.split, errors.single[k, 0], errors.single[k, 1])
        drawn = [np.sqrt(v) * design.T @ t for v, t in zip(errors.trend, group.system.trends, strict=True)]
        single += (design.T * own) @ design
        trend += sum((one @ one.T for one in drawn), np.zeros_like(trend))
        moved += design.T @ group.alike
    edges = moved[:, :1]
    knowledge = Knowledge(normal=normal, single=single + edges @ edges.T, trend=trend, board=moved[:, 1:])
    rows = np.asarray(layout.rig_rows)
    by_source = knowledge.covariances()[np.ix_(np.arange(len(SOURCES)), rows, rows)]
    return BoardSigma(knowledge=knowledge, errors=errors, by_source=frozen(by_source))


def _pair(adjusted: Adjustment, views: list[BoardView], at: list[int], tag: Tag, size: tuple[int, int]) -> _Pair:
    """Put the tags of a pair into one system, all left corners first, each tag's pose taken out."""
    parts = [view_residual(adjusted.shared, adjusted.poses[k], views[k]) for k in at]
    splits = [2 * len(views[k].left_px) for k in at]
    alike = np.concatenate([_alike(adjusted.shared, adjusted.poses[k], views[k], tag) for k in at])
    project = np.zeros((len(alike), len(alike)))
    start = 0
    for residual, _, by_pose in parts:
        rows = slice(start, start + len(residual))
        q, _ = np.linalg.qr(by_pose)
        project[rows, rows] = np.eye(len(residual)) - q @ q.T
        start += len(residual)
    order = _left_first([len(residual) for residual, _, _ in parts], splits)
    design = project @ np.concatenate([by_shared for _, by_shared, _ in parts])
    system = ViewSystem(
        residual=np.concatenate([residual for residual, _, _ in parts])[order],
        design=design[order],
        project=project[np.ix_(order, order)],
        split=sum(splits),
        trends=_frame_trends([views[k] for k in at], size),
    )
    return _Pair(system=system, alike=alike[order])


def _left_first(lengths: list[int], splits: list[int]) -> np.ndarray:
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    left = [np.arange(a, a + split) for a, split in zip(starts, splits, strict=True)]
    right = [np.arange(a + split, a + n) for a, n, split in zip(starts, lengths, splits, strict=True)]
    return np.concatenate([*left, *right])


def _frame_trends(views: list[BoardView], size: tuple[int, int]) -> tuple[FloatArray, ...]:
    """Return what the corners of a photo may share: shift, slopes and bends over the frame, left, then right."""
    n, m = (2 * sum(len(px) for px in side) for side in ([v.left_px for v in views], [v.right_px for v in views]))
    trends = []
    for pixels, before, after in (
        (np.concatenate([v.left_px for v in views]), 0, m),
        (np.concatenate([v.right_px for v in views]), n, 0),
    ):
        half = 0.5 * np.array(size)
        u, v = ((pixels - half) / half).T
        for columns in (np.ones((len(u), 1)), np.stack([u, v], axis=1), np.stack([u * u, u * v, v * v], axis=1)):
            trends.append(np.pad(np.kron(columns, np.eye(2)), ((before, after), (0, 0))))
    return tuple(trends)


def _alike(shared: FloatArray, pose: FloatArray, view: BoardView, tag: Tag) -> FloatArray:
    """Return how a sigma of edges, of each bend, of the print's scale and of its stretch moves the residual (R, 6)."""
    residual = view_residual(shared, pose, view)[0]
    moved = [
        view_residual(shared, pose, replace(view, left_points_m=shape, right_points_m=shape))[0] - residual
        for shape in shapes_of(view.left_points_m, tag)
    ]
    return np.stack([np.r_[_outward(view.left_px).ravel(), _outward(view.right_px).ravel()], *moved], axis=1)


def _outward(corners_px: FloatArray) -> FloatArray:
    """Return where corners (4, 2) go when all four sides move outwards by a sigma."""
    before, after = (corners_px - np.roll(corners_px, way, axis=0) for way in (1, -1))
    a, b = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in (before, after))
    sine = np.abs(a[:, :1] * b[:, 1:] - a[:, 1:] * b[:, :1])
    outward: FloatArray = EDGE_SIGMA_PX * (a + b) / np.maximum(sine, 0.1)
    return outward
