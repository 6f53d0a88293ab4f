"""The covariance of a rig's 14 numbers with the lenses' coefficients folded in.

A board that pins the rays down leaves focal length and distortion free to trade with each other: what one is too long
the other takes back. The 14 numbers' own covariance would count the error of the focal length in full, and with it a
fifth too much of every area's.
"""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.calibration.adjust import Adjustment
from asbuilt_bim.camera.calibration.parameters import camera_of, layout_of
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import bend, straighten
from asbuilt_bim.geometry.arrays import FloatArray, frozen

_GRID = (13, 11)
_INNER = 0.6  # of the frame: where faces that are seen whole lie; the rim is the lens's, and boards seldom pin it down
_STEP = 1e-5


def folded_covariance(adjusted: Adjustment, size: tuple[int, int]) -> FloatArray:
    """Return the covariance (14, 14) of `rig.PARAMETERS`, each lens coefficient as what it does to the picture.

    What a coefficient moves in a frame of `size` (width, height) px is written as the change of focal lengths and
    principal point that moves it most alike; the rest bends within a face and is small.
    """
    layout = layout_of(adjusted.shared)
    carried = np.zeros((len(layout.rig_rows), layout.shared))
    carried[np.arange(len(layout.rig_rows)), layout.rig_rows] = 1.0
    for side in (0, 1):
        own = np.flatnonzero(layout.of_side(side))
        carried[4 * side : 4 * side + 4, own[4:]] = _as_pinhole(camera_of(adjusted.shared, side, size))
    return frozen(carried @ adjusted.covariance @ carried.T)


def _as_pinhole(camera: Intrinsics) -> FloatArray:
    """Return the change (4, C) of fx, fy, cx, cy that comes nearest to a unit change of each coefficient."""
    across, down = (0.5 + 0.5 * _INNER * np.linspace(-1.0, 1.0, count) for count in _GRID)
    pixels = np.stack(np.meshgrid(across * camera.width_px, down * camera.height_px), axis=-1).reshape(-1, 2)
    focal, centre = camera.K[[0, 1], [0, 1]], camera.K[:2, 2]
    rays = straighten(camera.distortion, (pixels - centre) / focal)
    rays = rays[np.isfinite(rays).all(axis=1)]
    bent = bend(camera.distortion, rays)
    zero, one = np.zeros(len(rays)), np.ones(len(rays))
    pinhole = np.stack([np.r_[bent[:, 0], zero], np.r_[zero, bent[:, 1]], np.r_[one, zero], np.r_[zero, one]], axis=1)
    lens = []
    for step in _STEP * np.eye(len(camera.distortion)):
        moved = (bend(camera.distortion + step, rays) - bent) / _STEP * focal
        lens.append(np.r_[moved[:, 0], moved[:, 1]])
    return np.asarray(np.linalg.lstsq(pinhole, np.stack(lens, axis=1), rcond=None)[0], dtype=np.float64)
