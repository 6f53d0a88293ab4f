"""Designs a two-storey concrete building per seed: grid, columns, walls with openings, slabs, its place in world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_synthetic.building import CLEAR_M, SLAB_M, STOREY_M, Building, Element, Ids, Opening
from asbuilt_synthetic.meshes import pose_2d


def design(seed: int) -> Building:
    """Design the building of a seed."""
    rng = np.random.default_rng([seed, 1])
    ids = Ids(seed, "design")
    xs = (0.0, *(round(float(x), 2) for x in np.cumsum(rng.uniform(4.2, 5.2, 3))))
    ys = (0.0, *(round(float(y), 2) for y in np.cumsum(rng.uniform(4.2, 5.2, 2))))
    joint = round(xs[2] + 0.4 * (xs[3] - xs[2]), 2)
    elements = [*_columns(rng, ids, xs, ys), *_walls(rng, ids, xs, ys), *_slabs(ids, xs, ys, joint)]
    far = np.r_[rng.uniform(400, 4000, 2) * rng.choice([-1, 1], 2), rng.uniform(80, 600)]
    place = pose_2d(np.round(far[:2], 3).tolist(), round(float(far[2]), 3), np.deg2rad(round(rng.uniform(17, 40), 2)))
    return Building(
        seed=seed,
        name=f"Block {chr(65 + seed % 26)}",
        world_from_local=place,
        axes_x_m=xs,
        axes_y_m=ys,
        joint_x_m=joint,
        elements=tuple(_without_clashes(elements)),
    )


def _columns(rng: np.random.Generator, ids: Ids, xs: tuple[float, ...], ys: tuple[float, ...]) -> list[Element]:
    shapes = ["rect"] * 5 + ["round"] * 3
    rng.shuffle(shapes)
    out = []
    for i, (row, col) in enumerate([(r, c) for r in (0, 1) for c in range(4)]):
        size = np.round(rng.uniform(0.3, 0.6, 2) / 0.05) * 0.05
        a, b = (float(size[0]), float(size[0])) if shapes[i] == "round" else (float(size[0]), float(size[1]))
        for storey in (0, 1):
            name = f"Column {'AB'[row]}{col + 1}/{['GF', '1F'][storey]}"
            out.append(
                Element(
                    global_id=ids.of(name),
                    ifc_class="IfcColumn",
                    shape=shapes[i],
                    name=name,
                    storey=storey,
                    zone=int(col == 3),
                    xy=(xs[col], ys[row]),
                    z_m=storey * STOREY_M,
                    angle_rad=0.0,
                    length_m=a,
                    width_m=b,
                    height_m=CLEAR_M,
                )
            )
    return out


def _walls(rng: np.random.Generator, ids: Ids, xs: tuple[float, ...], ys: tuple[float, ...]) -> list[Element]:
    """Lay out the walls of each storey: a back wall in two touching pieces, a corner, free ones, one with a door."""
    out: list[Element] = []
    for storey in (0, 1):
        t = [float(v) for v in rng.choice([0.2, 0.24, 0.25, 0.3], 6)]
        t[1] = t[0]  # the collinear pair has one thickness
        back, mid = ys[2], ys[1]
        bay = xs[3] - xs[2]
        x_free = xs[0] + rng.uniform(0.9, 1.3)
        y_free = mid - rng.uniform(1.6, 2.2) if storey == 0 else mid + rng.uniform(1.4, 1.8)
        x_core = xs[2] + rng.uniform(0.55, 0.7) * bay
        runs = [  # letter, zone, start, angle, length, thickness
            ("back west", 0, (xs[0] - 0.15, back), 0.0, xs[1] - xs[0] + 0.15, t[0]),
            ("back east", 0, (xs[1], back), 0.0, xs[2] - xs[1], t[1]),
            ("side west", 0, (xs[0], back - t[0] / 2), -np.pi / 2, rng.uniform(2.2, 3.0), t[2]),
            ("free", 0, (x_free, y_free), 0.0, rng.uniform(1.8, 2.8), t[3]),
            ("core", 1, (x_core, mid + rng.uniform(0.9, 1.3)), np.pi / 2, rng.uniform(2.4, 3.0), t[4]),
            ("front", 1, (xs[2], ys[0]), 0.0, xs[3] - xs[2], t[5]),
        ]
        for k, (title, zone, start, angle, length, thick) in enumerate(runs):
            name = f"Wall {k + 1:02d} {title}/{['GF', '1F'][storey]}"
            length = round(float(length), 3)
            kinds = {"back east": "window", "front": "door", "back west": "window" if storey else ""}
            out.append(
                Element(
                    global_id=ids.of(name),
                    ifc_class="IfcWall",
                    shape="wall",
                    name=name,
                    storey=storey,
                    zone=zone,
                    xy=(round(float(start[0]), 3), round(float(start[1]), 3)),
                    z_m=storey * STOREY_M,
                    angle_rad=float(angle),
                    length_m=length,
                    width_m=thick,
                    height_m=CLEAR_M,
                    openings=_openings(rng, ids, name, kinds.get(title, ""), length),
                )
            )
    return out


def _openings(rng: np.random.Generator, ids: Ids, name: str, kind: str, length: float) -> tuple[Opening, ...]:
    if not kind:
        return ()
    width = float(rng.choice([1.0, 1.1])) if kind == "door" else float(rng.choice([1.2, 1.5, 1.8]))
    sill, height = (0.0, 2.1) if kind == "door" else (0.9, float(rng.choice([1.2, 1.35])))
    start = round(float(rng.uniform(0.9, length - width - 0.9)), 2)
    return (
        Opening(
            global_id=ids.of(name + " opening"), kind=kind, start_m=start, width_m=width, sill_m=sill, height_m=height
        ),
    )


def _slabs(ids: Ids, xs: tuple[float, ...], ys: tuple[float, ...], joint: float) -> list[Element]:
    x0, x1, y0, y1 = xs[0] - 0.45, xs[3] + 0.45, ys[0] - 0.45, ys[2] + 0.45
    pieces = [
        ("Ground slab", 0, 0, x0, x1, 0.0),
        ("First-floor slab west", 1, 0, x0, joint, STOREY_M),
        ("First-floor slab east", 1, 1, joint, x1, STOREY_M),
    ]
    return [
        Element(
            global_id=ids.of(name),
            ifc_class="IfcSlab",
            shape="slab",
            name=name,
            storey=storey,
            zone=zone,
            xy=(round((a + b) / 2, 3), round((y0 + y1) / 2, 3)),
            z_m=round(top - SLAB_M, 3),
            angle_rad=0.0,
            length_m=round(b - a, 3),
            width_m=round(y1 - y0, 3),
            height_m=SLAB_M,
        )
        for name, storey, zone, a, b, top in pieces
    ]


def _without_clashes(elements: list[Element]) -> list[Element]:
    """Shorten the front walls so that they stop at the faces of the columns they stand between."""
    out = []
    for e in elements:
        if "front" in e.name:
            ends = []
            for x in (e.xy[0], e.xy[0] + e.length_m):
                c = next(
                    c
                    for c in elements
                    if c.shape in ("rect", "round")
                    and c.storey == e.storey
                    and abs(c.xy[0] - x) < 1e-6
                    and abs(c.xy[1] - e.xy[1]) < 1e-6
                )
                ends.append(c.length_m / 2 + (0.0 if c.shape == "rect" else 0.25))
            e = _shortened(e, ends[0], ends[1])
        out.append(e)
    return out


def _shortened(e: Element, start_m: float, end_m: float) -> Element:
    length = round(e.length_m - start_m - end_m, 3)
    holes = tuple(
        replace(o, start_m=round(float(np.clip(o.start_m - start_m, 0.5, length - o.width_m - 0.5)), 2))
        for o in e.openings
    )
    return replace(e, xy=(round(e.xy[0] + start_m, 3), e.xy[1]), length_m=length, openings=holes)
