"""Regular grids over faces: which points lie in a region, asked once for each piece between two of its borders."""

from dataclasses import dataclass

import numpy as np

from asbuilt_bim.bim.model import DesignFace
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import Region, bounds, contains
from asbuilt_bim.geometry.transform import rotate

_SAME_M = 1e-9  # what rounding makes of equal coordinates


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceGrid:
    """A grid over a region: the places of its lines `u_m` (nu,) and `v_m` (nv,), and `inside` (nu, nv)."""

    u_m: FloatArray
    v_m: FloatArray
    inside: BoolArray


def face_grid(region: Region, spacing_m: float) -> tuple[FaceGrid, FloatArray]:
    """Return the grid of boxes of about `spacing_m` that a region's bounds are divided into, and their size (2,)."""
    u0, v0, u1, v1 = bounds(region)
    size = np.array([u1 - u0, v1 - v0])
    step = size / np.maximum(1, np.round(size / spacing_m))
    count = np.round(size / step).astype(int)
    u, v = (low + (np.arange(n) + 0.5) * one for low, n, one in zip((u0, v0), count, step, strict=True))
    return FaceGrid(u_m=u, v_m=v, inside=inside_grid(region, u, v)), step


def inside_grid(region: Region, u_m: FloatArray, v_m: FloatArray) -> BoolArray:
    """Say which points (nu, nv) of a grid lie in a region.

    Nearly every face has borders along u and v alone: then all points between two of them lie alike. Otherwise, or
    where a point lies on a border, all are asked.
    """
    borders = _borders(region)
    if borders is not None and _is_rectangle(region, borders):
        between = [(lines[0] < at) & (at < lines[1]) for lines, at in zip(borders, (u_m, v_m), strict=True)]
        rectangle: BoolArray = between[0][:, None] & between[1]
        return rectangle
    if borders is None or any(_on_one(lines, at) for lines, at in zip(borders, (u_m, v_m), strict=True)):
        return contains(region, np.stack(np.meshgrid(u_m, v_m, indexing="ij"), axis=-1))
    halfway = [(lines[:-1] + lines[1:]) / 2.0 for lines in borders]
    parts = contains(region, np.stack(np.meshgrid(*halfway, indexing="ij"), axis=-1))
    padded = np.pad(parts, 1)  # nothing lies past the outermost borders
    places = [np.searchsorted(lines, at) for lines, at in zip(borders, (u_m, v_m), strict=True)]
    inside: BoolArray = padded[places[0]][:, places[1]]
    return inside


def _is_rectangle(region: Region, borders: tuple[FloatArray, FloatArray]) -> bool:
    return len(region) == 1 and len(region[0]) == 1 and all(len(lines) == 2 for lines in borders)


def _borders(region: Region) -> tuple[FloatArray, FloatArray] | None:
    """Return the places of a region's borders along u and along v, None where one runs askew."""
    for ring in (ring for rings in region for ring in rings):
        along = np.abs(ring - np.concatenate([ring[-1:], ring[:-1]]))
        if along.min(axis=1).max() > _SAME_M:
            return None
    corners = np.sort(np.concatenate([ring for rings in region for ring in rings]), axis=0)
    u, v = (line[np.diff(line, prepend=-np.inf) > _SAME_M] for line in corners.T)
    return u, v


def _on_one(lines: FloatArray, at: FloatArray) -> bool:
    """Say whether any place lies on a line."""
    after = np.clip(np.searchsorted(lines, at), 1, len(lines) - 1)
    return bool((np.minimum(np.abs(at - lines[after - 1]), np.abs(at - lines[after])) <= 2.0 * _SAME_M).any())


def own_lines(
    face: DesignFace, grid: FaceGrid, axis_from_world: FloatArray, along: bool
) -> tuple[FloatArray, FloatArray] | None:
    """Return how far along its element (nu,) and how high (nv,) the lines of a face's grid run.

    None where height changes along u, or, if `along` is asked for, the way along the element with v.
    """
    u, v = grid.u_m, grid.v_m
    span_u, span_v = float(np.ptp(u)), float(np.ptp(v))
    if isinstance(face.frame, CylinderFrame):
        level = rotate(axis_from_world, face.frame.axis)
        askew = along or float(np.abs(level[:2]).max()) * face.frame.radius_m > _SAME_M
    else:
        of_u, of_v = rotate(axis_from_world, np.stack([face.frame.u, face.frame.v]))
        askew = abs(of_u[2]) * span_u > _SAME_M or (along and abs(of_v[0]) * span_v > _SAME_M)
    if askew:
        return None
    x = face.frame.from_uv(np.column_stack([u, np.full(len(u), v[0])])) @ axis_from_world[0, :3] + axis_from_world[0, 3]
    z = face.frame.from_uv(np.column_stack([np.full(len(v), u[0]), v])) @ axis_from_world[2, :3] + axis_from_world[2, 3]
    return x, z
