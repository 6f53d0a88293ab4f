"""Builds what lies round a place: ground to the horizon, streets of houses, towers, trees, a fence or none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from asbuilt_synthetic.meshes import Part, box, join, lump, tube

from asbuilt_training.classes import BACKGROUND
from asbuilt_training.images.things import Thing, of_kind

Rng = np.random.Generator


def surroundings(centre_xy: np.ndarray, reach_m: float, ground_z_m: float, rng: Rng) -> list[Thing]:
    """Build the world beyond `reach_m` of a centre, and the ground under all."""
    out = [ground(centre_xy, reach_m, ground_z_m, rng)]
    for _ in range(int(rng.choice([0, 4, 10, 18]))):
        out += house(_about(centre_xy, reach_m + 12, reach_m + 50, rng), ground_z_m, rng)
    for _ in range(int(rng.integers(0, 6))):
        out += tower(_about(centre_xy, reach_m + 60, reach_m + 220, rng), ground_z_m, rng)
    for _ in range(int(rng.choice([0, 6, 14, 22]))):
        out += tree(_about(centre_xy, reach_m + 1, reach_m + 40, rng), ground_z_m, rng)
    parts = [p.moved(centre_xy.tolist()) for p in _tree_line(reach_m + 90, ground_z_m, rng)]
    return of_kind([*out, *parts], BACKGROUND)


def ground(centre_xy: np.ndarray, reach_m: float, z_m: float, rng: Rng) -> Part:
    """Lay a grid that is level within reach, uneven beyond, and reaches the horizon."""
    near = np.linspace(-1, 1, 41) * (reach_m + 30)
    far = np.array([80.0, 200, 500, 1500])
    a = np.concatenate([-far[::-1] - reach_m, near, far + reach_m])
    n = len(a)
    x, y = np.meshgrid(a, a, indexing="ij")
    beyond = np.clip((np.maximum(np.abs(x), np.abs(y)) - reach_m) / 12, 0, 1)
    z = z_m + rng.uniform(0, 0.5) * rng.normal(size=(n, n)) * beyond - 0.002 * np.maximum(np.hypot(x, y) - 60, 0)
    z += rng.uniform(0.0, 0.012) * rng.normal(size=(n, n))
    v = np.c_[(x + centre_xy[0]).ravel(), (y + centre_xy[1]).ravel(), z.ravel()]
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    p = (i * n + j).ravel()
    tri = np.concatenate([np.c_[p, p + n, p + n + 1], np.c_[p, p + n + 1, p + 1]]).astype(np.int32)
    material = str(rng.choice(["ground", "ground", "ground", "asphalt", "grass"]))
    return Part(name="Ground", vertices_m=v, triangles=tri, material=material)


def house(at: np.ndarray, z_m: float, rng: Rng) -> list[Part]:
    """Build a house with windows on all sides, and a flat or a pitched roof."""
    w, d, h = rng.uniform(6, 22), rng.uniform(6, 14), rng.uniform(4, 16)
    skin = str(rng.choice(["plaster", "brick", "plaster", "blocks", "sheet"]))
    parts = [box("House", (-w / 2, -d / 2, -1.0), (w / 2, d / 2, h), skin, int(rng.integers(1 << 16)))]
    glass, frames = _windows(w, d, h, rng)
    parts += [join("Windows", glass), join("Window frames", frames)] if glass and skin != "sheet" else []
    if rng.random() < 0.5:
        rise = rng.uniform(1.5, 4)
        v = np.array([[-w / 2, -d / 2, h], [w / 2, -d / 2, h], [w / 2, d / 2, h], [-w / 2, d / 2, h],
                      [-w / 2, 0, h + rise], [w / 2, 0, h + rise]]) * [1.05, 1.1, 1]  # fmt: skip
        tri = np.array([[0, 1, 5], [0, 5, 4], [2, 3, 4], [2, 4, 5], [3, 0, 4], [1, 2, 5]], np.int32)
        parts.append(Part(name="Roof", vertices_m=v, triangles=tri, material=str(rng.choice(["brick", "asphalt"]))))
    angle = float(rng.choice([0, np.pi / 2]) + rng.normal(0, 0.1))
    return [p.moved(at.tolist(), z_m, angle) for p in parts]


def _windows(w: float, d: float, h: float, rng: Rng) -> tuple[list[Part], list[Part]]:
    glass: list[Part] = []
    frames: list[Part] = []
    wide, tall, step = rng.uniform(0.8, 2.0), rng.uniform(1.1, 1.8), rng.uniform(2.2, 4)
    for z in np.arange(1.0, h - 1.8, rng.uniform(2.7, 3.4)):
        for side, (length, depth) in enumerate(((w, d), (d, w))):
            for x in np.arange(-length / 2 + step / 2, length / 2 - wide, step):
                for sign in (-1, 1):
                    for inset, out, grow in ((glass, 0.02, 0.0), (frames, 0.01, 0.1)):
                        low = [x - grow, sign * depth / 2 - out, z - grow]
                        high = [x + wide + grow, sign * depth / 2 + out, z + tall + grow]
                        if side:
                            low, high = [low[1], low[0], low[2]], [high[1], high[0], high[2]]
                        inset.append(box("w", low, high, "glass" if inset is glass else "plaster"))
    return glass, frames


def tower(at: np.ndarray, z_m: float, rng: Rng) -> list[Part]:
    """Build a far tall block with bands of windows."""
    w, d, h = rng.uniform(12, 40), rng.uniform(12, 25), rng.uniform(12, 60)
    skin = str(rng.choice(["plaster", "glass", "brick"]))
    bands = [
        box(
            "band",
            (-w / 2 - 0.03, -d / 2 - 0.03, z),
            (w / 2 + 0.03, d / 2 + 0.03, z + 1.5),
            "glass" if skin != "glass" else "plaster",
        )
        for z in np.arange(2, h - 2, 3.2)
    ]
    return [
        p.moved(at.tolist(), z_m, float(rng.uniform(0, 6.3)))
        for p in (box("Tower", (-w / 2, -d / 2, -9), (w / 2, d / 2, h), skin), join("Bands", bands))
    ]


def tree(at: np.ndarray, z_m: float, rng: Rng) -> list[Part]:
    """Build a tree, a bush or a bare trunk."""
    h = float(rng.uniform(0.0, 5.0))
    out = [
        tube(
            "Trunk",
            (0, 0, -0.5),
            (rng.normal(0, 0.2), rng.normal(0, 0.2), h + 1.5),
            float(rng.uniform(0.06, 0.25)),
            "timber",
            10,
        )
    ]
    size = float(rng.uniform(0.5, 1.8))
    crown = []
    for _ in range(int(rng.integers(0, 8))):
        shift = rng.normal(0, 0.8 * size, 3) * [1, 1, 0.8] + [0, 0, h + 0.7 * size]
        lobe = lump("lobe", (rng.uniform(0.5, 1.1, 3) * size).tolist(), 0.13, rng, "foliage", 22, 14)
        crown.append(replace(lobe, vertices_m=lobe.vertices_m + shift))
    out += [join("Crown", crown)] if crown else []
    return [p.moved(at.tolist(), z_m) for p in out]


def _tree_line(radius_m: float, z_m: float, rng: Rng) -> list[Part]:
    """Close a part of the horizon with woods or hills."""
    if rng.random() < 0.3:
        return []
    lumps = []
    start, width = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 6.3)
    for a in np.arange(start, start + width, 0.12):
        size = rng.uniform(4, 9, 3) * [1.2, 1.2, rng.uniform(0.5, 1.2)]
        one = lump("wood", size.tolist(), 0.1, rng, "foliage", 12, 8)
        away = radius_m * rng.uniform(1, 1.6)
        lumps.append(replace(one, vertices_m=one.vertices_m + np.array([away * np.cos(a), away * np.sin(a), z_m])))
    return [join("Woods", lumps)]


def _about(centre: np.ndarray, nearest: float, furthest: float, rng: Rng) -> np.ndarray:
    a, r = rng.uniform(0, 2 * np.pi), rng.uniform(nearest, furthest)
    return np.asarray(centre[:2] + r * np.array([np.cos(a), np.sin(a)]))
