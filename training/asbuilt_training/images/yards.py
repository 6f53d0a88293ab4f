"""Yards: small layouts of walls and columns, from single specimens to shafts, rooms and retaining walls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count, pairwise

import numpy as np
from asbuilt_synthetic.meshes import box

from asbuilt_training.classes import BACKGROUND
from asbuilt_training.images.elements import a_column, erect, slab, some_openings, turned, wall
from asbuilt_training.images.frames import frame
from asbuilt_training.images.loose import strewn
from asbuilt_training.images.surroundings import surroundings
from asbuilt_training.images.things import Place, Thing, numbered, of_kind

Rng = np.random.Generator


def yard_place(rng: Rng) -> Place:
    """Draw a layout, turn it anyhow, strew things about it and build its surroundings."""
    layouts: list[tuple[float, Callable[[Rng], list[Thing]]]] = [
        (0.26, _specimens), (0.12, _row), (0.14, _room), (0.12, _shaft), (0.12, _retaining), (0.24, frame),
    ]  # fmt: skip
    make = layouts[int(rng.choice(len(layouts), p=[p for p, _ in layouts]))][1]
    things = turned(make(rng), (0.0, 0.0), 0.0, float(rng.uniform(0, 2 * np.pi)))
    points = np.concatenate([t.part.vertices_m for t in things])[:, :2]
    centre = (points.min(0) + points.max(0)) / 2
    reach = float(np.hypot(*np.ptp(points, axis=0)) / 2)
    things += strewn(things, centre, reach, rng)
    things += surroundings(centre, reach + float(rng.uniform(4, 12)), 0.0, rng)
    return Place(source="yard", things=numbered(things))


def _poured(rng: Rng) -> float:
    """Draw how far an element is: mostly whole, sometimes part, sometimes only bars or forms."""
    draw = rng.random()
    return 1.0 if draw < 0.7 else float(rng.uniform(0.15, 0.9)) if draw < 0.88 else 0.0


def _specimens(rng: Rng) -> list[Thing]:
    """Walls, L-walls and columns standing free, as in a testing yard."""
    out: list[Thing] = []
    number = count(1)
    side = float(rng.uniform(2.5, 7.0))
    for i in range(int(rng.integers(1, 4))):
        for j in range(int(rng.integers(1, 4))):
            xy = (side * i + float(rng.normal(0, 0.2 * side)), side * j + float(rng.normal(0, 0.2 * side)))
            angle = float(rng.choice([0.0, np.pi / 2]) + rng.normal(0, 0.3))
            h = float(rng.uniform(0.5, 4.2))
            if rng.random() < 0.45:
                out += erect(a_column(xy, h, rng, angle_rad=angle), _poured(rng), next(number), rng)
                continue
            length, thick = float(rng.uniform(1.1, min(6.0, side))), float(rng.uniform(0.12, 0.5))
            e = wall(xy, angle, length, thick, h, 0.0, some_openings(length, h, rng))
            out += erect(e, _poured(rng), next(number), rng)
            if rng.random() < 0.35:
                c, s = np.cos(angle), np.sin(angle)
                corner = (xy[0] - s * thick / 2, xy[1] + c * thick / 2)
                e = wall(corner, angle + np.pi / 2, float(rng.uniform(1.1, 4.0)), thick, h)
                out += turned(erect(e, _poured(rng), next(number), rng), (c * thick / 2, s * thick / 2), 0.0, 0.0)
    if rng.random() < 0.5:
        xs = float(side * 3.5)
        out += erect(slab((-side, -side), (xs, xs), 0.07, 0.3), 1.0, 0, rng)
    return out


def _row(rng: Rng) -> list[Thing]:
    """Columns in a row or two, perhaps with a beam, a slab or a wall between."""
    out: list[Thing] = []
    number = count(1)
    n, step, rows = int(rng.integers(2, 7)), float(rng.uniform(1.8, 6.5)), int(rng.integers(1, 3))
    h = float(rng.uniform(2.0, 5.5))
    like = a_column((0.0, 0.0), h, rng)
    covered = rng.random() < 0.45
    for j in range(rows):
        for i in range(n):
            e = type(like)(**{**{f: getattr(like, f) for f in like.__slots__}, "xy": (i * step, j * step)})
            out += erect(e, 1.0 if covered else _poured(rng), next(number), rng, finished=covered)
            if i and rng.random() < 0.3:
                gap = like.length_m / 2 + 0.01
                length = step - 2 * gap
                low = float(h if rng.random() < 0.5 else rng.uniform(0.5, h))
                if length > 1.1:
                    e = wall(
                        ((i - 1) * step + gap, j * step), 0.0, length, 0.2, low, 0.0, some_openings(length, low, rng)
                    )
                    out += erect(e, _poured(rng), next(number), rng, finished=covered)
    if covered:
        deep = float(rng.uniform(0.3, 0.7))
        for j in range(rows):
            out += erect(
                slab((-0.4, j * step - 0.2), ((n - 1) * step + 0.4, j * step + 0.2), h + deep, deep), 1.0, 0, rng
            )
        if rng.random() < 0.5:
            out += erect(
                slab((-1, -1), ((n - 1) * step + 1, (rows - 1) * step + 1), h + deep + 0.25, 0.25), 1.0, 0, rng
            )
    return out


def _room(rng: Rng) -> list[Thing]:
    """Walls about a floor, touching at the corners, with columns inside and perhaps a slab above."""
    number = count(1)
    lx, ly, h = float(rng.uniform(4, 14)), float(rng.uniform(4, 12)), float(rng.uniform(2.4, 4.0))
    t = float(rng.uniform(0.15, 0.35))
    out = erect(slab((-1, -1), (lx + 1, ly + 1), 0.07, 0.3), 1.0, 0, rng)
    covered = rng.random() < 0.4
    state: Callable[[], float] = (lambda: 1.0) if covered else (lambda: _poured(rng))
    runs = [((0.0, 0.0), 0.0, lx), ((t / 2, ly), 0.0, lx - t / 2), ((0.0, t / 2), np.pi / 2, ly - t / 2),
            ((lx, t / 2), np.pi / 2, ly - t)]  # fmt: skip
    for xy, angle, length in runs:
        if covered or rng.random() < 0.85:
            for at, part in _pieces(length, rng):
                start = (xy[0] + at * np.cos(angle), xy[1] + at * np.sin(angle))
                e = wall(start, angle, part, t, h, 0.0, some_openings(part, h, rng))
                out += erect(e, state(), next(number), rng, finished=covered)
    for _ in range(int(rng.integers(0, 4))):
        e = a_column((float(rng.uniform(1.2, lx - 1.2)), float(rng.uniform(1.2, ly - 1.2))), h, rng)
        out += erect(e, state(), next(number), rng, finished=covered)
    if covered:
        out += erect(slab((-0.2, -0.2), (lx + 0.2, ly + 0.2), h + 0.25, 0.25), 1.0, 0, rng)
    return out


def _pieces(length_m: float, rng: Rng) -> Iterator[tuple[float, float]]:
    """Cut a run into one to three touching pours: (start, length) each."""
    n = int(rng.integers(1, 4)) if length_m > 5 else 1
    cuts = np.r_[
        0.0, np.sort(rng.uniform(0.25, 0.75, n - 1)) if n < 3 else [rng.uniform(0.2, 0.4), rng.uniform(0.55, 0.8)], 1.0
    ]
    for a, b in pairwise(cuts):
        yield float(a * length_m), float((b - a) * length_m)


def _shaft(rng: Rng) -> list[Thing]:
    """One to three lift shafts, higher than all else."""
    number = count(1)
    out: list[Thing] = []
    deep, t = float(rng.uniform(2.0, 3.5)), float(rng.uniform(0.18, 0.3))
    h, x = float(rng.uniform(2.8, 14.0)), 0.0
    for _ in range(int(rng.integers(1, 4))):
        wide = float(rng.uniform(1.8, 3.2))
        for xy, angle, length in (
            ((x, 0.0), 0.0, wide), ((x, deep), 0.0, wide), ((x, t / 2), np.pi / 2, deep - t),
            ((x + wide, t / 2), np.pi / 2, deep - t),
        ):  # fmt: skip
            openings = some_openings(length, 2.7, rng) if length > 2.6 else ()
            share = 1.0 if rng.random() < 0.8 else float(rng.uniform(0.3, 0.9))
            out += erect(wall(xy, angle, length, t, h, 0.0, openings), share, next(number), rng)
        x += wide + t
    if rng.random() < 0.5:
        out += erect(slab((-6, -6), (x + 6, deep + 6), 0.07, 0.3), 1.0, 0, rng)
    return out


def _retaining(rng: Rng) -> list[Thing]:
    """A long wall in pours, stepped or level, with earth behind it and perhaps a return."""
    out: list[Thing] = []
    number = count(1)
    h, t, x = float(rng.uniform(1.2, 6.0)), float(rng.uniform(0.25, 0.6)), 0.0
    step = float(rng.uniform(2.0, 8.0))
    falling = float(rng.choice([0.0, 0.0, rng.uniform(0.1, 0.5)]))
    for k in range(int(rng.integers(2, 7))):
        top = max(0.8, h - falling * k)
        share = 1.0 if rng.random() < 0.85 else float(rng.uniform(0.0, 0.9))
        out += erect(wall((x, 0.0), 0.0, step, t, top), share, next(number), rng)
        x += step
    if rng.random() < 0.5:
        e = wall((0.0 if rng.random() < 0.5 else x, -t / 2), -np.pi / 2, float(rng.uniform(2, 8)), t, h)
        out += erect(e, 1.0, next(number), rng)
    if rng.random() < 0.75:
        earth = max(0.5, h - falling * 6 - rng.uniform(0.1, 1.0))
        out += of_kind([box("Earth", (-10, t / 2 + 0.01, -1), (x + 10, 30, earth), "ground")], BACKGROUND)
    if rng.random() < 0.5:
        out += erect(slab((-1, -3.0), (x + 1, -t / 2), 0.07, 0.4), 1.0, 0, rng)
    return out
