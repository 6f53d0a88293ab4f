"""Crowds a twin's scene: walls that the frame cuts, bodies before one another, windows, bars, forms, things about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_synthetic.clutter import barrel, barrier, pallet, red_sign, timber_stack
from asbuilt_synthetic.meshes import Part, box, circle, join, lump, pose_2d, transform, tube
from asbuilt_synthetic.model import FloatArray
from asbuilt_synthetic.people import person
from asbuilt_synthetic.twins import EYE_M, SURFACES, Block, Plan, Twin, bearings, plan

_APART_M = 0.2
_HALF_VIEW_RAD = 0.62  # the frame ends at 0.54


def crowded_plan(seed: int) -> Plan:
    """Return a seed's twins with more objects among them, before and behind them and past the frame's ends."""
    rng = np.random.default_rng([seed, 33])
    bare = plan(seed)
    objects = list(bare.objects)
    target = bearings(bare.target_xy_m + circle(0.2, 16))
    for k in range(4):
        for _ in range(60):
            made = _object(rng, at_end=k < 2)
            low, high = bearings(made.plan_m)
            hides_target = low < target[1] and high > target[0]
            if not hides_target and all(_apart(made.plan_m, o.plan_m) for o in objects):
                objects.append(made)
                break
    return replace(bare, objects=tuple(objects))


def _object(rng: np.random.Generator, at_end: bool) -> Twin:
    """Draw a wall, one with a window, or a column, anywhere from 3 to 9 m; `at_end`: near an end of the frame."""
    distance = float(rng.uniform(3.0, 9.0))
    bearing = float(rng.choice([-1, 1]) * rng.uniform(0.42, _HALF_VIEW_RAD) if at_end else rng.uniform(-0.45, 0.45))
    kind = str(rng.choice(["wall", "wall", "column", "round"]))
    height = float(rng.uniform(1.4, min(3.0, EYE_M + (0.40 if rng.random() < 0.8 else 0.6) * distance)))
    corner = distance * np.array([np.cos(bearing), np.sin(bearing)])
    blocks: tuple[Block, ...] = ()
    radius = float(rng.uniform(0.14, 0.42)) if kind == "round" else 0.0
    if kind != "round":
        length = float(rng.uniform(1.2, 4.5) if kind == "wall" else rng.uniform(0.25, 0.7))
        depth = float(rng.uniform(0.2, 0.35) if kind == "wall" else rng.uniform(0.25, 0.7))
        blocks = _blocks(rng, length, depth, height, with_window=kind == "wall" and length > 1.8)
    turn = float(rng.uniform(-0.9, 0.9))
    return Twin(
        kind=kind, blocks=blocks, radius_m=radius, height_m=height, xy_m=(float(corner[0]), float(corner[1])),
        angle_rad=bearing - np.pi / 2 + turn, material=str(rng.choice(SURFACES)),
        texture_seed=int(rng.integers(1, 60000)),
    )  # fmt: skip


def _blocks(
    rng: np.random.Generator, length: float, depth: float, height: float, with_window: bool
) -> tuple[Block, ...]:
    whole = ((0.0, length), (0.0, depth))
    if not with_window or rng.random() < 0.5:
        return (Block(x_m=whole[0], y_m=whole[1], z_m=(0.0, height)),)
    left, wide = float(rng.uniform(0.25, 0.45)) * length, float(rng.uniform(0.2, 0.35)) * length
    sill, tall = float(rng.uniform(0.3, 0.45)) * height, float(rng.uniform(0.25, 0.45)) * height
    bands = ((0.0, sill), (sill + tall, height))
    piers = ((0.0, left), (left + wide, length))
    return (
        *(Block(x_m=whole[0], y_m=whole[1], z_m=band) for band in bands),
        *(Block(x_m=pier, y_m=whole[1], z_m=(sill, sill + tall)) for pier in piers),
    )


def _apart(one: FloatArray, other: FloatArray) -> bool:
    """Tell whether two plans (N, 2) keep clear of one another, seen as the circles round them or their points."""
    middles = [ring.mean(axis=0) for ring in (one, other)]
    radii = [float(np.linalg.norm(ring - m, axis=1).max()) for ring, m in zip((one, other), middles, strict=True)]
    if float(np.linalg.norm(middles[1] - middles[0])) > sum(radii) + _APART_M:
        return True
    gap = np.linalg.norm(_along(one)[:, None] - _along(other)[None], axis=2)
    return float(gap.min()) > _APART_M


def _along(ring: FloatArray) -> FloatArray:
    """Return points about every 0.15 m on the plan's hull and within: a grid over its corners' mixtures."""
    share = np.linspace(0.0, 1.0, 13)
    return np.concatenate([a + share[:, None] * (b - a) for i, a in enumerate(ring) for b in ring[i + 1 :]])


def loose_things(seed: int, objects: tuple[Twin, ...], target_xy_m: FloatArray) -> list[Part]:
    """Build what stands about the objects and hides some of them: people, props, stacks, forms, heaps at their feet."""
    rng = np.random.default_rng([seed, 34])
    parts: list[Part] = []
    low, high = bearings(target_xy_m + circle(0.25, 16))
    for _ in range(7):
        bearing, distance = rng.uniform(-0.5, 0.5), rng.uniform(2.6, 7.5)
        xy = distance * np.array([np.cos(bearing), np.sin(bearing)])
        wide = 1.0 / distance
        if low - wide < bearing < high + wide or not all(_apart(xy + circle(0.3, 8), o.plan_m) for o in objects):
            continue
        maker = (person, pallet, barrel, barrier, red_sign, timber_stack, _prop)[int(rng.integers(7))]
        parts += [p.moved(xy, 0.0, float(rng.uniform(0.0, 6.28))) for p in maker(rng)]
    for one in objects:
        pose = pose_2d(one.xy_m, 0.0, one.angle_rad)
        parts += [replace(p, vertices_m=transform(pose, p.vertices_m)) for p in _about(one, rng)]
    return parts


def _prop(rng: np.random.Generator) -> list[Part]:
    return [tube("prop", (0, 0, 0), (0, 0, float(rng.uniform(1.5, 3.0))), 0.03, "scaffold_steel", 12)]


def _about(one: Twin, rng: np.random.Generator) -> list[Part]:
    """Build what belongs to one object, in its frame: bars over it, a sheet of ply on it, a heap at its foot."""
    parts: list[Part] = []
    corners = [(x, y) for b in one.blocks for x in b.x_m for y in b.y_m] or list(circle(one.radius_m, 8))
    (x0, y0), (x1, y1) = np.min(corners, axis=0), np.max(corners, axis=0)
    if rng.random() < 0.35:
        top = one.height_m
        places = [(x, y) for x in np.arange(x0 + 0.05, x1, 0.22) for y in (y0 + 0.05, y1 - 0.05)]
        bars = [tube("bar", (x, y, top), (x, y, top + 0.6), 0.008, "rebar", 6) for x, y in places]
        parts.append(join("Bars", bars))
    if rng.random() < 0.25:
        parts.append(
            lump("Heap", (rng.uniform(0.4, 1.2), rng.uniform(0.25, 0.5), rng.uniform(0.15, 0.5)), 0.08, rng, "ground")
            .moved((float(rng.uniform(x0, x1)), float(y0 - 0.2)))
        )  # fmt: skip
    if one.blocks and rng.random() < 0.2:  # a form that still stands before a part of the front
        end = x0 + float(rng.uniform(0.2, 0.7)) * (x1 - x0)
        off = float(rng.choice([0.0, 0.05, 0.4]))
        ply = box(
            "Ply",
            (x0, y0 - off - 0.021, 0.0),
            (end, y0 - off, one.height_m + 0.1),
            "formwork_ply",
            int(rng.integers(1 << 16)),
        )
        parts.append(ply)
    return parts
