"""Strews a place with what is no wall and no column but may look like one: the hard negatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from asbuilt_synthetic.meshes import Part, box, circle, join, lathe, lump, prism, tube
from asbuilt_synthetic.people import person

from asbuilt_training.classes import BACKGROUND, CONCRETE, OTHER, SLAB
from asbuilt_training.images.elements import form, slab, turned, wall
from asbuilt_training.images.machines import crane, digger, lorry
from asbuilt_training.images.surroundings import tree
from asbuilt_training.images.things import Thing, of_kind

Rng = np.random.Generator
Maker = Callable[[Rng], list[Thing]]


def strewn(things: Sequence[Thing], centre_xy: np.ndarray, reach_m: float, rng: Rng) -> list[Thing]:
    """Place loose things about a centre, clear of the walls and columns and of each other."""
    boxes = [
        (t.part.vertices_m[:, :2].min(0), t.part.vertices_m[:, :2].max(0))
        for t in things if t.kind in CONCRETE and t.part.vertices_m[:, 2].min() < 1.0
    ]  # fmt: skip
    taken: list[tuple[np.ndarray, float]] = []
    out: list[Thing] = []
    dense = float(rng.choice([0.4, 1.0, 1.8]))
    for most, radius, least, furthest, make in _MAKERS:
        for _ in range(int(rng.binomial(most, min(0.9, 0.4 * dense)))):
            for _ in range(8):
                a, r = rng.uniform(0, 2 * np.pi), rng.uniform(least * reach_m, reach_m + furthest)
                at = centre_xy + r * np.array([np.cos(a), np.sin(a)])
                near = any(
                    (np.maximum(np.maximum(low - at, at - high), 0) ** 2).sum() < radius**2 for low, high in boxes
                )
                if not near and all(np.hypot(*(at - p)) > radius + q for p, q in taken):
                    taken.append((at, radius))
                    out += turned(make(rng), (float(at[0]), float(at[1])), 0.0, float(rng.uniform(0, 2 * np.pi)))
                    break
    return out


def _people(rng: Rng) -> list[Thing]:
    return of_kind(person(rng), OTHER)


def _pallet(rng: Rng) -> list[Thing]:
    high = float(rng.uniform(0.2, 1.3))
    load = box(
        "Load",
        (-0.55, -0.45, 0.14),
        (0.55, 0.45, 0.14 + high),
        str(rng.choice(["brick", "blocks", "tarpaulin", "concrete", "timber"])),
    )
    base = box("Pallet", (-0.6, -0.5, 0), (0.6, 0.5, 0.14), "timber")
    return of_kind([base, load], OTHER)


def _barrel(rng: Rng) -> list[Thing]:
    r, h = float(rng.uniform(0.15, 0.6)), float(rng.uniform(0.4, 1.3))
    profile = [(r, 0.0), (r * float(rng.uniform(0.2, 1.05)), h)]
    return of_kind([lathe("Barrel", profile, str(rng.choice(["red_paint", "machine", "concrete"])), 24)], OTHER)


def _sheet_fence(rng: Rng) -> list[Thing]:
    """A hoarding of corrugated sheet or of boards, on posts."""
    length, high = float(rng.uniform(4, 22)), float(rng.uniform(1.8, 2.6))
    pitch, deep = float(rng.uniform(0.1, 0.35)), float(rng.choice([0.0, rng.uniform(0.02, 0.06)]))
    x = np.arange(-length / 2, length / 2, pitch / 2)
    y = deep * np.array([0, 0, 1, 1])[np.arange(len(x)) % 4] + 0.002 * (np.arange(len(x)) % 2)
    v = np.r_[np.c_[x, y, np.zeros(len(x))], np.c_[x, y, np.full(len(x), high)]]
    i, n = np.arange(len(x) - 1), len(x)
    tri = np.concatenate([np.c_[i, i + 1, n + i + 1], np.c_[i, n + i + 1, n + i]]).astype(np.int32)
    sheet = Part(name="Sheet", vertices_m=v, triangles=tri, material=str(rng.choice(["sheet", "hoarding"])))
    posts = [
        tube("post", (a, -0.06, 0), (a, -0.06, high), 0.04, "timber", 6)
        for a in np.arange(-length / 2, length / 2, 2.5)
    ]
    return of_kind([sheet, join("Posts", posts)], OTHER)


def _mesh_fence(rng: Rng) -> list[Thing]:
    n = int(rng.integers(1, 6))
    wires = []
    for k in range(n):
        x0 = 3.5 * (k - n / 2)
        wires += [tube("f", (x0, 0, z), (x0 + 3.4, 0, z), 0.02, "scaffold_steel", 4) for z in (0.1, 2.0)]
        wires += [
            tube("f", (x, 0, 0.1), (x, 0, 2.0), 0.006, "scaffold_steel", 4) for x in np.arange(x0, x0 + 3.41, 0.28)
        ]
    feet = [
        box("foot", (3.5 * (k - n / 2) - 0.35, -0.12, 0), (3.5 * (k - n / 2) + 0.35, 0.12, 0.15), "concrete")
        for k in range(n)
    ]
    return of_kind([join("Fence", wires), join("Feet", feet)], OTHER)


def _masonry(rng: Rng) -> list[Thing]:
    """A free wall or pillar of brick, blocks or plaster: upright and flat, and not concrete."""
    length = float(rng.choice([rng.uniform(0.35, 0.6), rng.uniform(1.5, 9.0)]))
    thick, high = float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.6, 3.4))
    skin = str(rng.choice(["brick", "blocks", "plaster", "brick"]))
    parts = [box("Masonry", (-length / 2, -thick / 2, 0), (length / 2, thick / 2, high), skin)]
    if rng.random() < 0.4 and length > 3:
        parts.append(box("Masonry end", (length / 2 - thick, thick / 2, 0), (length / 2, 2.5, high), skin))
    return of_kind(parts, BACKGROUND)


def _heap(rng: Rng) -> list[Thing]:
    r = rng.uniform(0.6, 3.0)
    heap = lump("Heap", (r, r * rng.uniform(0.6, 1.2), r * rng.uniform(0.3, 0.7)), 0.05, rng, "heap", 30, 16)
    return of_kind([heap], BACKGROUND)


def _green(rng: Rng) -> list[Thing]:
    return of_kind(tree(np.zeros(2), 0.0, rng), BACKGROUND)


def _container(rng: Rng) -> list[Thing]:
    length = float(rng.choice([2.5, 6.0, 6.0, 9.0]))
    parts = []
    for k in range(int(rng.integers(1, 3))):
        z = 2.6 * k
        parts.append(box("Box", (-length / 2, -1.2, z), (length / 2, 1.2, z + 2.58), "sheet"))
        ribs = [box("rib", (x, s * 1.2 - 0.03, z + 0.1), (x + 0.1, s * 1.2 + 0.03, z + 2.5), "sheet")
                for x in np.arange(-length / 2 + 0.1, length / 2 - 0.1, 0.28) for s in (-1, 1)]  # fmt: skip
        parts.append(join("Ribs", ribs))
        if rng.random() < 0.6:
            parts.append(box("Window", (-0.7, -1.25, z + 1.0), (0.7, -1.18, z + 2.0), "glass"))
    return of_kind(parts, OTHER)


def _steel(rng: Rng) -> list[Thing]:
    """A bundle of bars, a mat on edge, or a cage lying about."""
    length = float(rng.uniform(2, 6))
    bars = [
        tube("bar", (-length / 2, y, z), (length / 2, y + rng.normal(0, 0.05), z), 0.008, "rebar", 4)
        for y, z in rng.uniform([-0.4, 0.02], [0.4, 0.35], (25, 2))
    ]
    return of_kind([join("Bars", bars)], OTHER)


def _scaffold(rng: Rng) -> list[Thing]:
    n, high = int(rng.integers(1, 6)), float(rng.choice([2.0, 4.0, 6.0]))
    bars, decks = [], []
    for k in range(n + 1):
        bars += [tube("s", (2.5 * k, y, 0), (2.5 * k, y, high + 1), 0.024, "scaffold_steel", 6) for y in (0, 0.9)]
    for z in np.arange(1.9, high + 0.1, 2.0):
        bars += [
            tube("l", (0, y, z + d), (2.5 * n, y, z + d), 0.024, "scaffold_steel", 6) for y in (0, 0.9) for d in (0, 1)
        ]
        decks.append(box("deck", (0, 0, z), (2.5 * n, 0.9, z + 0.05), "timber"))
    bars += [tube("d", (2.5 * k, 0, 0), (2.5 * k + 2.5, 0, 2.0), 0.024, "scaffold_steel", 6) for k in range(n)]
    parts = [join("Scaffold", bars), join("Decks", decks)]
    if rng.random() < 0.2:
        parts.append(box("Net", (0, -0.05, 0.3), (2.5 * n, -0.04, high + 0.9), "tarpaulin"))
    return of_kind(parts, OTHER)


def _precast(rng: Rng) -> list[Thing]:
    """Concrete that is no wall and no column of the building: barriers, rings, blocks, lying elements."""
    draw = rng.random()
    if draw < 0.35:
        ring = np.array([[-0.3, 0], [0.3, 0], [0.12, 0.35], [0.09, 0.9], [-0.09, 0.9], [-0.12, 0.35]])
        bar = prism("Barrier", ring, -1.2, 1.2, "concrete")
        return of_kind([replace(bar, vertices_m=bar.vertices_m[:, [2, 0, 1]])], OTHER)
    if draw < 0.6:
        r = float(rng.uniform(0.4, 1.0))
        return of_kind([lathe("Ring", [(r, 0.0), (r, float(rng.uniform(0.3, 1.0)))], "concrete", 40)], OTHER)
    rows = [
        box("Lying", (-1.5, -0.6, 0.3 * k), (1.5 + rng.normal(0, 0.1), 0.6, 0.3 * k + 0.22), "concrete")
        for k in range(int(rng.integers(1, 5)))
    ]
    return of_kind([join("Lying", rows)], OTHER)


def _post(rng: Rng) -> list[Thing]:
    """Upright and slender, and no concrete column: posts, poles, steel columns, trunks."""
    h = float(rng.uniform(1.5, 6.0))
    draw = int(rng.integers(4))
    if draw == 0:
        parts = [box("I", (-0.12, y - 0.008, 0), (0.12, y + 0.008, h), "machine") for y in (-0.12, 0.12)]
        parts.append(box("I", (-0.006, -0.12, 0), (0.006, 0.12, h), "machine"))
        return of_kind([join("Steel column", parts)], OTHER)
    radius = float(rng.uniform(0.04, 0.2))
    material = ("timber", "scaffold_steel", "hoarding")[draw - 1]
    return of_kind([prism("Post", circle(radius, 24 if draw > 1 else 4), 0.0, h, material)], OTHER)


def _panels(rng: Rng) -> list[Thing]:
    """Forms that stand about, and panels stacked flat."""
    e = wall((0.0, 0.0), 0.0, float(rng.uniform(1.2, 6.0)), 0.25, float(rng.uniform(1.2, 3.4)))
    return form(e, rng)


def _steps(rng: Rng) -> list[Thing]:
    """Stairs and footings: concrete, class slab or beam."""
    n, wide = int(rng.integers(1, 9)), float(rng.uniform(0.9, 2.5))
    rows = [slab((0.28 * k, 0.0), (0.28 * n + 0.6, wide), 0.17 * (k + 1), 0.17) for k in range(n)]
    parts = [
        box(
            "Step",
            (e.xy[0] - e.length_m / 2, 0.0, e.z_m),
            (e.xy[0] + e.length_m / 2, wide, e.z_m + 0.17),
            "concrete_slab",
        )
        for e in rows
    ]
    return of_kind([join("Steps", parts)], SLAB)


def _sign(rng: Rng) -> list[Thing]:
    z, w = float(rng.uniform(0.8, 1.8)), float(rng.uniform(0.15, 0.8))
    board = box("Sign", (-w, -0.01, z), (w, 0.01, z + w), str(rng.choice(["red_paint", "helmet_white", "machine"])))
    return of_kind([board, tube("Pole", (0, 0.03, 0), (0, 0.03, z + w), 0.02, "scaffold_steel", 6)], OTHER)


def _target(rng: Rng) -> list[Thing]:
    z = float(rng.uniform(0.8, 1.8))
    disc = tube("Disc", (0, -0.005, z), (0, 0.005, z), 0.15, "red_paint", 48)
    return of_kind([disc, tube("Stand", (0, 0.03, 0), (0, 0.03, z), 0.015, "stand_black", 6)], OTHER)


# most, radius m, least and furthest distance (shares of the reach, metres beyond it), maker
_MAKERS: tuple[tuple[int, float, float, float, Maker], ...] = (
    (6, 0.4, 0.0, 6.0, _people),
    (4, 0.8, 0.0, 6.0, _pallet),
    (3, 0.6, 0.0, 6.0, _barrel),
    (2, 6.0, 0.6, 14.0, _sheet_fence),
    (2, 5.0, 0.6, 10.0, _mesh_fence),
    (3, 3.0, 0.3, 12.0, _masonry),
    (3, 2.5, 0.4, 10.0, _heap),
    (3, 1.5, 0.7, 12.0, _green),
    (2, 4.0, 0.6, 14.0, _container),
    (2, 2.5, 0.2, 5.0, _steel),
    (2, 5.0, 0.3, 6.0, _scaffold),
    (3, 1.6, 0.2, 6.0, _precast),
    (4, 0.4, 0.1, 6.0, _post),
    (3, 3.2, 0.2, 6.0, _panels),
    (1, 2.5, 0.3, 5.0, _steps),
    (3, 0.6, 0.1, 5.0, _sign),
    (1, 0.4, 0.1, 4.0, _target),
    (1, 3.5, 0.5, 12.0, digger),
    (1, 4.0, 0.6, 14.0, lorry),
    (1, 3.0, 0.9, 40.0, crane),
)
