"""Machine-like shapes: a digger, a lorry, a tower crane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from asbuilt_synthetic.meshes import Part, box, join, tube

from asbuilt_training.classes import OTHER
from asbuilt_training.images.things import Thing, of_kind

Rng = np.random.Generator


def digger(rng: Rng) -> list[Thing]:
    """Tracks, a body, a cabin, and an arm in two pieces with a bucket."""
    k = float(rng.uniform(0.5, 1.2))
    knee, tip = np.array([3.4, 0.0, 3.0 + rng.uniform(-0.8, 1.0)]), np.array([5.0, 0.0, rng.uniform(0.6, 2.5)])
    yellow = [
        box("body", (-1.6, -1.2, 0.9), (1.2, 1.2, 1.9), "machine"),
        tube("boom", (0.9, 0.2, 1.5), knee, 0.25, "machine", 4),
        tube("stick", knee, tip, 0.18, "machine", 4),
    ]
    dark = [box("track", (-1.9, s - 0.28, 0), (1.9, s + 0.28, 0.8), "stand_black") for s in (-1.1, 1.1)]
    dark.append(box("bucket", (tip[0] - 0.4, -0.5, tip[2] - 0.5), (tip[0] + 0.3, 0.5, tip[2] + 0.2), "stand_black"))
    cabin = box("cabin", (-0.1, -1.15, 1.9), (1.1, -0.1, 3.0), "glass")
    return of_kind(_scaled([join("Digger", yellow), join("Tracks", dark), cabin], k), OTHER)


def lorry(rng: Rng) -> list[Thing]:
    """A cab, a load bed, box or drum, and wheels."""
    long = float(rng.uniform(2.5, 6.0))
    wheels = [
        tube("wheel", (x, s - 0.15, 0.5), (x, s + 0.15, 0.5), 0.5, "stand_black", 18)
        for x in (-long + 0.8, -long + 1.9, 1.2)
        for s in (-1.0, 1.0)
    ]
    cab = [box("cab", (0.3, -1.2, 0.6), (2.2, 1.2, 2.7), "machine")]
    load = box(
        "bed",
        (-long, -1.2, 0.9),
        (0.1, 1.2, float(rng.uniform(1.3, 3.2))),
        str(rng.choice(["sheet", "machine", "tarpaulin"])),
    )
    pane = box("pane", (2.1, -1.05, 1.7), (2.24, 1.05, 2.5), "glass")
    parts = [join("Wheels", wheels), join("Cab", cab), load, pane]
    return of_kind(_scaled(parts, float(rng.uniform(0.6, 1.1))), OTHER)


def crane(rng: Rng) -> list[Thing]:
    """A lattice mast with its jib and ballast."""
    high, jib, w = float(rng.uniform(16, 40)), float(rng.uniform(15, 40)), float(rng.uniform(0.5, 0.9))
    bars = [tube("leg", (x, y, 0), (x, y, high), 0.09, "machine", 4) for x in (-w, w) for y in (-w, w)]
    corners = [(-w, -w), (w, -w), (w, w), (-w, w)]
    for k, z in enumerate(np.arange(0, high - 2, 2 * w)):
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            first, last = (a, b) if k % 2 else (b, a)
            bars.append(tube("brace", (*first, z), (*last, z + 2 * w), 0.05, "machine", 4))
    for y, z in ((-0.5, high), (0.5, high), (0.0, high + 1.2)):
        bars.append(tube("jib", (-jib / 3, y, z), (jib, y, z), 0.08, "machine", 4))
    for k, x in enumerate(np.arange(-jib / 3, jib - 1.5, 1.5)):
        bars.append(tube("brace", (x, 0.5 * (-1) ** k, high), (x + 1.5, 0, high + 1.2), 0.05, "machine", 4))
    ballast = box("Ballast", (-jib / 3, -0.6, high - 1.5), (-jib / 3 + 2, 0.6, high), "concrete")
    foot = box("Foot", (-2, -2, 0), (2, 2, 0.6), "concrete")
    return of_kind([join("Crane", bars), ballast, foot], OTHER)


def _scaled(parts: list[Part], k: float) -> list[Part]:
    return [replace(p, vertices_m=p.vertices_m * k) for p in parts]
