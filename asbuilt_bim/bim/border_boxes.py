"""What a face's border leaves outside the boxes of its samples: pieces of boxes whose middle lies past it."""

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.polygon import MIN_AREA_M2, Region, area, areas_of_boxes, bounds, contains

Owners = NDArray[np.intp]
"""Numbers of samples."""


def grid_of(region: Region, step_m: FloatArray) -> FloatArray:
    """Return the middles (N, 2) of the boxes of `step_m` (2,) that a region's bounds are divided into."""
    u0, v0, u1, v1 = bounds(region)
    count = np.round(np.array([u1 - u0, v1 - v0]) / step_m).astype(int)
    u, v = (low + (np.arange(n) + 0.5) * step for low, n, step in zip((u0, v0), count, step_m, strict=True))
    return np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)


def border_boxes(region: Region, uv_m: FloatArray, step_m: FloatArray) -> tuple[FloatArray, Owners]:
    """Return the middles (M, 2) of boxes that reach into the region from past its border, and the sample of each (M,).

    `uv_m` (N, 2) are the grid's middles within the region, one at least. Each box belongs to the nearest sample. A
    strip of 7 cm beside a contact has one column of samples 5 cm wide, and they stand for all of it.
    """
    grid = np.zeros((0, 2)) if _is_box(region) else grid_of(region, step_m)
    past = grid[~contains(region, grid)]
    past = past[_areas(region, past, step_m) > MIN_AREA_M2]
    owner = [int(np.argmin(np.abs((uv_m - one) / step_m).sum(axis=1))) for one in past]  # all at once: gigabytes
    return past, np.array(owner, dtype=np.intp)


def sample_areas(region: Region, uv_m: FloatArray, step_m: FloatArray) -> FloatArray:
    """Return what each sample (N, 2) stands for of the region, in m2: its box's part, and its border boxes'."""
    if _is_box(region):
        return np.full(len(uv_m), area(region) / len(uv_m))
    past, owner = border_boxes(region, uv_m, step_m)
    own = _areas(region, uv_m, step_m)
    return own + np.bincount(owner, weights=_areas(region, past, step_m), minlength=len(uv_m))


def _is_box(region: Region) -> bool:
    u0, v0, u1, v1 = bounds(region)
    return abs(area(region) - (u1 - u0) * (v1 - v0)) <= MIN_AREA_M2


def _areas(region: Region, uv_m: FloatArray, step_m: FloatArray) -> FloatArray:
    low, high = (uv_m - 0.5 * step_m).T, (uv_m + 0.5 * step_m).T
    return areas_of_boxes(region, *low, *high)
