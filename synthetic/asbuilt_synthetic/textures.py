"""Bakes surface patterns (concrete, gravel, boards, brick ...) into tiles with mip levels, and looks them up."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_synthetic.materials import MATERIALS, Courses, Formwork, Material

Image = NDArray[np.float32]  # (h, w, 3)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tile:
    """A pattern that repeats every `size_m`: linear albedo (N, N, 3) float32 at falling resolutions."""

    size_m: float
    levels: tuple[Image, ...]

    def look_up(self, u_m: np.ndarray, v_m: np.ndarray, footprint_m: np.ndarray) -> Image:
        """Return the linear albedo (N, 3) at surface places, averaged over about a pixel's footprint."""
        texel = self.size_m / self.levels[0].shape[0]
        level = np.clip(np.log2(np.maximum(footprint_m, 1e-6) / texel), 0, len(self.levels) - 1.001)
        low = level.astype(np.int32)
        part = (level - low).astype(np.float32)[:, None]
        out = np.zeros((len(u_m), 3), np.float32)
        for k in np.unique(low):
            pick = np.flatnonzero(low == k)
            a = _sample(self.levels[k], u_m[pick] / self.size_m, v_m[pick] / self.size_m)
            b = _sample(self.levels[k + 1], u_m[pick] / self.size_m, v_m[pick] / self.size_m)
            out[pick] = a + (b - a) * part[pick]
        return out


@lru_cache(maxsize=64)
def tile(material: str) -> Tile:
    """Bake the tile of a material (a key of MATERIALS)."""
    m = MATERIALS[material]
    n, texel = (2048, 0.0021) if m.kind in ("concrete", "ground") else (1024, 0.0024)
    if m.kind in ("masonry", "leaves", "painted") and material != "stand_black":
        texel = 0.0048
    size = n * texel
    if m.formwork:  # a whole number of panels to the tile
        size = round(size / m.formwork.panel_m[0]) * m.formwork.panel_m[0]
    return bake(m, np.random.default_rng(zlib.crc32(material.encode())), n, size)


def bake(m: Material, rng: np.random.Generator, n: int, size: float) -> Tile:
    """Bake a tile of (n, n) texels that repeats every `size` metres; for panels a whole number of them."""
    base, second = linear(np.array(m.base_srgb)), linear(np.array(m.second_srgb))
    image: np.ndarray = base * (1 + m.grain_contrast * _grain(rng, n, m.grain_m, size))[..., None]
    mottle = _fractal(rng, n, m.mottle_m, size)[..., None]
    image = image + (second - base) * np.clip(2.2 * m.mottle_contrast * mottle + m.mottle_contrast, 0, 1)
    image = _own_pattern(image, m, rng, size, second)
    levels: list[Image] = [np.clip(image, 0.004, 1.0).astype(np.float32)]
    while levels[-1].shape[0] > 8:
        half = cv2.resize(levels[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        levels.append(np.asarray(half, np.float32))
    return Tile(size_m=size, levels=tuple(levels))


def linear(srgb: np.ndarray) -> np.ndarray:
    """Turn sRGB 0..255 into linear reflectance 0..1."""
    c = np.asarray(srgb, np.float32) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _sample(level: Image, s: np.ndarray, t: np.ndarray) -> Image:
    n = level.shape[0]
    rows = -(-len(s) // 1024)
    x, y = np.zeros(rows * 1024, np.float32), np.zeros(rows * 1024, np.float32)
    x[: len(s)], y[: len(s)] = np.mod(s, 1.0) * n - 0.5, np.mod(t, 1.0) * n - 0.5
    out = cv2.remap(level, x.reshape(rows, 1024), y.reshape(rows, 1024), cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(out, np.float32).reshape(-1, 3)[: len(s)]


def _noise(rng: np.random.Generator, n: int, cells: int) -> np.ndarray:
    """Smooth periodic noise of unit variance with about `cells` lumps to the tile."""
    cells = int(np.clip(cells, 2, n))
    small = rng.normal(size=(cells, cells)).astype(np.float32)
    pad = 3
    k = n // cells + 1
    big = cv2.resize(np.pad(small, pad, mode="wrap"), None, fx=k, fy=k, interpolation=cv2.INTER_CUBIC)
    big = big[pad * k : (pad + cells) * k, pad * k : (pad + cells) * k]
    out = cv2.resize(big, (n, n), interpolation=cv2.INTER_AREA)
    return np.asarray((out - out.mean()) / (out.std() + 1e-9), np.float32)


def _fractal(rng: np.random.Generator, n: int, lump_m: float, size: float, octaves: int = 5) -> np.ndarray:
    total = sum(_noise(rng, n, int(size / lump_m * 2**k)) * 0.6**k for k in range(octaves))
    return np.asarray(total, np.float32) * 0.75


def _grain(rng: np.random.Generator, n: int, grain_m: float, size: float) -> np.ndarray:
    """Fine grain at the material's size and two coarser ones, so that every distance shows some."""
    sizes = (grain_m, 2.5 * grain_m, 6 * grain_m, 15 * grain_m)
    return sum(w * _noise(rng, n, int(size / g)) for g, w in zip(sizes, (1.0, 0.8, 0.7, 0.5), strict=True))  # type: ignore[return-value]


def _own_pattern(image: Image, m: Material, rng: np.random.Generator, size: float, second: np.ndarray) -> Image:
    n = image.shape[0]
    shade = np.ones((n, n), np.float32)
    if m.pore_radius_m:
        _dots(shade, rng, int(m.pore_share * 90 * size * size), m.pore_radius_m * n / size, 0.45)
    if m.formwork:
        _joints_and_ties(shade, m.formwork, rng, n / size)
        streaks = cv2.blur(_noise(rng, n, 96), (1, 301), borderType=cv2.BORDER_REFLECT)
        shade *= 1 + 0.16 * np.clip(streaks / (streaks.std() + 1e-9) - 0.7, -2, 0) * 0.5
    if m.kind == "wood":
        shade *= 1 + 0.10 * cv2.blur(_noise(rng, n, 512), (1, 81))
        for x in range(0, n, max(8, int(0.15 * n / size))):
            shade[:, x : x + 1] *= 0.6
    if m.kind == "ply":
        shade *= 1 + 0.22 * cv2.blur(_noise(rng, n, 400), (3, 61))
    if m.kind == "ground":
        _dots(shade, rng, int(260 * size * size), 0.011 * n / size, 0.72)
        _dots(shade, rng, int(260 * size * size), 0.010 * n / size, 1.32)
    if m.kind == "leaves":
        shade *= 1 + 0.3 * _noise(rng, n, int(size / 0.05)) + 0.2 * _noise(rng, n, int(size / 0.11))
    if m.kind == "rust":
        image = image + (second - image) * np.clip(_noise(rng, n, int(size / 0.012)), 0, 1)[..., None]
    if m.courses:
        image = _courses(image, m.courses, rng, size)
    return np.asarray(image * np.maximum(shade, 0.1)[..., None])


def _dots(shade: np.ndarray, rng: np.random.Generator, count: int, radius_px: float, tone: float) -> None:
    n = shade.shape[0]
    radii = rng.gamma(2.0, radius_px / 2, count)
    for x, y, r in zip(rng.uniform(0, n, count), rng.uniform(0, n, count), radii, strict=True):
        p = (int(x * 16), int(y * 16))
        cv2.circle(shade, p, int(max(r, 0.5) * 16), tone + 0.1 * float(r < radius_px), -1, cv2.LINE_AA, 4)


def _joints_and_ties(shade: np.ndarray, f: Formwork, rng: np.random.Generator, px: float) -> None:
    n = shade.shape[0]
    w = max(1, round(f.joint_m * px))
    for step, horizontal in ((f.panel_m[0], False), (f.panel_m[1], True)):
        for p in np.arange(0.0, n / px - 0.2 * step, step):
            k = int(p * px)
            strip = shade[k : k + w] if horizontal else shade[:, k : k + w]
            strip *= 0.55 + 0.1 * rng.random()
    for x in np.arange(f.tie_spacing_m[0] / 2, n / px, f.tie_spacing_m[0]):
        for y in np.arange(f.tie_spacing_m[1] / 3, n / px, f.tie_spacing_m[1]):
            c = (int(x * px * 16), int(y * px * 16))
            cv2.circle(shade, c, int(f.tie_radius_m * 2.2 * px * 16), 0.86, -1, cv2.LINE_AA, 4)
            cv2.circle(shade, c, int(f.tie_radius_m * px * 16), 0.3, -1, cv2.LINE_AA, 4)


def _courses(image: Image, c: Courses, rng: np.random.Generator, size: float) -> Image:
    n = image.shape[0]
    rows, cols = max(1, round(size / c.brick_m[1])), max(1, round(size / c.brick_m[0]))
    h, w, mortar = n / rows, n / cols, c.mortar_m * n / size / 2
    y, x = np.mgrid[0:n, 0:n].astype(np.float32)
    row = (y / h).astype(int)
    sx = x + (row % 2) * w / 2
    col = (sx / w).astype(int) % cols
    tone = 1 + 0.16 * rng.normal(size=(rows + 1, cols)).astype(np.float32)
    in_joint = (np.abs(y / h - np.round(y / h)) * h < mortar) | (np.abs(sx / w - np.round(sx / w)) * w < mortar)
    out = image * tone[row, col][..., None]
    out[in_joint] = linear(np.array(c.mortar_srgb)) * (1 + 0.08 * rng.normal(size=(int(in_joint.sum()), 1)))
    return np.asarray(out, np.float32)
