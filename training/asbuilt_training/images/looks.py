"""Draws materials at random, bakes a pool of their patterns, and dresses a scene's things in them."""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from asbuilt_synthetic.materials import MATERIALS, Courses, Formwork, Material, Srgb
from asbuilt_synthetic.meshes import Part
from asbuilt_synthetic.textures import Tile, bake, linear

Rng = np.random.Generator


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """A pattern in a colour: `gain` (3,) multiplies the tile so that its mean is the colour; `scale` stretches it."""

    tile: Tile
    gain: np.ndarray
    scale: float


# How many patterns of each family a pool holds, their side in texels, and the metres of a texel.
_POOL = {
    "concrete": (14, 768, 0.006), "slab": (4, 512, 0.008), "ply": (3, 512, 0.005), "panel": (3, 512, 0.006),
    "timber": (3, 512, 0.005), "rust": (1, 256, 0.005), "steel": (2, 256, 0.008), "paint": (3, 512, 0.01),
    "brick": (4, 512, 0.009), "blocks": (2, 512, 0.012), "plaster": (4, 512, 0.012), "ground": (6, 512, 0.010),
    "grass": (2, 512, 0.012), "leaves": (3, 512, 0.012), "glass": (2, 256, 0.02), "cloth": (2, 256, 0.006),
    "print": (2, 256, 0.002),
}  # fmt: skip


@lru_cache(maxsize=1)
def pool(seed: int) -> dict[str, tuple[Tile, ...]]:
    """Bake the patterns of a pool; scenes of one pool share patterns, never colours."""
    out = {}
    for f, (family, (count, n, texel)) in enumerate(_POOL.items()):
        tiles = []
        for k in range(count):
            rng = np.random.default_rng([seed, 41, f, k])
            m, size = _pattern(family, rng), n * texel
            if m.formwork:
                size = max(1, round(size / m.formwork.panel_m[0])) * m.formwork.panel_m[0]
            tiles.append(bake(m, rng, n, size))
        out[family] = tuple(tiles)
    return out


def _pattern(family: str, rng: Rng) -> Material:
    """Draw a material of a family about the one that both renderers know, with much wider ranges."""
    known = {
        "slab": "concrete_slab", "ply": "formwork_ply", "panel": "formwork_steel", "rust": "rebar",
        "steel": "scaffold_steel", "paint": "hoarding", "blocks": "brick", "leaves": "foliage", "cloth": "cloth_blue",
        "print": "hoarding",
    }  # fmt: skip
    m = MATERIALS[known.get(family, family)]
    second = float(rng.uniform(0.6 if family == "concrete" else 0.45, 0.95))
    m = replace(
        m,
        second_srgb=_shade(m.base_srgb, second, rng),
        grain_m=m.grain_m * float(rng.uniform(0.7, 2.5)),
        grain_contrast=m.grain_contrast * float(rng.uniform(0.25, 1.3)),
        mottle_m=m.mottle_m * float(np.exp(rng.uniform(-0.7, 0.9))),
        mottle_contrast=m.mottle_contrast * float(rng.uniform(0.15, 1.5)),
        pore_share=m.pore_share * float(rng.uniform(0, 2.0)),
    )
    if family == "concrete":
        return replace(m, formwork=_prints(rng))
    if family in ("brick", "blocks"):
        brick = (0.24, 0.083) if family == "brick" else tuple(rng.choice([[0.5, 0.25], [0.4, 0.2], [1.0, 0.6]]))
        tone = float(rng.uniform(0.8, 1.3))
        length, height = float(brick[0]) * float(rng.uniform(0.85, 1.15)), float(brick[1])
        courses = Courses(brick_m=(length, height), mortar_m=0.011, mortar_srgb=_shade(m.base_srgb, tone, rng))
        return replace(m, courses=courses)
    return replace(m, kind="painted") if family == "paint" and rng.random() < 0.6 else m


def _prints(rng: Rng) -> Formwork | None:
    """Draw what the forms left: nothing, panels with ties, or boards."""
    draw = rng.random()
    if draw < 0.3:
        return None
    if draw < 0.8:
        width, height = float(rng.choice([0.6, 0.9, 1.25, 1.35, 2.4])), float(rng.choice([1.2, 1.35, 2.5, 2.7]))
        return Formwork(
            panel_m=(width, height), joint_m=float(rng.uniform(0.004, 0.018)),
            tie_spacing_m=(width / float(rng.choice([1, 2])), float(rng.uniform(0.6, 1.3))),
            tie_radius_m=float(rng.choice([0.006, 0.014, 0.022])),
        )  # fmt: skip
    return Formwork(
        panel_m=(float(rng.uniform(2.0, 4.0)), float(rng.uniform(0.1, 0.25))), joint_m=0.006,
        tie_spacing_m=(9.0, 9.0), tie_radius_m=0.001,
    )  # fmt: skip


def _shade(srgb: Srgb, factor: float, rng: Rng) -> Srgb:
    r, g, b = (int(np.clip(c * factor * rng.uniform(0.95, 1.05), 4, 250)) for c in srgb)
    return r, g, b


def _grey(low: float, high: float, warm: float = 10.0) -> Callable[[Rng], np.ndarray]:
    def one(rng: Rng) -> np.ndarray:
        v, w = rng.uniform(low, high), rng.normal(0, 0.5) * warm
        return np.array([v + w, v + 0.25 * w, v - w])

    return one


def _hue(
    hue: tuple[float, float], saturation: tuple[float, float], value: tuple[float, float]
) -> Callable[[Rng], np.ndarray]:
    def one(rng: Rng) -> np.ndarray:
        return 255 * np.array(colorsys.hsv_to_rgb(rng.uniform(*hue) % 1, rng.uniform(*saturation), rng.uniform(*value)))

    return one


def _either(*draws: Callable[[Rng], np.ndarray]) -> Callable[[Rng], np.ndarray]:
    return lambda rng: draws[int(rng.integers(len(draws)))](rng)


_PAINTS = _either(
    _hue((0.12, 0.16), (0.7, 1), (0.6, 0.95)), _hue((0.55, 0.68), (0.4, 0.9), (0.2, 0.75)),
    _hue((0.98, 1.05), (0.6, 0.95), (0.4, 0.85)), _hue((0.25, 0.45), (0.2, 0.7), (0.2, 0.6)),
    _grey(150, 235), _grey(40, 110), _hue((0.05, 0.1), (0.6, 1), (0.6, 0.95)),
)  # fmt: skip
_EARTH = _either(
    _hue((0.06, 0.12), (0.12, 0.5), (0.3, 0.8)), _grey(80, 170), _hue((0.08, 0.13), (0.25, 0.45), (0.6, 0.85))
)
_FACADE = _either(
    _hue((0.08, 0.15), (0.05, 0.35), (0.65, 0.95)), _grey(140, 240), _hue((0.0, 0.08), (0.15, 0.5), (0.5, 0.9)),
    _hue((0.5, 0.65), (0.05, 0.3), (0.5, 0.85)),
)  # fmt: skip

# Material name of a part -> pattern family and colour.
_DRESS: dict[str, tuple[tuple[str, ...], Callable[[Rng], np.ndarray]]] = {
    "concrete": (
        ("concrete",),
        _either(_grey(115, 215, 14), _grey(150, 200), _hue((0.08, 0.14), (0.03, 0.16), (0.5, 0.85))),
    ),
    "concrete_slab": (("slab", "concrete"), _grey(95, 205, 14)),
    "formwork_ply": (
        ("ply", "timber"),
        _either(_hue((0.07, 0.12), (0.25, 0.65), (0.4, 0.85)), _hue((0.02, 0.06), (0.4, 0.7), (0.25, 0.55))),
    ),
    "formwork_steel": (("panel", "ply", "paint"), _PAINTS),
    "timber": (
        ("timber",),
        _either(
            _hue((0.08, 0.13), (0.2, 0.6), (0.5, 0.85)), _grey(90, 160), _hue((0.12, 0.15), (0.7, 0.9), (0.7, 0.95))
        ),
    ),
    "rebar": (("rust",), _hue((0.02, 0.08), (0.2, 0.6), (0.2, 0.5))),
    "scaffold_steel": (("steel",), _either(_grey(90, 190), _grey(90, 190), _PAINTS)),
    "ground": (("ground",), _either(_EARTH, _EARTH, _EARTH, _grey(205, 245))),
    "asphalt": (("ground", "plaster"), _grey(55, 150)),
    "heap": (("ground",), _EARTH),
    "plaster": (("plaster",), _FACADE),
    "hoarding": (("paint", "timber"), _either(_PAINTS, _grey(150, 235))),
    "brick": (
        ("brick",),
        _either(_hue((0.0, 0.07), (0.3, 0.65), (0.35, 0.75)), _hue((0.08, 0.12), (0.2, 0.45), (0.6, 0.9))),
    ),
    "blocks": (("blocks",), _either(_grey(130, 235), _hue((0.03, 0.09), (0.3, 0.6), (0.55, 0.8)))),
    "skin": (("cloth",), _hue((0.04, 0.08), (0.3, 0.6), (0.3, 0.9))),
    "cloth_blue": (("cloth",), _either(_hue((0.55, 0.68), (0.3, 0.8), (0.1, 0.5)), _grey(30, 200))),
    "cloth_orange_vest": (
        ("cloth",),
        _either(_hue((0.04, 0.08), (0.8, 1), (0.85, 1)), _hue((0.15, 0.2), (0.8, 1), (0.8, 1)), _grey(40, 160)),
    ),
    "red_paint": (("paint",), _hue((0.97, 1.03), (0.7, 0.95), (0.5, 0.85))),
    "helmet_white": (("paint",), _either(_grey(210, 245), _PAINTS)),
    "tarpaulin": (("cloth",), _PAINTS),
    "stand_black": (("paint",), _grey(20, 70)),
    "grass": (("grass",), _hue((0.15, 0.3), (0.2, 0.6), (0.25, 0.6))),
    "foliage": (
        ("leaves",),
        _either(_hue((0.17, 0.35), (0.2, 0.6), (0.2, 0.55)), _hue((0.05, 0.13), (0.3, 0.6), (0.3, 0.6))),
    ),
    "glass": (("glass",), _grey(25, 150, 20)),
    "machine": (("paint", "panel"), _PAINTS),
    "sheet": (("paint", "steel", "panel"), _PAINTS),
    "print": (("print",), _grey(40, 230)),
}


def name_of(part: Part) -> str:
    """Say by which name a part is dressed."""
    return "concrete" if part.material in ("concrete_fair", "concrete_dark") else part.material


def draw_material(name: str, rng: Rng) -> Material:
    """Draw a whole material for a name, for a renderer that makes its patterns itself."""
    families, colour = _DRESS[name]
    m = _pattern(families[int(rng.integers(len(families)))], rng)
    r, g, b = (int(c) for c in np.clip(colour(rng), 6, 250))
    return replace(m, base_srgb=(r, g, b), second_srgb=_shade((r, g, b), float(rng.uniform(0.55, 0.95)), rng))


class Wardrobe:
    """One scene's looks: a few variants a material name, drawn when first asked for."""

    def __init__(self, rng: Rng, tiles: dict[str, tuple[Tile, ...]]) -> None:
        self._rng, self._tiles = rng, tiles
        self._variants: dict[str, list[int]] = {}
        self.looks: list[Look] = []

    def look_of(self, part: Part) -> int:
        """Choose the look (index into `looks`) of a part."""
        name = name_of(part)
        if name not in self._variants:
            few = int(self._rng.integers(1, 4)) if name not in ("ground", "asphalt", "grass") else 1
            self._variants[name] = [self._draw(name) for _ in range(few)]
        mine = self._variants[name]
        return mine[int(self._rng.integers(len(mine)))]

    def _draw(self, name: str) -> int:
        families, colour = _DRESS[name]
        tiles = self._tiles[families[int(self._rng.integers(len(families)))]]
        tile = tiles[int(self._rng.integers(len(tiles)))]
        gain = linear(np.clip(colour(self._rng), 6, 250)) / tile.levels[-1].mean((0, 1))
        scale = float(np.exp(self._rng.uniform(-0.25, 0.35)))
        self.looks.append(Look(tile=tile, gain=gain.astype(np.float32), scale=scale))
        return len(self.looks) - 1
