"""A corridor of prints, and stations that walk along it: what links them, and what may go wrong with it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, vector_from_rotation
from asbuilt_bim.measure.depth_reference import DepthReference
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.pose import Placement, SurveyedMarker
from asbuilt_bim.register.solve import project_both
from asbuilt_bim.vision.markers.find import MarkerSighting
from tests.register.test_solve import FAR_OFF, camera

SIZE_M = 0.25
NORTH = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Of a camera or a print: x to the east, y down, z to the north."""


def prints(count: int = 14) -> dict[int, np.ndarray]:
    """Return corners (4, 3) of prints along a wall with niches, each turned a little."""
    rng = np.random.default_rng(3)
    found = {}
    for number in range(count):
        middle = FAR_OFF + np.array([0.8 * number - 1.5, (number % 3) * 0.9, 1.0 + 1.2 * ((number * 5) % 7) / 6])
        turn = NORTH @ rotation_from_vector(rng.normal(0.0, [0.02, 0.3, 0.02]))
        half = 0.5 * SIZE_M
        local = np.array([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])
        found[number] = local @ turn.T + middle
    return found


def poses(count: int = 6) -> dict[str, np.ndarray]:
    """Return the stations' true poses (4, 4): side by side, all looking north, held by hand."""
    rng = np.random.default_rng(4)
    return {
        f"A{k}": rigid(
            rotation_from_vector(rng.normal(0.0, 0.05, 3)) @ NORTH,
            FAR_OFF + np.array([1.6 * k, -4.0 + 0.5 * (k % 2), 1.6 + 0.1 * (k % 3)]),
        )
        for k in range(count)
    }


def stations(
    seed: int = 0, noise_px: float = 0.08, there: dict[int, np.ndarray] | None = None, count: int = 6
) -> tuple[StationMeasurement, ...]:
    """Return what the stations see of the prints `there`."""
    rng = np.random.default_rng(seed)
    corners = prints() if there is None else there
    return tuple(
        StationMeasurement(
            station=name, camera=camera(), faces=(), target=None, markers=seen(pose, corners, rng, noise_px),
            depth_ref=DepthReference(png=b"", sigma_png=b"", scale=2), vertical=None, rejections=(), seconds={},
            left_digest="", right_digest="", thumbnail_jpeg=b"",
        )
        for name, pose in poses(count).items()
    )  # fmt: skip


def seen(
    pose: np.ndarray, corners: dict[int, np.ndarray], rng: np.random.Generator, noise_px: float
) -> tuple[MarkerSighting, ...]:
    """Return the prints whose corners lie in both photos."""
    found = []
    for number, points in corners.items():
        pixels = project_both(camera(), pose, points)[0]
        if pixels.min() < 5.0 or pixels[:, [0, 2]].max() > 1275.0 or pixels[:, [1, 3]].max() > 955.0:
            continue
        pixels = pixels + rng.normal(0.0, noise_px, pixels.shape)
        found.append(
            MarkerSighting(
                marker_id=number, left_px=frozen(pixels[:, :2]), right_px=frozen(pixels[:, 2:]), sigma_px=0.08
            )
        )
    return tuple(found)


def survey(numbers: Collection[int], sigma_m: float = 0.001) -> list[SurveyedMarker]:
    """Return a survey of some prints, without errors."""
    return [
        SurveyedMarker(marker_id=number, corners_m=frozen(corners), sigma_m=sigma_m)
        for number, corners in prints().items() if number in numbers
    ]  # fmt: skip


def centre_alone(one: SurveyedMarker) -> SurveyedMarker:
    """Return a marker of which the centre alone was surveyed."""
    return replace(one, corners_m=frozen(one.corners_m.mean(axis=0)[None]))


def errors(placement: Placement) -> dict[str, np.ndarray]:
    """Return by station the small motion (6,) [rad, m] from where it was found to where it stood."""
    true = poses(20)
    found = {}
    for placed in placement.stations:
        here, there = placed.pose.world_from_left, true[placed.pose.station]
        found[placed.pose.station] = np.concatenate(
            [vector_from_rotation(there[:3, :3] @ here[:3, :3].T), there[:3, 3] - here[:3, 3]]
        )
    return found


def codes(placement: Placement) -> list[str]:
    """Return what was rejected, by code."""
    return [str(one.code) for one in placement.rejections]


def shown_by(measured: Sequence[StationMeasurement], number: int) -> list[str]:
    """Return the stations that see a print."""
    return [one.station for one in measured if any(mark.marker_id == number for mark in one.markers)]
