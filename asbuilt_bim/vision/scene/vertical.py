"""Which way is up: the vanishing direction of the photo's upright edges."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.robust_least_squares import tukey
from asbuilt_bim.geometry.transform import unit

MOST_TILT_DEG = 25.0  # a hand-held camera; beyond, a raking shore is as likely an upright
LEAST_LENGTH_PX = 40.0  # gives a direction to 0.1 px / 40 px = 0.15 degrees
TOLERANCE_DEG = 0.6  # what a formwork edge may lean, and a line detector err
LEAST_EDGES = 4  # two fix the direction, two more confirm it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vertical:
    """`up` (3,) unit in the RECTIFIED frame, and its sigma in radians."""

    up: FloatArray
    sigma_rad: float


@lru_cache(maxsize=1)  # surfaces and a network's geometry ask of the same pair
def find_vertical(pair: RectifiedPair) -> Vertical | None:
    """Return the direction that most upright edge length of the left photo agrees on; None where edges don't say."""
    normals, lengths = _upright_edges(pair)
    if len(normals) < LEAST_EDGES:
        return None
    sine = np.sin(np.radians(TOLERANCE_DEG))
    candidates = _candidates(normals, lengths, np.cos(np.radians(MOST_TILT_DEG)))
    if len(candidates) == 0:
        return None
    agreement = (np.abs(candidates @ normals.T) < sine) @ lengths
    up = candidates[int(np.argmax(agreement))]
    weight = np.zeros_like(lengths)
    spread = 1.0
    for shrink in (1.0, 0.7, 0.5, 0.5):
        residual = normals @ up
        weight = lengths * tukey(residual, reach=sine * shrink * 1.5)
        values, vectors = np.linalg.eigh((normals * weight[:, None]).T @ normals)
        up = vectors[:, 0] * -np.sign(vectors[1, 0])
        spread = float(values[1] / max(values.sum(), 1e-12))
    edges = int(np.count_nonzero(weight))
    if edges < LEAST_EDGES:
        return None
    scatter = float(np.sqrt(np.average((normals @ up) ** 2, weights=weight)))
    # edges that stand close together fix the direction along their common plane badly
    sigma = max(scatter / np.sqrt((edges - 2.0) * max(spread, 1e-4)), 2e-4) if edges > 2 else sine
    return Vertical(up=frozen(up), sigma_rad=float(sigma))


def _upright_edges(pair: RectifiedPair) -> tuple[FloatArray, FloatArray]:
    """Return the interpretation planes' unit normals (N, 3) of long upright edges, and their lengths (N,)."""
    found = cv2.createLineSegmentDetector().detect(cv2.cvtColor(pair.left, cv2.COLOR_BGR2GRAY))[0]
    segments = np.zeros((0, 4)) if found is None else np.asarray(found, dtype=np.float64).reshape(-1, 4)
    rise = np.abs(segments[:, 3] - segments[:, 1])
    lengths = np.hypot(segments[:, 2] - segments[:, 0], rise)
    middle = np.round(0.5 * (segments[:, :2] + segments[:, 2:])).astype(np.intp)
    height, width = pair.valid_left.shape
    inner = cv2.erode(pair.valid_left.astype(np.uint8), np.ones((9, 9), np.uint8), borderValue=0) > 0
    inside = inner[np.clip(middle[:, 1], 0, height - 1), np.clip(middle[:, 0], 0, width - 1)]
    # an upright edge off the axis leans by more than the camera does: hence the slack of 15 degrees
    upright = rise > lengths * np.cos(np.radians(MOST_TILT_DEG + 15.0))
    kept = (lengths >= LEAST_LENGTH_PX) & upright & inside
    ends = pair.camera.rectified_rays(segments[kept].reshape(-1, 2, 2))
    return unit(np.cross(ends[:, 0], ends[:, 1])), lengths[kept]


def _candidates(normals: FloatArray, lengths: FloatArray, least_cosine: float) -> FloatArray:
    """Return the directions (M, 3) that pairs of the longest edges share, where they are near the camera's own up."""
    longest = normals[np.argsort(-lengths)[:60]]
    first, second = np.triu_indices(len(longest), 1)
    crossed = np.cross(longest[first], longest[second])
    length = np.linalg.norm(crossed, axis=1)
    apart = length > np.sin(np.radians(1.5))  # two edges at one place fix nothing
    up = crossed[apart] / length[apart, None]
    up = up * -np.sign(up[:, 1:2])
    return np.asarray(up[-up[:, 1] > least_cosine])
