"""Draws the light of a scene: sun, sky, clouds and haze."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

_CLOUD_TEXELS = 256


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Weather:
    """Radiances are linear RGB (3,); `towards_sun` a unit vector, z up."""

    towards_sun: np.ndarray
    sun: np.ndarray
    zenith: np.ndarray
    horizon: np.ndarray
    bounce: np.ndarray
    haze_m: float  # the distance over which 63 % of the contrast is lost
    cover: float  # 0 a clear sky .. 1 wholly clouded
    clouds: np.ndarray  # (n, n) float32 0..1, periodic
    open_reach_m: float  # things further off darken no surface


def draw_weather(rng: np.random.Generator) -> Weather:
    """Draw a clear, hazy, clouded, wet or dull day, low sun or high."""
    azimuth, height = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(7, 68))
    towards = np.array([np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)])
    strength = float(rng.choice([0.0, 0.0, 0.3, 0.7, 1.0, 1.3]))
    low = 1 - np.sin(height)
    sun = 1.5 * strength * np.array([1.0, 0.96 - 0.14 * low**2, 0.88 - 0.38 * low**2])
    cover = float(rng.uniform(0.0, 0.7)) if strength > 0.5 else float(rng.uniform(0.6, 1.0))
    blue = np.array([rng.uniform(0.25, 0.5), rng.uniform(0.42, 0.6), rng.uniform(0.65, 0.95)])
    grey = np.full(3, rng.uniform(0.45, 0.85)) * [0.98, 1.0, 1.03]
    zenith = blue * (1 - cover) + grey * cover
    horizon = (0.45 * zenith + 0.55) * rng.uniform(0.8, 1.25)
    bounce = rng.uniform(0.08, 0.26) * np.array([1.05, 1.0, 0.92])
    return Weather(
        towards_sun=towards, sun=sun.astype(np.float32), zenith=zenith.astype(np.float32),
        horizon=horizon.astype(np.float32), bounce=bounce.astype(np.float32),
        haze_m=float(np.exp(rng.uniform(np.log(200), np.log(5000)))), cover=cover, clouds=_clouds(rng),
        open_reach_m=float(np.exp(rng.uniform(np.log(2.5), np.log(25)))),
    )  # fmt: skip


def sky(weather: Weather, ray: np.ndarray) -> np.ndarray:
    """Return the sky's radiance (N, 3) along rays (N, 3) of any length."""
    unit = ray / np.linalg.norm(ray, axis=1, keepdims=True)
    up = np.clip(unit[:, 2:], 0, 1)
    out = weather.zenith + (weather.horizon - weather.zenith) * np.exp(-5 * up)
    n = _CLOUD_TEXELS
    where = unit[:, :2] / (np.abs(unit[:, 2:]) + 0.12) * 40
    x, y = (np.mod(where[:, k], n).astype(np.int32) % n for k in (0, 1))
    cloud = np.clip((weather.clouds[y, x] - 1 + weather.cover) * 2.5, 0, 1)[:, None]
    bright = weather.horizon * (0.75 + 0.4 * weather.clouds[x, y][:, None])
    out = out + 0.8 * cloud * (bright - out)
    glow = np.clip(unit @ weather.towards_sun.astype(np.float32), 0, 1)[:, None] ** 24
    return np.asarray(out + 0.9 * glow * weather.sun * (1 - 0.7 * weather.cover), np.float32)


def _clouds(rng: np.random.Generator) -> np.ndarray:
    n = _CLOUD_TEXELS
    total = np.zeros((n, n), np.float32)
    for k in range(5):
        cells = 6 * 2**k
        grid = np.pad(rng.random((cells, cells), np.float32), 2, mode="wrap")
        big = cv2.resize(grid, None, fx=n / cells, fy=n / cells, interpolation=cv2.INTER_CUBIC)
        edge = round(2 * n / cells)
        total += 0.55**k * big[edge : edge + n, edge : edge + n]
    low, high = np.quantile(total, (0.01, 0.99))
    return np.asarray(np.clip((total - low) / (high - low), 0, 1), np.float32)
