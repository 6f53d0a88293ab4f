"""The area that the published method gives, from the parts of it that the package has."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.geometry.arrays import BoolArray
from asbuilt_bim.geometry.polygon import ring_area
from asbuilt_bim.measure.algorithm_1 import boundary_pixels, world_from_boundary


def paper_area(mask: BoolArray, depth_m: ArrayLike, camera_matrix: ArrayLike) -> float:
    """Return the area in m2 that the published method gives for a mask (H, W) and a depth map (H, W).

    Boundary pixels without a depth (NaN) are left out. Zero where fewer than three are left.

    Reference: Perez & Tah 2023, section 3.4.
    """
    pixels = boundary_pixels(mask)
    if len(pixels) < 3:
        return 0.0
    depth = np.asarray(depth_m, dtype=np.float64)[pixels[:, 1].astype(np.intp), pixels[:, 0].astype(np.intp)]
    known = np.isfinite(depth)
    return abs(ring_area(world_from_boundary(pixels[known], depth[known], camera_matrix)))
