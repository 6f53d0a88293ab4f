"""Can a rig's covariance be one? What can't be would leave sigmas without the calibration's part, or with any."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig

_TOLERANCE = 1e-6  # of the sigmas' product; a calibration's own is symmetric to 1e-10


def covariance_problems(rig: StereoRig) -> list[str]:
    """Say what makes a covariance none, or the rig unknown: a sigma as large as what it belongs to."""
    spread = np.diag(rig.covariance)
    if not np.all(np.isfinite(rig.covariance)) or np.any(spread < 0):
        return ["covariance: variances must be finite and not negative"]
    pixels = [limit for camera in (rig.left, rig.right) for limit in _pixels(camera)]
    limits = np.array([*pixels, 1.0, 1.0, 1.0, *[rig.baseline_m] * 3])
    units = ["px"] * 8 + ["rad"] * 3 + ["m"] * 3
    sigmas = np.sqrt(spread)
    if wide := [i for i in range(len(limits)) if sigmas[i] > limits[i]]:
        i = wide[0]
        return [
            f"covariance: row {i} ({PARAMETERS[i]}) says ±{sigmas[i]:.3g} {units[i]}, limit {limits[i]:.3g} "
            f"{units[i]}: that is no calibration; calibrate again, or leave covariance out (then no sigma "
            "holds the rig's part)"
        ]
    scale = np.where(sigmas > 0, sigmas, 1.0)
    shares = rig.covariance / np.outer(scale, scale)
    off = np.abs(shares - shares.T)
    if off.max() > _TOLERANCE:
        row, column = (int(i) for i in np.unravel_index(off.argmax(), off.shape))
        return [
            f"covariance: isn't symmetric: row {row}, column {column} holds {rig.covariance[row, column]:.4g} and its "
            f"mirror {rig.covariance[column, row]:.4g}; copy it whole from the calibration"
        ]
    least = float(np.linalg.eigvalsh((shares + shares.T) / 2.0)[0])
    if least < -_TOLERANCE:
        return [
            f"covariance: is none: a combination of its rows has a negative variance ({least:.2g} of what the diagonal "
            "says); copy it whole from the calibration"
        ]
    return []


def _pixels(camera: Intrinsics) -> tuple[float, float, float, float]:
    """Return what fx, fy, cx and cy can be unsure by at most: themselves, or the picture."""
    return float(camera.K[0, 0]), float(camera.K[1, 1]), float(camera.width_px), float(camera.height_px)
