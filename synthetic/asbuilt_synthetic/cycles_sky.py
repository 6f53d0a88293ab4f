"""The sky of a visit as a picture of all directions: gradient, glow about the sun, drifting clouds."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_synthetic.materials import linear_rgb
from asbuilt_synthetic.model import Light

WIDTH_PX = 3072
_CLEAR_RADIANCE = 0.42
_OVERCAST_RADIANCE = 0.80
_GREY = np.array([0.97, 1.0, 1.04], dtype=np.float32)
_BELOW = np.array([0.10, 0.09, 0.075], dtype=np.float32)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)


def sky_panorama(light: Light, seed: int) -> NDArray[np.float32]:
    """Paint linear radiance (WIDTH / 2, WIDTH, 3), rows from straight up to straight down.

    Column c looks along (-cos a, -sin a) with a = 2 pi (c + 0.5) / WIDTH: Blender's equirectangular order.
    """
    towards = np.asarray(light.towards_sun, dtype=np.float32)
    towards = towards / np.linalg.norm(towards)
    x, y, z = _directions()
    clear = float(np.clip(light.sun_strength, 0.0, 1.0))
    radiance = _OVERCAST_RADIANCE + clear * (_CLEAR_RADIANCE - _OVERCAST_RADIANCE)
    zenith = np.array(linear_rgb(light.sky_srgb), dtype=np.float32)
    zenith = zenith / max(float(zenith @ _LUMINANCE), 1e-3)
    top = radiance * (clear * zenith + (1.0 - clear) * _GREY)
    horizon = radiance * 1.7 * (0.3 * zenith + 0.7 * _GREY)
    height = np.maximum(z, 0.0)[..., None]
    sky = horizon + (top - horizon) * height**0.55
    cover = (_cloud_cover(x, y, z, seed, 0.50 - 0.08 * (1.0 - clear)) * 0.85)[..., None]
    sky = sky + cover * (radiance * 2.1 * _GREY - sky)
    facing = np.maximum(x * towards[0] + y * towards[1] + z * towards[2], 0.0)
    sky = sky * (1.0 + 1.4 * clear * facing**12)[..., None]
    return np.where(z[..., None] < -0.002, _BELOW, sky).astype(np.float32)


def _directions() -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    rows = (np.arange(WIDTH_PX // 2, dtype=np.float32) + 0.5) / (WIDTH_PX // 2)
    columns = (np.arange(WIDTH_PX, dtype=np.float32) + 0.5) / WIDTH_PX
    up = np.cos(np.pi * rows)[:, None] * np.ones_like(columns)[None, :]
    level = np.sin(np.pi * rows)[:, None]
    azimuth = 2.0 * np.pi * columns[None, :]
    directions = (-level * np.cos(azimuth), -level * np.sin(azimuth), up)
    return directions[0].astype(np.float32), directions[1].astype(np.float32), directions[2].astype(np.float32)


def _cloud_cover(
    x: NDArray[np.float32], y: NDArray[np.float32], z: NDArray[np.float32], seed: int, threshold: float
) -> NDArray[np.float32]:
    """Share of cloud 0..1: fractal noise on a level plane overhead, thinning into haze at the horizon."""
    lifted = np.maximum(z, 0.0) + 0.12
    size = 2048
    field = _fractal(size, seed)
    scale = size / 18.0
    columns, rows = (x / lifted) * scale + size / 2, (y / lifted) * scale + size / 2
    value = cv2.remap(
        field, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT
    )
    step = np.clip((value - threshold) / (0.74 - threshold), 0.0, 1.0)
    return np.asarray(step * step * (3.0 - 2.0 * step), dtype=np.float32)


def _fractal(size: int, seed: int) -> NDArray[np.float32]:
    """Sum octaves of smooth random fields to values about 0.5, mostly within 0.2..0.8."""
    rng = np.random.default_rng([seed & 0x7FFFFFFF, 17])
    total, weight = np.zeros((size, size), dtype=np.float32), 0.0
    for octave in range(7):
        cells = 10 * 2**octave
        share = 0.56**octave
        grid = rng.random((cells, cells), dtype=np.float32)
        total += share * cv2.resize(grid, (size, size), interpolation=cv2.INTER_CUBIC)
        weight += share
    return np.asarray(0.5 + 1.15 * (total / weight - 0.5), dtype=np.float32)
