"""The stereo rig as it was calibrated."""

import math
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


@dataclass(frozen=True, slots=True, kw_only=True)
class RigWidth:
    """What a rig without a covariance is trusted to, one sigma each: how the right camera stands, lenses and scale.

    `turn_rad`: pitch, yaw and roll, and the baseline's direction down and ahead. `lens_px` is what the lenses leave,
    smoothly over the frame. `scale_share` is that of every length.
    """

    turn_rad: tuple[float, float, float, float, float]
    lens_px: float
    scale_share: float = 0.0


def radians_each(
    pitch: float, yaw: float, roll: float, down: float, ahead: float
) -> tuple[float, float, float, float, float]:
    """Return five angles in degrees as `RigWidth.turn_rad` has them."""
    return math.radians(pitch), math.radians(yaw), math.radians(roll), math.radians(down), math.radians(ahead)


OTHER_PROGRAMS = RigWidth(turn_rad=radians_each(0.005, 0.02, 0.005, 0.05, 0.2), lens_px=0.2)
"""A calibration by another program: twice what twenty pairs of a good board leave open.

Its lenses: on two published rigs (EuRoC, ETH3D) matches leave 0.13 to 0.19 px by cell of the frame. The turn fitted to
them changed areas at 5 m by 20 to 36 %, which a board and a laser contradict.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StereoRig:
    """Two cameras and where the right one stands: `right_from_left` (4, 4) in metres.

    `covariance` (P, P) belongs to `PARAMETERS` and, after them, to the coefficients of the left and of the right lens.
    That of an older rig file ends with `PARAMETERS` (14, 14). All zeros means "not known" (a rig file of another tool):
    then `width` says what it is trusted to.
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
    width: RigWidth = OTHER_PROGRAMS
    lens_px: float = 0.0  # what the lenses leave beyond the covariance, smoothly over the frame

    @property
    def lens_left_px(self) -> float:
        """Return what the lenses leave: beyond the covariance, or what a rig without one is trusted to."""
        return self.lens_px if np.any(self.covariance) else self.width.lens_px

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
