"""Builds what stands where concrete is not yet: starter bars, rebar cages, and formwork before the design faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_synthetic.building import Building, Element
from asbuilt_synthetic.meshes import Part, box, circle, join, lathe, transform, tube
from asbuilt_synthetic.model import FloatArray
from asbuilt_synthetic.progress import Form, Progress
from asbuilt_synthetic.solids import in_opening

_COVER_M = 0.045


def reinforcement(building: Building, progress: Progress, rng: np.random.Generator) -> list[Part]:
    """Build the bars and forms of every wall and column that is not finished or not yet covered by a slab."""
    slabs = [e for e in building.elements if e.ifc_class == "IfcSlab" and progress.stands(e)]
    out: list[Part] = []
    for e in building.vertical:
        below = any(s.storey == e.storey and (e.storey == 0 or s.zone == e.zone) for s in slabs)
        above = e.storey == 0 and any(s.storey == 1 and s.zone == e.zone for s in slabs)
        if not below:
            continue
        f = progress.fraction[e.global_id]
        top = f * e.height_m
        form = progress.formwork.get(e.global_id)
        if form:
            out += formwork(e, form, rng)
        elif e.global_id in progress.cages:
            out.append(bars(e, 0.0, e.height_m + 0.6, stirrups=True))
        elif f < 1.0 or not above:
            out.append(bars(e, top, top + rng.uniform(0.5, 0.9), stirrups=0 < f < 1))
    return out


def formwork(e: Element, form: Form, rng: np.random.Generator) -> list[Part]:
    """Stand panels with walings before the faces of an absent element; a wall may have only one side closed."""
    material, panel_m = form.material, form.panel_m
    if e.shape == "round":
        r = e.length_m / 2 + panel_m
        rings = [
            lathe("ring", [(r + 0.03, z), (r + 0.03, z + 0.06)], "formwork_steel", 32) for z in (0.2, 1.0, 1.8, 2.6)
        ]
        shell = lathe(f"Form {e.name}", [(r, 0.0), (r, e.height_m)], material, 64)
        return [_at(e, shell), _at(e, join(f"Form rings {e.name}", rings))]
    (x0, x1), h, top = e.x_range_m, e.width_m / 2, e.height_m
    both = e.shape == "rect" or rng.random() < 0.6
    skins, walings = [], []
    for sign in (1, -1) if both else (1,):
        y = sorted((sign * h, sign * (h + panel_m)))
        skins.append(box("ply", (x0, y[0], 0), (x1, y[1], top), material))
        y = sorted((sign * (h + panel_m), sign * (h + panel_m + 0.1)))
        walings += [
            box("waling", (x0 - 0.1, y[0], z), (x1 + 0.1, y[1], z + 0.09), "timber") for z in (0.25, 1.0, 1.75, 2.5)
        ]
        if e.shape == "wall":
            walings += [
                box("soldier", (x - 0.04, y[0], 0.0), (x + 0.04, y[1], top), "timber")
                for x in np.arange(x0 + 0.2, x1, 0.6)
            ]
    if e.shape == "rect":
        for a, b in ((x0 - panel_m, x0), (x1, x1 + panel_m)):
            skins.append(box("ply", (a, -h - panel_m, 0), (b, h + panel_m, top), material))
    return [
        replace(_at(e, join(f"Form {e.name}", skins)), texture_seed=int(rng.integers(1 << 16))),
        _at(e, join(f"Walings {e.name}", walings)),
    ]


def bars(e: Element, low_m: float, high_m: float, *, stirrups: bool) -> Part:
    """Stand the bars of an element between two heights over its base, with stirrups where its cage shows."""
    parts = [tube("bar", (x, y, low_m), (x, y, high_m), 0.008, "rebar", 6) for x, y in _bar_places(e, low_m)]
    if stirrups:
        ring = _ring(e)
        for z in np.arange(low_m + 0.1, high_m - 0.1, 0.2 if e.shape != "wall" else 0.3):
            corners = [(x, y, float(z)) for x, y in ring]
            parts += [
                tube("tie", a, b, 0.005, "rebar", 4)
                for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
                if not _crosses_opening(e, a, b, z)
            ]
    return _at(e, join(f"Bars {e.name}", parts))


def _bar_places(e: Element, low_m: float) -> list[tuple[float, float]]:
    if e.shape == "round":
        return [(float(x), float(y)) for x, y in circle(e.length_m / 2 - _COVER_M, 8)]
    (x0, x1), h = e.x_range_m, e.width_m / 2 - _COVER_M
    if e.shape == "rect":
        xs, ys = np.linspace(x0 + _COVER_M, x1 - _COVER_M, 3), np.linspace(-h, h, 3)
        return [(float(x), float(y)) for x in xs for y in ys if not (x == xs[1] and y == ys[1])]
    xs = np.linspace(x0 + _COVER_M, x1 - _COVER_M, max(2, int((x1 - x0) / 0.22)))
    open_ = in_opening(e, xs - x0, np.full(len(xs), max(low_m - 0.05, 0.02)))
    return [(float(x), y) for x in xs[~open_] for y in (-h, h)]


def _ring(e: Element) -> list[tuple[float, float]]:
    if e.shape == "round":
        return [(float(x), float(y)) for x, y in circle(e.length_m / 2 - _COVER_M + 0.01, 12)]
    (x0, x1), h, c = e.x_range_m, e.width_m / 2 - _COVER_M + 0.01, _COVER_M - 0.01
    return [(x0 + c, -h), (x1 - c, -h), (x1 - c, h), (x0 + c, h)]


def _crosses_opening(e: Element, a: tuple[float, float, float], b: tuple[float, float, float], z: float) -> bool:
    x = np.linspace(a[0], b[0], 40) - e.x_range_m[0]
    return bool(in_opening(e, x, np.full(40, z)).any())


def _at(e: Element, part: Part) -> Part:
    m: FloatArray = e.local_from_element
    return replace(part, vertices_m=transform(m, part.vertices_m))
