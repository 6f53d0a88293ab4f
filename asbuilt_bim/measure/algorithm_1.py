"""Algorithm 1 as it was published: boundary pixels with a depth become world coordinates, Green's theorem their area.

This is the method to compare with, not the one that is used. It measures the face's shadow on the image plane, A
cos(theta), and loses half a pixel all round.
"""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray


def boundary_pixels(mask: BoolArray) -> FloatArray:
    """Return the mask's boundary pixels (N, 2) as x, y, in order along the contour of its largest part.

    The paper collects them in raster order, on which Green's theorem has no meaning; along the contour it has.
    """
    rings, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if len(rings) == 0:
        return np.zeros((0, 2))
    longest = max(rings, key=cv2.contourArea)
    return np.asarray(longest, dtype=np.float64).reshape(-1, 2)


def world_from_boundary(pixels: ArrayLike, depth_m: ArrayLike, camera_matrix: ArrayLike) -> FloatArray:
    """Return X_w, Y_w (N, 2) in metres of pixels (N, 2) with depths (N,).

    Reference: Perez & Tah 2023, eq. 5 and 6, Algorithm 1.
    """
    px = np.asarray(pixels, dtype=np.float64)
    z = np.asarray(depth_m, dtype=np.float64)
    k = np.asarray(camera_matrix, dtype=np.float64)
    return np.stack([(px[:, 0] - k[0, 2]) * z / k[0, 0], (px[:, 1] - k[1, 2]) * z / k[1, 1]], axis=-1)
