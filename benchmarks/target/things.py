"""The red disc as a site shows it, what may cover it, and the red things that are no target."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from benchmarks.target.layers import Layer, Paint, facing, linear

Light = Callable[[FloatArray], FloatArray]
"""From (u, v) in metres (N, 2) to the light's colour (N, 3) there: what a surface's own colour is multiplied by."""

RED = (0.035, 0.03, 0.52)  # linear BGR of red paint in full light
OCCLUDERS = {"concrete": (140, 145, 150), "timber": (90, 130, 175), "steel": (60, 70, 90), "leaf": (50, 110, 60)}
DISTRACTORS = ("square", "panel", "jacket", "ring sign", "no entry", "octagon", "triangle", "bricks", "barrel",
               "small disc", "large disc", "half disc", "orange disc")  # fmt: skip


def lit(kind: str, radius_m: float, rng: np.random.Generator) -> Light:
    """Return the light of `sun` (with a shadow's edge across in a third), `shade` or `dusk` on a thing."""
    strength = {"sun": rng.uniform(0.7, 1.5), "shade": rng.uniform(0.12, 0.35), "dusk": rng.uniform(0.3, 0.6)}[kind]
    tint = {"sun": (0.92, 0.98, 1.05), "shade": (1.25, 1.0, 0.85), "dusk": rng.uniform([0.8, 0.9, 0.9], [1.3, 1, 1.1])}
    colour = strength * np.asarray(tint[kind], dtype=np.float64)
    slope = rng.uniform(-0.25, 0.25, 2) / radius_m
    turn, place = rng.uniform(0, 2 * np.pi), rng.uniform(-0.7, 0.7) * radius_m
    dark = rng.uniform(0.25, 0.5) * np.array([1.3, 1.0, 0.8])
    soft = rng.uniform(0.004, 0.03)
    shadowed = kind == "sun" and rng.random() < 0.33

    def light(uv: FloatArray) -> FloatArray:
        shading = np.clip(1.0 + uv @ slope, 0.3, 2.0)[:, None] * colour
        if not shadowed:
            return shading
        share = np.clip((uv @ [np.cos(turn), np.sin(turn)] - place) / soft + 0.5, 0.0, 1.0)[:, None]
        darker: FloatArray = shading * (1.0 - share + share * dark)
        return darker

    return light


def painted(shape: Callable[[FloatArray], BoolArray], bgr: tuple[float, float, float], light: Light) -> Paint:
    """Return the paint of one linear colour within a shape."""

    def paint(uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.asarray(bgr) * light(uv), shape(uv).astype(np.float64)

    return paint


def target_disc(centre_m: FloatArray, tilt_rad: float, about_rad: float, light: Light, dirt: float,
                rng: np.random.Generator, radius_m: float = 0.15, opacity: float = 1.0) -> Layer:  # fmt: skip
    """Return the red disc; `dirt` 0..0.4 is how much darker its blotches are, `opacity` under 1 makes a reflection."""
    u, v = facing(centre_m, tilt_rad, about_rad)
    waves, phase = rng.normal(0.0, 2.5 / radius_m, (6, 2)), rng.uniform(0, 2 * np.pi, 6)

    def paint(uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        blotch = np.sin(uv @ waves.T + phase).mean(axis=1)
        colour = np.asarray(RED) * light(uv) * (1.0 - dirt * np.clip(2.0 * blotch, 0.0, 1.0))[:, None]
        return colour, opacity * (np.hypot(uv[:, 0], uv[:, 1]) < radius_m)

    return Layer(centre_m=centre_m, u=u, v=v, reach_m=radius_m, paint=paint)


def cover(centre_m: FloatArray, radius_m: float, share: float, rng: np.random.Generator) -> tuple[Layer, FloatArray]:
    """Return a board, a bar or a blob before a disc that hides about `share` of its area, and its (3,) gap towards us.

    It stands 1 to 15 cm before the disc, so that both photos see it at another place against the disc.
    """
    near = centre_m * (1.0 - rng.uniform(0.01, 0.15) / float(np.linalg.norm(centre_m)))
    u, v = facing(near, 0.0, 0.0)
    turn = rng.uniform(0, 2 * np.pi)
    along = np.array([np.cos(turn), np.sin(turn)])
    bgr = tuple(float(c) for c in linear(OCCLUDERS[str(rng.choice(list(OCCLUDERS)))]) * rng.uniform(0.4, 1.2))
    kind = rng.choice(["board", "bar", "blob"])
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 81)] * 2), axis=-1).reshape(-1, 2) * radius_m
    disc = grid[np.hypot(*grid.T) < radius_m]
    if kind == "board":
        edge = float(np.quantile(disc @ along, 1.0 - share))
        shape = lambda uv: (uv @ along > edge) & (uv @ along < 3 * radius_m)  # noqa: E731
    elif kind == "bar":
        middle = rng.uniform(-0.5, 0.5) * radius_m
        half = float(np.quantile(np.abs(disc @ along - middle), share))
        shape = lambda uv: np.abs(uv @ along - middle) < half  # noqa: E731
    else:
        heart = 1.1 * radius_m * along
        size = float(np.quantile(np.hypot(*(disc - heart).T), share))
        shape = lambda uv: np.hypot(*(uv - heart).T) < size  # noqa: E731
    flat = lambda uv: np.ones((len(uv), 3))  # noqa: E731
    layer = Layer(centre_m=near, u=u, v=v, reach_m=2.2 * radius_m, paint=painted(shape, bgr, flat))
    return layer, near


def distractor(kind: str, centre_m: FloatArray, light: Light, rng: np.random.Generator) -> Layer:
    """Return a red thing that is no target: by shape, or a disc by its size or its colour."""
    u, v = facing(centre_m, rng.uniform(0.0, 0.5), rng.uniform(0.0, 2 * np.pi) if "disc" in kind else 0.0)
    red = tuple(float(c) for c in np.asarray(RED) * rng.uniform([0.6, 0.6, 0.7], [1.6, 1.6, 1.2]))
    white = np.array([0.7, 0.7, 0.7])
    size = {"small disc": rng.uniform(0.04, 0.10), "large disc": rng.uniform(0.21, 0.4)}.get(
        kind, rng.uniform(0.12, 0.35)
    )

    def paint(uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y = uv.T / size
        r = np.hypot(x, y)
        on, inner = r < 1.0, np.zeros(len(uv), dtype=bool)
        if kind == "square":
            on = (np.abs(x) < 0.85) & (np.abs(y) < 0.85)
        elif kind in ("panel", "barrel"):
            on = (np.abs(x) < 0.6) & (np.abs(y) < 1.0)
            on &= (kind == "panel") | (np.abs(y) < 0.88 + 0.12 * np.sqrt(np.clip(1 - (x / 0.6) ** 2, 0, 1)))
        elif kind == "jacket":
            on = (np.abs(x) < 0.42 + 0.08 * np.sin(9 * y)) & (np.abs(y) < 1.0)
            on |= (np.abs(np.abs(x) - 0.55) < 0.14) & (y > -0.9) & (y < 0.6)
            inner = (np.abs(y - 0.35) < 0.07) | (np.abs(y + 0.05) < 0.07)
        elif kind == "ring sign":
            inner = r < 0.78
        elif kind == "no entry":
            inner = (np.abs(y) < 0.14) & (np.abs(x) < 0.75)
        elif kind == "octagon":
            on = (np.maximum(np.abs(x), np.abs(y)) < 0.92) & (np.abs(x) + np.abs(y) < 1.3)
            inner = (np.abs(y) < 0.2) & (np.abs(x) < 0.7) & (np.sin(25 * x) > 0)
        elif kind == "triangle":
            on = (y < 0.6) & (y > -1.0 + 1.6 * np.abs(x) / 0.92)
            inner = (y < 0.45) & (y > -0.65 + 1.6 * np.abs(x) / 0.92)
        elif kind == "bricks":
            on = (np.abs(x) < 1.0) & (np.abs(y) < 1.0)
            row = np.floor(y * 5)
            inner = (np.abs(y * 5 - row - 0.5) > 0.42) | (np.abs((x * 2 + 0.5 * (row % 2)) % 1.0 - 0.5) > 0.46)
        elif kind == "half disc":
            on = (r < 1.0) & (y < 0.0)
        base = {"orange disc": (0.02, 0.22, 0.75), "bricks": (0.06, 0.08, 0.26)}.get(kind, red)
        colour = np.where(inner[:, None], white, np.asarray(base)) * light(uv)
        return colour, on.astype(np.float64)

    return Layer(centre_m=centre_m, u=u, v=v, reach_m=1.02 * size, paint=paint)
