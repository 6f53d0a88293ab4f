"""Stations placed by the design: places that fit, the likeliest of them, and how likely every other is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_bim.bim.model import BimModel, Storey
from asbuilt_bim.codes import Value
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, wrapped
from asbuilt_bim.register.by_design.fitting import HEIGHT_LOOSE_M, Fitted, LinkedPrior, Prior, fitted, possible, turned
from asbuilt_bim.register.by_design.heights import CAMERA_M
from asbuilt_bim.register.by_design.planes import Seen, Upright, designed_faces
from asbuilt_bim.register.by_design.rough import RoughPlace
from asbuilt_bim.register.by_design.starts import starts
from asbuilt_bim.register.options import FURTHEST_M, RegisterOptions
from asbuilt_bim.register.point_links import SAME_M, SAME_RAD
from asbuilt_bim.register.pose import ByDesign, StationPose

LEVEL_SIGMA_RAD = 5e-4
"""How well a photo pair knows what is plumb, the rig's principal point left aside: read off ten of the sample."""
ABOVE_M, BELOW_M = 12.0, 5.0
"""What is seen from a storey begins so far under its floor at most, and ends so far over it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Place:
    """A place that fits, the storey it is on, and the storey's design faces; coordinates are from `origin_m` (2,)."""

    fit: Fitted
    storey: Storey
    design: Upright
    origin_m: FloatArray

    def at(self, turn_rad: float, shift_m: FloatArray) -> tuple[float, FloatArray]:
        """Return turn and place (2,) of what is turned and shifted in the frame of this place."""
        return self.fit.turn_rad + turn_rad, self.fit.place_m + turned(self.fit.turn_rad) @ shift_m


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground:
    """A storey where a station may stand: its design faces, from an origin (2,), and what is known of the place."""

    storey: Storey
    design: Upright
    prior: Prior
    origin_m: FloatArray


def grounds(rough: RoughPlace, design: BimModel, origin_m: FloatArray) -> list[Ground]:
    """Return the storeys that a station may stand on; coordinates are from an origin (2,)."""
    storeys = [one for one in design.storeys if not rough.storeys or one.global_id in rough.storeys]
    found = []
    for storey in storeys:
        walls = designed_faces(design, origin_m, storey.elevation_m - BELOW_M, storey.elevation_m + ABOVE_M)
        if not len(walls.halves_m):
            continue
        prior = _prior(rough, walls, len(storeys), origin_m)
        if prior.sigma_m is not None:
            walls = _near(walls, prior.level_m, FURTHEST_M + 4.0 * prior.sigma_m)
        found.append(Ground(storey=storey, design=walls, prior=prior, origin_m=origin_m))
    return found


def origin_of(rough: RoughPlace, design: BimModel) -> FloatArray:
    """Return a point (2,) in the world near all of it: coordinates may be a map's."""
    if rough.level_m is not None:
        return rough.level_m
    middles = [element.vertices_m[:, :2].mean(axis=0) for element in design.elements]
    return np.mean(middles, axis=0) if middles else np.zeros(2)


def places_on(
    seen: Seen,
    ground: Ground,
    options: RegisterOptions,
    more: Sequence[tuple[float, FloatArray]] = (),
    linked: Sequence[LinkedPrior] = (),
    *,
    search: bool = True,
) -> list[Place]:
    """Return all places on a storey that fit: near the starts given, and those that are searched for."""
    prior = replace(ground.prior, linked=tuple(linked))
    may = possible(seen, ground.design, ground.storey.elevation_m + CAMERA_M, HEIGHT_LOOSE_M)
    searched = starts(seen, ground.design, may, prior) if search else ()
    found = []
    for start in (*more, *searched):
        fit = fitted(seen, ground.design, may, prior, start, options.rig_disparity_px)
        if fit is not None:
            found.append(Place(fit=fit, storey=ground.storey, design=ground.design, origin_m=ground.origin_m))
    return found


def _near(walls: Upright, place_m: FloatArray, reach_m: float) -> Upright:
    keep = np.linalg.norm(walls.middles_m - place_m, axis=1) - walls.halves_m <= reach_m
    return Upright(
        normals=walls.normals[keep], middles_m=walls.middles_m[keep], halves_m=walls.halves_m[keep],
        heights_m=walls.heights_m[keep], round=walls.round[keep], elements=walls.elements[keep],
    )  # fmt: skip


def _prior(rough: RoughPlace, walls: Upright, storeys: int, origin_m: FloatArray) -> Prior:
    low, high = walls.middles_m.min(axis=0) - FURTHEST_M, walls.middles_m.max(axis=0) + FURTHEST_M
    anywhere = rough.level_m is None
    return Prior(
        level_m=np.zeros(2) if rough.level_m is None else rough.level_m - origin_m,
        sigma_m=None if anywhere else 0.5 * rough.within_m,
        turn_rad=0.0 if rough.bearing_rad is None else -rough.bearing_rad,
        sigma_rad=None if rough.bearing_rad is None else 0.5 * rough.within_rad,
        area_m2=float(np.prod(high - low)),
        storey_share=1.0 / max(storeys, 1),
    )


def merged(places: Sequence[Place]) -> list[Place]:
    """Return the places that differ, the likeliest first."""
    found: list[Place] = []
    for one in sorted(places, key=lambda place: -place.fit.log_odds):
        if not any(_same(one, other) for other in found):
            found.append(one)
    return found


def _same(one: Place, other: Place) -> bool:
    return one.storey.global_id == other.storey.global_id and is_near(one.fit, other.fit.turn_rad, other.fit.place_m)


def is_near(fit: Fitted, turn_rad: float, place_m: FloatArray) -> bool:
    """Say whether a fit is at a place."""
    near = np.linalg.norm(fit.place_m - place_m) <= SAME_M
    return bool(near and abs(float(wrapped(fit.turn_rad - turn_rad))) <= SAME_RAD)


def second_of(places: Sequence[Place], shares: FloatArray) -> dict[str, Value]:
    """Return how likely the best and the second best place are, and how far apart."""
    second: dict[str, Value] = {"chance": float(shares[0])}
    if len(places) > 1:
        away = float(np.linalg.norm(places[0].fit.place_m - places[1].fit.place_m))
        second |= {"other_chance": float(shares[1]), "away_m": away}
    return second


def by_design_of(places: Sequence[Place], shares: FloatArray) -> ByDesign:
    """Return what is told of the best place: what fits there, and which other fits second best."""
    best = places[0]
    fits = int(np.sum(best.fit.on >= 0))
    if len(places) < 2:
        return ByDesign(faces=fits, second_away_m=None, second_turned_rad=None, second_chance=0.0, second_storey="")
    other = places[1]
    turn = float(wrapped(other.fit.turn_rad - best.fit.turn_rad))
    return ByDesign(
        faces=fits,
        second_away_m=float(np.linalg.norm(best.fit.place_m - other.fit.place_m)),
        second_turned_rad=float(abs(turn)),
        second_chance=float(shares[1] / (shares[0] + shares[1])),
        second_storey=other.storey.name,
    )


def pose_of(
    name: str, focal_px: float, seen: Seen, place: Place, height: tuple[float, float], by_design: ByDesign,
    options: RegisterOptions,
) -> StationPose:  # fmt: skip
    """Return the pose with its covariance: turn and level place as fitted, height by feet, tilt by what is plumb."""
    world_from_level = rotation_from_vector([0.0, 0.0, place.fit.turn_rad])
    pose = rigid(world_from_level @ seen.level_from_left, (*(place.fit.place_m + place.origin_m), height[0]))
    covariance = np.diag([LEVEL_SIGMA_RAD**2] * 2 + [0.0] * 3 + [height[1] ** 2])
    at = np.ix_([2, 3, 4], [2, 3, 4])
    covariance[at] = place.fit.covariance
    covariance[:3, :3] += np.eye(3) * (options.rig_direction_px / focal_px) ** 2
    return StationPose(
        station=name, world_from_left=frozen(pose), covariance=frozen(covariance), residual_px=0.0, markers_used=(),
        method="design", by_design=by_design,
    )  # fmt: skip
