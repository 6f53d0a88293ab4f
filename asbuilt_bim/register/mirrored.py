"""Is the survey a mirror image of the site: x and y exchanged, or an axis counted the wrong way?

No camera sees a mirrored survey's markers as they are given. Two that lie in one plane may agree all the same, on a
place behind it, and such stations would be held against the wrong elements: so none of a visit's is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.markers import pose_from_markers
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import StationPose, SurveyedMarker

LEAST_SHARE = 0.5
"""Of the surveyed markers that are seen, more agree in the mirror; and so many don't as they are given."""


def mirrored_survey(
    measured: Sequence[StationMeasurement],
    poses: Sequence[StationPose],
    survey: Sequence[SurveyedMarker],
    options: RegisterOptions,
) -> Rejection | None:
    """Return why a visit's survey can't be used, where its markers agree in the mirror alone.

    `poses` are those that the stations were given by the survey as it is.
    """
    known = {marker.marker_id for marker in survey}
    seen = sum(sighting.marker_id in known for station in measured for sighting in station.markers)
    used = sum(len(pose.markers_used) for pose in poses)
    if used >= LEAST_SHARE * seen:
        return None
    exchanged = [replace(one, corners_m=frozen(one.corners_m[:, np.array([1, 0, 2])])) for one in survey]
    found = (pose_from_markers(station, exchanged, options)[0] for station in measured)
    agree = sum(len(pose.markers_used) for pose in found if pose is not None)
    if agree <= LEAST_SHARE * seen:
        return None
    return Rejection(
        code=Reason.SURVEY_MIRRORED,
        subject=Subject(kind=SubjectKind.SURVEY),
        values={"seen": seen, "agree_mirrored": agree, "agree": used},
    )
