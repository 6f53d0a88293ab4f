"""A place dressed and lit, ready for its pictures: what each triangle is and looks like."""

from __future__ import annotations

import numpy as np
from asbuilt_synthetic.textures import Tile
from asbuilt_synthetic.tracer import Tracer

from asbuilt_training.images.looks import Wardrobe
from asbuilt_training.images.things import Place
from asbuilt_training.images.weather import draw_weather


class Stage:
    """The meshes with per-body class, instance and look, under one weather.

    `surface` (M,) numbers the pieces of surface that shade alike: of one body, and turned about the same way.
    """

    def __init__(self, place: Place, tiles: dict[str, tuple[Tile, ...]], rng: np.random.Generator) -> None:
        self.place = place
        self.weather = draw_weather(rng)
        wardrobe = Wardrobe(rng, tiles)
        parts = [t.part for t in place.things]
        self.origin_m = np.round(place.middle_m, 1)
        self.tracer = Tracer(self.origin_m, [p.placed(np.eye(4)) for p in parts])
        self.kind = np.array([t.kind for t in place.things], np.uint8)
        self.instance = np.array([t.instance for t in place.things], np.uint16)
        self.look = np.array([wardrobe.look_of(p) for p in parts])
        self.looks = tuple(wardrobe.looks)
        tone = np.exp(rng.normal(0, 0.07, len(parts)))
        self.tone = np.asarray(tone[:, None] * np.exp(rng.normal(0, 0.012, (len(parts), 3))), np.float32)
        self.shift = rng.uniform(0, 40, (len(parts), 2)).astype(np.float32)
        self.is_round = np.array([p.round_axis_m is not None for p in parts])
        self.axis = np.array(
            [(0.0, 0.0) if p.round_axis_m is None else (p.round_axis_m - self.origin_m)[:2] for p in parts], np.float32
        )
        normal, body = self.tracer.normal, self.tracer.body
        turned = (np.round(normal * 4) + 4).astype(np.int32)
        self.surface = ((body * 9 + turned[:, 0]) * 9 + turned[:, 1]) * 9 + turned[:, 2]
        self.surface[self.is_round[body]] = body[self.is_round[body]] * 729
        self.along, self.across = _axes(normal)


def _axes(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lay axes (M, 3) on every triangle: along the wall and down; x and y where it is level."""
    level = np.abs(normal[:, 2]) > 0.75
    along = np.c_[-normal[:, 1], normal[:, 0], np.zeros(len(normal))]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)
    along[level] = (1, 0, 0)
    across = np.broadcast_to(np.array([0, 0, -1.0]), along.shape).copy()
    across[level] = (0, 1, 0)
    return along.astype(np.float32), across.astype(np.float32)
