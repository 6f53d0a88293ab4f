"""Cameras of viewpoints: where a photo was taken, or where the next one should be, in world metres."""

import math
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.report import StationRecord, WantedView

_PLANNED_FOV_DEG, _PLANNED_ASPECT = 55.0, 4.0 / 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole camera: place, unit direction and unit up in the world, vertical field of view, width by height."""

    place_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view_deg: float
    aspect: float


def station_camera(station: StationRecord) -> Camera | None:
    """Return the camera of a station's picture, the rectified left photo; None where it wasn't placed."""
    if station.world_from_left is None:
        return None
    world_from_rectified = station.world_from_left[:3, :3] @ station.rectified_from_left.T
    return Camera(
        place_m=_three(station.world_from_left[:3, 3]),
        direction=_three(world_from_rectified[:, 2]),
        up=_three(-world_from_rectified[:, 1]),
        field_of_view_deg=math.degrees(2.0 * math.atan(0.5 * station.height_px / station.f_px)),
        aspect=station.width_px / station.height_px,
    )


def wanted_camera(view: WantedView) -> Camera | None:
    """Return the camera of a photo to take, held level; None where the design leaves no place for it."""
    if view.stand_x_m is None or view.stand_y_m is None:
        return None
    away = np.array([view.look_x_m - view.stand_x_m, view.look_y_m - view.stand_y_m, 0.0])
    length = float(np.linalg.norm(away))
    if length <= 0.0:
        return None
    return Camera(
        place_m=(view.stand_x_m, view.stand_y_m, view.look_z_m),
        direction=_three(away / length),
        up=(0.0, 0.0, 1.0),
        field_of_view_deg=_PLANNED_FOV_DEG,
        aspect=_PLANNED_ASPECT,
    )


def _three(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(part) for part in vector)
    return x, y, z
