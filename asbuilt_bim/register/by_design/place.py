"""A station placed by the design: places that fit, the likeliest of them, and how likely every other is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.model import BimModel, Storey
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import wrapped
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.register.by_design.fitting import HEIGHT_LOOSE_M, Fitted, Prior, fitted, possible, turned
from asbuilt_bim.register.by_design.heights import CAMERA_M, camera_height
from asbuilt_bim.register.by_design.planes import FURTHEST_M, Seen, Upright, designed_faces, seen_faces
from asbuilt_bim.register.by_design.rough import RoughPlace
from asbuilt_bim.register.by_design.starts import starts
from asbuilt_bim.register.markers import judged
from asbuilt_bim.register.options import RegisterOptions
from asbuilt_bim.register.pose import ByDesign, StationPose

WRONG = 1e-3
"""How likely a place may be the wrong one at most, all others that fit and none at all counted in."""
MISTAKEN = 0.05
"""How often somebody is wrong about a place, by a storey, a date or a photo: one in twenty, before anything is seen."""
LEVEL_SIGMA_RAD = 5e-4
"""How well a photo pair knows what is plumb, the rig's principal point left aside: read off ten of the sample."""
ABOVE_M, BELOW_M = 12.0, 5.0
"""What is seen from a storey begins so far under its floor at most, and ends so far over it."""
SAME_M, SAME_RAD = 0.10, float(np.radians(2.0))
"""Two fits as near as that are one place."""

Found = tuple[StationPose | None, tuple[Rejection, ...]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Place:
    """A place that fits, the storey it is on, and the storey's design faces."""

    fit: Fitted
    storey: Storey
    design: Upright


def pose_by_design(station: StationMeasurement, rough: RoughPlace, design: BimModel, options: RegisterOptions) -> Found:
    """Find where a station stood by the design alone, near a rough place; without a pose the rejection says why."""
    subject = about(SubjectKind.STATION, station.station)
    seen = seen_faces(station)
    count = 0 if seen is None else len(seen.faces.halves_m)
    if seen is None or count < 2:
        return None, (rejected(Reason.DESIGN_TOO_LITTLE_SEEN, subject, faces=count),)
    origin = _origin(design, rough)
    storeys = _storeys(design, rough)
    places = _merged([one for storey in storeys for one in _places(seen, rough, design, storey, origin, options)])
    if not places:
        return None, (rejected(Reason.DESIGN_NOT_FOUND, subject, faces=count, fits=0),)
    chances = _chances(places)
    best, wrong = places[0], 1.0 - chances[0]
    fits = int(np.sum(best.fit.on >= 0))
    if best.fit.log_odds <= np.log(MISTAKEN / WRONG):
        return None, (rejected(Reason.DESIGN_NOT_FOUND, subject, faces=count, fits=fits),)
    if wrong > WRONG:
        return None, (rejected(Reason.DESIGN_AMBIGUOUS, subject, **_second(places, chances)),)
    height, sigma_m, elsewhere = camera_height(seen, best.design, best.fit, best.storey.elevation_m)
    if elsewhere > WRONG:
        return None, (rejected(Reason.DESIGN_HEIGHT_OPEN, subject, faces=fits),)
    pose = _pose(
        station.station,
        station.camera.f_px,
        seen,
        best,
        origin,
        (height, sigma_m),
        _by_design(places, chances, fits),
        options,
    )
    refused = judged(pose, options)
    return (None, (refused,)) if refused is not None else (pose, ())


def _storeys(design: BimModel, rough: RoughPlace) -> list[Storey]:
    return [one for one in design.storeys if not rough.storeys or one.global_id in rough.storeys]


def _origin(design: BimModel, rough: RoughPlace) -> FloatArray:
    """Return a point (2,) in the world near all of it: coordinates may be a map's."""
    if rough.level_m is not None:
        return rough.level_m
    middles = [element.vertices_m[:, :2].mean(axis=0) for element in design.elements]
    return np.mean(middles, axis=0) if middles else np.zeros(2)


def _places(
    seen: Seen, rough: RoughPlace, design: BimModel, storey: Storey, origin: FloatArray, options: RegisterOptions
) -> list[_Place]:
    """Return all places on a storey that fit."""
    low, high = storey.elevation_m - BELOW_M, storey.elevation_m + ABOVE_M
    walls = designed_faces(design, origin, low, high)
    if not len(walls.halves_m):
        return []
    prior = _prior(rough, walls, len(_storeys(design, rough)))
    if prior.sigma_m is not None:
        walls = _near(walls, FURTHEST_M + 4.0 * prior.sigma_m)
    may = possible(seen, walls, storey.elevation_m + CAMERA_M, HEIGHT_LOOSE_M)
    found = []
    for start in starts(seen, walls, may, prior):
        fit = fitted(seen, walls, may, prior, start, options.rig_disparity_px)
        if fit is not None:
            found.append(_Place(fit=fit, storey=storey, design=walls))
    return found


def _near(walls: Upright, reach_m: float) -> Upright:
    keep = np.linalg.norm(walls.middles_m, axis=1) - walls.halves_m <= reach_m
    return Upright(
        normals=walls.normals[keep], middles_m=walls.middles_m[keep], halves_m=walls.halves_m[keep],
        heights_m=walls.heights_m[keep], round=walls.round[keep], elements=walls.elements[keep],
    )  # fmt: skip


def _prior(rough: RoughPlace, walls: Upright, storeys: int) -> Prior:
    low, high = walls.middles_m.min(axis=0) - FURTHEST_M, walls.middles_m.max(axis=0) + FURTHEST_M
    anywhere = rough.level_m is None
    return Prior(
        level_m=np.zeros(2),
        sigma_m=None if anywhere else 0.5 * rough.within_m,
        turn_rad=0.0 if rough.bearing_rad is None else -rough.bearing_rad,
        sigma_rad=None if rough.bearing_rad is None else 0.5 * rough.within_rad,
        area_m2=float(np.prod(high - low)),
        storey_share=1.0 / max(storeys, 1),
    )


def _merged(places: Sequence[_Place]) -> list[_Place]:
    """Return the places that differ, the likeliest first."""
    found: list[_Place] = []
    for one in sorted(places, key=lambda place: -place.fit.log_odds):
        if not any(_same(one, other) for other in found):
            found.append(one)
    return found


def _same(one: _Place, other: _Place) -> bool:
    turn = float(wrapped(one.fit.turn_rad - other.fit.turn_rad))
    near = np.linalg.norm(one.fit.place_m - other.fit.place_m) <= SAME_M and abs(turn) <= SAME_RAD
    return bool(near and one.storey.global_id == other.storey.global_id)


def _chances(places: Sequence[_Place]) -> FloatArray:
    """Return how likely each place is; that it is none of them is counted in, and goes without one."""
    log = np.array([*(one.fit.log_odds for one in places), np.log(MISTAKEN)])
    share = np.exp(log - log.max())
    chances: FloatArray = (share / share.sum())[:-1]
    return chances


def _second(places: Sequence[_Place], chances: FloatArray) -> dict[str, float]:
    """Return how likely the best and the second best place are, and how far apart."""
    second = {"chance": float(chances[0])}
    if len(places) > 1:
        away = float(np.linalg.norm(places[0].fit.place_m - places[1].fit.place_m))
        second |= {"other_chance": float(chances[1]), "away_m": away}
    return second


def _by_design(places: Sequence[_Place], chances: FloatArray, fits: int) -> ByDesign:
    best = places[0]
    if len(places) < 2:
        return ByDesign(faces=fits, second_away_m=None, second_turned_rad=None, second_chance=0.0, second_storey="")
    other = places[1]
    turn = float(wrapped(other.fit.turn_rad - best.fit.turn_rad))
    return ByDesign(
        faces=fits,
        second_away_m=float(np.linalg.norm(best.fit.place_m - other.fit.place_m)),
        second_turned_rad=float(abs(turn)),
        second_chance=float(chances[1] / (chances[0] + chances[1])),
        second_storey=other.storey.name,
    )


def _pose(
    name: str, focal_px: float, seen: Seen, place: _Place, origin: FloatArray, height: tuple[float, float],
    told: ByDesign, options: RegisterOptions,
) -> StationPose:  # fmt: skip
    """Return the pose with its covariance: turn and level place as fitted, height by feet, tilt by what is plumb."""
    world_from_level = np.eye(3)
    world_from_level[:2, :2] = turned(place.fit.turn_rad)
    pose = np.eye(4)
    pose[:3, :3] = world_from_level @ seen.level_from_left
    pose[:3, 3] = *(place.fit.place_m + origin), height[0]
    covariance = np.diag([LEVEL_SIGMA_RAD**2] * 2 + [0.0] * 3 + [height[1] ** 2])
    at = np.ix_([2, 3, 4], [2, 3, 4])
    covariance[at] = place.fit.covariance
    covariance[:3, :3] += np.eye(3) * (options.rig_direction_px / focal_px) ** 2
    return StationPose(
        station=name, world_from_left=frozen(pose), covariance=frozen(covariance), residual_px=0.0, markers_used=(),
        method="design", by_design=told,
    )  # fmt: skip
