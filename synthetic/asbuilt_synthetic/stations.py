"""Chooses where photos are taken: places that see elements, tags and the target, found by ray casting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from asbuilt_synthetic.building import CLEAR_M, STOREY_M, Building, Element
from asbuilt_synthetic.clutter import Plan
from asbuilt_synthetic.in_view import disc_is_seen, joined, marker_is_seen, points_in_view
from asbuilt_synthetic.meshes import join, transform, tube
from asbuilt_synthetic.model import Disc, FloatArray, Marker, RigTruth, Station
from asbuilt_synthetic.progress import Progress
from asbuilt_synthetic.rig import rotation
from asbuilt_synthetic.surface import samples
from asbuilt_synthetic.tracer import Tracer

DISC_RADIUS_M = 0.15
_SEEN_WITHIN_M = 10.0
_WHOLE_WITHIN_M = 7.5
_COARSE_M = 0.16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Candidate:
    station: Station
    upper: bool
    inside: bool
    aim: int
    tags: int
    seen: FloatArray  # (E,) per element: share of its exposed samples in view
    whole: float  # sum over built faces wholly in view and near of what they are worth, large ones more


class StationFinder:
    """Holds what a search for stations needs: the site at a visit, its tracer, its tags, its rig."""

    def __init__(
        self,
        building: Building,
        state: Progress,
        rig: RigTruth,
        tracer: Tracer,
        markers: tuple[Marker, ...],
        plans: tuple[Plan, Plan],
    ) -> None:
        self.building, self.state, self.rig, self.tracer, self.plans = building, state, rig, tracer, plans
        self.markers = markers
        self.elements = building.vertical
        parts = [samples(building, e, state.fraction[e.global_id], _COARSE_M) for e in self.elements]
        self.coarse = joined(parts)
        self.owner = np.repeat(np.arange(len(parts)), [len(p.points_m) for p in parts])
        self.face = self.owner * 4 + self.coarse.side
        self.exposed_m2 = np.bincount(self.owner, self.coarse.area_m2 * self.coarse.exposed)
        self.built = self.coarse.built & self.coarse.exposed
        built_m2 = np.bincount(self.face, self.coarse.area_m2 * self.built, minlength=4 * len(parts))
        self.face_worth = np.clip(built_m2 / 2.0, 0.25, 2.0) * (built_m2 > 0)
        self.standing = [i for i, e in enumerate(self.elements) if state.stands(e)]
        self.local_from_world = np.linalg.inv(building.world_from_local)

    def find(self, count: int, rng: np.random.Generator, tries: int) -> tuple[Station, ...]:
        """Choose `count` stations that together see much of the site, out of `tries` places drawn.

        Raises:
            RuntimeError: when the site offers too few places from which tags and target are seen.
        """
        pool = [c for c in (self._candidate(rng) for _ in range(tries)) if c is not None]
        if len(pool) < count:
            raise RuntimeError(
                f"seed {self.building.seed} visit {self.state.visit}: only {len(pool)} places for stations"
            )
        return tuple(replace(c.station, name=_name(k, c)) for k, c in enumerate(self._choose(pool, count)))

    def _choose(self, pool: list[_Candidate], count: int) -> list[_Candidate]:
        chosen: list[_Candidate] = []
        seen = np.zeros(len(self.elements))
        upper_wanted = 2 if any(c.upper for c in pool) else 0
        for k in range(count):
            need_upper = k >= count - max(0, upper_wanted - sum(c.upper for c in chosen))
            left = [c for c in pool if c not in chosen]
            open_ = [c for c in left if c.upper or not need_upper] or left
            if k == 1 and not need_upper:
                open_ = [c for c in open_ if c.inside != chosen[0].inside] or open_
            aimed = [c.aim for c in chosen]
            eyes = np.array([c.station.world_from_left[:3, 3] for c in chosen]).reshape(-1, 3)
            gains = [
                float(
                    (np.maximum(c.seen, seen) - seen).sum()
                    + 0.8 * min(c.whole, 3.5)
                    + 0.4 * min(c.tags, 5)
                    - 1.0 * (c.tags < 3)
                    - 1.0 * (c.aim in aimed)
                    - 0.8 * _is_near(c, eyes)
                    - 0.8 * (upper_wanted and c.upper and sum(d.upper for d in chosen) >= 2)
                )
                for c in open_
            ]
            best = open_[int(np.argmax(gains))]
            chosen.append(best)
            seen = np.maximum(seen, best.seen)
        return chosen

    def _candidate(self, rng: np.random.Generator) -> _Candidate | None:
        some = self.standing if self.standing and rng.random() < 0.75 else range(len(self.elements))
        aim = int(rng.choice(some))
        e = self.elements[aim]
        floor = e.storey * STOREY_M
        if e.storey == 1 and not any(
            s.storey == 1 and s.zone == e.zone and self.state.stands(s)
            for s in self.building.elements
            if s.ifc_class == "IfcSlab"
        ):
            return None
        place = self._stand_before(e, rng)
        if place is None:
            return None
        eye, target = place
        station = Station(name="?", world_from_left=self._look(eye, target, rng), disc=None)
        if not self._is_clear(station):
            return None
        tags = [m for m in self.markers if marker_is_seen((self.tracer,), self.rig, station, m)]
        if len(tags) < 2:
            return None
        with_disc = self._with_disc(station, e, floor, rng)
        if with_disc is None:
            return None
        own = Tracer(self.tracer.origin_m, with_disc.bodies, (), with_disc.disc)
        tags = [m for m in tags if marker_is_seen((own,), self.rig, with_disc, m)]
        if len(tags) < 2:
            return None
        seen, whole = self._seen(with_disc)
        if seen[aim] < 0.15:
            return None
        inside = self.plans[0].is_inside(float(eye[0]), float(eye[1]))
        return _Candidate(
            station=with_disc, upper=e.storey == 1, inside=inside, aim=aim, tags=len(tags), seen=seen, whole=whole
        )

    def _stand_before(self, e: Element, rng: np.random.Generator) -> tuple[FloatArray, FloatArray] | None:
        """Draw an eye point 3 to 8 m from a point of the element, where a person can stand; local frame."""
        x0, x1 = e.x_range_m
        at = transform(e.local_from_element, np.array([[rng.uniform(0.25, 0.75) * (x1 - x0) + x0, 0, 0]]))[0]
        plan = self.plans[e.storey]
        for _ in range(12):
            d, a = 3.0 + 5.0 * rng.beta(1.4, 1.8), rng.uniform(0, 2 * np.pi)
            x, y = at[0] + d * np.cos(a), at[1] + d * np.sin(a)
            if e.storey == 1:
                edge = self.building.joint_x_m if self.state.visit < 2 else self.building.axes_x_m[3]
                if not (plan.is_inside(x, y) and x < edge - 0.3):
                    continue
                floor = STOREY_M
            else:
                floor = plan.floor_m(x, y)
            if plan.is_free(x, y, 0.3):
                eye = np.array([x, y, floor + rng.uniform(1.4, 1.8)])
                return eye, np.array([at[0], at[1], e.z_m + CLEAR_M / 2 + rng.normal(0, 0.12)])
        return None

    def _look(self, eye: FloatArray, target: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Pose the left camera in world: towards the target, by hand (yaw, pitch and roll a little off)."""
        forward = target - eye
        yaw = np.arctan2(forward[1], forward[0]) + np.deg2rad(rng.normal(0, 6))
        pitch = np.arctan2(forward[2], np.hypot(*forward[:2])) + np.deg2rad(rng.normal(0, 1.5))
        pitch = np.clip(pitch, -np.deg2rad(8), np.deg2rad(8))
        roll = np.deg2rad(np.clip(rng.normal(0, 1.2), -3, 3))
        f = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
        right = np.cross(f, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :3] = np.c_[right, np.cross(f, right), f] @ rotation(np.array([0, 0, roll]))
        pose[:3, 3] = eye
        return np.asarray(self.building.world_from_local @ pose)

    def _is_clear(self, station: Station) -> bool:
        """Refuse places with things right before the lens, or shut in."""
        x, y = np.meshgrid(np.linspace(-0.6, 0.6, 31), np.linspace(-0.45, 0.45, 23))
        d = np.c_[x.ravel(), y.ravel(), np.ones(x.size)]
        pose = station.world_from_left
        _, t = self.tracer.first_hit(pose[:3, 3], d @ pose[:3, :3].T)
        return bool(t.min() > 0.7 and np.mean(t < 2.0) < 0.1)

    def _with_disc(self, station: Station, e: Element, floor: float, rng: np.random.Generator) -> Station | None:
        """Set the target up beside the element, or return None where no place is seen from both cameras."""
        eye = transform(self.local_from_world, station.world_from_left[None, :3, 3])[0]
        x0, x1 = e.x_range_m
        mid = transform(e.local_from_element, np.array([[(x0 + x1) / 2, 0, 0]]))[0]
        way = mid[:2] - eye[:2]
        distance = float(np.hypot(*way))
        way /= distance
        across = float(abs(np.cos(e.angle_rad) * way[1] - np.sin(e.angle_rad) * way[0]))
        half = (e.length_m * across + e.width_m * (1 - across)) / 2
        plan = self.plans[e.storey]
        for _ in range(40):
            d = float(np.clip(distance + rng.uniform(-1.2, 0.8), 3.0, 6.8))
            off = float(rng.choice([-1, 1]) * (0.25 + half * float(rng.random() < 0.8) + rng.uniform(0.0, 1.5)))
            x, y = eye[:2] + d * way + off * np.array([-way[1], way[0]])
            if not plan.is_free(x, y, 0.22) or (e.storey == 1 and not plan.is_inside(x, y)):
                continue
            base = floor if e.storey == 1 else plan.floor_m(x, y)
            centre = np.array([x, y, base + rng.uniform(0.9, 1.7)])
            turn = np.arctan2(eye[1] - y, eye[0] - x) + np.deg2rad(rng.uniform(-22, 22))
            tilt = np.deg2rad(rng.uniform(-6, 6))
            normal = np.array([np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)])
            made = self._set_up(station, centre, normal, base)
            if disc_is_seen(self.tracer, self.rig, made):
                return made
        return None

    def _set_up(self, station: Station, centre: FloatArray, normal: FloatArray, base: float) -> Station:
        world = self.building.world_from_local
        back = centre - 0.03 * normal
        foot = np.array([back[0], back[1], base])
        legs = [
            tube(
                "leg",
                (*foot[:2], base + 0.45),
                (foot[0] + 0.32 * np.cos(a), foot[1] + 0.32 * np.sin(a), base),
                0.01,
                "stand_black",
                8,
            )
            for a in (0.4, 2.5, 4.6)
        ]
        pole = tube("pole", foot + np.array([0, 0, 0.3]), back, 0.012, "stand_black", 10)
        disc = Disc(centre_m=transform(world, centre[None])[0], normal=world[:3, :3] @ normal, radius_m=DISC_RADIUS_M)
        return replace(station, disc=disc, bodies=(join("Target stand", [pole, *legs]).placed(world),))

    def _seen(self, station: Station) -> tuple[FloatArray, float]:
        """Estimate, on coarse samples, what share of each element is in view and how many built faces wholly."""
        eye = station.world_from_left[:3, 3]
        tracers = (self.tracer, Tracer(self.tracer.origin_m, station.bodies, (), station.disc))
        distance = np.linalg.norm(self.coarse.points_m - eye, axis=1)
        left = points_in_view(tracers, self.rig, station, "left", self.coarse)
        near = left & (distance < _SEEN_WITHIN_M)
        n = len(self.elements)
        seen = np.bincount(self.owner, self.coarse.area_m2 * near, minlength=n) / np.maximum(
            0.5 * self.exposed_m2, 1e-9
        )
        both = left & points_in_view(tracers, self.rig, station, "right", self.coarse) & (distance < _WHOLE_WITHIN_M)
        missing = np.bincount(self.face, self.built & ~both, minlength=4 * n)
        return np.minimum(seen, 1.0), float(self.face_worth[missing == 0].sum())


def _is_near(c: _Candidate, eyes: FloatArray) -> bool:
    return bool((np.linalg.norm(eyes - c.station.world_from_left[:3, 3], axis=1) < 3.0).any())


def _name(k: int, c: _Candidate) -> str:
    return f"{'U' if c.upper else 'G'}{k + 1}"
