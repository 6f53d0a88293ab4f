"""A station's place in the world, with its covariance."""

from dataclasses import dataclass
from typing import Literal

from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station import StationMeasurement


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationPose:
    """`world_from_left` (4, 4) of the PHYSICAL left camera in world metres.

    `covariance` (6, 6): [rotation vector (rad), translation (m)] of a small motion in WORLD axes about the camera's
    centre.
    `residual_px` is the rms reprojection error over all corners used.
    """

    station: str
    world_from_left: FloatArray
    covariance: FloatArray
    residual_px: float
    markers_used: tuple[int, ...]
    method: Literal["markers", "control_points", "given", "planes"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedStation:
    """A measured station and where it stood."""

    measurement: StationMeasurement
    pose: StationPose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """The stations that were placed, and why others weren't."""

    stations: tuple[PlacedStation, ...]
    rejections: tuple[Rejection, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyedMarker:
    """A marker's corners (4, 3) in world metres, order top-left, top-right, bottom-right, bottom-left of the print."""

    marker_id: int
    corners_m: FloatArray
    sigma_m: float
