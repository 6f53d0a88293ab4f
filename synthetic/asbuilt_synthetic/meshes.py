"""Builds closed triangle meshes of simple solids in a local metric frame (z up, outside counter-clockwise)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asbuilt_synthetic.model import AnyArray, Body, FloatArray, IntArray

ROUND_SEGMENTS = 128  # chord of a 0.6 m column stays within 0.1 mm of the circle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A mesh in the site's local frame, before it is placed in world; fields as in `Body`."""

    name: str
    vertices_m: FloatArray  # (N, 3) local
    triangles: IntArray  # (M, 3)
    material: str
    face_id: IntArray | None = None  # (M,), None: all -1
    element: str | None = None
    texture_seed: int = 0
    round_axis_m: FloatArray | None = None

    def placed(self, world_from_local: FloatArray) -> Body:
        """Return the Body with its vertices in world."""
        none = np.full(len(self.triangles), -1, np.int32)
        return Body(
            name=self.name,
            vertices_m=transform(world_from_local, self.vertices_m),
            triangles=self.triangles,
            face_id=none if self.face_id is None else self.face_id,
            material=self.material,
            element=self.element,
            texture_seed=self.texture_seed,
            round_axis_m=None if self.round_axis_m is None else transform(world_from_local, self.round_axis_m[None])[0],
        )

    def moved(self, xy: Sequence[float], z: float = 0.0, angle_rad: float = 0.0) -> Part:
        """Return the part turned about z by the angle, then shifted."""
        pose = pose_2d(xy, z, angle_rad)
        axis = None if self.round_axis_m is None else transform(pose, self.round_axis_m[None])[0]
        return replace(self, vertices_m=transform(pose, self.vertices_m), round_axis_m=axis)


def transform(b_from_a: AnyArray, points: AnyArray) -> FloatArray:
    """Apply a 4x4 transform to points (N, 3)."""
    return np.asarray(points @ b_from_a[:3, :3].T + b_from_a[:3, 3], np.float64)


def pose_2d(xy: Sequence[float], z: float, angle_rad: float) -> FloatArray:
    """Return the 4x4 that turns about z and shifts."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0, xy[0]], [s, c, 0, xy[1]], [0, 0, 1, z], [0, 0, 0, 1]], np.float64)


def join(name: str, parts: Sequence[Part], material: str | None = None) -> Part:
    """Merge parts of one material into one part (element, faces and round axis are dropped)."""
    offsets = np.cumsum([0] + [len(p.vertices_m) for p in parts[:-1]])
    return Part(
        name=name,
        vertices_m=np.concatenate([p.vertices_m for p in parts]),
        triangles=np.concatenate([p.triangles + o for p, o in zip(parts, offsets, strict=True)]).astype(np.int32),
        material=material or parts[0].material,
        texture_seed=parts[0].texture_seed,
    )


def box(name: str, low: Sequence[float], high: Sequence[float], material: str, texture_seed: int = 0) -> Part:
    """Build an axis-aligned box."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    v = np.array([[x, y, z] for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))], np.float64)
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return Part(name=name, vertices_m=v, triangles=_fans(quads), material=material, texture_seed=texture_seed)


def prism(name: str, ring_xy: FloatArray, z0: float, z1: float, material: str) -> Part:
    """Extrude a convex ring (K, 2), counter-clockwise, from z0 to z1; the K lateral quads come first."""
    k = len(ring_xy)
    v = np.concatenate([np.c_[ring_xy, np.full(k, z0)], np.c_[ring_xy, np.full(k, z1)]])
    sides = [(i, (i + 1) % k, k + (i + 1) % k, k + i) for i in range(k)]
    caps = [tuple(range(k - 1, -1, -1)), tuple(range(k, 2 * k))]
    return Part(name=name, vertices_m=v, triangles=_fans([*sides, *caps]), material=material)


def circle(radius_m: float, segments: int = ROUND_SEGMENTS) -> FloatArray:
    """Return a ring (segments, 2), counter-clockwise, its corners on the circle."""
    a = np.arange(segments) * (2 * np.pi / segments)
    return np.asarray(radius_m * np.c_[np.cos(a), np.sin(a)])


def tube(
    name: str,
    start: Sequence[float] | FloatArray,
    end: Sequence[float] | FloatArray,
    radius_m: float,
    material: str,
    segments: int = 10,
) -> Part:
    """Build a solid round bar between two points."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    w = (b - a) / np.linalg.norm(b - a)
    u = np.cross(w, [1.0, 0, 0] if abs(w[0]) < 0.8 else [0, 1.0, 0])
    u /= np.linalg.norm(u)
    bar = prism(name, circle(radius_m, segments), 0.0, float(np.linalg.norm(b - a)), material)
    frame = np.eye(4)
    frame[:3, :4] = np.c_[u, np.cross(w, u), w, a]
    return replace(bar, vertices_m=transform(frame, bar.vertices_m))


def lathe(
    name: str, profile_rz: Sequence[tuple[float, float]], material: str, segments: int = 20, squash: float = 1.0
) -> Part:
    """Turn a profile of (radius, z), from low to high, about z; `squash` scales y."""
    k, n = segments, len(profile_rz)
    rings = [np.c_[circle(r, k) * [1, squash], np.full(k, z)] for r, z in profile_rz]
    quads = [
        (j * k + i, j * k + (i + 1) % k, (j + 1) * k + (i + 1) % k, (j + 1) * k + i)
        for j in range(n - 1)
        for i in range(k)
    ]
    caps = [tuple(range(k - 1, -1, -1)), tuple(range((n - 1) * k, n * k))]
    return Part(name=name, vertices_m=np.concatenate(rings), triangles=_fans([*quads, *caps]), material=material)


def lump(
    name: str,
    radii: Sequence[float],
    roughness: float,
    rng: np.random.Generator,
    material: str,
    segments: int = 24,
    levels: int = 14,
) -> Part:
    """Build a bumpy ellipsoid (a tree crown, a heap, a bush) about the origin."""
    phi = np.linspace(-np.pi / 2 * 0.98, np.pi / 2 * 0.98, levels)
    part = lathe(name, [(float(np.cos(p)), float(np.sin(p))) for p in phi], material, segments)
    bumps = 1 + roughness * rng.normal(size=(len(part.vertices_m), 1)).clip(-2, 2)
    return replace(part, vertices_m=part.vertices_m * bumps * np.asarray(radii, np.float64))


def _fans(polygons: Sequence[Sequence[int]]) -> IntArray:
    return np.array([(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)], np.int32)
