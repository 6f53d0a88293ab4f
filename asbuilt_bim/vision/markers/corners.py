"""A marker's corners as the meeting points of its four printed edges, each a line through many sub-pixel edges."""

from functools import partial

import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, median
from asbuilt_bim.geometry.robust_least_squares import cauchy, reweighted_linear
from asbuilt_bim.vision.edges import edge_channels, find_edges

SIGMA_FLOOR_PX = 0.03
"""Interpolation and lens residue that a line's own misfit doesn't show."""
SIGMA_UNREFINED_PX = 0.3
"""Of corners as the detector gives them, where no edge could be followed."""
_LEAST_SCATTER_PX = 0.02
_CLOSE_CAUCHY = partial(cauchy, reach=2.0)  # printed edges are straight: what is off lies close
_ROUNDS = 4  # more move a corner by thousandths of a pixel
_FEWEST_POINTS = 6
_LARGEST_MOVE_PX = 3.0


def refine_corners(
    grey: ByteImage, corners: FloatArray, modules: int, *, bowed: bool = False
) -> tuple[FloatArray, float]:
    """Return corners (4, 2) of a marker refined on its black border's outer edges, and their sigma in pixels.

    `modules` is the number of squares along a side, border included. `bowed`: a lens bends the sides. Where an edge
    can't be followed the corners come back as they were, with the detector's own sigma.
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    reach = float(np.clip(0.7 * sides.min() / modules, 1.5, 6.0))
    corner, light = _patch(grey, corners, reach)
    refined, sigma = corners - corner, SIGMA_UNREFINED_PX
    for _ in range(2):
        lines, sigmas = [], []
        for side in range(4):
            line = _side(light, refined[side], refined[(side + 1) % 4], reach, bowed=bowed)
            if line is None:
                return corners, SIGMA_UNREFINED_PX
            lines.append(line[0])
            sigmas.append(line[1])
        met = np.stack([_meet(lines[side - 1], lines[side]) for side in range(4)])
        if not np.all(np.isfinite(met)) or np.abs(met + corner - corners).max() > max(_LARGEST_MOVE_PX, reach):
            return corners, SIGMA_UNREFINED_PX
        refined, sigma = met, float(np.sqrt(np.mean(np.square(sigmas))))
    return refined + corner, float(np.hypot(sigma, SIGMA_FLOOR_PX))


def _patch(grey: ByteImage, corners: FloatArray, reach: float) -> tuple[FloatArray, Float32Array]:
    x0, y0 = np.maximum(np.floor(corners.min(axis=0) - reach - 3), 0).astype(int)
    x1, y1 = np.ceil(corners.max(axis=0) + reach + 4).astype(int)
    light = edge_channels(np.repeat(grey[y0:y1, x0:x1, None], 3, axis=-1))
    return np.array([x0, y0], dtype=np.float64), light


def _side(
    light: Float32Array, start: FloatArray, end: FloatArray, reach: float, *, bowed: bool
) -> tuple[FloatArray, float] | None:
    """Return a side's line (3,), a x + b y + c = 0 with a unit normal, and the sigma of its place at its ends.

    That of a bowed side runs through its ends.
    """
    length = float(np.linalg.norm(end - start))
    along = (end - start) / max(length, 1e-9)
    outward = np.array([along[1], -along[0]])  # corners run clockwise in the picture (y down): out is to the left
    count = int(np.clip(length / 1.2, _FEWEST_POINTS, 80))
    share = np.linspace(0.08, 0.92, count)
    points = start + share[:, None] * (end - start)
    edges = find_edges(light, points, np.broadcast_to(outward, points.shape).copy(), reach)
    good = np.isfinite(edges.points[:, 0]) & (edges.contrast > 0.3 * median(edges.contrast))
    seen, at = edges.points[good], share[good] - 0.5
    if len(seen) < max(_FEWEST_POINTS, 0.5 * count):
        return None
    height = (seen - start) @ outward
    columns = [np.ones_like(at), at, *([at * at - 0.25] if bowed else [])]  # none of the bow at the ends
    fit = reweighted_linear(np.stack(columns, axis=-1), height, _LEAST_SCATTER_PX, loss=_CLOSE_CAUCHY, rounds=_ROUNDS)
    level, slope = fit.parameters[:2]
    ends = start + np.array([[0.0], [1.0]]) * (end - start) + (level + np.array([[-0.5], [0.5]]) * slope) * outward
    normal = np.array([ends[1, 1] - ends[0, 1], ends[0, 0] - ends[1, 0]])
    normal /= max(float(np.linalg.norm(normal)), 1e-9)
    # n points give a line of k numbers to k times sigma / sqrt(n) at its end; neighbours share pixels.
    sigma = len(columns) * fit.scale * _LEAST_SCATTER_PX * np.sqrt(2.0 / len(seen))
    return np.array([*normal, -normal @ ends[0]]), float(sigma)


def _meet(one: FloatArray, other: FloatArray) -> FloatArray:
    crossing = np.cross(one, other)
    with np.errstate(divide="ignore", invalid="ignore"):
        met: FloatArray = crossing[:2] / crossing[2]
    return met
