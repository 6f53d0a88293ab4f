"""What is told of stations that the design alone placed."""

from collections.abc import Sequence

import numpy as np

from asbuilt_bim.codes import Note, Reason, SubjectKind, Value, about, noted
from asbuilt_bim.register.pose import ByDesign, PlacedStation, StationPose


def design_notes(stations: Sequence[PlacedStation]) -> tuple[Note, ...]:
    """Say of each station that the design placed how well that is known, and which place fits second best."""
    return tuple(_note(one.pose, one.pose.by_design) for one in stations if one.pose.by_design is not None)


def _note(pose: StationPose, told: ByDesign) -> Note:
    sigma = np.sqrt(np.diag(pose.covariance))
    second: dict[str, Value] = {}
    if told.second_away_m is not None and told.second_turned_rad is not None:
        second = {
            "second_away_m": told.second_away_m,
            "second_turned_rad": told.second_turned_rad,
            "second_chance": told.second_chance,
            "second_storey": told.second_storey,
        }
    return noted(
        Reason.PLACED_BY_DESIGN,
        about(SubjectKind.STATION, pose.station),
        sigma_m=float(sigma[3:].max()),
        direction_sigma_rad=float(sigma[:3].max()),
        fits=told.faces,
        **second,
    )
