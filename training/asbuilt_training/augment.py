"""Pictures made different on purpose: what the camera, the weather and the light do, as much as a short run can bear.

What was drawn is too clean, and a network that may learn it clean fails on the first photograph. Nothing here
moves a pixel; see `samples` for crops and flips.
"""

from __future__ import annotations

import cv2
import numpy as np
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array


def disturbed(rng: np.random.Generator, rgb: ByteImage, inverse_depth_per_m: Float32Array) -> ByteImage:
    """Return an RGB picture (h, w, 3) with other light, weather, colours, sharpness, noise and compression."""
    picture = rgb.astype(np.float32) * np.float32(1 / 255)
    if rng.random() < 0.3:
        picture *= _uneven_light(rng, *rgb.shape[:2])[..., None]
    if rng.random() < 0.15 and inverse_depth_per_m.any():
        picture = _hazy(rng, picture, inverse_depth_per_m)
    picture = _tones(rng, picture)
    if rng.random() < 0.35:
        picture = _blurred(rng, picture)
    if rng.random() < 0.5:
        picture += _noise(rng, *rgb.shape[:2])
    out = np.clip(picture * 255.0, 0.0, 255.0).astype(np.uint8)
    if rng.random() < 0.35:
        quality = int(rng.integers(25, 95))
        _, packed = cv2.imencode(".jpg", out, [cv2.IMWRITE_JPEG_QUALITY, quality])
        out = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), dtype=np.uint8)  # channels as they went in
    return out


def cut_out(rng: np.random.Generator, rgb: ByteImage, kind: np.ndarray) -> None:
    """Cover a few patches with something flat or noisy, in place; nothing is asked about them (255)."""
    height, width = kind.shape
    for _ in range(int(rng.integers(1, 4))):
        w, h = int(rng.integers(width // 20, width // 5)), int(rng.integers(height // 20, height // 4))
        x, y = int(rng.integers(0, width - w)), int(rng.integers(0, height - h))
        patch = rgb[y : y + h, x : x + w]
        patch[:] = rng.integers(0, 256, 3 if rng.random() < 0.6 else patch.shape, dtype=np.uint8)
        kind[y : y + h, x : x + w] = 255


def _uneven_light(rng: np.random.Generator, height: int, width: int) -> Float32Array:
    """Return a factor (h, w) for each pixel: clouds, stains, and the hard shadow of something out of sight."""
    size = int(rng.integers(2, 10))
    bumps = rng.standard_normal((size, size + 1), dtype=np.float32)
    light = np.exp(
        cv2.resize(bumps, (width, height), interpolation=cv2.INTER_CUBIC) * np.float32(rng.uniform(0.03, 0.2))
    )
    if rng.random() < 0.4:
        corners = rng.uniform(-0.3, 1.3, (int(rng.integers(3, 6)), 2)) * (width, height)
        shadow = np.zeros((height, width), dtype=np.uint8)
        cv2.fillPoly(shadow, [corners.astype(np.int32)], 255)
        soft = cv2.blur(shadow, (3, 3)).astype(np.float32) * np.float32(rng.uniform(0.15, 0.55) / 255)
        light = light * (1.0 - soft)
    return np.asarray(light, dtype=np.float32)


def _hazy(rng: np.random.Generator, picture: Float32Array, inverse_depth_per_m: Float32Array) -> Float32Array:
    """Let the air swallow what is far."""
    depth_m = 1.0 / np.maximum(inverse_depth_per_m, 1e-3)
    clear = np.exp(-depth_m * np.float32(1.0 / rng.uniform(15.0, 150.0)))[..., None]
    air = rng.uniform(0.5, 0.95) * rng.uniform(0.92, 1.0, 3)
    return np.asarray(picture * clear + (1.0 - clear) * air.astype(np.float32), dtype=np.float32)


def _tones(rng: np.random.Generator, picture: Float32Array) -> Float32Array:
    """Change exposure, contrast, white balance, saturation, hue and the curve; now and then to plain grey."""
    grey = np.full((3, 3), [0.3, 0.59, 0.11])
    saturation = 0.0 if rng.random() < 0.12 else rng.uniform(0.4, 1.5)
    turn = rng.normal(0.0, 0.08)
    about_grey = np.cross(np.eye(3), np.full(3, 1.0 / np.sqrt(3.0)))
    hue = np.eye(3) + np.sin(turn) * about_grey + (1.0 - np.cos(turn)) * about_grey @ about_grey
    matrix = (saturation * np.eye(3) + (1.0 - saturation) * grey) @ hue
    matrix = np.diag(np.exp(rng.normal(0.0, 0.07, 3)) * np.exp(rng.normal(0.0, 0.18))) @ matrix
    changed = cv2.transform(picture, matrix.astype(np.float32))
    middle = np.float32(changed.mean())
    changed = (
        middle + (changed - middle) * np.float32(np.exp(rng.normal(0.0, 0.15))) + np.float32(rng.normal(0.0, 0.03))
    )
    changed = np.clip(changed, 0.0, 1.0)
    curve = (np.linspace(0.0, 1.0, 1025) ** np.exp(rng.normal(0.0, 0.2))).astype(np.float32)
    return np.asarray(curve[(changed * 1024.0).astype(np.int32)])


def _blurred(rng: np.random.Generator, picture: Float32Array) -> Float32Array:
    """Take sharpness away by focus, movement or size, or add the camera's own sharpening."""
    way = rng.random()
    if way < 0.4:
        return np.asarray(cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.3, 1.6))))
    if way < 0.6:
        kernel = np.zeros((7, 7), dtype=np.float32)
        end = rng.uniform(-3.0, 3.0, 2)
        cv2.line(kernel, (3, 3), (int(3 + round(end[0])), int(3 + round(end[1]))), 1.0)
        return np.asarray(cv2.filter2D(picture, -1, kernel / kernel.sum()))
    if way < 0.8:
        height, width = picture.shape[:2]
        scale = rng.uniform(0.4, 0.9)
        small = cv2.resize(picture, (int(width * scale), int(height * scale)), interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR))
    return np.asarray(picture + np.float32(rng.uniform(0.3, 1.2)) * (picture - cv2.GaussianBlur(picture, (0, 0), 1.0)))


def _noise(rng: np.random.Generator, height: int, width: int) -> Float32Array:
    """Return noise (h, w, 3), in part the same in all colours."""
    strength = np.float32(10.0 ** rng.uniform(-2.6, -1.35))
    noise = rng.standard_normal((height, width, 1 if rng.random() < 0.5 else 3), dtype=np.float32) * strength
    return np.asarray(np.broadcast_to(noise, (height, width, 3)))
