"""The surveyed markers, checked against the design before a pose is built on them."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, SurveyError, rejected
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.print_shape import UNIT_MISTAKES

MAX_COORDINATE_M = 1e9
"""Beyond the moon; what is written so is no place."""
FAR_M = 200.0
"""A marker further than this from the building is not on its site."""


def check_survey(survey: Sequence[SurveyedMarker], design: BimModel) -> tuple[Rejection, ...]:
    """Name the markers that lie far from the design's building.

    Raises:
        SurveyError: most of the markers do; survey and model are in two coordinate systems or units.
    """
    if not survey or (box := design.box_m()) is None:
        return ()
    low, high = box
    away_m = design.off_box_m(np.array([one.corners_m.mean(axis=0) for one in survey]))
    found = [(one, float(away)) for one, away in zip(survey, away_m, strict=True) if away > FAR_M]
    if 2 * len(found) > len(survey):
        marker, away = found[0]
        raise SurveyError(
            f"the survey: {len(found)} of {len(survey)} markers lie further than {FAR_M:.0f} m from the building of "
            f"{design.file_name} (marker {marker.marker_id}: {metres(away)}; the building spans "
            f"{_xyz(low)} to {_xyz(high)} m){_offset_hint(survey, low, high)}. Give the survey in the IFC's world "
            "coordinates, in metres (site placement applied, no map conversion)"
        )
    return tuple(
        rejected(Reason.MARKER_FAR, about(SubjectKind.MARKER, str(marker.marker_id)), away_m=away, limit_m=FAR_M)
        for marker, away in found
    )


def _offset_hint(survey: Sequence[SurveyedMarker], low: FloatArray, high: FloatArray) -> str:
    middle = np.mean([m.corners_m.mean(axis=0) for m in survey], axis=0)
    target = 0.5 * (low + high)
    every = np.concatenate([marker.corners_m for marker in survey])
    span, wanted = float(np.linalg.norm(np.ptp(every, axis=0))) + 1e-3, float(np.linalg.norm(high - low))
    for factor, unit in UNIT_MISTAKES.items():
        near = np.all(np.abs(middle / factor - target) < FAR_M) and not np.all(np.abs(middle - target) < FAR_M)
        if near and abs(np.log(span / factor / wanted)) < abs(np.log(span / wanted)):
            return f"; the numbers look like {unit}"
    exchanged = middle[[1, 0, 2]]
    if np.all(np.abs(exchanged - target) < FAR_M):
        return "; x and y (easting and northing) look exchanged"
    return "; if it was right before, the IFC was written from another origin since"


def _xyz(point: FloatArray) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in point) + ")"


def metres(value: float) -> str:
    """Return a distance over 200 m as people say it."""
    return f"{value:.0f} m" if value < 10_000 else f"{value / 1000:.0f} km"
