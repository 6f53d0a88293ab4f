"""Poses as rig files print them, made rigid where digits were rounded away."""

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray

ROUNDED = 1e-4
"""How far off length 1 a printed rotation's axes may be: four digits leave 5e-5, a turn of 0.003 degrees at the most.

Fewer digits don't hold a rig, and what is further off is no rotation.
"""
EXACT = 1e-9
"""A rotation this near is left as it is: this program's own files are read back to the last digit."""


def nearest_rigid(matrix: FloatArray) -> FloatArray:
    """Return a matrix (4, 4) whose rotation, off by the file's rounding, is made a rotation; larger faults stay."""
    if not np.all(np.isfinite(matrix)):
        return matrix
    turn = matrix[:3, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() <= EXACT:
        return matrix
    u, sizes, v = np.linalg.svd(turn)
    if np.abs(sizes - 1.0).max() > ROUNDED or np.linalg.det(u @ v) < 0.0:
        return matrix
    mended = matrix.copy()
    mended[:3, :3] = u @ v
    return mended


def rotation_from_quaternion(x: float, y: float, z: float, w: float) -> FloatArray | None:
    """Return the rotation matrix (3, 3) of a quaternion, None where it isn't of length 1 but for rounding."""
    quaternion = np.array([x, y, z, w])
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) <= 10.0 * ROUNDED:
        return None
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
