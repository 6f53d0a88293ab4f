"""One camera of the rig: its matrix, its lens, its picture size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import FloatArray

MAX_LENS_STEPS = 60
"""The fixed point gains about a digit in two steps for the lenses of site cameras."""
LENS_TOLERANCE_PX = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intrinsics:
    """The camera matrix of eq. 1 and the lens.

    `K` (3, 3) in pixels, pixel centres at integers; `distortion` (5,) or (8,) in OpenCV's order
    k1 k2 p1 p2 k3 [k4 k5 k6].

    Reference: Perez & Tah 2023, eq. 1.
    """

    K: FloatArray
    distortion: FloatArray
    width_px: int
    height_px: int

    def project(self, points_m: ArrayLike) -> FloatArray:
        """Return the pixels (..., 2) of the ORIGINAL photo for points (..., 3) in this camera's frame."""
        points = np.asarray(points_m, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = points[..., :2] / points[..., 2:]
        pixels: FloatArray = self.distorted(xy) * self.K[[0, 1], [0, 1]] + self.K[:2, 2]
        return pixels

    def distorted(self, xy: FloatArray) -> FloatArray:
        """Bend ideal coordinates (..., 2), x/z and y/z, as the lens does.

        Reference: Brown 1966, in OpenCV's rational form.
        """
        k1, k2, p1, p2, k3, *rational = (*self.distortion, *([0.0] * 8))[:8]
        x, y = xy[..., 0], xy[..., 1]
        r2 = x * x + y * y
        scale = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if any(rational):
            k4, k5, k6 = rational
            scale = scale / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        bent = np.empty_like(xy)
        bent[..., 0] = x * scale + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bent[..., 1] = y * scale + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return bent

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """Return the directions (..., 3), z = 1, of pixels (..., 2) of the ORIGINAL photo.

        The lens has no closed inverse: a fixed point x <- x - (project(x) - pixel) / f, to 1e-9 px.
        """
        px = np.asarray(pixels, dtype=np.float64)
        focal = self.K[[0, 1], [0, 1]]
        rays = np.ones((*px.shape[:-1], 3))
        rays[..., :2] = (px - self.K[:2, 2]) / focal
        for _ in range(MAX_LENS_STEPS):
            miss = self.project(rays) - px
            rays[..., :2] -= miss / focal
            if not miss.size or float(np.abs(miss).max()) < LENS_TOLERANCE_PX:
                break
        return rays
