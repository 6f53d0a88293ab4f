"""Points that a station's left photo shows, each with its look, and with the disparity that stereo found there."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, frozen

MOST = 800
"""Of a station: the strongest of every part of the frame."""
PARTS = 4
"""The frame is so many by so many parts; each keeps its share of points."""
SIGMA_PX = 0.3
"""What SIFT places a point to, in pixels of the picture it is found in; what is left over widens it."""
_FEATURES = 4000
_LEAST_DISPARITY_PX = 2.0  # further away nothing is known of the distance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Landmarks:
    """N points: rectified left pixels (N, 2), disparities (N,) with sigma (N,), and looks (N, 128) as SIFT has them.

    `sigma_px` is the standard deviation of a pixel coordinate.
    """

    left_px: FloatArray
    disparity_px: FloatArray
    disparity_sigma_px: FloatArray
    looks: NDArray[np.float32]
    sigma_px: float


def find_landmarks(
    grey: ByteImage, full_per_px: float, disparity: Float32Array, sigma: Float32Array, scale: int
) -> Landmarks:
    """Find points in a left photo (h, w) of which a pixel is `full_per_px` of the rectified one.

    `disparity`, `sigma` and `scale` are of `depth_reference.unpack`.

    Reference: Lowe 2004, distinctive image features from scale-invariant keypoints.
    """
    finder = cv2.SIFT.create(nfeatures=_FEATURES, contrastThreshold=0.01)
    points, looks = finder.detectAndCompute(grey, None)
    if looks is None:
        points, looks = (), np.zeros((0, 128), dtype=np.float32)
    at = np.array([p.pt for p in points], dtype=np.float64).reshape(-1, 2)
    pixels = (at + 0.5) * full_per_px - 0.5
    column, row = (np.clip(np.floor((pixels[:, k] + 0.5) / scale).astype(np.intp), 0, disparity.shape[1 - k] - 1)
                   for k in (0, 1))  # fmt: skip
    here = np.asarray(disparity[row, column], dtype=np.float64)
    known = np.flatnonzero(np.isfinite(here) & (here > _LEAST_DISPARITY_PX))
    strength = np.array([p.response for p in points])[known] if len(points) else np.zeros(0)
    size = np.array([grey.shape[1], grey.shape[0]]) * full_per_px
    kept = known[_spread(pixels[known], strength, (float(size[0]), float(size[1])))]
    return Landmarks(
        left_px=frozen(pixels[kept]), disparity_px=frozen(here[kept]),
        disparity_sigma_px=frozen(np.asarray(sigma[row[kept], column[kept]], dtype=np.float64)),
        looks=np.asarray(looks, dtype=np.float32)[kept], sigma_px=SIGMA_PX * full_per_px,
    )  # fmt: skip


def _spread(left_px: FloatArray, strength: FloatArray, size: tuple[float, float]) -> NDArray[np.intp]:
    """Return which points to keep: the strongest of each part of the frame, as many as there is room for."""
    part = parts_of(left_px, size)
    order = np.lexsort((left_px[:, 1], left_px[:, 0], -strength))
    rank = np.empty(len(order), dtype=np.intp)
    for number in np.unique(part):
        mine = order[part[order] == number]
        rank[mine] = np.arange(len(mine))
    return np.sort(np.lexsort((left_px[:, 1], left_px[:, 0], rank))[:MOST])


def parts_of(pixels: FloatArray, size: tuple[float, float]) -> NDArray[np.intp]:
    """Return the part of the frame (n,) that each pixel (n, 2) lies in."""
    at = np.clip((pixels / np.asarray(size) * PARTS).astype(np.intp), 0, PARTS - 1)
    return np.asarray(at[:, 1] * PARTS + at[:, 0], dtype=np.intp)
