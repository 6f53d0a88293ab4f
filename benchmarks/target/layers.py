"""Flat coloured things in space, drawn exactly into both photos of a rectified pair: what target.py composes with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import Float32Array, FloatArray
from asbuilt_bim.geometry.transform import unit

GAMMA = 2.2
_SAMPLES = 4
"""Per pixel and direction: an edge is right to a sixteenth of its contrast."""

Paint = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """A flat thing: `paint(uv_m)` gives linear BGR (N, 3) and cover 0..1 (N,); it spans `reach_m` about its centre."""

    centre_m: FloatArray  # (3,) in the rectified left frame
    u: FloatArray  # (3,) unit, right
    v: FloatArray  # (3,) unit, down
    reach_m: float
    paint: Paint


def linear(bgr: tuple[float, float, float]) -> FloatArray:
    """Return linear light 0..1 of a colour in grey levels."""
    return (np.asarray(bgr, dtype=np.float64) / 255.0) ** GAMMA


def facing(centre_m: FloatArray, tilt_rad: float, about_rad: float) -> tuple[FloatArray, FloatArray]:
    """Return axes u, v of a plane whose normal makes `tilt_rad` with the ray to its centre, tilted about `about_rad`.

    The tilt's axis lies in the plane square to the ray; `about_rad` counts from level.
    """
    ray = unit(centre_m)
    right = unit(np.cross([0.0, 1.0, 0.0], ray))
    down = np.cross(ray, right)
    axis = np.cos(about_rad) * right + np.sin(about_rad) * down
    across = np.cross(ray, axis)
    leaning = np.cos(tilt_rad) * across + np.sin(tilt_rad) * ray
    u = np.cos(about_rad) * axis - np.sin(about_rad) * leaning
    v = np.sin(about_rad) * axis + np.cos(about_rad) * leaning
    return u, v


def seen_from(camera: RectifiedCamera, points_m: FloatArray, shift_m: float) -> FloatArray:
    """Return pixels (N, 2) of points (N, 3) in a camera that stands `shift_m` to the right of the left one."""
    moved = points_m - [shift_m, 0.0, 0.0]
    pixels: FloatArray = camera.f_px * moved[:, :2] / moved[:, 2:] + [camera.cx_px, camera.cy_px]
    return pixels


def draw(canvas: Float32Array, layer: Layer, camera: RectifiedCamera, shift_m: float) -> None:
    """Draw a layer into a photo in linear light (H, W, 3), in place."""
    centre = layer.centre_m - [shift_m, 0.0, 0.0]
    corners = np.array([[a, b] for a in (-1, 1) for b in (-1, 1)]) * layer.reach_m
    outline = seen_from(camera, layer.centre_m + corners @ np.stack([layer.u, layer.v]), shift_m)
    height, width = canvas.shape[:2]
    x0, y0 = np.maximum(np.floor(outline.min(axis=0)) - 1, 0).astype(int)
    x1, y1 = np.minimum(np.ceil(outline.max(axis=0)) + 2, [width, height]).astype(int)
    if x1 <= x0 or y1 <= y0:
        return
    normal = np.cross(layer.u, layer.v)
    fine = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
    x = (np.arange(x0, x1)[:, None] + fine).ravel()
    y = (np.arange(y0, y1)[:, None] + fine).ravel()
    rays = np.ones((len(y), len(x), 3))
    rays[..., 0], rays[..., 1] = (x - camera.cx_px) / camera.f_px, ((y - camera.cy_px) / camera.f_px)[:, None]
    met = rays * ((centre @ normal) / (rays @ normal))[..., None] - centre
    uv = np.stack([met @ layer.u, met @ layer.v], axis=-1).reshape(-1, 2)
    colour, cover = layer.paint(uv)
    shape = (y1 - y0, _SAMPLES, x1 - x0, _SAMPLES)
    cover = cover.reshape(shape)
    colour = colour.reshape(*shape, 3) * cover[..., None]
    patch = canvas[y0:y1, x0:x1]
    patch *= (1.0 - cover.mean(axis=(1, 3)))[..., None].astype(np.float32)
    patch += colour.mean(axis=(1, 3)).astype(np.float32)
