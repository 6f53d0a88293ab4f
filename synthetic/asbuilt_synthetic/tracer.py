"""Casts rays at the meshes of a scene with Embree, in float32 about the scene's origin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from asbuilt_synthetic.meshes import circle
from asbuilt_synthetic.model import AnyArray, Body, Decal, Disc, FloatArray, IntArray

DISC_SEGMENTS = 256


class Tracer:
    """Meshes to cast rays at: bodies first, then decals (two triangles each), then the disc.

    `body` (M,) says of each triangle which body it is of (-1: none), `decal` (M,) which decal, `is_disc` (M,).
    Points passed in and out are in world metres.
    """

    def __init__(
        self, origin_m: FloatArray, bodies: Sequence[Body], decals: Sequence[Decal] = (), disc: Disc | None = None
    ) -> None:
        self.origin_m = origin_m
        self.bodies, self.decals, self.disc = tuple(bodies), tuple(decals), disc
        vertices = [b.vertices_m - origin_m for b in bodies] + [d.corners_m - origin_m for d in decals]
        quad = np.array([[0, 3, 2], [0, 2, 1]], np.int32)
        triangles: list[IntArray] = [b.triangles for b in bodies] + [quad] * len(decals)
        if disc is not None:
            fan, rim = disc_mesh(disc)
            vertices.append(rim - origin_m)
            triangles.append(fan)
        counts = [len(t) for t in triangles]
        starts = np.cumsum([0] + [len(v) for v in vertices])[:-1]
        owner = np.repeat(np.arange(len(triangles)), counts)
        nb, nd = len(self.bodies), len(self.decals)
        self.body = np.where(owner < nb, owner, -1).astype(np.int32)
        self.decal = np.where((owner >= nb) & (owner < nb + nd), owner - nb, -1).astype(np.int32)
        self.is_disc = owner >= nb + nd
        self.face = np.concatenate([*[b.face_id for b in bodies], np.full(sum(counts[nb:]), -1)]).astype(np.int32)
        v = np.concatenate(vertices)
        t = np.concatenate([tri + s for tri, s in zip(triangles, starts, strict=True)])
        corner = v[t]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        self.normal = (normal / np.maximum(length, 1e-30)).astype(np.float32)
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, v.astype(np.float32), t.astype(np.int32))

    def first_hit(self, start_m: AnyArray, direction: AnyArray) -> tuple[IntArray, FloatArray]:
        """Return the triangle hit first (N,), -1 for none, and the ray parameter t (N,), inf for none."""
        o, d = self._rays(start_m, direction)
        hit = self._scene.run(o, d, output=True)
        triangle = np.asarray(hit["primID"], np.int32)
        return triangle, np.where(triangle >= 0, hit["tfar"], np.inf).astype(np.float64)

    def is_free(self, start_m: AnyArray, end_m: AnyArray, gap_m: float = 2e-3) -> np.ndarray:
        """Tell which straight lines (N,) from start to within `gap_m` of end meet nothing."""
        way = np.asarray(end_m, np.float64) - start_m
        length = np.linalg.norm(way, axis=-1)
        o, d = self._rays(start_m, way / np.maximum(length, 1e-12)[:, None])
        blocked = self._scene.run(o, d, dists=(length - gap_m).astype(np.float32), query="OCCLUDED")
        return np.asarray(blocked) < 0

    def is_dark(self, start_m: AnyArray, direction: AnyArray, reach_m: float) -> np.ndarray:
        """Tell which rays (N,), unit directions, meet something within a reach."""
        o, d = self._rays(start_m, direction)
        return np.asarray(self._scene.run(o, d, dists=np.full(len(o), reach_m, np.float32), query="OCCLUDED")) >= 0

    def _rays(self, start_m: AnyArray, direction: AnyArray) -> tuple[np.ndarray, np.ndarray]:
        d = np.ascontiguousarray(direction, np.float32)
        o = np.broadcast_to(np.asarray(start_m - self.origin_m, np.float32), d.shape)
        return np.ascontiguousarray(o), d


def disc_mesh(disc: Disc) -> tuple[IntArray, FloatArray]:
    """Return the triangles of a fan and its vertices (K, 3) in world, facing the disc's normal."""
    u = np.cross([0.0, 0.0, 1.0], disc.normal)
    u /= np.linalg.norm(u)
    w = np.cross(disc.normal, u)
    ring = circle(disc.radius_m, DISC_SEGMENTS)
    rim = disc.centre_m + ring[:, :1] * u + ring[:, 1:] * w
    k = np.arange(1, DISC_SEGMENTS - 1)
    return np.c_[np.zeros_like(k), k, k + 1].astype(np.int32), rim
