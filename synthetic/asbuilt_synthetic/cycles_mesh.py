"""Bodies, decals and discs as Blender meshes, with surface coordinates in metres for the patterns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from asbuilt_synthetic.model import Body, Decal, Disc, FloatArray, IntArray

_UP = np.array([0.0, 0.0, 1.0])
_SMOOTH_ANGLE_RAD = 0.6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceCoordinates:
    """Per triangle corner (M, 3, 2): metres along the face and up it, from the face's own low corner."""

    uv_m: FloatArray
    round_body: bool


def triangle_normals(vertices_m: FloatArray, triangles: IntArray) -> FloatArray:
    """Give unit normals (M, 3); a degenerate triangle's is zero."""
    a, b, c = (vertices_m[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.asarray(cross / np.maximum(length, 1e-15))


def surface_coordinates(vertices_m: FloatArray, triangles: IntArray) -> SurfaceCoordinates:
    """Unfold a body: lateral faces by (along, up), flat ones by the body's main horizontal axis, round ones by arc."""
    normals = triangle_normals(vertices_m, triangles)
    lateral = np.abs(normals[:, 2]) < 0.5
    corners = vertices_m[triangles]
    radius = _round_radius(vertices_m, normals[lateral])
    along = _along(normals, lateral)
    across = np.cross(normals, along)
    uv = np.stack([np.einsum("mij,mj->mi", corners, along), np.einsum("mij,mj->mi", corners, across)], axis=-1)
    keys = np.column_stack(
        [np.rint(normals * 50.0), np.rint(np.einsum("mi,mi->m", normals, corners[:, 0]) * 200.0)]
    ).astype(np.int64)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    low = np.full((int(group.max()) + 1, 2), np.inf)
    np.minimum.at(low, group, uv.min(axis=1))
    uv = uv - low[group][:, None, :]
    if radius is not None:
        centre = vertices_m[:, :2].mean(axis=0)
        offset = corners[..., :2] - centre
        angle = np.arctan2(offset[..., 1], offset[..., 0])
        angle = np.where(angle - angle[:, :1] > np.pi, angle - 2 * np.pi, angle)
        angle = np.where(angle - angle[:, :1] < -np.pi, angle + 2 * np.pi, angle)
        uv[lateral, :, 0] = (angle * radius)[lateral]
    uv[lateral, :, 1] = corners[lateral][..., 2] - vertices_m[:, 2].min()
    return SurfaceCoordinates(uv_m=uv, round_body=radius is not None)


def _round_radius(vertices_m: FloatArray, lateral_normals: FloatArray) -> float | None:
    if len(np.unique(np.rint(lateral_normals[:, :2] * 100.0), axis=0)) < 12:
        return None
    offset = vertices_m[:, :2] - vertices_m[:, :2].mean(axis=0)
    distance = np.linalg.norm(offset, axis=1)
    outer = distance > 0.5 * distance.max()
    return float(distance[outer].mean()) if distance[outer].std() < 0.03 * distance.max() else None


def _along(normals: FloatArray, lateral: NDArray[np.bool_]) -> FloatArray:
    """Unit direction of u per triangle: horizontal in a lateral face, the body's main axis in a flat one."""
    sideways = np.cross(_UP, normals)
    main = sideways[int(np.argmax(lateral))] if bool(lateral.any()) else np.array([1.0, 0.0, 0.0])
    sideways[~lateral] = main - normals[~lateral] * (normals[~lateral] @ main)[:, None]
    return np.asarray(sideways / np.maximum(np.linalg.norm(sideways, axis=1, keepdims=True), 1e-12))


def body_object(body: Body, origin_m: FloatArray, material: Any) -> Any:
    """Make the Blender object of a body (not yet linked); vertices at one place are merged for smooth shading."""
    local = body.vertices_m - origin_m
    unique, inverse = np.unique(np.rint(local * 1e5).astype(np.int64), axis=0, return_index=False, return_inverse=True)
    merged = np.zeros((len(unique), 3))
    merged[inverse.reshape(-1)] = local
    triangles = inverse.reshape(-1)[body.triangles]
    keep = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    triangles = triangles[keep].astype(np.int32)
    coordinates = surface_coordinates(merged, triangles)
    mesh = _mesh(body.name, merged, triangles, coordinates.uv_m.reshape(-1, 2))
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=_SMOOTH_ANGLE_RAD)
    mesh.materials.append(material)
    made = bpy.data.objects.new(body.name, mesh)
    rng = np.random.default_rng([body.texture_seed & 0x7FFFFFFF, 91])
    made.color = (*rng.random(3), float(rng.random()))
    made["round_body"] = float(coordinates.round_body)
    return made


def decal_object(decal: Decal, origin_m: FloatArray, material: Any) -> Any:
    """Make the quad of a decal, its picture's pixel edges on the quad's edges."""
    uv = np.array([[0, 1], [0, 0], [1, 0], [0, 1], [1, 0], [1, 1]], dtype=np.float64)
    triangles = np.array([[0, 3, 2], [0, 2, 1]], dtype=np.int32)
    mesh = _mesh(decal.name, decal.corners_m - origin_m, triangles, uv)
    mesh.materials.append(material)
    return bpy.data.objects.new(decal.name, mesh)


def disc_object(name: str, disc: Disc, origin_m: FloatArray, material: Any, segments: int = 180) -> Any:
    """Make the target as a fan without thickness, so that its outline is exactly the circle's."""
    normal = disc.normal / np.linalg.norm(disc.normal)
    helper = _UP if abs(normal[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right = np.cross(helper, normal)
    right /= np.linalg.norm(right)
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    grown = disc.radius_m / np.sqrt(np.sinc(2.0 / segments))  # polygon of the circle's area
    rim = np.outer(np.cos(angle), right) + np.outer(np.sin(angle), np.cross(normal, right))
    vertices = np.vstack([np.zeros(3), rim * grown]) + (disc.centre_m - origin_m)
    ring = np.arange(segments)
    triangles = np.column_stack([np.zeros_like(ring), ring + 1, (ring + 1) % segments + 1]).astype(np.int32)
    flat = np.zeros((segments * 3, 2))
    mesh = _mesh(name, vertices, triangles, flat)
    mesh.materials.append(material)
    return bpy.data.objects.new(name, mesh)


def _mesh(name: str, vertices_m: FloatArray, triangles: IntArray, corner_uv: FloatArray) -> Any:
    mesh = bpy.data.meshes.new(name)
    count = len(triangles)
    mesh.vertices.add(len(vertices_m))
    mesh.vertices.foreach_set("co", vertices_m.astype(np.float32).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles, dtype=np.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    layer = mesh.uv_layers.new(name="surface")
    layer.data.foreach_set("uv", np.ascontiguousarray(corner_uv, dtype=np.float32).ravel())
    return mesh
