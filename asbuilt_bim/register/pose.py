"""A station's place in the world, with its covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.tags import TagPlace


@dataclass(frozen=True, slots=True, kw_only=True)
class ByDesign:
    """What a pose by the design rests on: how many faces fit, and the second best place, None where there is none.

    `second_chance` is how likely that one is beside the best.
    """

    faces: int
    second_away_m: float | None
    second_turned_rad: float | None
    second_chance: float
    second_storey: str


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
    linked_to: tuple[str, ...] = field(default=(), kw_only=True)  # stations that points of both photos link it to
    method: Literal["markers", "control_points", "given", "linked", "design"]
    by_design: ByDesign | None = None  # where the design alone placed it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedStation:
    """A measured station and where it stood."""

    measurement: StationMeasurement
    pose: StationPose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """The stations that were placed, why others weren't, and where prints are that nobody surveyed, by id."""

    stations: tuple[PlacedStation, ...]
    rejections: tuple[Rejection, ...]
    tags: Mapping[int, TagPlace] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyedMarker:
    """A marker's corners (4, 3) in world metres, order top-left, top-right, bottom-right, bottom-left of the print.

    Of one that was surveyed by its centre alone, that point (1, 3).
    """

    marker_id: int
    corners_m: FloatArray
    sigma_m: float
