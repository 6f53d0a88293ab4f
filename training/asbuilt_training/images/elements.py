"""Makes design elements anywhere, and what stands of them: concrete, starter bars, forms, paper tags."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from asbuilt_synthetic.building import Element, Opening
from asbuilt_synthetic.meshes import Part, box, join, pose_2d, transform
from asbuilt_synthetic.reinforcement import bars, formwork
from asbuilt_synthetic.solids import poured

from asbuilt_training.classes import COLUMN, FORMWORK, OTHER, SLAB, WALL
from asbuilt_training.images.things import Thing, of_kind

Rng = np.random.Generator
WIDEST_COLUMN_M = 1.0  # what is wider is a wall to those who measure


def wall(
    xy: tuple[float, float],
    angle_rad: float,
    length_m: float,
    thick_m: float,
    height_m: float,
    z_m: float = 0.0,
    openings: tuple[Opening, ...] = (),
) -> Element:
    """Make a wall that starts at xy and runs along the angle."""
    return _element("IfcWall", "wall", xy, z_m, angle_rad, (length_m, thick_m, height_m), openings)  # fmt: skip


def column(
    xy: tuple[float, float], angle_rad: float, size_m: tuple[float, float], height_m: float, z_m: float = 0.0
) -> Element:
    """Make a column of two sides about xy; a second side of 0 makes it round."""
    shape = "rect" if size_m[1] else "round"
    return _element("IfcColumn", shape, xy, z_m, angle_rad, (size_m[0], size_m[1] or size_m[0], height_m))


def slab(low: tuple[float, float], high: tuple[float, float], top_m: float, thick_m: float) -> Element:
    """Make a slab or a beam between two corners."""
    middle = ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2)
    return _element("IfcSlab", "slab", middle, top_m - thick_m, 0.0, (high[0] - low[0], high[1] - low[1], thick_m))


def a_column(xy: tuple[float, float], height_m: float, rng: Rng, z_m: float = 0.0, angle_rad: float = 0.0) -> Element:
    """Draw a column's section."""
    a, b = rng.uniform(0.2, 0.75, 2) if rng.random() < 0.85 else rng.uniform(0.5, WIDEST_COLUMN_M, 2)
    b = 0.0 if rng.random() < 0.35 else (a if rng.random() < 0.4 else b)
    return column(xy, angle_rad, (float(a), float(b)), height_m, z_m)


def some_openings(length_m: float, height_m: float, rng: Rng) -> tuple[Opening, ...]:
    """Draw doors and windows that leave piers between; none in short or low walls."""
    if length_m < 2.6 or height_m < 2.3 or rng.random() < 0.45:
        return ()
    out: list[Opening] = []
    x = float(rng.uniform(0.4, 1.6))
    while x + 1.2 < length_m and len(out) < 4:
        width = float(rng.uniform(0.8, min(2.4, length_m - x - 0.4)))
        is_door = rng.random() < 0.4
        sill = 0.0 if is_door else float(rng.uniform(0.5, 1.2))
        tall = float(rng.uniform(1.9, 2.15)) if is_door else float(rng.uniform(0.6, height_m - sill - 0.3))
        kind = "door" if is_door else "window"
        out.append(Opening(global_id="", kind=kind, start_m=x, width_m=width, sill_m=sill, height_m=tall))
        x += width + float(rng.uniform(0.5, 3.0))
    return tuple(o for o in out if o.start_m + o.width_m < length_m - 0.3)


def erect(e: Element, fraction: float, number: int, rng: Rng, finished: bool = False) -> list[Thing]:
    """Stand an element up to a share of its height; 0 leaves its cage or its forms. `finished`: nothing sticks out."""
    if fraction <= 0:
        if rng.random() < 0.5:
            return form(e, rng)
        return of_kind([bars(e, 0.0, e.height_m + 0.5, stirrups=True)], OTHER)
    kind = {"IfcWall": WALL, "IfcColumn": COLUMN, "IfcSlab": SLAB}[e.ifc_class]
    top = fraction * e.height_m
    out = [Thing(part=poured(e, top, -1, number), kind=kind, instance=number)]
    if kind != SLAB:
        if not finished and rng.random() < 0.55:
            out += of_kind([bars(e, top, top + float(rng.uniform(0.3, 1.2)), stirrups=fraction < 1)], OTHER)
        if kind == WALL and fraction == 1 and rng.random() < 0.12:
            out += form(e, rng)
        if rng.random() < 0.12 and top > 1.2:
            out += [Thing(part=p, kind=kind, instance=number) for p in _tag(e, top, rng)]
    return out


def form(e: Element, rng: Rng) -> list[Thing]:
    """Stand the forms of an element: of timber, or framed panels with ribs behind."""
    material = str(rng.choice(["formwork_ply", "formwork_steel"]))
    if e.shape != "wall" or rng.random() < 0.5:
        return of_kind(formwork(e, material, rng), FORMWORK)
    skins, ribs = [], []
    (x0, x1), h = e.x_range_m, e.width_m / 2
    pitch, depth = float(rng.choice([0.3, 0.45, 0.6, 0.9])), float(rng.uniform(0.08, 0.14))
    for sign in (1, -1) if rng.random() < 0.5 else (int(rng.choice([1, -1])),):
        y = sorted((sign * h, sign * (h + 0.02)))
        skins.append(box("skin", (x0, y[0], 0), (x1, y[1], e.height_m + 0.1), "formwork_ply"))
        y = sorted((sign * (h + 0.02), sign * (h + depth)))
        for x in np.arange(x0, x1 + 0.05, pitch):
            ribs.append(box("rib", (x - 0.02, y[0], 0), (x + 0.02, y[1], e.height_m + 0.1), material))
        for z in np.arange(0.05, e.height_m, float(rng.choice([0.45, 0.6, 0.9]))):
            ribs.append(box("rib", (x0, y[0], z - 0.02), (x1, y[1], z + 0.02), material))
    parts = [join("Form skin", skins), join("Form ribs", ribs)]
    return of_kind([replace(p, vertices_m=transform(e.local_from_element, p.vertices_m)) for p in parts], FORMWORK)


def turned(things: list[Thing], xy: tuple[float, float], z_m: float, angle_rad: float) -> list[Thing]:
    """Turn things about z and shift them."""
    return [replace(t, part=t.part.moved(xy, z_m, angle_rad)) for t in things]


def _tag(e: Element, top_m: float, rng: Rng) -> list[Part]:
    """Paste a paper with black squares on a flat face: it is of the face it is on."""
    size = float(rng.uniform(0.12, 0.3))
    (x0, x1), h = e.x_range_m, e.width_m / 2
    if e.shape == "round" or x1 - x0 < size + 0.1:
        return []
    x, z = rng.uniform(x0 + 0.02, x1 - size - 0.02), rng.uniform(0.4, top_m - size)
    if any(o.start_m - size < x < o.start_m + o.width_m for o in e.openings):
        return []
    sign = int(rng.choice([1, -1]))
    paper = [sorted((sign * (h + a), sign * (h + b))) for a, b in ((0.001, 0.004), (0.004, 0.006))]
    parts = [box("Paper", (x, paper[0][0], z), (x + size, paper[0][1], z + size), "helmet_white")]
    cell = size / 10
    black = []
    for i, j in product(range(8), range(8)):
        if i in (0, 7) or j in (0, 7) or rng.random() < 0.5:
            low = (x + cell * (1 + i), paper[1][0], z + cell * (1 + j))
            high = (x + cell * (2 + i), paper[1][1], z + cell * (2 + j))
            black.append(box("ink", low, high, "stand_black"))
    parts.append(join("Ink", black))
    return [replace(p, vertices_m=transform(pose_2d(e.xy, e.z_m, e.angle_rad), p.vertices_m)) for p in parts]


def _element(
    ifc_class: str,
    shape: str,
    xy: tuple[float, float],
    z_m: float,
    angle_rad: float,
    size_m: tuple[float, float, float],
    openings: tuple[Opening, ...] = (),
) -> Element:
    return Element(
        global_id=ifc_class, ifc_class=ifc_class, shape=shape, name=ifc_class, storey=0, zone=0, xy=xy, z_m=z_m,
        angle_rad=angle_rad, length_m=size_m[0], width_m=size_m[1], height_m=size_m[2], openings=openings,
    )  # fmt: skip
