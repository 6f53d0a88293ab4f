"""Divides an element into cells and its lateral faces into small samples, each exposed or in contact, built or not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from asbuilt_synthetic.building import Building, Element
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.model import AnyArray, FloatArray, IntArray
from asbuilt_synthetic.solids import in_opening, sides

COLUMN_CELL_M = 0.1
WALL_CELL_M = (0.25, 0.15)  # length, height
_CONTACT_GAP_M = 0.004


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Points of an element's lateral design surface, openings left out; world metres."""

    points_m: FloatArray  # (N, 3)
    normals: FloatArray  # (N, 3) outward
    area_m2: FloatArray  # (N,)
    side: IntArray  # (N,) index into solids.sides(element)
    cell: IntArray  # (N,) index into cells(element)
    built: np.ndarray  # (N,) bool
    exposed: np.ndarray  # (N,) bool: not in contact with another element of the design
    height_m: FloatArray  # (N,) above the element's base


def cells(e: Element) -> FloatArray:
    """Divide an element: (C, 2, 2) low and high of length and height in fractions; cells in openings left out."""
    (x0, x1), height = e.x_range_m, e.height_m
    if e.shape != "wall":
        z = _edges([0.0, height], COLUMN_CELL_M) / height
        return np.stack([np.broadcast_to([0.0, 1.0], (len(z) - 1, 2)), np.c_[z[:-1], z[1:]]], axis=1)
    x, z = _wall_edges(e)
    low = np.stack(np.meshgrid(x[:-1], z[:-1], indexing="ij"), -1).reshape(-1, 2)
    high = np.stack(np.meshgrid(x[1:], z[1:], indexing="ij"), -1).reshape(-1, 2)
    mid = (low + high) / 2
    keep = ~in_opening(e, mid[:, 0], mid[:, 1])
    return np.asarray(np.stack([low[keep], high[keep]], axis=-1) / np.array([x1 - x0, height])[None, :, None])


def cell_built(e: Element, fraction: float) -> np.ndarray:
    """Tell which cells have their centre below the pour height."""
    return np.asarray(cells(e)[:, 1].mean(1) <= fraction + 1e-9)


def samples(building: Building, e: Element, fraction: float, step_m: float) -> Samples:
    """Sample the lateral design faces about every `step_m`, edges of openings and of the pour respected."""
    rows: list[tuple[AnyArray, ...]] = []
    pour = fraction * e.height_m
    grid = cells(e)
    for index, side in enumerate(sides(e)):
        a, b = side.x_from_u
        holes = [(h - a) / b for o in e.openings for h in (o.start_m, o.start_m + o.width_m)] if abs(b) == 1 else []
        u, du = _steps([0.0, side.length_m, *holes], step_m)
        levels = [h for o in e.openings for h in (o.sill_m, o.sill_m + o.height_m)]
        v, dv = _steps([0.0, e.height_m, *levels, *([pour] if 0 < fraction < 1 else [])], step_m)
        uu, vv = (g.ravel() for g in np.meshgrid(u, v, indexing="ij"))
        area = np.outer(du, dv).ravel()
        x = a + b * uu
        keep = ~in_opening(e, x, vv) if abs(b) == 1 else ~in_opening(e, np.clip(x, 1e-6, e.length_m - 1e-6), vv)
        uu, vv, x, area = uu[keep], vv[keep], x[keep], area[keep]
        p, n = side.points(uu, vv)
        rows.append((p, np.array(n), area, np.full(len(p), index), _cell_of(e, grid, x, vv), vv <= pour, vv))
    p, n, area, side_of, cell, built, height = (np.concatenate([r[k] for r in rows]) for k in range(7))
    local = transform(e.local_from_element, p)
    normal = n @ e.local_from_element[:3, :3].T
    world = building.world_from_local
    return Samples(
        points_m=transform(world, local),
        normals=normal @ world[:3, :3].T,
        area_m2=area,
        side=side_of.astype(np.int32),
        cell=cell.astype(np.int32),
        built=built.astype(bool),
        height_m=height,
        exposed=~touched(
            local + _CONTACT_GAP_M * normal, (o for o in building.elements if o is not e and o.is_near(e))
        ),
    )


def touched(points_local_m: FloatArray, elements: Iterable[Element]) -> np.ndarray:
    """Tell which points (N, 3) of the site's local frame lie in the design body of any of the elements."""
    hit = np.zeros(len(points_local_m), bool)
    for o in elements:
        q = transform(np.linalg.inv(o.local_from_element), points_local_m)
        within = (q[:, 2] > 0) & (q[:, 2] < o.height_m)
        if o.shape == "round":
            within &= np.hypot(q[:, 0], q[:, 1]) < o.length_m / 2
        else:
            x0, x1 = o.x_range_m
            within &= (q[:, 0] > x0) & (q[:, 0] < x1) & (np.abs(q[:, 1]) < o.width_m / 2)
            within &= ~in_opening(o, q[:, 0] - x0, q[:, 2])
        hit |= within
    return hit


def _cell_of(e: Element, grid: FloatArray, x: FloatArray, z: FloatArray) -> IntArray:
    if e.shape != "wall":
        n = len(grid)
        return np.clip((z / e.height_m * n).astype(np.int32), 0, n - 1)
    xe, ze = _wall_edges(e)
    i = np.clip(np.searchsorted(xe, x) - 1, 0, len(xe) - 2)
    k = np.clip(np.searchsorted(ze, z) - 1, 0, len(ze) - 2)
    xm, zm = (xe[1:] + xe[:-1]) / 2, (ze[1:] + ze[:-1]) / 2
    solid = ~in_opening(e, xm[:, None], zm[None, :])
    number = np.where(solid, np.cumsum(solid.ravel()).reshape(solid.shape) - 1, -1)
    return np.asarray(number[i, k], np.int32)


def _wall_edges(e: Element) -> tuple[FloatArray, FloatArray]:
    xs = [0.0, e.length_m, *(v for o in e.openings for v in (o.start_m, o.start_m + o.width_m))]
    zs = [0.0, e.height_m, *(v for o in e.openings for v in (o.sill_m, o.sill_m + o.height_m))]
    return _edges(xs, WALL_CELL_M[0]), _edges(zs, WALL_CELL_M[1])


def _edges(breaks: Sequence[float], step_m: float) -> FloatArray:
    """Divide the spans between breaks into nearly equal steps."""
    b = np.unique(np.round(breaks, 9))
    spans = [np.linspace(p, q, max(1, round((q - p) / step_m)) + 1)[:-1] for p, q in pairwise(b)]
    return np.asarray(np.r_[np.concatenate(spans), b[-1]])


def _steps(breaks: Sequence[float], step_m: float) -> tuple[FloatArray, FloatArray]:
    edges = _edges(breaks, step_m)
    return (edges[1:] + edges[:-1]) / 2, np.diff(edges)
