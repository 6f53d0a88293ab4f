"""A station's pose from the surveyed markers that it sees in both photos."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.codes import PHOTO_FAULTS, Reason, Subject, SubjectKind, Value, about
from asbuilt_bim.errors import Rejection, rejected
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
    subject = about(SubjectKind.STATION, station.station)
    if len(seen) < options.min_markers:
        unreadable = any(one.code in PHOTO_FAULTS for one in station.rejections)  # then no other family is the cause
        any_read = bool(station.markers) or unreadable
        return None, (*notes, _too_few(subject, len(seen), options, any_read=any_read, surveyed=bool(survey)))
    agreement = largest_agreement(station.camera, seen, min(options.min_markers, len(seen)))
    if agreement is None:
        return None, (*notes, rejected(Reason.MARKERS_DISAGREE, subject, found=len(seen)))
    if agreement.ambiguous:
        return None, (*notes, _ambiguous(subject, agreement))
    notes += tuple(_wrong_marker(station.station, name, s) for name, s in agreement.wrong.items() if s > NAMED_SIGMAS)
    pose, refused = judged_pose(station.station, station.camera.f_px, agreement, options, "markers")
    return pose, (*notes, *refused)


def judged_pose(
    station: str, focal_px: float, agreement: Agreement, options: RegisterOptions, method: str
) -> tuple[StationPose | None, tuple[Rejection, ...]]:
    """Turn an agreement into a pose, or refuse it by its residual and its sigma ahead."""
    solution = agreement.solution
    covariance = solution.covariance.copy()
    covariance[:3, :3] += np.eye(3) * (options.rig_direction_px / focal_px) ** 2
    used = tuple(int(group.name) for group in agreement.used) if method == "markers" else ()
    pose = StationPose(
        station=station,
        world_from_left=frozen(solution.world_from_left),
        covariance=frozen(covariance),
        residual_px=solution.residual_px,
        markers_used=used,
        method="markers" if method == "markers" else "control_points",
    )
    refused = judged(pose, options)
    return (pose, ()) if refused is None else (None, (refused,))


def judged(pose: StationPose, options: RegisterOptions) -> Rejection | None:
    """Return why a pose can't be used, by its residual or its sigma ahead; None where it can."""
    subject = about(SubjectKind.STATION, pose.station)
    if pose.residual_px > options.max_residual_px:
        residual: dict[str, Value] = {"residual_px": pose.residual_px, "limit_px": options.max_residual_px}
        return rejected(Reason.POSE_RESIDUAL, subject, **residual)
    ahead = sigma_ahead_m(pose.world_from_left, pose.covariance)
    if ahead > options.max_sigma_at_5_m_m:
        limit: dict[str, Value] = {"limit_m": options.max_sigma_at_5_m_m, "ahead_m": AHEAD_M}
        sigma = {"sigma_m": ahead, **limit, "method": pose.method, "residual_px": pose.residual_px}
        return rejected(Reason.POSE_UNCERTAIN, subject, **sigma)
    return None


def sigma_ahead_m(world_from_left: FloatArray, covariance: FloatArray) -> float:
    """Return the largest standard deviation in metres of a point `AHEAD_M` straight ahead of the camera."""
    arm = world_from_left[:3, 2] * AHEAD_M
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
            if survey:  # without one, prints tie stations to each other, and nothing is amiss
                notes.append(_unknown(station.station, sighting.marker_id))
            continue
        if len(marker.corners_m) != len(sighting.left_px):
            continue  # its centre alone: of use where the visit is placed together
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


def _unknown(station: str, marker_id: int) -> Rejection:
    return rejected(Reason.MARKER_NOT_SURVEYED, about(SubjectKind.MARKER, str(marker_id), station))


def _too_few(station: Subject, count: int, options: RegisterOptions, *, any_read: bool, surveyed: bool) -> Rejection:
    values: dict[str, Value] = {"found": count, "needed": options.min_markers, "any_read": any_read}
    return rejected(Reason.MARKERS_TOO_FEW, station, **values, **({} if surveyed else {"surveyed": False}))


def _ambiguous(station: Subject, agreement: Agreement) -> Rejection:
    return rejected(
        Reason.MARKERS_AMBIGUOUS,
        station,
        agree=tuple(group.name for group in agreement.used),
        others=tuple(agreement.wrong),
    )


def _wrong_marker(station: str, name: str, sigmas: float) -> Rejection:
    return rejected(Reason.MARKER_CONTRADICTS, about(SubjectKind.MARKER, name, station), **off_values(sigmas))


def off_values(sigmas: float) -> dict[str, Value]:
    """Return by how many sigmas a point is off, with the limit; an infinite number says nothing and is left out."""
    limit: dict[str, Value] = {"limit_sigmas": NAMED_SIGMAS}
    return limit | {"off_sigmas": float(sigmas)} if np.isfinite(sigmas) else limit
