"""What part each face of a wall plays: side, end, or reveal of an opening."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.mesh import Mesh, crossings
from asbuilt_bim.bim.model import FaceRole
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.polygon import Region, bounds
from asbuilt_bim.geometry.transform import cross

_END = 0.7
"""Cosine to the length from which a face turns more to it than across it."""
_NARROW = 2.0
"""An end or a reveal is at most this many wall thicknesses wide (a mitre at 45 degrees: 1.4)."""
_BENT = 2.0
"""A wall whose rectangle is this many thicknesses deep goes round a corner or a curve."""
_GENTLE = float(np.cos(np.radians(45.0)))
_JOINT_M = 0.005
_BEFORE_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """One face before it has a role: its frame, its polygons in (u, v) metres, their area."""

    frame: PlaneFrame | CylinderFrame
    region: Region
    area_m2: float


def wall_roles(mesh: Mesh, surfaces: list[Surface], axis_from_world: FloatArray) -> list[FaceRole]:
    """Return the role of each surface of a wall.

    A narrow face across the length is an end. In a bent wall, that is one with a sharp edge to its neighbour. It is a
    reveal where it looks at the wall's own concrete, across an opening. Everything else is a side.
    """
    thick_m = _thickness(mesh, sum(surface.area_m2 for surface in surfaces))
    depth_m = float(np.ptp(mesh.vertices_m[np.unique(mesh.triangles)] @ axis_from_world[1, :3]))
    across = _ends_of_bent(surfaces) if depth_m > _BENT * thick_m else _ends_of_straight(surfaces, axis_from_world)
    narrow = [across[i] and _width(surface) <= _NARROW * thick_m for i, surface in enumerate(surfaces)]
    if all(narrow):
        return ["side"] * len(surfaces)
    return [_across(mesh, surface) if short else "side" for surface, short in zip(surfaces, narrow, strict=True)]


def _thickness(mesh: Mesh, lateral_m2: float) -> float:
    """Return the mean thickness in metres: plan area over half the plan's girth, whatever way the wall bends."""
    height = float(np.ptp(mesh.bounds_m[:, 2]))
    corners = mesh.corners_m
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plan_m2 = float(np.abs(across[:, 2]).sum() / 4.0)
    return 2.0 * plan_m2 * height / lateral_m2 if lateral_m2 > 0.0 else 0.0


def _width(surface: Surface) -> float:
    u0, _, u1, _ = bounds(surface.region)
    return u1 - u0


def _ends_of_straight(surfaces: list[Surface], axis_from_world: FloatArray) -> list[bool]:
    return [
        isinstance(surface.frame, PlaneFrame) and bool(abs(surface.frame.normal @ axis_from_world[0, :3]) >= _END)
        for surface in surfaces
    ]


def _ends_of_bent(surfaces: list[Surface]) -> list[bool]:
    """Say which flat surfaces have no neighbour that turns by less than 45 degrees."""
    corners = [surface.frame.from_uv(np.concatenate([rings[0] for rings in surface.region])) for surface in surfaces]
    ends = []
    for i, surface in enumerate(surfaces):
        gentle = [
            isinstance(other.frame, CylinderFrame) or surface.frame.normal @ other.frame.normal > _GENTLE
            for other in surfaces
            if isinstance(surface.frame, PlaneFrame)
        ]
        meets = [
            gentle[j] and float(np.linalg.norm(corners[i][:, None] - corners[j], axis=2).min()) < _JOINT_M
            for j in range(len(gentle))
            if j != i
        ]
        ends.append(isinstance(surface.frame, PlaneFrame) and not any(meets))
    return ends


def _across(mesh: Mesh, surface: Surface) -> FaceRole:
    """Say whether a face across the wall looks at the wall's own concrete."""
    assert isinstance(surface.frame, PlaneFrame)
    before_m = (mesh.vertices_m - surface.frame.origin_m) @ surface.frame.normal
    if before_m.max() < _BEFORE_M:  # no concrete there to look at, as before most ends
        return "end"
    u0, v0, u1, v1 = bounds(surface.region)
    grid = np.stack(np.meshgrid(np.linspace(u0, u1, 5)[1:-1], np.linspace(v0, v1, 9)[1:-1]), axis=-1).reshape(-1, 2)
    count, _ = crossings(mesh, surface.frame.from_uv(grid, height_m=_BEFORE_M), surface.frame.normal)
    return "reveal" if np.mean(count > 0) > 0.5 else "end"
