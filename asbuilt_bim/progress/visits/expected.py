"""What a planned station is for, and how well it will measure that: elements, distance, sigma of an area, tags."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.camera.photo.working_size import working_rig
from asbuilt_bim.camera.rectify import RectifiedCamera, rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, cross, inverse, unit
from asbuilt_bim.measure.sigma.area import calibration_sigmas_m2, image_sigma_m2, rings_area_m2
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.visits.plan_visit import PlannedStation, PlannedVisit
from asbuilt_bim.progress.visits.squares import SIDE_M, Squares
from asbuilt_bim.progress.visits.tags import NEEDED, HelpfulTag, TagInPlace, tags_in_view

MATCH_PX, WINDOW_PX = 0.1, 9
"""Noise of a match on concrete, and the side of the window that shares it."""
SIDE_PX = 0.5
"""Of each side of an outline: the edge's own, and which of two edges it is. Of the sample's whole faces the sigma that
was measured is 0.8 of what is expected by it (median)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownElement:
    """An element that a station shows: its own share of what the station adds, in m2."""

    element: BimElement
    m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExpectedStation:
    """A planned station with what to expect of it; `sigma` is a share of the area of what it mainly shows."""

    planned: PlannedStation
    shown: tuple[ShownElement, ...]  # the most first
    distance_m: float  # of what it mainly shows
    sigma: float
    tags: tuple[int, ...]  # surveyed ones that it will see
    nearest: tuple[tuple[BimElement, float], ...]  # what stands nearest, and how far off it is: to find the place by


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VisitPlan:
    """A planned visit with what to expect of it; `known` is the report of what earlier visits saw, perhaps nothing."""

    day: date
    known: ProgressReport
    visit: PlannedVisit
    stations: tuple[ExpectedStation, ...]
    tags: tuple[HelpfulTag, ...]
    due: tuple[BimElement, ...]
    later: int  # elements that the plan begins after that day
    has_dates: bool  # whether the plan says of any element when it is due
    by_tags: bool = True  # surveyed tags place its stations; else poses, points or rough places do

    @property
    def unplaced(self) -> tuple[int, ...]:
        """Return the stations, by number, that see too few surveyed tags to be placed by them."""
        return tuple(one.planned.number for one in self.stations if self.by_tags and len(one.tags) < NEEDED)

    @property
    def placed_m2(self) -> float:
        """Return the area of what the stations show that will be placed: no other photo counts."""
        wanted, left = self.visit.wanted, set(self.unplaced)
        shown = np.zeros(len(wanted.area_m2), dtype=np.bool_)
        for one in self.stations:
            if one.planned.number not in left:
                shown[wanted.square[one.planned.patches]] = True
        return float(wanted.area_m2[shown].sum())


def expected_stations(
    visit: PlannedVisit, rig: StereoRig, tags: Sequence[TagInPlace], standing: Sequence[BimElement], most_width_px: int
) -> tuple[ExpectedStation, ...]:
    """Return what to expect of each planned station; photos are measured at `most_width_px` at most."""
    worked = working_rig(rig, most_width_px)
    camera = rectification(worked).camera
    return tuple(_expected(one, visit, worked, camera, tags, standing) for one in visit.stations)


def _expected(
    station: PlannedStation,
    visit: PlannedVisit,
    rig: StereoRig,
    camera: RectifiedCamera,
    tags: Sequence[TagInPlace],
    standing: Sequence[BimElement],
) -> ExpectedStation:
    squares, pose = visit.wanted, station.world_from_left
    new = np.unique(squares.square[station.first])
    areas = np.bincount(squares.element[new], squares.area_m2[new], minlength=len(squares.elements))
    order = [int(index) for index in np.argsort(-areas, kind="stable") if areas[index] > 0.0]
    main = _main_face(station, squares)
    away = float(np.linalg.norm(squares.points_m[main].mean(axis=0) - pose[:3, 3]))
    return ExpectedStation(
        planned=station,
        shown=tuple(ShownElement(element=squares.elements[i], m2=float(areas[i])) for i in order),
        distance_m=away,
        sigma=_sigma(squares.points_m[main], squares.normals[main], pose, rig, camera),
        tags=tags_in_view(rig, visit.around, pose, tags),
        nearest=_nearest(pose[:3, 3], [one for one in standing if one.storey == station.storey]),
    )


def _main_face(station: PlannedStation, squares: Squares) -> NDArray[np.intp]:
    """Return the patches (N,) of the face of which a station shows most that no other does."""
    faces = squares.face[station.first]
    most = int(np.bincount(faces).argmax())
    return np.flatnonzero(station.first & (squares.face == most))


def _sigma(
    points_m: FloatArray, normals: FloatArray, pose: FloatArray, rig: StereoRig, camera: RectifiedCamera
) -> float:
    """Return the sigma of the area of a face's patches, as the share of it: the rectangle round them, measured."""
    rectified_from_world = camera.rectified_from_left @ inverse(pose)[:3, :3]
    normal = unit(normals.mean(axis=0))
    along = unit(cross([0.0, 0.0, 1.0], normal))
    up = cross(normal, along)
    middle = points_m.mean(axis=0)
    u, v = (points_m - middle) @ along, (points_m - middle) @ up
    half = 0.5 * SIDE_M
    corners = [(u.min() - half, v.min() - half), (u.max() + half, v.min() - half)]
    corners += [(u.max() + half, v.max() + half), (u.min() - half, v.max() + half)]
    ring_m = np.array([middle + a * along + b * up for a, b in corners])
    ring = camera.project(apply(inverse(pose), ring_m))
    if np.isnan(ring).any():
        return float("nan")
    turned = rectified_from_world @ normal
    height = float(turned @ (rectified_from_world @ (middle - pose[:3, 3])))
    q = camera.f_px * camera.baseline_m * turned / height
    rays = _windows(ring, camera)
    covariance = frozen(MATCH_PX**2 * np.linalg.inv(rays.T @ rays))
    ends = np.roll(ring, -1, axis=0)
    sides = [(0.5 * (a + b), float(np.linalg.norm(b - a)), SIDE_PX) for a, b in zip(ring, ends, strict=True)]
    own = image_sigma_m2([ring], sides, 0.0, q, covariance, camera)
    shared = float(calibration_sigmas_m2([([ring], q)], rig, camera)[0])
    return float(np.hypot(own, shared)) / rings_area_m2([ring], q, camera)


def _windows(ring: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return rays (N, 3), z = 1 in the rectified frame, of windows that each match a box round a ring on their own."""
    low, high = ring.min(axis=0), ring.max(axis=0)
    across, down = (np.arange(a, max(b, a + 3 * WINDOW_PX), WINDOW_PX) for a, b in zip(low, high, strict=True))
    x, y = (one.ravel() for one in np.meshgrid(across, down))
    return camera.rectified_rays(np.column_stack([x, y]))


def _nearest(eye_m: FloatArray, standing: Sequence[BimElement]) -> tuple[tuple[BimElement, float], ...]:
    """Return the two elements that stand nearest to a place and in different directions, each with its distance."""
    found: list[tuple[float, BimElement, FloatArray]] = []
    for element in standing:
        own = apply(element.axis_from_world, eye_m[None])[0]
        nearest = np.clip(own[:2], [0.0, -0.5 * element.thickness_m], [element.length_m, 0.5 * element.thickness_m])
        way = own[:2] - nearest
        turned = element.axis_from_world[:2, :2].T @ way
        found.append((float(np.linalg.norm(way)), element, turned))
    found.sort(key=lambda one: (one[0], one[1].global_id))
    first = found[:1]
    second = [one for one in found[1:] if first and _apart(one[2], first[0][2])][:1]
    return tuple((element, away) for away, element, _ in [*first, *second])


def _apart(a: FloatArray, b: FloatArray) -> bool:
    """Say whether two ways cross well: distances along one line fix no place."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return size > 0.0 and abs(float(a @ b)) < 0.8 * size
