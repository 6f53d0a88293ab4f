"""An element's own axes: length, thickness and height from its vertices."""

import numpy as np

from asbuilt_bim.bim.mesh import Mesh
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import cross

_ROOM = 1.05
"""The placement's axes are kept while their rectangle is at most 5 % larger than the smallest one."""


def axes(mesh: Mesh, preferred: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Return `axis_from_world` (4, 4) and the extents (3,) in metres: length >= thickness, and height.

    Element coordinates: x from 0 to length, y from -thickness / 2 to thickness / 2, z up from 0 to height. `preferred`
    (2,) is a plan direction, a wall's placement axis, that is taken where its rectangle is as tight as the tightest.
    """
    points = mesh.vertices_m[np.unique(mesh.triangles)]
    shift = points.mean(axis=0)
    plan = (points - shift)[:, :2]
    directions = _edge_directions(mesh)
    if preferred is not None and np.linalg.norm(preferred) > 1e-6:
        directions = np.concatenate([[np.arctan2(preferred[1], preferred[0])], directions])
    spans = _spans(plan, directions)
    areas = np.prod(spans, axis=1)
    best = int(np.argmin(areas))
    if preferred is not None and areas[0] <= areas[best] * _ROOM + 1e-6:
        best = 0
    angle = directions[best]
    if spans[best, 0] < spans[best, 1] - 1e-6:
        angle += np.pi / 2.0
    x = np.array([np.cos(angle), np.sin(angle), 0.0])
    turn = np.stack([x, cross([0.0, 0.0, 1.0], x), [0.0, 0.0, 1.0]])
    own = (points - shift) @ turn.T
    low, high = own.min(axis=0), own.max(axis=0)
    origin = np.array([low[0], (low[1] + high[1]) / 2.0, low[2]])
    axis_from_world = np.eye(4)
    axis_from_world[:3, :3] = turn
    axis_from_world[:3, 3] = -turn @ shift - origin
    return axis_from_world, high - low


def _edge_directions(mesh: Mesh) -> FloatArray:
    """Return the plan directions (N,) in radians of the lateral triangles; the smallest rectangle lies along one."""
    corners = mesh.corners_m
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = np.linalg.norm(across[:, :2], axis=1)
    upright = level > np.abs(across[:, 2])
    if not upright.any():
        return np.zeros(1)
    angles = np.mod(np.arctan2(across[upright, 0], -across[upright, 1]), np.pi / 2.0)
    largest = np.argsort(-level[upright], kind="stable")[:200]
    unique: FloatArray = np.unique(np.round(angles[largest], 9))
    return unique


def _spans(plan: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the extents (N, 2) of points (P, 2) along and across each direction."""
    along = np.stack([np.cos(angles), np.sin(angles)])
    across = np.stack([-np.sin(angles), np.cos(angles)])
    return np.stack([np.ptp(plan @ along, axis=0), np.ptp(plan @ across, axis=0)], axis=1)
