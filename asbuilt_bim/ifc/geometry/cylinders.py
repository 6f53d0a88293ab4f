"""Round columns come as many narrow facets: here they become one cylinder again."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import Region
from asbuilt_bim.geometry.transform import cross, unit
from asbuilt_bim.ifc.geometry.coplanar_regions import UP, CoplanarRegion, triangles_union

MAX_TURN_RAD = float(np.radians(31.0))
"""A 12-sided prism is drawn for a circle, an octagon (45 degrees) is meant as one."""
MIN_TURN_RAD = float(np.radians(0.3))
MIN_ARC_RAD = float(np.radians(60.0))
MIN_SIDES = 4
MAX_STEP = 2.5
"""Facets of one arc are about as wide as each other: the flat side that an arc runs into is no part of it."""
MAX_RADIUS_M = 1.5
"""Beyond this a curved wall: its facets are flat to a camera that stands a few metres away."""
FIT_M = 0.002
FIT_SHARE = 0.01
_FEW = 256  # facets of which every two are held against each other: a millisecond at most


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundCylinder:
    """A convex piece of a cylinder: its frame (v from 0 up), polygons in (u, v) metres, and the facets it replaces."""

    frame: CylinderFrame
    region: Region
    parts: frozenset[int]


def find_cylinders(mesh: Mesh, parts: tuple[CoplanarRegion, ...]) -> tuple[FoundCylinder, ...]:
    """Find the chains of facets that turn evenly about an axis and whose corners lie on one circle."""
    cylinders = (_fit(mesh, parts, chain) for chain in _chains(mesh, parts) if len(chain) >= MIN_SIDES)
    return tuple(round_face for round_face in cylinders if round_face is not None)


def _chains(mesh: Mesh, parts: tuple[CoplanarRegion, ...]) -> list[list[int]]:
    """Return groups of facets that meet neighbours of about their own width along an edge with a small convex turn."""
    if len(parts) < MIN_SIDES:
        return []
    normals = np.array([part.normal for part in parts])
    if _none_alike(normals):
        return []
    part_of = np.full(len(mesh.triangles), -1)
    part_of[np.concatenate([part.triangles for part in parts])] = np.repeat(
        np.arange(len(parts)), [len(part.triangles) for part in parts]
    )
    edges = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    owner = np.tile(part_of, 3)
    edges, owner = np.sort(edges[owner >= 0], axis=1), owner[owner >= 0]
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    same = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1) & (owner[1:] != owner[:-1]))
    if len(same) == 0:
        return []
    first, second = owner[same], owner[same + 1]
    middles, widths = _extents(mesh, parts, normals)
    turn = np.arccos(np.clip((normals[first] * normals[second]).sum(axis=1), -1.0, 1.0))
    behind = ((middles[second] - mesh.vertices_m[edges[same, 0]]) * normals[first]).sum(axis=1) < 0.0
    alike = np.maximum(widths[first], widths[second]) < MAX_STEP * np.minimum(widths[first], widths[second])
    joined = (turn > MIN_TURN_RAD) & (turn < MAX_TURN_RAD) & behind & alike
    labels = np.arange(len(parts))
    first, second = first[joined], second[joined]
    while True:
        before = labels.copy()
        lowest = np.minimum(labels[first], labels[second])
        np.minimum.at(labels, first, lowest)
        np.minimum.at(labels, second, lowest)
        labels = labels[labels]
        if np.array_equal(labels, before):
            break
    found, size = np.unique(labels, return_counts=True)
    return [list(np.flatnonzero(labels == label)) for label in found[size > 1]]


def _none_alike(normals: FloatArray) -> bool:
    """Say of few facets, by their normals (P, 3), that no two turn so little that an arc could join them: a box's."""
    if len(normals) > _FEW:
        return False
    turned = normals @ normals.T
    np.fill_diagonal(turned, -1.0)
    return bool(turned.max() < np.cos(MAX_TURN_RAD) - 1e-9)


def _extents(mesh: Mesh, parts: tuple[CoplanarRegion, ...], normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the facets' middles (P, 3) and their level extents (P,) in metres."""
    sizes = [len(part.triangles) for part in parts]
    start = np.cumsum([0, *sizes[:-1]])
    corners = mesh.vertices_m[mesh.triangles[np.concatenate([part.triangles for part in parts])]]
    along = unit(cross(UP, normals))
    reach = (corners * np.repeat(along, sizes, axis=0)[:, None]).sum(axis=2)
    widths = np.maximum.reduceat(reach.max(axis=1), start) - np.minimum.reduceat(reach.min(axis=1), start)
    middles = np.add.reduceat(corners.mean(axis=1), start, axis=0) / np.array(sizes)[:, None]
    return middles, widths


def _fit(mesh: Mesh, parts: tuple[CoplanarRegion, ...], chain: list[int]) -> FoundCylinder | None:
    normals = np.array([parts[i].normal for i in chain])
    axis = UP if np.abs(normals[:, 2]).max() < 1e-3 else np.linalg.svd(normals)[2][2]
    axis = axis if axis[2] > 0.0 else -axis
    numbers = np.concatenate([parts[i].triangles for i in chain])
    corners = mesh.corners_m[numbers]
    points = corners.reshape(-1, 3)
    x = cross(np.array([0.0, 1.0, 0.0]), axis)
    x /= np.linalg.norm(x)
    y = cross(axis, x)
    shift = points.mean(axis=0)
    plan = np.stack([(points - shift) @ x, (points - shift) @ y], axis=1)
    solved, *_ = np.linalg.lstsq(np.column_stack([2.0 * plan, np.ones(len(plan))]), (plan**2).sum(axis=1), rcond=None)
    centre = solved[:2]
    radius = float(np.sqrt(max(solved[2] + centre @ centre, 0.0)))
    misfit = np.abs(np.linalg.norm(plan - centre, axis=1) - radius).max()
    if not 0.0 < radius <= MAX_RADIUS_M or misfit > max(FIT_M, FIT_SHARE * radius):
        return None
    outward = np.repeat(normals, [len(parts[i].triangles) for i in chain], axis=0)
    facing = np.arctan2(outward @ y, outward @ x)
    angles = np.arctan2(*(plan - centre).T[::-1]).reshape(-1, 3)
    angles = facing[:, None] + _wrapped(angles - facing[:, None])
    seam, arc = _seam(angles)
    if arc < MIN_ARC_RAD:
        return None
    foot = shift + centre[0] * x + centre[1] * y + ((points - shift) @ axis).min() * axis
    zero = np.cos(seam + np.pi) * x + np.sin(seam + np.pi) * y
    frame = CylinderFrame(origin_m=frozen(foot), axis=frozen(axis), zero=frozen(zero), radius_m=radius)
    middle = angles.mean(axis=1, keepdims=True)
    from_zero = _wrapped(middle - seam - np.pi) + (angles - middle)
    uv = np.stack([radius * from_zero, (corners - foot) @ axis], axis=-1)
    return FoundCylinder(frame=frame, region=triangles_union(uv), parts=frozenset(int(i) for i in chain))


def _wrapped(angle: FloatArray) -> FloatArray:
    wrapped: FloatArray = np.pi - np.mod(np.pi - angle, 2.0 * np.pi)
    return wrapped


def _seam(angles: FloatArray) -> tuple[float, float]:
    """Return the angle at which the lateral surface is cut open, a facet's border, and the arc that it covers."""
    borders = np.unique(np.round(np.mod(angles.reshape(-1), 2.0 * np.pi), 6))
    gaps = np.diff(np.append(borders, borders[0] + 2.0 * np.pi))
    widest = int(np.argmax(gaps))
    if gaps[widest] <= MAX_TURN_RAD:
        return float(borders[0]), 2.0 * np.pi
    return float(borders[widest] + gaps[widest] / 2.0), float(2.0 * np.pi - gaps[widest])
