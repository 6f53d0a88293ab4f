"""Draws twins of the paper's two experiments: a corner-on column, a stepped wall with its side, others about them.

Three to five objects at 3.5 to 8 m, none before another; drawn on a random stream of their own.

Reference: Perez & Tah 2023, section 4: column 0.50 x 0.50 x 2.70 m, wall 0.80 x 1.30 + 1.00 x 1.70 m, 0.30 m thick.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt_synthetic.meshes import circle, pose_2d, transform
from asbuilt_synthetic.model import FloatArray

SURFACES = ("concrete", "concrete_slab", "concrete_fair", "concrete_dark")
EYE_M = 1.5
_GAP_RAD = 0.034  # between the outlines of two objects: some 35 px
_EDGE_RAD = 0.50  # of the frame's half width of 0.54


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A box of an object in its own frame: x along the front, y towards the back, z up; low and high of each (m)."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]
    z_m: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """One object: its kind, its blocks (or its radius and height), where it stands and how it is turned."""

    kind: str  # "column" | "wall" | "round"
    blocks: tuple[Block, ...]
    radius_m: float
    height_m: float
    xy_m: tuple[float, float]  # of the corner towards the camera; of a round one, its axis
    angle_rad: float
    material: str
    texture_seed: int

    @property
    def plan_m(self) -> FloatArray:
        """Points (N, 2) round its plan, on the ground."""
        if self.kind == "round":
            return circle(self.radius_m, 32) + np.array(self.xy_m)
        flat = [(x, y, 0.0) for b in self.blocks for x in b.x_m for y in b.y_m]
        return transform(pose_2d(self.xy_m, 0.0, self.angle_rad), np.array(flat))[:, :2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """What stands in a seed's scene: the objects, and where the target does."""

    objects: tuple[Twin, ...]
    target_xy_m: FloatArray  # (2,)


def plan(seed: int) -> Plan:
    """Draw the objects of a seed: an even one has the paper's column in it, an odd one the paper's wall."""
    rng = np.random.default_rng([seed, 31])
    objects: list[Twin] = []
    taken: list[FloatArray] = []
    target = np.zeros(2)
    first = "column" if seed % 2 == 0 else "wall"
    for k in range(5):
        if k == 1:  # before the others: it needs a place
            target = _target_place(taken, rng)
            taken.append(target + circle(0.2, 16))
        kind = first if k == 0 else str(rng.choice(["column", "column", "wall", "round"]))
        for _ in range(200):
            made = _drawn(kind, k == 0, rng)
            if made is not None and _is_clear(made.plan_m, taken):
                objects.append(made)
                taken.append(made.plan_m)
                break
    return Plan(objects=tuple(objects), target_xy_m=target)


def _target_place(taken: list[FloatArray], rng: np.random.Generator) -> FloatArray:
    while True:
        bearing, distance = rng.uniform(-0.42, 0.42), rng.uniform(3.2, 6.8)
        at = distance * np.array([np.cos(bearing), np.sin(bearing)])
        if _is_clear(at + circle(0.2, 16), taken):
            return np.asarray(at)


def _drawn(kind: str, papers: bool, rng: np.random.Generator) -> Twin | None:
    """Draw one object; None where its sizes are nothing that is built."""
    bearing = rng.uniform(-0.2, 0.2) if papers else rng.uniform(-0.46, 0.46)
    distance = rng.uniform(4.0 if kind == "wall" else 3.5, 8.0)
    most = EYE_M + 0.40 * distance
    skin = {"material": str(rng.choice(SURFACES)), "texture_seed": int(rng.integers(1, 60000))}
    corner = distance * np.array([np.cos(bearing), np.sin(bearing)])
    if kind == "round":
        radius = float(rng.uniform(0.14, 0.42))
        return Twin(
            kind=kind, blocks=(), radius_m=radius, height_m=float(min(rng.uniform(2.0, 2.9), most)),
            xy_m=(float(corner[0]), float(corner[1])), angle_rad=0.0, **skin,
        )  # fmt: skip
    split = rng.uniform(0.5, 0.8) if kind == "column" or not papers else rng.uniform(0.7, 0.88)
    size = _paper_sizes(kind, split) if papers else _sizes(kind, split, distance, rng)
    if size is None:
        return None
    front, side, turn = size
    height = 3.0 if kind == "wall" else 2.7
    height = float(min(height if papers else rng.uniform(1.6, 3.0), most))
    mirrored = bool(rng.random() < 0.5)
    # seen along the line of sight, the front runs off to one side turned back by `turn`, the side to the other
    if kind == "wall":
        step = front * (0.8 if papers else rng.uniform(0.5, 0.85))
        level = height * (1.7 / 3.0 if papers else rng.uniform(0.35, 0.65))
        widths, levels = (front, step), ((0.0, level), (level, height))
    else:
        widths, levels = (front,), ((0.0, height),)
    blocks = tuple(
        Block(x_m=(-w, 0.0) if mirrored else (0.0, w), y_m=(0.0, side), z_m=z)
        for w, z in zip(widths, levels, strict=True)
    )
    # an object's y points away from the camera, its x to the right: to -y of the scene where the camera looks along x
    angle = bearing - np.pi / 2 + (-turn if mirrored else turn)
    return Twin(
        kind=kind, blocks=blocks, radius_m=0.0, height_m=height, xy_m=(float(corner[0]), float(corner[1])),
        angle_rad=float(angle), **skin,
    )  # fmt: skip


def _paper_sizes(kind: str, split: float) -> tuple[float, float, float] | None:
    front, side = (0.5, 0.5) if kind == "column" else (1.0, 0.3)
    # front cos(turn) : side sin(turn) = split : 1 - split
    return front, side, float(np.arctan((1 - split) / split * front / side))


def _sizes(kind: str, split: float, distance: float, rng: np.random.Generator) -> tuple[float, float, float] | None:
    """Draw front, side and turn so that narrow sides of every class come about alike."""
    low, high = ((12.0, 30.0), (30.0, 60.0), (60.0, 110.0))[int(rng.integers(3))]
    narrow = rng.uniform(low, high) / 1050.0 * distance
    turn = np.deg2rad(rng.uniform(20.0, 50.0))
    front, side = narrow * split / (1 - split) / np.cos(turn), narrow / np.sin(turn)
    built = 0.4 <= front <= 1.6 if kind == "wall" else 0.2 <= front <= 0.9
    return (float(front), float(side), float(turn)) if built and 0.12 <= side <= 0.9 else None


def bearings(plan: FloatArray) -> tuple[float, float]:
    """Return the lowest and highest bearing of plan points (N, 2) from both cameras."""
    both = np.concatenate([np.arctan2(plan[:, 1] - y, plan[:, 0]) for y in (0.0, -0.25)])
    return float(both.min()), float(both.max())


def _is_clear(plan: FloatArray, others: list[FloatArray]) -> bool:
    """Tell whether something with plan points (N, 2) lies in view and hides no other, nor is hidden."""
    low, high = bearings(plan)
    if low < -_EDGE_RAD or high > _EDGE_RAD:
        return False
    return all(high + _GAP_RAD < a or low - _GAP_RAD > b for a, b in map(bearings, others))
