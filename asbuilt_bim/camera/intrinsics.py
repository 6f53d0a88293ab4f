"""One camera of the rig: its matrix, its lens, its picture size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.camera.lens import LensModel, bend, lens_of, straighten
from asbuilt_bim.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intrinsics:
    """The camera matrix of eq. 1 and the lens.

    `K` (3, 3) in pixels, pixel centres at integers. `distortion` is in OpenCV's order: (5,) k1 k2 p1 p2 k3, (8,)
    rational k1 k2 p1 p2 k3 k4 k5 k6, or (4,) fisheye k1 k2 k3 k4. Their number tells the model.

    Raises: ValueError for another number of coefficients.
    Reference: Perez & Tah 2023, eq. 1.
    """

    K: FloatArray
    distortion: FloatArray
    width_px: int
    height_px: int

    def __post_init__(self) -> None:
        lens_of(self.distortion)

    @property
    def lens(self) -> LensModel:
        """Return the lens's model."""
        return lens_of(self.distortion)

    def project(self, points_m: ArrayLike) -> FloatArray:
        """Return the pixels (..., 2) of the ORIGINAL photo for points (..., 3) in this camera's frame, z > 0."""
        points = np.asarray(points_m, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = points[..., :2] / points[..., 2:]
        pixels: FloatArray = bend(self.distortion, xy) * self.K[[0, 1], [0, 1]] + self.K[:2, 2]
        return pixels

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """Return the directions (..., 3), z = 1, of pixels (..., 2) of the ORIGINAL photo, to 1e-9 px.

        NaN where the lens shows nothing: beyond the angle at which its polynomial folds back, or 88 degrees.
        """
        px = np.asarray(pixels, dtype=np.float64)
        rays = np.ones((*px.shape[:-1], 3))
        rays[..., :2] = straighten(self.distortion, (px - self.K[:2, 2]) / self.K[[0, 1], [0, 1]])
        rays[np.isnan(rays[..., 0])] = np.nan
        return rays
