"""A station's pose from the surveyed markers that it sees in both photos."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import skew
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.agree import Agreement, largest_agreement
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import StationPose, SurveyedMarker
from asbuilt_bim.register.solve import Sighted

AHEAD_M = 5.0
"""Where the pose's own sigma is judged: elements stand 3 to 8 m away."""


NAMED_SIGMAS = 3.0
"""A marker that the others leave out is named as wrong from here on; under it, it is only not needed."""


def pose_from_markers(
    station: StationMeasurement, survey: Sequence[SurveyedMarker], options: RegisterOptions
) -> tuple[StationPose | None, tuple[Rejection, ...]]:
    """Find a station's pose from its marker sightings; without a pose the rejections say why.

    A marker that contradicts the others, or that the survey lacks, is named and left out; the station is kept.
    """
    seen, notes = _sighted(station, survey, options)
    what = f"station {station.station}"
    if len(seen) < options.min_markers:
        return None, (*notes, _too_few(what, len(seen), options.min_markers, any_read=bool(station.markers)))
    agreement = largest_agreement(station.camera, seen, min(options.min_markers, len(seen)))
    if agreement is None:
        return None, (*notes, _none_agree(what, len(seen)))
    if agreement.ambiguous:
        return None, (*notes, _ambiguous(what, agreement))
    notes += tuple(_wrong_marker(what, name, s) for name, s in agreement.wrong.items() if s > NAMED_SIGMAS)
    pose, refused = judged_pose(station.station, station.camera.f_px, agreement, options, "markers")
    return pose, (*notes, *refused)


def judged_pose(
    station: str, focal_px: float, agreement: Agreement, options: RegisterOptions, method: str
) -> tuple[StationPose | None, tuple[Rejection, ...]]:
    """Turn an agreement into a pose, or refuse it by its residual and its sigma ahead."""
    what, solution = f"station {station}", agreement.solution
    covariance = solution.covariance.copy()
    covariance[:3, :3] += np.eye(3) * (options.rig_direction_px / focal_px) ** 2
    if solution.residual_px > options.max_residual_px:
        return None, (_residual(what, solution.residual_px, options.max_residual_px),)
    ahead = sigma_ahead_m(solution.world_from_left, covariance, AHEAD_M)
    if ahead > options.max_sigma_at_5_m_m:
        return None, (_uncertain(what, ahead, options.max_sigma_at_5_m_m),)
    used = tuple(int(group.name) for group in agreement.used) if method == "markers" else ()
    pose = StationPose(
        station=station,
        world_from_left=frozen(solution.world_from_left),
        covariance=frozen(covariance),
        residual_px=solution.residual_px,
        markers_used=used,
        method="markers" if method == "markers" else "control_points",
    )
    return pose, ()


def sigma_ahead_m(world_from_left: FloatArray, covariance: FloatArray, distance_m: float) -> float:
    """Return the largest standard deviation in metres of a point `distance_m` straight ahead of the camera."""
    arm = world_from_left[:3, 2] * distance_m
    jacobian = np.hstack([-skew(arm), np.eye(3)])
    return float(np.sqrt(np.max(np.linalg.eigvalsh(jacobian @ covariance @ jacobian.T))))


def _sighted(
    station: StationMeasurement, survey: Sequence[SurveyedMarker], options: RegisterOptions
) -> tuple[list[Sighted], tuple[Rejection, ...]]:
    surveyed = {marker.marker_id: marker for marker in survey}
    seen: list[Sighted] = []
    notes: list[Rejection] = []
    for sighting in station.markers:
        marker = surveyed.get(sighting.marker_id)
        if marker is None:
            notes.append(_unknown(f"station {station.station}", sighting.marker_id))
            continue
        seen.append(
            Sighted(
                name=str(sighting.marker_id),
                world_m=marker.corners_m,
                left_px=sighting.left_px,
                right_px=sighting.right_px,
                sigma_px=max(sighting.sigma_px, options.min_corner_sigma_px),
                sigma_m=marker.sigma_m,
            )
        )
    return seen, tuple(notes)


def _unknown(what: str, marker_id: int) -> Rejection:
    return Rejection(
        what=f"{what}, marker {marker_id}",
        reason="the survey has no such marker",
        remedy="add its four corners to the survey, or take the print down",
    )


def _too_few(what: str, count: int, limit: int, *, any_read: bool) -> Rejection:
    more = "show more surveyed markers, spread over the frame"
    return Rejection(
        what=what,
        reason="too few surveyed markers in view",
        value=f"{count}",
        limit=f"at least {limit}",
        remedy=more if any_read else f"where the photos do show some, check markers.family; else {more}",
    )


def _none_agree(what: str, count: int) -> Rejection:
    return Rejection(
        what=what,
        reason=f"no two of its {count} surveyed markers agree on one pose",
        remedy="check their ids, the corner order and the survey's unit and handedness (x east, y north, z up)",
    )


def _ambiguous(what: str, agreement: Agreement) -> Rejection:
    names = ", ".join(group.name for group in agreement.used)
    wrong = ", ".join(agreement.wrong)
    return Rejection(
        what=what,
        reason=f"its markers give two different poses: {names} say one, {wrong} another",
        remedy="survey these markers again, or show one more",
    )


def _wrong_marker(what: str, name: str, sigmas: float) -> Rejection:
    return Rejection(
        what=f"{what}, marker {name}",
        reason="contradicts the other markers and was left out",
        value=f"{sigmas:.0f} sigma" if np.isfinite(sigmas) else "",
        limit="3 sigma",
        remedy="survey it again: it was moved, or its corners are mistaken",
    )


def _residual(what: str, value_px: float, limit_px: float) -> Rejection:
    return Rejection(
        what=what,
        reason="its pose leaves too large a reprojection error",
        value=f"{value_px:.1f} px",
        limit=f"{limit_px:.1f} px",
        remedy="check the survey and the rig's calibration",
    )


def _uncertain(what: str, sigma_m: float, limit_m: float) -> Rejection:
    return Rejection(
        what=what,
        reason=f"its pose is too uncertain {AHEAD_M:.0f} m ahead",
        value=f"{sigma_m * 1000:.0f} mm",
        limit=f"{limit_m * 1000:.0f} mm",
        remedy="show markers that are nearer, or further apart in the frame",
    )
