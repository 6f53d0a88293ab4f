"""A station's pose from points clicked in its left photo whose world coordinates are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.agree import largest_agreement
from asbuilt_bim.register.markers import judged_pose, off_values
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import StationPose
from asbuilt_bim.register.solve import Sighted

SUBSET = 4
"""Three points leave up to four poses; the fourth settles which."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlPoint:
    """A named point: `world_m` (3,) and `left_px` (2,) in rectified pixels: clicks go through the lens model first."""

    name: str
    world_m: FloatArray
    left_px: FloatArray


def pose_from_control_points(
    station: StationMeasurement, points: Sequence[ControlPoint], options: RegisterOptions
) -> tuple[StationPose | None, tuple[Rejection, ...]]:
    """Find a station's pose from control points; a point that contradicts the others is named and left out."""
    subject = Subject(kind=SubjectKind.STATION, name=station.station)
    if len(points) < options.min_control_points:
        few = Rejection(
            code=Reason.CONTROL_POINTS_TOO_FEW,
            subject=subject,
            values={"found": len(points), "needed": options.min_control_points},
        )
        return None, (few,)
    seen = [
        Sighted(
            name=point.name,
            world_m=point.world_m.reshape(1, 3),
            left_px=point.left_px.reshape(1, 2),
            right_px=None,
            sigma_px=options.control_point_sigma_px,
            sigma_m=options.control_point_sigma_m,
        )
        for point in points
    ]
    agreement = largest_agreement(station.camera, seen, SUBSET)
    if agreement is None or len(agreement.used) < options.min_control_points - 1 or agreement.ambiguous:
        none = Rejection(
            code=Reason.CONTROL_POINTS_DISAGREE,
            subject=subject,
            values={
                "agree": len(agreement.used) if agreement else 0,
                "found": len(points),
                "needed": options.min_control_points - 1,
            },
        )
        return None, (none,)
    notes = tuple(
        Rejection(
            code=Reason.CONTROL_POINT_CONTRADICTS,
            subject=Subject(kind=SubjectKind.CONTROL_POINT, name=name, station=station.station),
            values=off_values(sigmas),
        )
        for name, sigmas in agreement.wrong.items()
    )
    pose, refused = judged_pose(station.station, station.camera.f_px, agreement, options, "control_points")
    return pose, (*notes, *refused)
