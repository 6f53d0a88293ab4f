"""From linear radiance on the sensor to the 8-bit photo: exposure, vignetting, noise, tone curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_FULL_WELL_ELECTRONS = 9000.0
_READ_NOISE = 0.0012
_CORNER_FALL_OFF = 0.16
_KEY = 0.155
"""Radiance (after exposure) that the middle of a picture is exposed to."""


def auto_exposure(preview: NDArray[np.float32]) -> float:
    """Meter a small linear preview (h, w, 3) as a camera does: centre-weighted, damped, bounded."""
    luminance = preview @ np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
    height, width = luminance.shape
    across = np.linspace(-1.0, 1.0, width)[None, :]
    down = np.linspace(-1.0, 1.0, height)[:, None]
    weight = np.exp(-1.2 * (across**2 + (down - 0.15) ** 2))
    level = float(np.exp(np.average(np.log(np.clip(luminance, 0.004, 1.2)), weights=weight)))
    return float(np.clip((_KEY / level) ** 0.8, 0.4, 6.0))


def develop(radiance: NDArray[np.float32], exposure: float, noise_seed: list[int]) -> NDArray[np.uint8]:
    """Turn radiance (H, W, 3) into an sRGB photo; the noise is the sensor's and differs in every photo."""
    height, width, _ = radiance.shape
    columns = (np.arange(width, dtype=np.float32) - (width - 1) / 2.0)[None, :]
    rows = (np.arange(height, dtype=np.float32) - (height - 1) / 2.0)[:, None]
    squared = (columns**2 + rows**2) / float((width / 2.0) ** 2 + (height / 2.0) ** 2)
    falling = (1.0 - _CORNER_FALL_OFF * squared * (0.6 + 0.4 * squared))[..., None]
    signal = np.clip(radiance * exposure * falling, 0.0, 8.0)
    rng = np.random.default_rng(noise_seed)
    sigma = np.sqrt(signal / _FULL_WELL_ELECTRONS + _READ_NOISE**2)
    noisy = signal + sigma * rng.standard_normal(signal.shape, dtype=np.float32)
    encoded = _srgb_encoded(_tone_curve(np.maximum(noisy, 0.0)))
    dither = rng.random(encoded.shape, dtype=np.float32) - 0.5
    return np.asarray(np.clip(np.rint(encoded * 255.0 + 0.5 * dither), 0, 255), dtype=np.uint8)


def _tone_curve(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Roll highlights off and deepen shadows a little (Narkowicz 2015, the ACES fit, toe lifted)."""
    x = linear * 0.78
    return np.asarray(np.clip((x * (2.51 * x + 0.06)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0), dtype=np.float32)


def _srgb_encoded(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    low = linear * 12.92
    high = 1.055 * np.power(np.maximum(linear, 0.0031308), 1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, low, high)
