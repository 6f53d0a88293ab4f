"""The stereo rig as it was calibrated."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.geometry.arrays import FloatArray, frozen

PARAMETERS = (
    "fx_left",
    "fy_left",
    "cx_left",
    "cy_left",
    "fx_right",
    "fy_right",
    "cx_right",
    "cy_right",
    "rx",
    "ry",
    "rz",
    "tx",
    "ty",
    "tz",
)
"""The first rows of `StereoRig.covariance`: pixels, rotation vector (rad) and translation (m) of right_from_left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StereoRig:
    """Two cameras and where the right one stands: `right_from_left` (4, 4) in metres.

    `covariance` (P, P) belongs to `PARAMETERS` and, after them, to the coefficients of the left and of the right lens.
    That of an older rig file ends with `PARAMETERS` (14, 14). All zeros means "not known" (a rig file of another tool).
    `rms_px` is the calibration's stereo reprojection error, 0 where it isn't known.
    `camera_model`, `camera_serial`, `focal_length_mm` come from the boards' EXIF, "" / 0 where there is none:
    a photo that says otherwise is of another camera, or was zoomed.
    """

    left: Intrinsics
    right: Intrinsics
    right_from_left: FloatArray
    covariance: FloatArray
    rms_px: float = 0.0
    views_used: int = 0
    camera_model: str = ""
    camera_serial: str = ""
    focal_length_mm: float = 0.0
    camera_serial_right: str = ""  # "" where the right camera's boards carry no serial
    exif_orientation: int = 0  # of the boards; 0 where they carry none

    @property
    def baseline_m(self) -> float:
        """Return the distance between the two camera centres in metres."""
        return float(np.linalg.norm(self.right_from_left[:3, 3]))

    @property
    def knows_lenses(self) -> bool:
        """Say whether the covariance goes on to the lenses' coefficients."""
        return len(self.covariance) > len(PARAMETERS)


def rig_of_unknown_sigma(left: Intrinsics, right: Intrinsics, right_from_left: FloatArray) -> StereoRig:
    """Return a rig that came without a covariance, such as another program's: all zeros."""
    unknown = np.zeros((len(PARAMETERS), len(PARAMETERS)))
    return StereoRig(left=left, right=right, right_from_left=frozen(right_from_left), covariance=frozen(unknown))
