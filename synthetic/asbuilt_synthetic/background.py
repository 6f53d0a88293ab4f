"""Builds the world round the site: ground, hoarding, neighbouring buildings with windows, trees, heaps of earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_synthetic.building import Building
from asbuilt_synthetic.clutter import GROUND_Z_M
from asbuilt_synthetic.meshes import Part, box, join, lump, tube

_HALF_GROUND_M = 70.0


def background(building: Building) -> list[Part]:
    """Build what stays the same through the visits of a seed."""
    rng = np.random.default_rng([building.seed, 4])
    xs, ys = building.axes_x_m, building.axes_y_m
    centre = np.array([(xs[0] + xs[3]) / 2, (ys[0] + ys[2]) / 2])
    half = np.array([xs[3] - xs[0], ys[2] - ys[0]]) / 2
    fence = half + rng.uniform(9.5, 13.0, 2)
    return [
        _ground(centre, half, rng),
        *_hoarding(centre, fence, rng),
        *_neighbours(centre, fence, rng),
        *_trees(centre, fence, rng),
        *_heaps(centre, half, fence, rng),
    ]


def _ground(centre: np.ndarray, half: np.ndarray, rng: np.random.Generator) -> Part:
    """Lay a grid of earth: flat near the building, uneven beyond."""
    n = 71
    a = np.linspace(-_HALF_GROUND_M, _HALF_GROUND_M, n)
    x, y = np.meshgrid(a, a, indexing="ij")
    away = np.clip((np.maximum(np.abs(x) - half[0], np.abs(y) - half[1]) - 3.0) / 12.0, 0, 1)
    noise = rng.normal(size=(n, n))
    noise = (noise + np.roll(noise, 1, 0) + np.roll(noise, 1, 1) + np.roll(noise, (1, 1), (0, 1))) / 2
    z = GROUND_Z_M + noise * 0.12 * away
    v = np.c_[(x + centre[0]).ravel(), (y + centre[1]).ravel(), z.ravel()]
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    p = (i * n + j).ravel()
    tri = np.concatenate([np.c_[p, p + n, p + n + 1], np.c_[p, p + n + 1, p + 1]]).astype(np.int32)
    return Part(name="Ground", vertices_m=v, triangles=tri, material="ground")


def _hoarding(centre: np.ndarray, fence: np.ndarray, rng: np.random.Generator) -> list[Part]:
    out, posts = [], []
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        other = 1 - axis
        n = int(2 * fence[other] / 2.44)
        start = -fence[other] + rng.uniform(0, 0.5)
        gate = int(rng.integers(2, max(3, n - 2)))
        for k in range(n):
            if k == gate and axis == 1:
                continue
            low, high = np.zeros(3), np.zeros(3)
            low[other], high[other] = start + 2.44 * k, start + 2.44 * k + 2.42
            low[axis], high[axis] = sorted((sign * fence[axis], sign * (fence[axis] + 0.018)))
            low[2], high[2] = GROUND_Z_M - 0.3, GROUND_Z_M + 2.0 + rng.normal(0, 0.015)
            low[:2] += centre
            high[:2] += centre
            out.append(
                box(f"Hoarding {axis}{sign}{k}", low.tolist(), high.tolist(), "hoarding", int(rng.integers(1 << 16)))
            )
            p = low.copy()
            posts.append(tube("post", (*p[:2], GROUND_Z_M - 0.3), (*p[:2], high[2] + 0.05), 0.045, "timber", 8))
    return [*out, join("Hoarding posts", posts)]


def _neighbours(centre: np.ndarray, fence: np.ndarray, rng: np.random.Generator) -> list[Part]:
    """Stand terraces with windows behind the hoarding on all four sides."""
    out: list[Part] = []
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        other = 1 - axis
        at = -fence[other] - 6.0
        while at < fence[other] + 6.0:
            width, gap = float(rng.uniform(8, 15)), float(rng.choice([0.0, 0.0, 3.0, 5.0]))
            front = fence[axis] + float(rng.uniform(4.0, 9.0))
            out += _house(axis, sign, centre, at, width, front, float(rng.uniform(6.5, 12.5)), rng)
            at += width + gap
    return out


def _house(
    axis: int,
    sign: int,
    centre: np.ndarray,
    start: float,
    width: float,
    front: float,
    height: float,
    rng: np.random.Generator,
) -> list[Part]:
    def block(a: float, b: float, depth_low: float, depth_high: float, z0: float, z1: float, material: str) -> Part:
        low, high = np.zeros(3), np.zeros(3)
        low[1 - axis], high[1 - axis] = a, b
        low[axis], high[axis] = sorted((sign * depth_low, sign * depth_high))
        low[2], high[2] = z0, z1
        low[:2] += centre
        high[:2] += centre
        return box("house", low.tolist(), high.tolist(), material)

    skin = str(rng.choice(["brick", "plaster", "brick"]))
    wall = block(start, start + width, front, front + 8.0, -0.6, height, skin)
    parts = [replace(wall, name=f"House {axis}{sign}{start:.0f}", texture_seed=int(rng.integers(1 << 16)))]
    glass, frames = [], []
    n, w = max(2, int(width / 2.6)), float(rng.uniform(1.0, 1.4))
    for z in np.arange(1.0, height - 1.8, 2.9):
        for k in range(n):
            mid = start + width * (k + 0.5) / n
            glass.append(block(mid - w / 2, mid + w / 2, front - 0.01, front + 0.05, z, z + 1.45, "glass"))
            for a, b, c, d in (
                (mid - w / 2 - 0.08, mid + w / 2 + 0.08, z - 0.12, z),
                (mid - w / 2 - 0.08, mid + w / 2 + 0.08, z + 1.45, z + 1.58),
                (mid - 0.03, mid + 0.03, z, z + 1.45),
            ):
                frames.append(block(a, b, front - 0.05, front + 0.05, c, d, "plaster"))
    eaves = block(start - 0.1, start + width + 0.1, front - 0.25, front + 8.2, height, height + 0.35, "timber")
    return [*parts, join("Windows", glass), join("Window frames", frames), replace(eaves, name="Eaves")]


def _trees(centre: np.ndarray, fence: np.ndarray, rng: np.random.Generator) -> list[Part]:
    out = []
    for k in range(9):
        axis, sign = int(rng.integers(2)), int(rng.choice([-1, 1]))
        p = np.zeros(2)
        p[axis] = sign * (fence[axis] + rng.uniform(1.5, 3.2))
        p[1 - axis] = rng.uniform(-1, 1) * fence[1 - axis]
        p += centre
        h = float(rng.uniform(2.6, 4.5))
        out.append(tube(f"Trunk {k}", (*p, -0.5), (*p, h), 0.14, "timber", 10))
        crown = []
        for _ in range(5):
            shift = rng.normal(0, 0.7, 3) * [1, 1, 0.6] + [*p, h + 0.9]
            lobe = lump("lobe", rng.uniform(0.8, 1.4, 3).tolist(), 0.09, rng, "foliage", 32, 20)
            crown.append(replace(lobe, vertices_m=lobe.vertices_m + shift))
        out.append(join(f"Crown {k}", crown))
    return out


def _heaps(centre: np.ndarray, half: np.ndarray, fence: np.ndarray, rng: np.random.Generator) -> list[Part]:
    out = []
    for k in range(4):
        axis, sign = int(rng.integers(2)), int(rng.choice([-1, 1]))
        p = np.zeros(2)
        p[axis] = sign * (fence[axis] - rng.uniform(1.8, 2.6))
        p[1 - axis] = rng.uniform(-0.9, 0.9) * half[1 - axis]
        r = rng.uniform(1.2, 2.0, 2)
        heap = lump(f"Heap {k}", (float(r[0]), float(r[1]), float(rng.uniform(0.6, 1.1))), 0.05, rng, "ground", 36, 18)
        out.append(replace(heap, vertices_m=heap.vertices_m + np.array([*(p + centre), GROUND_Z_M])))
    return out
