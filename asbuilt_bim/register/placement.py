"""Places the measured stations in the world, and says why one could not be placed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.control_points import ControlPoint, pose_from_control_points
from asbuilt_bim.register.markers import pose_from_markers
from asbuilt_bim.register.mirrored import mirrored_survey
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import PlacedStation, Placement, StationPose, SurveyedMarker

NOTHING: Mapping[str, StationPose] = MappingProxyType({})
NO_POINTS: Mapping[str, Sequence[ControlPoint]] = MappingProxyType({})


def register(
    measured: Sequence[StationMeasurement],
    survey: Sequence[SurveyedMarker],
    options: RegisterOptions,
    *,
    given: Mapping[str, StationPose] = NOTHING,
    control_points: Mapping[str, Sequence[ControlPoint]] = NO_POINTS,
) -> Placement:
    """Place each station: by its given pose, else by its control points, else by the surveyed markers that it sees.

    `given` and `control_points` are by the station's name. No station is placed by a mirrored survey.
    """
    by_markers = [one for one in measured if one.station not in given and one.station not in control_points]
    found = {one.station: pose_from_markers(one, survey, options) for one in by_markers}
    mirrored = mirrored_survey(by_markers, [pose for pose, _ in found.values() if pose], survey, options)
    if mirrored is not None:
        found = {one: (None, (_not_placed(one),)) for one in found}
    placed: list[PlacedStation] = []
    rejections: list[Rejection] = [] if mirrored is None else [mirrored]
    for station in measured:
        if station.station in given:
            pose: StationPose | None = given[station.station]
            notes: tuple[Rejection, ...] = ()
        elif station.station in control_points:
            pose, notes = pose_from_control_points(station, control_points[station.station], options)
        else:
            pose, notes = found[station.station]
        rejections.extend(notes)
        if pose is not None:
            placed.append(PlacedStation(measurement=station, pose=pose))
    return Placement(stations=tuple(placed), rejections=tuple(rejections))


def _not_placed(station: str) -> Rejection:
    return Rejection(code=Reason.STATION_SURVEY_MIRRORED, subject=Subject(kind=SubjectKind.STATION, name=station))


def given_pose(station: str, world_from_left: ArrayLike, sigma_rad: float, sigma_m: float) -> StationPose:
    """Make a pose (4, 4) that another instrument knows, with the standard deviation of each angle and coordinate."""
    return StationPose(
        station=station,
        world_from_left=frozen(world_from_left),
        covariance=frozen(np.diag([sigma_rad**2] * 3 + [sigma_m**2] * 3)),
        residual_px=0.0,
        markers_used=(),
        method="given",
    )
