"""Builds the scene of a seed's twins: their meshes with numbered sides, the target, a yard behind, light and pose."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from asbuilt_synthetic.background import background
from asbuilt_synthetic.building import Building
from asbuilt_synthetic.crowd import crowded_plan, loose_things
from asbuilt_synthetic.meshes import Part, box, circle, join, pose_2d, prism, transform, tube
from asbuilt_synthetic.model import (
    Body,
    DesignFaceTruth,
    Disc,
    ElementTruth,
    FloatArray,
    IntArray,
    Light,
    Scene,
    Station,
)
from asbuilt_synthetic.people import person
from asbuilt_synthetic.progress import FIRST_DAY
from asbuilt_synthetic.rig import rig_truth, rotation
from asbuilt_synthetic.twins import EYE_M, Twin, plan

DISC_RADIUS_M = 0.15
_VISIT = 500  # a noise stream of its own


@lru_cache(maxsize=2)
def twin_scene(seed: int, crowded: bool = False) -> Scene:
    """Build the scene of a seed, with its one station, sides numbered as faces and objects as elements.

    `crowded`: with bodies before one another, some cut by the frame, and things about.
    """
    rng = np.random.default_rng([seed, 32])
    drawn = crowded_plan(seed) if crowded else plan(seed)
    bodies: list[Body] = []
    faces: list[DesignFaceTruth] = []
    for k, o in enumerate(drawn.objects):
        body, own = _solid(o, f"twin {k}", len(faces))
        bodies.append(body)
        faces += own
    about = loose_things(seed, drawn.objects, drawn.target_xy_m) if crowded else []
    pose = _pose(rng)
    disc, stand = _target(drawn.target_xy_m, rng)
    return Scene(
        seed=seed,
        visit=_VISIT,
        day=FIRST_DAY,
        origin_m=np.zeros(3),
        bodies=(*bodies, *(p.placed(np.eye(4)) for p in (*about, *_surroundings(seed, rng)))),
        decals=(),
        faces=tuple(faces),
        elements=tuple(_element(o, k) for k, o in enumerate(drawn.objects)),
        markers=(),
        rig=rig_truth(seed),
        stations=(Station(name="T", world_from_left=pose, disc=disc, bodies=(stand.placed(np.eye(4)),)),),
        light=_light(rng),
    )


def _light(rng: np.random.Generator) -> Light:
    azimuth, height = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(28, 55))
    strength = float(rng.choice([0.15, 0.5, 0.8, 1.0]))
    level = np.cos(height)
    return Light(
        towards_sun=np.array([np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(height)]),
        sun_strength=strength,
        sky_srgb=(168, 190, 220) if strength > 0.4 else (196, 202, 210),
        exposure=float(rng.uniform(0.85, 1.15)),
    )


def _element(o: Twin, k: int) -> ElementTruth:
    return ElementTruth(
        global_id=f"twin {k}", ifc_class="IfcWall" if o.kind == "wall" else "IfcColumn", name=f"{o.kind} {k}",
        storey="", built_height_fraction=1.0, cells=np.zeros((0, 2, 2)), cell_built=np.zeros(0, bool),
    )  # fmt: skip


def _solid(o: Twin, name: str, first: int) -> tuple[Body, list[DesignFaceTruth]]:
    """Mesh an object; sides of its blocks that lie in one plane are one face."""
    pose = pose_2d(o.xy_m, 0.0, o.angle_rad)
    if o.kind == "round":
        ring = circle(o.radius_m, 256)
        part = prism(name, ring, 0.0, o.height_m, o.material)
        face = np.where(np.arange(len(part.triangles)) < 2 * len(ring), first, -1).astype(np.int32)
        part = Part(
            name=name, vertices_m=part.vertices_m, triangles=part.triangles, material=o.material, face_id=face,
            element=name, texture_seed=o.texture_seed, round_axis_m=np.zeros(3),
        )  # fmt: skip
        lateral = DesignFaceTruth(
            element=name, kind="cylinder", origin_m=transform(pose, np.zeros((1, 3)))[0], normal=np.array([0, 0, 1.0]),
            radius_m=o.radius_m, design_area_m2=2 * np.pi * o.radius_m * o.height_m, name="round",
        )  # fmt: skip
        return part.placed(pose), [lateral]
    boxes = [box(name, *zip(*(b.x_m, b.y_m, b.z_m), strict=True), o.material) for b in o.blocks]
    merged = join(name, boxes)
    ids, faces = _sides(o, merged, name, pose, first)
    part = Part(
        name=name, vertices_m=merged.vertices_m, triangles=merged.triangles, material=o.material, face_id=ids,
        element=name, texture_seed=o.texture_seed,
    )  # fmt: skip
    return part.placed(pose), faces


def _sides(o: Twin, part: Part, name: str, pose: FloatArray, first: int) -> tuple[IntArray, list[DesignFaceTruth]]:
    """Number the upright planes of a mesh from `first`, and sum up what lies in each."""
    corner = part.vertices_m[part.triangles]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    normal = cross / (2 * area[:, None])
    upright = np.flatnonzero(np.abs(normal[:, 2]) < 0.5)
    keys = np.round(np.c_[normal, (normal * corner[:, 0]).sum(1)], 6)[upright]
    planes, number = np.unique(keys, axis=0, return_inverse=True)
    ids = np.full(len(area), -1, np.int32)
    ids[upright] = first + number.ravel()
    faces = []
    for k, plane in enumerate(planes):
        own = ids == first + k
        middle = corner[own].reshape(-1, 3).mean(0)
        faces.append(
            DesignFaceTruth(
                element=name, kind="plane", origin_m=transform(pose, middle[None])[0], normal=pose[:3, :3] @ plane[:3],
                radius_m=0.0, design_area_m2=float(area[own].sum()), name=f"{o.kind} side {k}",
            )
        )  # fmt: skip
    return ids, faces


def _pose(rng: np.random.Generator) -> FloatArray:
    """Hold the left camera at the origin, looking along x, by hand."""
    yaw, pitch, roll = (np.deg2rad(float(np.clip(rng.normal(0, s), -2 * s, 2 * s))) for s in (1.0, 0.8, 1.2))
    f = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross(f, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.c_[right, np.cross(f, right), f] @ rotation(np.array([0, 0, roll]))
    pose[:3, 3] = [0.0, 0.0, EYE_M + rng.uniform(-0.08, 0.08)]
    return pose


def _target(at: FloatArray, rng: np.random.Generator) -> tuple[Disc, Part]:
    """Stand the red disc on its pole, turned a little off the camera."""
    centre = np.array([*at, rng.uniform(0.9, 1.8)])
    turn = np.arctan2(at[1], at[0]) + np.pi + np.deg2rad(rng.uniform(-22, 22))
    normal = np.array([np.cos(turn), np.sin(turn), 0.0])
    back = centre - 0.03 * normal
    pole = tube("pole", (back[0], back[1], 0.0), back, 0.012, "stand_black", 10)
    return Disc(centre_m=centre, normal=normal, radius_m=DISC_RADIUS_M), pole


def _surroundings(seed: int, rng: np.random.Generator) -> list[Part]:
    """Build a yard behind, a floor below, and a few loose things further off that hide nothing."""
    yard = Building(
        seed=seed, name="twins", world_from_local=np.eye(4), axes_x_m=(0.0, 3.0, 6.0, 9.0), axes_y_m=(-4.0, 0.0, 4.0),
        joint_x_m=6.0, elements=(),
    )  # fmt: skip
    floor = str(rng.choice(["concrete_slab", "ground"]))
    out = [*background(yard), box("Floor", (-3.0, -9.0, -0.3), (13.0, 9.0, 0.0), floor)]
    for _ in range(3):
        x, y = rng.uniform(9.5, 12.0), rng.uniform(-5.0, 5.0)
        out += [p.moved((x, y), 0.0, float(rng.uniform(0, 6.28))) for p in person(rng)]
    for k in range(4):
        x, y = rng.uniform(9.0, 12.5), rng.uniform(-5.5, 5.5)
        out.append(tube(f"Prop {k}", (x, y, 0.0), (x, y, 2.8), 0.03, "scaffold_steel", 12))
    return out
