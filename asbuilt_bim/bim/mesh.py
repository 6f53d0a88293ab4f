"""Triangle meshes: welding, pieces, outward orientation, volume, sections, and which points lie inside."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, unique_rows
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.geometry.transform import cross

WELD_M = 1e-5
"""Vertices nearer than this are one: modellers' own precision, a hundredth of the coplanarity tolerance."""
_CHUNK = 2_000_000  # point-triangle pairs tested at once: bounds the memory to some 100 MB
_NEXT = [1, 2, 0]
_RAY = np.array([0.2718281828, 0.5772156649, 0.7701635339])  # along no wall, edge or diagonal that is ever drawn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """Vertices (N, 3) in metres and triangles (M, 3), counter-clockwise seen from outside."""

    vertices_m: FloatArray
    triangles: NDArray[np.int32]

    @property
    def corners_m(self) -> FloatArray:
        """Return the triangles' corners (M, 3, 3)."""
        corners: FloatArray = self.vertices_m[self.triangles]
        return corners

    @property
    def bounds_m(self) -> FloatArray:
        """Return the axis-parallel box (2, 3): lowest and highest corner of what the triangles use."""
        used = self.vertices_m[np.unique(self.triangles)] if len(self.triangles) else np.zeros((1, 3))
        return np.stack([used.min(axis=0), used.max(axis=0)])


def welded(mesh: Mesh) -> Mesh:
    """Return the mesh with equal vertices merged and triangles without an area left out."""
    if len(mesh.triangles) == 0:
        return mesh
    low = mesh.vertices_m.min(axis=0)
    first, where = unique_rows(np.round((mesh.vertices_m - low) / WELD_M).astype(np.int64))
    triangles = where[mesh.triangles].astype(np.int32)
    vertices = mesh.vertices_m[first]
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    keep = np.linalg.norm(cross(b - a, c - a), axis=1) > 2.0 * WELD_M**2
    return Mesh(vertices_m=vertices, triangles=triangles[keep])


def pieces(mesh: Mesh) -> tuple[Mesh, ...]:
    """Return the connected pieces of a welded mesh, each with its own vertices alone."""
    labels = np.arange(len(mesh.vertices_m))
    while True:
        lowest = labels[mesh.triangles].min(axis=1)
        before = labels.copy()
        np.minimum.at(labels, mesh.triangles.reshape(-1), np.repeat(lowest, 3))
        labels = labels[labels]
        if np.array_equal(labels, before):
            break
    of_triangle = labels[mesh.triangles[:, 0]] if len(mesh.triangles) else np.zeros(0, dtype=int)
    found = np.unique(of_triangle)
    if len(found) == 1:
        return (mesh,)
    return tuple(_compact(mesh.vertices_m, mesh.triangles[of_triangle == label]) for label in found)


def _compact(vertices_m: FloatArray, triangles: NDArray[np.int32]) -> Mesh:
    """Return triangles with those vertices alone that they use: a wall of 500 blocks would carry them all 500 times."""
    used, where = np.unique(triangles, return_inverse=True)
    return Mesh(vertices_m=vertices_m[used], triangles=where.reshape(-1, 3).astype(np.int32))


def merged(meshes: tuple[Mesh, ...]) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
    return Mesh(
        vertices_m=np.concatenate([mesh.vertices_m for mesh in meshes]),
        triangles=np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]).astype(
            np.int32
        ),
    )


def signed_volume(mesh: Mesh) -> float:
    """Return the volume in m3 by the divergence theorem: below zero when the mesh is inside out."""
    if len(mesh.triangles) == 0:
        return 0.0
    corners = mesh.corners_m
    a, b, c = (corners - corners.reshape(-1, 3).mean(axis=0)).transpose(1, 0, 2)
    return float(np.sum(a * cross(b, c)) / 6.0)


def is_closed(mesh: Mesh) -> bool:
    """Say whether a welded mesh is watertight and turned one way: every edge is met once in each direction."""
    edges = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    count = len(mesh.vertices_m)
    forth = np.sort(edges[:, 0].astype(np.int64) * count + edges[:, 1])
    back = np.sort(edges[:, 1].astype(np.int64) * count + edges[:, 0])
    return bool(np.array_equal(forth, back))


def turned_outwards(mesh: Mesh) -> Mesh:
    """Return one connected piece with every triangle's normal pointing out of the solid.

    A closed piece is judged by its signed volume. In any other (surface models, shells with T-joints) each triangle is
    judged by points a millimetre before and behind it: the side that lies inside is the back. A triangle with the same
    on both sides is left as it is.
    """
    if is_closed(mesh):
        if signed_volume(mesh) >= 0.0:
            return mesh
        return Mesh(vertices_m=mesh.vertices_m, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
    corners = mesh.corners_m
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    step = 1e-3 * across / np.linalg.norm(across, axis=1, keepdims=True)
    middle = corners.mean(axis=1)
    wrong = inside(mesh, middle + step) & ~inside(mesh, middle - step)
    triangles = np.where(wrong[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    return Mesh(vertices_m=mesh.vertices_m, triangles=triangles.astype(np.int32))


def section(mesh: Mesh, frame: PlaneFrame, lift_m: float) -> FloatArray:
    """Return the segments (N, 2, 2), in (u, v) metres, where the plane of `frame` moved out by `lift_m` cuts a mesh."""
    height = (mesh.vertices_m - frame.origin_m) @ frame.normal - lift_m
    if height.size == 0 or height.min() > 0.0 or height.max() <= -1e-9:
        return np.zeros((0, 2, 2))
    height[np.abs(height) < 1e-9] = 1e-9
    over = (height > 0.0)[mesh.triangles]
    crosses = over != over[:, _NEXT]  # two of the three edges of each triangle that is cut
    start, end = mesh.triangles[crosses], mesh.triangles[:, _NEXT][crosses]
    share = height[start] / (height[start] - height[end])
    points = mesh.vertices_m[start] + share[:, None] * (mesh.vertices_m[end] - mesh.vertices_m[start])
    return frame.to_uv(points).reshape(-1, 2, 2)


def crossings(mesh: Mesh, origins_m: ArrayLike, direction: ArrayLike) -> tuple[NDArray[np.int64], FloatArray]:
    """Return for rays from points (P, 3) in one direction how many triangles each meets (P,), and how far the first is.

    The distance (P,) is in metres along the unit direction, infinite where nothing is met.
    """
    origins = np.asarray(origins_m, dtype=np.float64).reshape(-1, 3)
    turn = _onto_z(np.asarray(direction, dtype=np.float64))
    centre = mesh.vertices_m.mean(axis=0) if len(mesh.vertices_m) else np.zeros(3)
    corners = (mesh.corners_m - centre) @ turn.T
    points = (origins - centre) @ turn.T
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    (abx, aby), (acx, acy) = (b - a)[:, :2].T, (c - a)[:, :2].T
    turning = abx * acy - aby * acx
    solid = np.abs(turning) > 1e-14
    a, b, c, abx, aby, acx, acy, turning = (x[solid] for x in (a, b, c, abx, aby, acx, acy, turning))
    count = np.zeros(len(points), dtype=np.int64)
    nearest = np.full(len(points), np.inf)
    step = max(1, _CHUNK // max(len(a), 1))
    for first in range(0, len(points) if len(a) else 0, step):
        chunk = points[first : first + step]
        px, py = chunk[:, :1] - a[:, 0], chunk[:, 1:2] - a[:, 1]
        s, t = (px * acy - py * acx) / turning, (abx * py - aby * px) / turning
        depth = a[:, 2] + s * (b - a)[:, 2] + t * (c - a)[:, 2] - chunk[:, 2:3]
        met = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (depth > 0.0)
        count[first : first + step] = met.sum(axis=1)
        nearest[first : first + step] = np.where(met, depth, np.inf).min(axis=1)
    return count, nearest


def inside(mesh: Mesh, points_m: ArrayLike) -> BoolArray:
    """Say for each point (P, 3) whether it lies inside the mesh, by the parity of a ray's crossings."""
    count, _ = crossings(mesh, points_m, _RAY)
    odd: BoolArray = count % 2 == 1
    return odd


def _onto_z(direction: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) that takes the direction to +z."""
    z = direction / np.linalg.norm(direction)
    x = cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, cross(z, x), z])
