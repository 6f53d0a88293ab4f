"""Plain data that a scene is made of: what both renderers draw and what the truth is read from.

World is the IFC file's world frame in metres (site placement applied), which lies far from the
origin; a renderer subtracts `Scene.origin_m` before it goes to float32. Camera frames are x right,
y down, z forward; pixel centres are integers. Transforms are 4x4 and named `b_from_a`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
AnyArray = NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A triangle mesh of one material; `element` is the GlobalId of the IFC element it is a part of.

    `face_id` (M,) numbers the element's design faces (index into `Scene.faces`), -1 where a triangle
    belongs to no lateral design face. A poured-to-half column is one Body that ends at its pour height.
    `round_axis_m` (3,) is a point on the vertical axis of a round body, to shade it smooth; None if flat.
    """

    name: str
    vertices_m: FloatArray  # (N, 3) world
    triangles: IntArray  # (M, 3), counter-clockwise seen from outside
    face_id: IntArray  # (M,)
    material: str  # a key of asbuilt_synthetic.materials.MATERIALS
    element: str | None = None
    texture_seed: int = 0
    round_axis_m: FloatArray | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decal:
    """A flat printed picture (AprilTag, board) on a quad.

    Corners in the order top-left, top-right, bottom-right, bottom-left, as seen upright from the front.
    """

    name: str
    corners_m: FloatArray  # (4, 3) world
    image_srgb: NDArray[np.uint8]  # (h, w, 3) RGB


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Disc:
    """The red target: a thin matt disc facing `normal`, on a thin stand."""

    centre_m: FloatArray  # (3,) world
    normal: FloatArray  # (3,) unit, towards the camera
    radius_m: float
    colour_srgb: tuple[int, int, int] = (196, 22, 28)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Light:
    """Sun and sky of a visit; `towards_sun` is a unit vector in world."""

    towards_sun: FloatArray
    sun_strength: float  # relative, 0 (overcast) .. 1 (clear)
    sky_srgb: tuple[int, int, int]
    exposure: float  # multiplies radiance before tone mapping


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraTruth:
    """One camera as it really is: K (3, 3) in pixels, distortion (5,) k1 k2 p1 p2 k3 (OpenCV order)."""

    K: FloatArray
    distortion: FloatArray
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigTruth:
    """The stereo rig as it really is."""

    left: CameraTruth
    right: CameraTruth
    right_from_left: FloatArray  # (4, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Station:
    """Where one photo pair is taken, and what only stands there for it (disc, stand, people)."""

    name: str
    world_from_left: FloatArray  # (4, 4), the PHYSICAL left camera
    disc: Disc | None
    bodies: tuple[Body, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignFaceTruth:
    """One lateral design face: plane (origin, outward normal) or cylinder (axis point, axis, radius)."""

    element: str
    kind: str  # "plane" | "cylinder"
    origin_m: FloatArray  # (3,) world
    normal: FloatArray  # (3,) outward; for a cylinder the axis direction
    radius_m: float  # 0 for a plane
    design_area_m2: float  # openings off, contact not taken off
    name: str = ""  # side+, side-, start, end; or round


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementTruth:
    """One wall or column: how much of it stands at this visit."""

    global_id: str
    ifc_class: str
    name: str
    storey: str
    built_height_fraction: float  # 0 absent .. 1 complete (poured from below)
    cells: FloatArray  # (C, 2, 2): per cell (length, height) by (low, high), in design fractions 0..1; openings off
    cell_built: NDArray[np.bool_]  # (C,), by the cell's centre


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Marker:
    """An AprilTag 36h11: true corners, and the corners as surveyed (with millimetres of noise)."""

    tag_id: int
    true_corners_m: FloatArray  # (4, 3) world, order top-left, top-right, bottom-right, bottom-left of the tag
    surveyed_corners_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """One site at one visit."""

    seed: int
    visit: int
    day: date
    origin_m: FloatArray  # (3,) subtract before float32
    bodies: tuple[Body, ...]
    decals: tuple[Decal, ...]
    faces: tuple[DesignFaceTruth, ...]
    elements: tuple[ElementTruth, ...]
    markers: tuple[Marker, ...]
    rig: RigTruth
    stations: tuple[Station, ...]
    light: Light
    storeys: tuple[str, ...] = field(default=())
