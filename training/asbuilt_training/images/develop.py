"""What a camera and its file make of radiance: rain, lens, exposure, noise, colour, tone, JPEG."""

from __future__ import annotations

import cv2
import numpy as np

Rng = np.random.Generator


def develop(radiance: np.ndarray, rng: Rng) -> np.ndarray:
    """Turn linear radiance (h, w, 3) into an 8-bit RGB photo (h, w, 3) of a camera drawn at random."""
    light = _through_lens(_in_rain(radiance, rng), rng)
    level = float(np.exp(np.log(np.clip(light.mean(2), 0.01, 3.0)).mean()))
    stops = float(np.clip(rng.normal(0.0, 0.45), -1.6, 1.5))
    light = light * (0.16 / level) ** float(rng.uniform(0.7, 1.0)) * 2.0**stops
    light = light * np.exp(rng.normal(0, 0.055, 3) * [1, 0.3, 1]).astype(np.float32)
    value = _tone(_noisy(light, rng), rng)
    srgb = np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055)
    photo = np.clip(_graded(srgb.astype(np.float32), rng) * 255 + 0.5, 0, 255).astype(np.uint8)
    quality = int(rng.integers(40, 96))
    return _as_stored(photo, quality)


def _in_rain(radiance: np.ndarray, rng: Rng) -> np.ndarray:
    """Veil one picture in twelve with streaks."""
    if rng.random() > 0.08:
        return radiance
    h, w = radiance.shape[:2]
    drops = (rng.random((h, w)) < rng.uniform(0.002, 0.02)).astype(np.float32)
    length, slope = int(rng.integers(5, 19)), rng.uniform(-0.3, 0.3)
    kernel = np.zeros((length, length), np.float32)
    for k in range(length):
        kernel[k, int(np.clip(length / 2 + slope * (k - length / 2), 0, length - 1))] = 1 / length
    veil = cv2.filter2D(drops, -1, kernel)[..., None] * rng.uniform(0.5, 2.0)
    return np.asarray(radiance * (1 - 0.1 * veil) + 0.35 * veil * radiance.mean(), np.float32)


def _through_lens(light: np.ndarray, rng: Rng) -> np.ndarray:
    """Blur a little (defocus, or the hand's motion), and darken the corners."""
    h, w = light.shape[:2]
    blur = float(np.clip(np.exp(rng.normal(-0.7, 0.45)), 0.25, 1.6))
    light = cv2.GaussianBlur(np.minimum(light, 8.0).astype(np.float32), (0, 0), blur)
    if rng.random() < 0.1:
        n = int(rng.choice([3, 5]))
        path = np.zeros((n, n), np.float32)
        angle = rng.uniform(0, np.pi)
        for k in np.linspace(-(n // 2), n // 2, 4 * n):
            path[round(n // 2 + k * np.sin(angle)), round(n // 2 + k * np.cos(angle))] += 1
        light = cv2.filter2D(light, -1, path / path.sum())
    y, x = np.mgrid[0:h, 0:w].astype(np.float32)
    r2 = ((x - w / 2) ** 2 + (y - h / 2) ** 2) / (w * w / 4)
    return np.asarray(light * (1 - rng.uniform(0, 0.3) * r2 / 1.6)[..., None], np.float32)


def _noisy(light: np.ndarray, rng: Rng) -> np.ndarray:
    well = float(np.exp(rng.uniform(np.log(600), np.log(20000))))
    electrons = np.clip(light, 0, 6) * well
    read = rng.uniform(3, 14)
    noise = rng.standard_normal(light.shape, np.float32) * np.sqrt(electrons + read**2)
    if rng.random() < 0.4:  # a phone has smoothed its noise into blotches
        noise = cv2.GaussianBlur(noise, (0, 0), float(rng.uniform(0.5, 1.0))) * 1.6
    return np.asarray(np.clip((electrons + noise) / well, 0, None), np.float32)


def _tone(value: np.ndarray, rng: Rng) -> np.ndarray:
    """Bend the highlights: from a hard clip to a soft shoulder."""
    soft = float(rng.uniform(0.0, 0.9))
    bent = value * (1 + 0.12 * value) / (1 + 0.42 * value)
    return np.asarray(np.clip(value + soft * (bent - value), 0, 1), np.float32)


def _graded(srgb: np.ndarray, rng: Rng) -> np.ndarray:
    """Change contrast, colourfulness, and sharpen as cameras do."""
    grey = srgb.mean(2, keepdims=True)
    srgb = grey + (srgb - grey) * float(np.clip(rng.normal(1.0, 0.25), 0.0, 1.6))
    srgb = 0.45 + (srgb - 0.45) * float(np.clip(rng.normal(1.0, 0.13), 0.6, 1.4)) + float(rng.normal(0, 0.025))
    if rng.random() < 0.4:
        srgb = srgb + float(rng.uniform(0.2, 1.0)) * (srgb - cv2.GaussianBlur(srgb, (0, 0), 1.0))
    return np.asarray(srgb, np.float32)


def _as_stored(photo: np.ndarray, quality: int) -> np.ndarray:
    ok, file = cv2.imencode(".jpg", photo[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not ok:
        raise RuntimeError(f"OpenCV could not write a JPEG of {photo.shape[1]}x{photo.shape[0]} at quality {quality}")
    return np.asarray(cv2.cvtColor(np.asarray(cv2.imdecode(file, cv2.IMREAD_COLOR)), cv2.COLOR_BGR2RGB), np.uint8)
