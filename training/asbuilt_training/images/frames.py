"""Big sites: frames of several storeys with cores, part walled, the top one under way; as fixed cameras see them."""

from __future__ import annotations

from itertools import count, pairwise

import numpy as np
from asbuilt_synthetic.meshes import Part, box, join, tube

from asbuilt_training.classes import BACKGROUND, FORMWORK, OTHER
from asbuilt_training.images.elements import a_column, column, erect, slab, some_openings, wall
from asbuilt_training.images.things import Thing, of_kind

Rng = np.random.Generator


def frame(rng: Rng) -> list[Thing]:
    """Build a frame of one to five storeys; what is below the top storey is complete."""
    number = count(1)
    xs = np.cumsum(np.r_[0, rng.uniform(3.5, 8, int(rng.integers(1, 5)))])
    ys = np.cumsum(np.r_[0, rng.uniform(3.5, 8, int(rng.integers(1, 4)))])
    h, t = float(rng.uniform(2.6, 3.8)), float(rng.uniform(0.2, 0.35))
    storeys = int(rng.choice([1, 1, 2, 2, 3, 4, 5]))
    over = float(rng.uniform(0.1, 1.2))
    core = (int(rng.integers(len(xs) - 1)), int(rng.integers(len(ys) - 1)))
    walled = rng.random((len(xs) + len(ys), 2)) < 0.25
    like = a_column((0, 0), h - t, rng)
    out = erect(slab((-over, -over), (float(xs[-1]) + over, float(ys[-1]) + over), 0.07, 0.3), 1.0, 0, rng)
    for s in range(storeys):
        z, top = s * h, s == storeys - 1
        done = 1.0 if not top else float(rng.uniform(0.2, 1.0))
        out += _storey(
            xs, ys, z, h - t, like.length_m, like.width_m if like.shape == "rect" else 0.0, done, number, rng
        )
        out += _core(xs, ys, core, z, h if not top else h * float(rng.uniform(0.6, 1.6)), number, rng)
        out += _edge_walls(xs, ys, walled, z, h - t, done, number, rng)
        if not top or (done > 0.7 and rng.random() < 0.5):
            corner = (float(xs[-1]) + over, float(ys[-1]) + over)
            out += erect(slab((-over, -over), corner, z + h, t), 1.0, 0, rng)
            out += of_kind(_rails(corner, over, z + h, rng), OTHER)
            if top or (s == storeys - 2 and rng.random() < 0.6):
                out += of_kind(props(xs, ys, z, h - t, rng), OTHER)
        elif rng.random() < 0.35:
            out += _deck(xs, ys, z, h - t, rng)
    if storeys > 1 and rng.random() < 0.4:
        out += _infill(xs, ys, storeys, h, t, rng)
    return out


def _storey(
    xs: np.ndarray, ys: np.ndarray, z: float, h: float, a: float, b: float, done: float, number: count[int], rng: Rng
) -> list[Thing]:
    out: list[Thing] = []
    for x in xs:
        for y in ys:
            share = 1.0 if rng.random() < done else float(rng.choice([0.0, 0.0, rng.uniform(0.2, 0.9)]))
            if share or rng.random() < 0.6:
                e = column((float(x), float(y)), 0.0, (a, b), h, z)
                out += erect(e, share, next(number), rng, finished=done == 1)
    return out


def _core(
    xs: np.ndarray, ys: np.ndarray, core: tuple[int, int], z: float, h: float, number: count[int], rng: Rng
) -> list[Thing]:
    """Stand the four walls of the core in its bay; one has a door."""
    x0, x1 = float(xs[core[0]]) + 0.8, float(xs[core[0] + 1]) - 0.8
    y0, y1 = float(ys[core[1]]) + 0.8, float(ys[core[1] + 1]) - 0.8
    t = 0.25
    out: list[Thing] = []
    for k, (xy, angle, length) in enumerate((
        ((x0, y0), 0.0, x1 - x0), ((x0, y1), 0.0, x1 - x0), ((x0, y0 + t / 2), np.pi / 2, y1 - y0 - t),
        ((x1, y0 + t / 2), np.pi / 2, y1 - y0 - t),
    )):  # fmt: skip
        openings = some_openings(length, min(h, 2.6), rng) if k == 0 else ()
        out += erect(wall(xy, angle, length, t, h, z, openings), 1.0, next(number), rng)
    return out


def _edge_walls(
    xs: np.ndarray, ys: np.ndarray, walled: np.ndarray, z: float, h: float, done: float, number: count[int], rng: Rng
) -> list[Thing]:
    """Fill the edge bays that are walls by design, between the columns."""
    out: list[Thing] = []
    bays = [((float(a) + 0.55, float(ys[s])), 0.0, float(b - a) - 1.1, walled[i, k])
            for k, s in enumerate((0, -1)) for i, (a, b) in enumerate(pairwise(xs))]  # fmt: skip
    bays += [((float(xs[s]), float(a) + 0.55), np.pi / 2, float(b - a) - 1.1, walled[len(xs) + i, k])
             for k, s in enumerate((0, -1)) for i, (a, b) in enumerate(pairwise(ys))]  # fmt: skip
    for xy, angle, length, is_wall in bays:
        if is_wall and length > 1.1:
            share = 1.0 if rng.random() < done else float(rng.choice([0.0, rng.uniform(0.2, 0.9)]))
            e = wall(xy, angle, length, 0.22, h, z, some_openings(length, h, rng))
            out += erect(e, share, next(number), rng, finished=done == 1)
    return out


def _infill(xs: np.ndarray, ys: np.ndarray, storeys: int, h: float, t: float, rng: Rng) -> list[Thing]:
    """Brick up some bays of the lower storeys: masonry is no concrete."""
    out: list[Part] = []
    material = str(rng.choice(["brick", "blocks", "plaster"]))
    for s in range(storeys - 1):
        for k, y in enumerate((float(ys[0]), float(ys[-1]))):
            for a, b in pairwise(xs):
                if rng.random() < 0.4:
                    away = 0.12 if k else -0.12
                    low, high = sorted((y + away, y + 3 * away))
                    top = s * h + (h - t) * float(rng.choice([1.0, 0.4]))
                    out.append(box("Infill", (float(a) + 0.3, low, s * h), (float(b) - 0.3, high, top), material))
    return of_kind(out, BACKGROUND)


def props(xs: np.ndarray, ys: np.ndarray, z: float, h: float, rng: Rng) -> list[Part]:
    """Stand steel props in rows under a slab or a deck."""
    step = float(rng.uniform(1.2, 2.6))
    bars = [
        tube("prop", (x, y, z), (x, y, z + h), 0.03, "scaffold_steel", 6)
        for x in np.arange(xs[0] + 0.5, xs[-1], step)
        for y in np.arange(ys[0] + 0.5, ys[-1], step)
    ]
    return [join("Props", bars)] if bars else []


def _deck(xs: np.ndarray, ys: np.ndarray, z: float, h: float, rng: Rng) -> list[Thing]:
    """Lay the deck that the next slab will be cast on, over a part of the storey."""
    x1 = float(xs[int(rng.integers(1, len(xs)))])
    sheet = [box("deck", (float(xs[0]), float(ys[0]), z + h - 0.02), (x1, float(ys[-1]), z + h), "formwork_ply")]
    beams = [
        box("beam", (float(xs[0]), y, z + h - 0.22), (x1, y + 0.08, z + h - 0.02), "timber")
        for y in np.arange(ys[0], ys[-1], 0.6)
    ]
    out = of_kind([join("Deck", sheet), join("Deck beams", beams)], FORMWORK)
    return out + of_kind(props(np.array([xs[0], x1]), ys, z, h - 0.22, rng), OTHER)


def _rails(corner: tuple[float, float], over: float, z: float, rng: Rng) -> list[Part]:
    if rng.random() < 0.4:
        return []
    ring = [(-over, -over), (corner[0], -over), corner, (-over, corner[1])]
    rails, posts = [], []
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        for up in (0.5, 1.0):
            rails.append(tube("rail", (*a, z + up), (*b, z + up), 0.025, "timber", 4))
        n = max(2, int(np.hypot(b[0] - a[0], b[1] - a[1]) / 2))
        for w in np.linspace(0, 1, n, endpoint=False):
            x, y = a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1])
            posts.append(tube("post", (x, y, z), (x, y, z + 1.1), 0.02, "scaffold_steel", 4))
    return [join("Rails", rails), join("Rail posts", posts)]
