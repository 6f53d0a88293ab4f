"""Stations that are tied to each other, whatever the design: by prints that nobody surveyed, and by points."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.fitting import turned
from asbuilt_bim.register.by_design.planes import Seen, Upright
from asbuilt_bim.register.growth import Viewpoint
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.point_links import PointLink
from asbuilt_bim.register.visit import Sources, place_visit

KNOWN = 1e-12
"""The variance of what the others are measured from."""
LEVEL_RAD = float(np.radians(1.0))
"""Two stations know what is plumb far better; a tie that says otherwise is none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tie:
    """How a station stands in the level frame of another: turn counter-clockwise from above, and place (3,)."""

    turn_rad: float
    shift_m: FloatArray
    sigma_rad: float
    sigma_m: float


OWN = Tie(turn_rad=0.0, shift_m=np.zeros(3), sigma_rad=0.0, sigma_m=0.0)


def links_of(
    first: StationMeasurement,
    stations: Sequence[StationMeasurement],
    levels: Mapping[str, FloatArray],
    links: Sequence[PointLink],
    options: RegisterOptions,
) -> dict[str, Tie]:
    """Return the stations that are tied to a first one, without itself; `levels` (3, 3) turn each to its level frame.

    What hangs on one print alone is none of them.
    """
    names = {one.station for one in stations}
    inside = [one for one in links if one.first in names and one.second in names]
    shown = {mark.marker_id for mark in first.markers}
    others = {mark.marker_id for one in stations if one is not first for mark in one.markers}
    if not shown & others and not any(first.station in (one.first, one.second) for one in inside):
        return {}
    sources = Sources(
        poses={first.station: (np.eye(4), KNOWN * np.eye(6))}, survey={}, remembered={}, sizes_m={},
        starts={first.station: np.eye(4)}, points={}, links=inside,
    )  # fmt: skip
    viewpoints = [
        Viewpoint(name=one.station, camera=one.camera, seen={mark.marker_id: mark for mark in one.markers})
        for one in stations
    ]
    places = place_visit(viewpoints, sources, options)
    found: dict[str, Tie] = {}
    for name, (pose, covariance) in places.poses.items():
        sure = len(places.used[name]) >= options.min_markers or name in places.linked_to
        if name != first.station and sure and name not in places.hanging:
            tie = _tie(levels[first.station], levels[name], pose, covariance)
            if tie is not None:
                found[name] = tie
    return found


def _tie(level: FloatArray, own: FloatArray, pose: FloatArray, covariance: FloatArray) -> Tie | None:
    turn = level @ pose[:3, :3] @ own.T
    if np.linalg.norm(turn[2, :2]) > LEVEL_RAD:
        return None
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = level
    leveled = both @ covariance @ both.T
    return Tie(
        turn_rad=float(np.arctan2(turn[1, 0], turn[0, 0])),
        shift_m=level @ pose[:3, 3],
        sigma_rad=float(np.sqrt(leveled[2, 2])),
        sigma_m=float(np.sqrt(np.linalg.eigvalsh(leveled[3:5, 3:5])[-1])),
    )


def seen_together(seen: Sequence[Seen], ties: Sequence[Tie]) -> Seen:
    """Return what tied stations saw as what one saw, in the level frame that the ties are in: the first one's."""
    moved = [_moved(one, tie) for one, tie in zip(seen, ties, strict=True)]
    faces = [one.faces for one in moved]
    return Seen(
        faces=Upright(
            normals=np.concatenate([one.normals for one in faces]),
            middles_m=np.concatenate([one.middles_m for one in faces]),
            halves_m=np.concatenate([one.halves_m for one in faces]),
            heights_m=np.concatenate([one.heights_m for one in faces]),
            round=np.concatenate([one.round for one in faces]),
            elements=np.concatenate([one.elements for one in faces]),
        ),
        offset_sigma_m=np.concatenate([one.offset_sigma_m for one in moved]),
        angle_sigma_rad=np.concatenate([one.angle_sigma_rad for one in moved]),
        whole=np.concatenate([one.whole for one in moved]),
        by_disparity_m=np.concatenate([one.by_disparity_m for one in moved]),
        eyes_m=np.concatenate([one.eyes_m for one in moved]),
        level_from_left=seen[0].level_from_left,
    )


def _moved(seen: Seen, tie: Tie) -> Seen:
    turn = turned(tie.turn_rad).T
    faces = replace(
        seen.faces,
        normals=seen.faces.normals @ turn,
        middles_m=seen.faces.middles_m @ turn + tie.shift_m[:2],
        heights_m=seen.faces.heights_m + tie.shift_m[2],
    )
    return replace(
        seen,
        faces=faces,
        offset_sigma_m=np.hypot(seen.offset_sigma_m, tie.sigma_m),
        angle_sigma_rad=np.hypot(seen.angle_sigma_rad, tie.sigma_rad),
        by_disparity_m=seen.by_disparity_m @ turn,
        eyes_m=seen.eyes_m @ turn + tie.shift_m[:2],
    )
