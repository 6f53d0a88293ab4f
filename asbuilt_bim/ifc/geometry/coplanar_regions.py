"""A mesh's lateral triangles, grouped into flat facets."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.geometry.arrays import FloatArray, IntArray
from asbuilt_bim.geometry.plane import Plane, PlaneFrame, frame_on_plane
from asbuilt_bim.geometry.polygon import Region, grown, region_of

COPLANAR_M = 0.002
"""Triangles this near to one plane are one face: below what a stereo camera sees, above modellers' noise."""
COPLANAR_RAD = float(np.radians(1.0))
LATERAL = 0.2
"""A face is lateral when the vertical part of its unit normal is below this (within 11.5 degrees of upright)."""
UP = np.array([0.0, 0.0, 1.0])
_GRID_M = 1e-6
_HAIR_M = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoplanarRegion:
    """Coplanar triangles of a mesh: their numbers (K,), outward unit normal (3,), and area in m2."""

    normal: FloatArray
    triangles: IntArray
    area_m2: float


def coplanar_regions(mesh: Mesh) -> tuple[CoplanarRegion, ...]:
    """Group the lateral triangles of an outward-turned mesh into facets, the largest first."""
    corners = mesh.corners_m
    if len(corners) == 0:
        return ()
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(across, axis=1)
    normals = across / double[:, None]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    sliver = double / longest < COPLANAR_M  # its normal says nothing: only its distance does
    left = np.abs(normals[:, 2]) < LATERAL
    parts = []
    for seed in np.argsort(-double, kind="stable"):
        if not left[seed]:
            continue
        heights = (corners - corners[seed, 0]) @ normals[seed]
        turned = normals @ normals[seed]
        near = left & (np.abs(heights).max(axis=1) < COPLANAR_M)
        near &= (turned > np.cos(COPLANAR_RAD)) | (sliver & (turned > 0.0))
        near[seed] = True
        left &= ~near
        mean = (across * near[:, None]).sum(axis=0)
        numbers = np.flatnonzero(near).astype(np.int32)
        normal = mean / np.linalg.norm(mean)
        parts.append(CoplanarRegion(normal=normal, triangles=numbers, area_m2=float(double[near].sum() / 2.0)))
    return tuple(parts)


def plane_region(mesh: Mesh, part: CoplanarRegion) -> tuple[PlaneFrame, Region]:
    """Return a facet's frame (v up, origin at its lower left) and its polygons in (u, v) metres, holes kept."""
    corners = mesh.corners_m[part.triangles]
    points = corners.reshape(-1, 3)
    offset = float(np.median(points @ part.normal))
    plane = Plane(normal=part.normal, offset_m=offset)
    frame = frame_on_plane(plane, points[0], UP)
    frame = frame_on_plane(plane, frame.from_uv(frame.to_uv(points).min(axis=0)), UP)
    return frame, triangles_union(frame.to_uv(corners))


def triangles_union(triangles_uv_m: FloatArray) -> Region:
    """Return the union of triangles (N, 3, 2) as polygons; hairlines between triangles that should touch are closed."""
    rounded = np.round(triangles_uv_m / _GRID_M) * _GRID_M
    region = region_of([[triangle] for triangle in rounded])
    if len(region) > 1 or any(len(rings) > 1 for rings in region):
        region = grown(grown(region, _HAIR_M), -_HAIR_M)
    return region
