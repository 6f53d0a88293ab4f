"""A mesh's lateral triangles, grouped into flat facets."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray, frozen, median
from asbuilt_bim.geometry.plane import Plane, PlaneFrame, frame_on_plane
from asbuilt_bim.geometry.polygon import Region, grown, triangles_region
from asbuilt_bim.geometry.transform import cross

COPLANAR_M = 0.002
"""Triangles this near to one plane are one face: below what a stereo camera sees, above modellers' noise."""
COPLANAR_RAD = float(np.radians(1.0))
LATERAL = 0.2
"""A face is lateral when the vertical part of its unit normal is below this (within 11.5 degrees of upright)."""
UP = np.array([0.0, 0.0, 1.0])
_GRID_M = 1e-6
_HAIR_M = 1e-4
_FORMS_KEPT = 1024  # of faces, mostly a rectangle's few hundred bytes
_PAIRS_AT_ONCE = 65_536  # of triangles that are held against each other: bounds the memory to some 10 MB


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
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.sqrt((across**2).sum(axis=1))
    order = np.argsort(-double, kind="stable")
    lateral = order[np.abs(across[order, 2]) < LATERAL * double[order]]
    if len(lateral) == 0:
        return ()
    corners, across, double = corners[lateral], across[lateral], double[lateral]
    longest = np.sqrt(((corners - corners[:, [2, 0, 1]]) ** 2).sum(axis=2)).max(axis=1)
    sliver = double / longest < COPLANAR_M  # its normal says nothing: only its distance does
    leader = _leaders(corners, across / double[:, None], sliver)
    order = np.lexsort((lateral, leader))
    start = np.flatnonzero(np.diff(leader[order], prepend=-1))
    means, areas = np.add.reduceat(across[order], start), np.add.reduceat(double[order], start) / 2.0
    means /= np.sqrt((means**2).sum(axis=1))[:, None]
    own, first = lateral[order].astype(np.int32), start.tolist()
    return tuple(
        CoplanarRegion(normal=normal, triangles=own[begin:end], area_m2=area_m2)
        for normal, begin, end, area_m2 in zip(means, first, [*first[1:], len(own)], areas.tolist(), strict=True)
    )


def _leaders(corners: FloatArray, normals: FloatArray, sliver: BoolArray) -> NDArray[np.intp]:
    """Return for each triangle (T,), the largest first, the number of the one in whose plane it lies.

    Each in turn takes what lies in its plane, where none before it has been given to another. Where all that lead lead
    themselves, as nearly always, that is the first one that a triangle is coplanar with.
    """
    leader = np.full(len(corners), -1)
    while len(seeds := np.flatnonzero(leader < 0)[: max(1, _PAIRS_AT_ONCE // len(corners))]):
        alike = _coplanar(corners, normals, sliver, seeds) & (leader < 0)
        led = alike.any(axis=0)
        first = seeds[alike.argmax(axis=0)]
        if np.array_equal(first[first[led]], first[led]):
            leader[led] = first[led]
            continue
        for seed, own in zip(seeds.tolist(), alike, strict=True):
            if leader[seed] < 0:
                leader[own & (leader < 0)] = seed
    return leader


def _coplanar(corners: FloatArray, normals: FloatArray, sliver: BoolArray, seeds: NDArray[np.intp]) -> BoolArray:
    """Say of each seed (S, T) which triangles lie in its plane; a round column has sixty, so all are asked at once."""
    turned = normals[seeds] @ normals.T
    alike: BoolArray = (turned > np.cos(COPLANAR_RAD)) | (sliver & (turned > 0.0))
    which, other = np.nonzero(alike)
    seed = seeds[which]
    heights = ((corners[other] - corners[seed, :1]) * normals[seed, None]).sum(axis=2)
    alike[which, other] = (np.abs(heights) < COPLANAR_M).all(axis=1)
    alike[np.arange(len(seeds)), seeds] = True
    return alike


def plane_region(mesh: Mesh, part: CoplanarRegion) -> tuple[PlaneFrame, Region]:
    """Return a facet's frame (v up, origin at its lower left) and its polygons in (u, v) metres, holes kept."""
    corners = mesh.corners_m[part.triangles]
    points = corners.reshape(-1, 3)
    offset = median(points @ part.normal)
    plane = Plane(normal=part.normal, offset_m=offset)
    frame = frame_on_plane(plane, points[0], UP)
    frame = replace(frame, origin_m=frozen(plane.foot_m(frame.from_uv(frame.to_uv(points).min(axis=0)))))
    return frame, triangles_union(frame.to_uv(points).reshape(-1, 3, 2))


def triangles_union(triangles_uv_m: FloatArray) -> Region:
    """Return the union of triangles (N, 3, 2) as polygons; hairlines between triangles that should touch are closed."""
    return _union((np.round(triangles_uv_m / _GRID_M) * _GRID_M).tobytes())


@lru_cache(maxsize=_FORMS_KEPT)
def _union(rounded: bytes) -> Region:
    """Return the union of triangles on the grid; a building has faces of one form a hundred times."""
    region = triangles_region(np.frombuffer(rounded).reshape(-1, 3, 2))
    if len(region) > 1 or any(len(rings) > 1 for rings in region):
        region = grown(grown(region, _HAIR_M), -_HAIR_M)
    return region
