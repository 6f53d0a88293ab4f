"""The array types that cross the package, and how an array is made read-only."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int32]
ByteImage = NDArray[np.uint8]  # (H, W, 3) BGR or (H, W)


def frozen(values: ArrayLike) -> FloatArray:
    """Copy `values` to a read-only float64 array."""
    array: FloatArray = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def freeze(array: NDArray[Any]) -> NDArray[Any]:
    """Make `array` itself read-only and return it."""
    array.setflags(write=False)
    return array


def unique_rows(rows: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the places (K,) of each distinct row (N, D), in the rows' order, and which of those each row is (N,).

    As `np.unique` of an axis gives them, without what that spends on small arrays.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    which = np.empty(len(rows), dtype=np.intp)
    which[order] = np.cumsum(new) - 1
    return order[new], which


def median(values: NDArray[Any]) -> float:
    """Return the median of finite numbers (N,), NaN of none; `np.median` without what it spends on small arrays."""
    count = values.size
    if count == 0:
        return float("nan")
    middle = count // 2
    ordered = np.partition(values, middle)  # of two places it takes several times as long
    return float(ordered[middle] if count % 2 else 0.5 * (ordered[:middle].max() + ordered[middle]))


def weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """Return the value that half of the weight lies under, between two values where it lies between them; both (N,)."""
    order = np.argsort(values)
    under = np.cumsum(weights[order]) - 0.5 * weights[order]
    return float(np.interp(0.5 * float(np.sum(weights)), under, values[order]))
