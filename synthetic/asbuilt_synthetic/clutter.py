"""Strews a site with what stands about: props, guard rails, scaffold, pallets, barrels, signs, people."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from asbuilt_synthetic.building import SLAB_M, STOREY_M, Building
from asbuilt_synthetic.meshes import Part, box, join, lathe, tube
from asbuilt_synthetic.people import person
from asbuilt_synthetic.progress import Progress

GROUND_Z_M = -0.12


class Plan:
    """Knows where a thing of some radius can stand: clear of the design's elements and of each other."""

    def __init__(self, building: Building) -> None:
        self._boxes = [e.footprint_m for e in building.vertical]
        self._round: list[tuple[float, float, float]] = []
        xs, ys = building.axes_x_m, building.axes_y_m
        self.inside = ((xs[0] - 0.4, ys[0] - 0.4), (xs[3] + 0.4, ys[2] + 0.4))

    def is_free(self, x: float, y: float, radius_m: float) -> bool:
        """Tell whether a disc clears every footprint and every thing placed before."""
        for x0, y0, x1, y1 in self._boxes:
            dx, dy = max(x0 - x, x - x1, 0.0), max(y0 - y, y - y1, 0.0)
            if np.hypot(dx, dy) < radius_m:
                return False
        return all(np.hypot(x - a, y - b) > radius_m + r for a, b, r in self._round)

    def take(self, x: float, y: float, radius_m: float) -> None:
        """Note that a disc is taken."""
        self._round.append((x, y, radius_m))

    def is_inside(self, x: float, y: float) -> bool:
        """Tell whether a place lies on the building's slabs."""
        (x0, y0), (x1, y1) = self.inside
        return bool(x0 < x < x1 and y0 < y < y1)

    def floor_m(self, x: float, y: float) -> float:
        """Return the height of the ground or ground slab at a place."""
        return 0.0 if self.is_inside(x, y) else GROUND_Z_M

    def place(self, rng: np.random.Generator, radius_m: float, margin_m: float) -> tuple[float, float] | None:
        """Find a free place within a margin of the building, or None."""
        (x0, y0), (x1, y1) = self.inside
        for _ in range(60):
            x, y = rng.uniform(x0 - margin_m, x1 + margin_m), rng.uniform(y0 - margin_m, y1 + margin_m)
            if self.is_free(x, y, radius_m):
                self.take(x, y, radius_m)
                return float(x), float(y)
        return None


def clutter(building: Building, progress: Progress, plan: Plan, rng: np.random.Generator) -> list[Part]:
    """Build the loose things of one visit."""
    out = _props(building, progress, plan) + _guard_rails(building, progress) + _scaffold(building, progress, rng)
    makers: list[tuple[int, float, float, Callable[[np.random.Generator], list[Part]]]] = [
        (4, 0.75, 7.0, pallet),
        (2, 0.45, 6.0, barrel),
        (2, 0.5, 6.0, barrier),
        (1, 0.35, 3.0, _extinguisher),
        (2, 1.4, 7.0, timber_stack),
        (3, 0.4, 5.0, person),
        (1, 0.5, 5.0, red_sign),
    ]
    for count, radius, margin, make in makers:
        for _ in range(count):
            at = plan.place(rng, radius, margin)
            if at is not None:
                angle = float(rng.uniform(0, 2 * np.pi))
                out += [p.moved(at, plan.floor_m(*at), angle) for p in make(rng)]
    return out


def _props(building: Building, progress: Progress, plan: Plan) -> list[Part]:
    """Stand steel props under a slab poured at this very visit."""
    bars = []
    for s in building.elements:
        if s.ifc_class != "IfcSlab" or s.storey == 0 or progress.visit != 1 + s.zone:
            continue
        nx, ny = int(s.length_m / 2.6), int(s.width_m / 2.6)
        for x in s.xy[0] + (np.arange(nx) - (nx - 1) / 2) * 2.6:
            for y in s.xy[1] + (np.arange(ny) - (ny - 1) / 2) * 2.6:
                if plan.is_free(float(x), float(y), 0.25):
                    plan.take(float(x), float(y), 0.1)
                    top = STOREY_M - SLAB_M
                    bars += [
                        tube("prop", (x, y, 0.01), (x, y, 1.7), 0.03, "scaffold_steel"),
                        tube("prop", (x, y, 1.7), (x, y, top - 0.1), 0.024, "scaffold_steel"),
                        box("foot", (x - 0.07, y - 0.07, 0), (x + 0.07, y + 0.07, 0.01), "scaffold_steel"),
                        box("head", (x - 0.07, y - 0.07, top - 0.1), (x + 0.07, y + 0.07, top), "scaffold_steel"),
                    ]
    return [join("Props", bars)] if bars else []


def _guard_rails(building: Building, progress: Progress) -> list[Part]:
    posts, rails = [], []
    for s in building.elements:
        if s.ifc_class != "IfcSlab" or s.storey == 0 or not progress.stands(s):
            continue
        x0, x1 = s.xy[0] - s.length_m / 2 + 0.06, s.xy[0] + s.length_m / 2 - 0.06
        y0, y1 = s.xy[1] - s.width_m / 2 + 0.06, s.xy[1] + s.width_m / 2 - 0.06
        ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        for k, (a, b) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)):
            if k == (1 if s.zone == 0 else 3) and progress.visit >= 2:
                continue  # no rail along the joint once both slabs are there
            n = max(2, round(np.hypot(b[0] - a[0], b[1] - a[1]) / 2.2))
            places = [np.array(a) + (np.array(b) - a) * t for t in np.linspace(0, 1, n + 1)]
            posts += [tube("post", (*p, STOREY_M), (*p, STOREY_M + 1.1), 0.02, "scaffold_steel") for p in places[:-1]]
            for z in (0.1, 0.55, 1.03):
                low = np.minimum(a, b) - 0.012
                high = np.maximum(a, b) + 0.012
                rails.append(box("rail", (*low, STOREY_M + z - 0.06), (*high, STOREY_M + z + 0.06), "timber"))
    return [join("Rail posts", posts), join("Rails", rails)] if posts else []


def _scaffold(building: Building, progress: Progress, rng: np.random.Generator) -> list[Part]:
    """Stand a two-row tube scaffold along a part of one long side, the same side at every visit."""
    pick = np.random.default_rng([building.seed, 5])
    xs, ys = building.axes_x_m, building.axes_y_m
    behind = pick.random() < 0.5
    y_in = ys[2] + 0.75 if behind else ys[0] - 0.85
    x0 = float(pick.uniform(xs[0], xs[2]))
    n = int(pick.integers(2, 4))
    top = 4.1 if progress.visit == 0 else 6.2
    out = []
    rows = (y_in, y_in + (0.9 if behind else -0.9))
    for i in range(n + 1):
        x = x0 + 2.0 * i
        out += [tube("standard", (x, y, GROUND_Z_M), (x, y, top), 0.024, "scaffold_steel", 8) for y in rows]
        out += [tube("transom", (x, rows[0], z), (x, rows[1], z), 0.024, "scaffold_steel", 8) for z in (1.9, 3.9)]
    for z in (1.9, 2.9, 3.9, 4.9):
        if z < top:
            out += [tube("ledger", (x0, y, z), (x0 + 2.0 * n, y, z), 0.024, "scaffold_steel", 8) for y in rows]
    low, high = min(rows), max(rows)
    deck = [box("deck", (x0, low, z + 0.03), (x0 + 2.0 * n, high, z + 0.07), "timber") for z in (1.9, 3.9) if z < top]
    return [join("Scaffold", out), join("Scaffold deck", deck)]


def pallet(rng: np.random.Generator) -> list[Part]:
    boards = [box("b", (-0.6, y, 0.1), (0.6, y + 0.1, 0.14), "timber") for y in (-0.4, -0.22, -0.05, 0.12, 0.3)]
    boards += [box("k", (x, -0.4, 0), (x + 0.1, 0.4, 0.1), "timber") for x in (-0.6, -0.05, 0.5)]
    load = float(rng.uniform(0.3, 0.9))
    material = str(rng.choice(["brick", "tarpaulin", "concrete_slab"]))
    seed = int(rng.integers(1 << 16))
    return [join("Pallet", boards), box("Load", (-0.55, -0.38, 0.14), (0.55, 0.38, 0.14 + load), material, seed)]


def barrel(rng: np.random.Generator) -> list[Part]:
    profile = [(0.28, 0.0), (0.29, 0.28), (0.28, 0.3), (0.29, 0.58), (0.28, 0.6), (0.285, 0.87)]
    material = "red_paint" if rng.random() < 0.7 else "tarpaulin"
    return [lathe("Barrel", profile, material, 32)]


def barrier(rng: np.random.Generator) -> list[Part]:
    red: list[Part] = []
    white: list[Part] = []
    for i in range(8):
        part = box("stripe", (-1.0 + 0.25 * i, -0.015, 0.85), (-0.75 + 0.25 * i, 0.015, 1.0), "red_paint")
        (red if i % 2 else white).append(part)
    legs = [tube("leg", (x, y, 0), (x, 0, 0.95), 0.02, "stand_black") for x in (-0.8, 0.8) for y in (-0.3, 0.3)]
    return [join("Barrier red", red), join("Barrier white", white, "helmet_white"), join("Barrier legs", legs)]


def _extinguisher(rng: np.random.Generator) -> list[Part]:
    profile = [(0.08, 0.0), (0.085, 0.05), (0.085, 0.45), (0.05, 0.52), (0.025, 0.58)]
    return [
        lathe("Extinguisher", profile, "red_paint", 24),
        tube("Hose", (0.03, 0, 0.55), (0.1, 0, 0.2), 0.01, "stand_black"),
    ]


def timber_stack(rng: np.random.Generator) -> list[Part]:
    rows = [
        box(
            "beam",
            (-1.25 + rng.normal(0, 0.04), -0.45 + 0.16 * j, 0.08 * i),
            (1.25 + rng.normal(0, 0.04), -0.31 + 0.16 * j, 0.075 + 0.08 * i),
            "timber",
        )
        for i in range(int(rng.integers(3, 7)))
        for j in range(6)
    ]
    return [replace(join("Timber", rows), texture_seed=int(rng.integers(1 << 16)))]


def red_sign(rng: np.random.Generator) -> list[Part]:
    z = float(rng.uniform(1.1, 1.5))
    return [
        box("Sign", (-0.25, -0.01, z - 0.18), (0.25, 0.01, z + 0.18), "red_paint"),
        tube("Sign post", (0, 0.02, 0), (0, 0.02, z + 0.1), 0.015, "stand_black"),
    ]
