"""Builds people-like shapes in site clothes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from asbuilt_synthetic.meshes import Part, join, lathe, tube


def person(rng: np.random.Generator) -> list[Part]:
    """Build a standing figure, 1.6 to 1.9 m, facing +x: legs, vest, arms, head, helmet."""
    k = float(rng.uniform(0.92, 1.08))
    stride = float(rng.uniform(0.0, 0.15))
    legs = [
        *_limb((stride, 0.1), (0.0, 0.1), 0.0, 0.86, (0.062, 0.078, 0.1), "cloth_blue"),
        *_limb((-stride, -0.1), (0.0, -0.1), 0.0, 0.86, (0.062, 0.078, 0.1), "cloth_blue"),
    ]
    torso_shape = [(0.15, 0.8), (0.19, 0.95), (0.185, 1.15), (0.215, 1.38), (0.16, 1.47), (0.06, 1.52)]
    torso = _squashed(lathe("torso", torso_shape, "cloth_orange_vest", 24))
    reach = float(rng.uniform(-0.1, 0.35))
    arms = []
    for side in (1, -1):
        shoulder, elbow = (0.0, side * 0.22, 1.42), (0.05, side * 0.27, 1.13)
        hand = (0.1 + max(reach, 0), side * (0.25 - 0.1 * max(reach, 0)), 0.9 + 0.4 * max(reach, 0))
        arms += [
            tube("arm", shoulder, elbow, 0.05, "cloth_blue", 12),
            tube("arm", elbow, hand, 0.042, "cloth_blue", 12),
        ]
    wrists = [a.vertices_m[-6:].mean(0) for a in arms[1::2]]
    hands = [tube("hand", w, w + np.array([0.05, 0, -0.06]), 0.035, "skin", 8) for w in wrists]
    head = lathe("head", [(0.05, 1.48), (0.055, 1.54), (0.085, 1.6), (0.095, 1.68), (0.08, 1.76)], "skin", 20)
    dome = [(0.135, 1.695), (0.13, 1.71), (0.115, 1.76), (0.08, 1.81), (0.02, 1.835)]
    helmet = lathe("helmet", dome, str(rng.choice(["helmet_white", "red_paint", "helmet_white"])), 20)
    parts = [join("Legs", legs), torso, join("Arms", arms), join("Hands", hands), head, helmet]
    return [replace(p, name=f"Person {p.name.lower()}", vertices_m=p.vertices_m * k) for p in parts]


def _limb(
    foot: tuple[float, float],
    hip: tuple[float, float],
    low: float,
    high: float,
    radii: tuple[float, float, float],
    material: str,
) -> list[Part]:
    knee = ((foot[0] + hip[0]) / 2 + 0.03, (foot[1] + hip[1]) / 2, (low + high) / 2)
    shoe = tube("shoe", (foot[0] - 0.08, foot[1], 0.05), (foot[0] + 0.2, foot[1], 0.04), 0.05, "stand_black", 10)
    return [
        tube("shin", (*foot, low + 0.05), knee, radii[1], material, 14),
        tube("thigh", knee, (*hip, high), radii[2], material, 14),
        shoe,
    ]


def _squashed(part: Part) -> Part:
    return replace(part, vertices_m=part.vertices_m * np.array([0.62, 1.0, 1.0]))
