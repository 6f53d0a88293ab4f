"""A hall with columns, and a station in it: what it measures of the hall, and where somebody says that it stood."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.joint import Found, looked_for, poses_by_design
from asbuilt_bim.register.by_design.rough import RoughPlace, RoughPlaces
from asbuilt_bim.register.options import RegisterOptions
from benchmarks.register.design_seen import Box, column, standing, wall

TRUE = standing(0.5, 0.0, 8.0)


def hall(foot_m: float = 0.0) -> list[Box]:
    """Return two walls at a corner, and columns before them, none as wide as another."""
    return [
        wall((-7.0, 7.0), (4.0, 7.0), foot_m=foot_m),
        wall((4.0, 7.0), (4.0, -3.0), foot_m=foot_m),
        column((-1.4, 5.0), 0.4, foot_m),
        column((2.3, 4.4), 0.5, foot_m),
        column((0.4, 6.2), 0.35, foot_m),
    ]


def rough(
    off_m: tuple[float, float] = (0.4, -0.3),
    off_deg: float = 5.0,
    *,
    anywhere: bool = False,
    bearing: bool = True,
    storeys: tuple[str, ...] = ("S0",),
    shift: np.ndarray | None = None,
) -> RoughPlace:
    """Return what somebody says of where the station stood: off by so much."""
    place = TRUE[:2, 3] + off_m + (np.zeros(2) if shift is None else shift[:2])
    return RoughPlace(
        storeys=storeys,
        level_m=None if anywhere else place,
        bearing_rad=None if anywhere or not bearing else float(np.radians(8.0 + off_deg)),
        within_m=1.5,
        within_rad=float(np.radians(20.0)),
    )


def pose_by_design(station: StationMeasurement, rough: RoughPlace, design: BimModel, options: RegisterOptions) -> Found:
    """Find where one station stood by the design alone, near a rough place; without a pose the rejection says why."""
    places = RoughPlaces(places={station.station: rough}, design=design)
    return poses_by_design(looked_for([station], places, options), options)[station.station]
