"""Reads the exact truth off a scene by casting rays: pixels, faces in view, cells built and visible, the target."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asbuilt_synthetic.in_view import marker_is_seen, points_in_view
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.lens import camera_of, directions, project, world_from_camera
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.model import FloatArray, IntArray, Marker, Scene, Station
from asbuilt_synthetic.scene import first_face
from asbuilt_synthetic.solids import sides
from asbuilt_synthetic.surface import Samples, samples
from asbuilt_synthetic.tracer import Tracer

STEP_M = 0.02
MOST_INCIDENCE_DEG = 80.0
NEAR_M = 10.0  # beyond it a 0.25 m baseline tells little


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PixelTruth:
    """What each pixel of the DISTORTED left photo shows; prints on surfaces count as the surface."""

    element: IntArray  # (H, W) index into Scene.elements, -1 none
    face: IntArray  # (H, W) index into Scene.faces, -1 none
    depth_m: FloatArray  # (H, W) Z in the physical left camera frame, inf where sky
    normal: FloatArray  # (H, W, 3) in the physical left camera frame, of the mesh's triangle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiscTruth:
    """The target's centre: pixels in both distorted photos, Z and distance from the left camera."""

    left_px: FloatArray  # (2,)
    right_px: FloatArray  # (2,)
    depth_m: float
    range_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceTruth:
    """One design face from one station; areas are of exposed surface (contact taken off)."""

    face: int
    built_area_m2: float
    visible_area_m2: float  # built and seen by the left camera
    wholly_in_view: bool  # all of what is built and exposed is seen by both cameras
    narrow_px: float  # size in pixels of its shorter side, in the left photo
    distance_m: float  # from the left camera to the middle of what is built
    incidence_deg: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationTruth:
    """All that is true at one station."""

    disc: DiscTruth | None
    marker_ids: tuple[int, ...]  # wholly in view of both cameras, 2.5 to 8 m away
    faces: tuple[FaceTruth, ...]  # those of which something built is seen
    cell_visible: tuple[np.ndarray, ...]  # per element of the scene (C,) bool
    cell_visible_near: tuple[np.ndarray, ...]  # the same, from no more than NEAR_M away
    cell_half_visible: tuple[np.ndarray, ...]  # half of one of its sides, of a round one half of what could be seen


def pixel_truth(scene: Scene, station: Station) -> PixelTruth:
    """Cast one ray through the middle of every pixel of the left photo."""
    camera, pose = scene.rig.left, station.world_from_left
    tracer = _tracer(scene, station)
    h, w = camera.height_px, camera.width_px
    y, x = np.mgrid[0:h, 0:w].astype(np.float64)
    ray = directions(camera, np.c_[x.ravel(), y.ravel()])
    triangle, t = tracer.first_hit(pose[:3, 3], ray @ pose[:3, :3].T)
    index = {e.global_id: i for i, e in enumerate(scene.elements)}
    owner = np.array([index.get(b.element or "", -1) for b in tracer.bodies] + [-1])
    element = np.where(triangle >= 0, owner[tracer.body[triangle]], -1)
    normal = np.where((triangle >= 0)[:, None], tracer.normal[triangle] @ pose[:3, :3], 0.0)
    return PixelTruth(
        element=element.reshape(h, w).astype(np.int32),
        face=np.where(element >= 0, tracer.face[triangle], -1).reshape(h, w).astype(np.int32),
        depth_m=t.reshape(h, w),
        normal=normal.reshape(h, w, 3),
    )


def station_truth(scene: Scene, station: Station) -> StationTruth:
    """Work out the target, the tags, the faces and the cells in view of a station."""
    tracer = _tracer(scene, station)
    faces: list[FaceTruth] = []
    visible: list[np.ndarray] = []
    visible_near: list[np.ndarray] = []
    half_visible: list[np.ndarray] = []
    eye = station.world_from_left[:3, 3]
    first = first_face(design(scene.seed))
    for e, s in zip(scene.elements, element_samples(scene), strict=True):
        left = points_in_view((tracer,), scene.rig, station, "left", s, MOST_INCIDENCE_DEG)
        seen = np.zeros(len(e.cells), bool)
        seen[s.cell[left]] = True
        visible.append(seen)
        near = left & (np.linalg.norm(s.points_m - eye, axis=1) < NEAR_M)
        visible_near.append(np.isin(np.arange(len(e.cells)), s.cell[near]))
        half_visible.append(_half_visible(s, left, len(e.cells), e.global_id, scene, first))
        built = left & s.built
        if built.any():
            right = points_in_view((tracer,), scene.rig, station, "right", s, MOST_INCIDENCE_DEG)
            for k in np.unique(s.side[built]):
                faces.append(_face(scene, station, first[e.global_id] + int(k), s, s.side == k, left, right))
    tags = tuple(m.tag_id for m in _present(scene) if marker_is_seen((tracer,), scene.rig, station, m))
    return StationTruth(
        disc=disc_truth(scene, station),
        marker_ids=tags,
        faces=tuple(faces),
        cell_visible=tuple(visible),
        cell_visible_near=tuple(visible_near),
        cell_half_visible=tuple(half_visible),
    )


def _half_visible(
    s: Samples, seen: np.ndarray, count: int, element: str, scene: Scene, first: dict[str, int]
) -> np.ndarray:
    """Say of which cells (C,) at least half of one exposed side is seen; a round column only ever shows one half."""
    found = np.zeros(count, bool)
    for side in np.unique(s.side):
        own = (s.side == side) & s.exposed
        total = np.bincount(s.cell[own], minlength=count)
        shown = np.bincount(s.cell[own & seen], minlength=count)
        share = 0.5 if scene.faces[first[element] + int(side)].kind == "plane" else 0.25
        found |= (total > 0) & (shown >= share * total)
    return found


def disc_truth(scene: Scene, station: Station) -> DiscTruth | None:
    """Project the target's centre into both photos."""
    if station.disc is None:
        return None
    px = {}
    for side in ("left", "right"):
        pose = world_from_camera(scene.rig, station, side)
        at = transform(np.linalg.inv(pose), station.disc.centre_m[None])
        px[side] = project(camera_of(scene.rig, side), at)[0]
    at = transform(np.linalg.inv(station.world_from_left), station.disc.centre_m[None])[0]
    return DiscTruth(left_px=px["left"], right_px=px["right"], depth_m=float(at[2]), range_m=float(np.linalg.norm(at)))


def element_samples(scene: Scene) -> tuple[Samples, ...]:
    """Sample the lateral surface of every element of the scene, every 2 cm."""
    return _samples(scene.seed, tuple(e.built_height_fraction for e in scene.elements))


@lru_cache(maxsize=4)
def _samples(seed: int, fractions: tuple[float, ...]) -> tuple[Samples, ...]:
    building = design(seed)
    return tuple(samples(building, e, f, STEP_M) for e, f in zip(building.vertical, fractions, strict=True))


def _face(
    scene: Scene, station: Station, index: int, s: Samples, of_side: np.ndarray, left: np.ndarray, right: np.ndarray
) -> FaceTruth:
    built = of_side & s.built & s.exposed
    face = scene.faces[index]
    way = station.world_from_left[:3, 3] - s.points_m
    cos = (way * s.normals).sum(1) / np.linalg.norm(way, axis=1)
    # of a column, the half that faces the camera
    facing = (cos > np.cos(np.deg2rad(MOST_INCIDENCE_DEG - 5))) | (face.kind == "plane")
    needed = built & facing
    middle = np.average(s.points_m[needed], axis=0, weights=s.area_m2[needed])
    to_eye = station.world_from_left[:3, 3] - middle
    slant = abs(float(np.average(cos[needed], weights=s.area_m2[needed])))
    return FaceTruth(
        face=index,
        built_area_m2=float(s.area_m2[built].sum()),
        visible_area_m2=float(s.area_m2[built & left].sum()),
        wholly_in_view=bool((left & right)[needed].all()),
        narrow_px=_narrow_px(scene, station, s, needed & left),
        distance_m=float(np.linalg.norm(to_eye)),
        incidence_deg=float(np.rad2deg(np.arccos(min(slant, 1.0)))),
    )


def _narrow_px(scene: Scene, station: Station, s: Samples, pick: np.ndarray) -> float:
    """Measure the extent of the samples in the left photo, across and up; the smaller."""
    if not pick.any():
        return 0.0
    px = project(scene.rig.left, transform(np.linalg.inv(station.world_from_left), s.points_m[pick]))
    level = s.height_m[pick]
    off = np.abs(level - np.median(level))
    middle = off <= off.min() + 1e-6
    across = float(np.ptp(px[middle, 0])) + 1e-9
    return min(across, float(np.ptp(px[:, 1])))


@lru_cache(maxsize=4)
def _tracer(scene: Scene, station: Station) -> Tracer:
    return Tracer(scene.origin_m, (*scene.bodies, *station.bodies), (), station.disc)


def _present(scene: Scene) -> list[Marker]:
    shown = {d.name for d in scene.decals}
    return [m for m in scene.markers if f"tag {m.tag_id}" in shown]


def exposed_area_m2(scene: Scene) -> FloatArray:
    """Return the exposed design area of every face of the scene (F,), contact taken off."""
    out = np.zeros(len(scene.faces))
    building = design(scene.seed)
    first = first_face(building)
    for e, s in zip(building.vertical, element_samples(scene), strict=True):
        for k in range(len(sides(e))):
            out[first[e.global_id] + k] = s.area_m2[s.exposed & (s.side == k)].sum()
    return out
