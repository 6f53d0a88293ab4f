"""Casts the rays of one picture: radiance, class, instance and inverse depth of every pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from asbuilt_synthetic.model import FloatArray, IntArray

from asbuilt_training.images.stage import Stage
from asbuilt_training.images.weather import sky

WIDTH_PX, HEIGHT_PX = 384, 288
_EDGE_SAMPLES = ((-0.33, -0.12), (0.12, -0.33), (0.33, 0.28))  # beside the pixel's middle
_OPEN_RAYS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """Where a picture is taken: pose (4, 4), camera x right, y down, z forward; a pinhole with square pixels."""

    world_from_camera: FloatArray
    fx_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layers:
    """One picture before the camera's own doing: (h, w, 3) linear radiance, and (h, w) truth at pixel middles."""

    radiance: np.ndarray
    kind: np.ndarray  # uint8
    instance: np.ndarray  # uint16
    inverse_depth_per_m: np.ndarray  # float32, 0 for sky


def rays(view: View, width_px: int, height_px: int, shift_px: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Return the rays (h*w, 3) in world whose parameter is the depth Z."""
    scale = WIDTH_PX / width_px
    x = (np.arange(width_px) - (width_px - 1) / 2 + shift_px[0]) * scale / view.fx_px
    y = (np.arange(height_px) - (height_px - 1) / 2 + shift_px[1]) * scale / view.fx_px
    u, v = np.meshgrid(x, y)
    camera = np.stack([u, v, np.ones_like(u)], -1).reshape(-1, 3).astype(np.float32)
    return np.asarray(camera @ view.world_from_camera[:3, :3].T.astype(np.float32))


def draw(stage: Stage, view: View, rng: np.random.Generator) -> Layers:
    """Take one picture of a stage."""
    h, w = HEIGHT_PX, WIDTH_PX
    eye, ray = view.world_from_camera[:3, 3], rays(view, w, h)
    triangle, t = stage.tracer.first_hit(eye, ray)
    hit = triangle >= 0
    surface = np.where(hit, stage.surface[triangle], -1).reshape(h, w)
    inverse = np.where(hit, 1 / np.maximum(t, 1e-3), 0).astype(np.float32).reshape(h, w)
    open_ = np.ones(h * w, np.float32)
    place = (eye - stage.origin_m + ray * np.where(hit, t, 0)[:, None]).astype(np.float32)
    open_[hit] = _openness(stage, place[hit], _facing(stage, triangle[hit], ray[hit], place[hit]), rng)
    open_ = _smoothed(open_.reshape(h, w), surface).ravel()
    image = _radiance(stage, view, ray, triangle, t, open_)
    edge = np.flatnonzero(_edges(surface, inverse))
    if len(edge):
        total = image[edge]
        for shift in _EDGE_SAMPLES:
            more = rays(view, w, h, shift)[edge]
            tri, far = stage.tracer.first_hit(eye, more)
            total += _radiance(stage, view, more, tri, far, open_[edge])
        image[edge] = total / (1 + len(_EDGE_SAMPLES))
    return layers(stage, triangle, t, image.reshape(h, w, 3))


def layers(stage: Stage, triangle: IntArray, t: FloatArray, radiance: np.ndarray) -> Layers:
    """Put beside a picture (h, w, 3) what its pixels' rays have hit: triangles (h*w,), -1 none, at depths t."""
    shape, hit = radiance.shape[:2], triangle >= 0
    body = stage.tracer.body[triangle]
    return Layers(
        radiance=radiance,
        kind=np.where(hit, stage.kind[body], 0).astype(np.uint8).reshape(shape),
        instance=np.where(hit, stage.instance[body], 0).astype(np.uint16).reshape(shape),
        inverse_depth_per_m=np.where(hit, 1 / np.maximum(t, 1e-3), 0).astype(np.float32).reshape(shape),
    )


def _edges(surface: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Mark (h, w) the pixels where the surface changes, or the depth jumps, to a neighbour."""
    edge = np.zeros(surface.shape, bool)
    for a, b in (
        ((slice(1, None),), (slice(None, -1),)),
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
    ):
        jump = (surface[a] != surface[b]) | (
            np.abs(inverse[a] - inverse[b]) > 0.03 * np.maximum(inverse[a], inverse[b])
        )
        edge[a] |= jump
        edge[b] |= jump
    return edge


def _facing(stage: Stage, triangle: IntArray, ray: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return normals (N, 3) that look at the camera, smooth round columns."""
    normal = stage.tracer.normal[triangle].copy()
    body = stage.tracer.body[triangle]
    smooth = stage.is_round[body] & (np.abs(normal[:, 2]) < 0.5)
    if smooth.any():
        r = place[smooth, :2] - stage.axis[body[smooth]]
        normal[smooth] = np.c_[r / np.maximum(np.linalg.norm(r, axis=1, keepdims=True), 1e-6), np.zeros(len(r))]
    normal[(normal * ray).sum(1) > 0] *= -1
    return np.asarray(normal, np.float32)


def _radiance(
    stage: Stage, view: View, ray: np.ndarray, triangle: IntArray, t: FloatArray, open_: np.ndarray
) -> np.ndarray:
    out = sky(stage.weather, ray) if (triangle < 0).any() else np.zeros((len(ray), 3), np.float32)
    hit = np.flatnonzero(triangle >= 0)
    tri, ray_, weather = triangle[hit], ray[hit], stage.weather
    length = np.linalg.norm(ray_, axis=1)
    eye = view.world_from_camera[:3, 3] - stage.origin_m
    p = (eye + ray_ * t[hit, None]).astype(np.float32)
    normal = _facing(stage, tri, ray_, p)
    slant = np.clip(-(normal * ray_).sum(1) / length, 0.15, 1)
    distance = (t[hit] * length).astype(np.float32)
    albedo = _albedo(stage, p, tri, distance / (view.fx_px * np.sqrt(slant)))
    slope = np.maximum(normal @ weather.towards_sun.astype(np.float32), 0)
    lit = slope > 0
    if weather.sun.any() and lit.any():
        start = p[lit] + stage.origin_m + 3e-3 * normal[lit]
        to_sun = np.broadcast_to(weather.towards_sun.astype(np.float32), start.shape)
        lit[lit] = ~stage.tracer.is_dark(start, to_sun, 150.0)
    dome = 0.5 + 0.5 * normal[:, 2:3]
    free = open_[hit, None]
    ambient = free * (weather.zenith * (0.3 + 0.7 * dome) + weather.bounce * (1 - dome)) + 0.5 * weather.bounce * (
        1 - free
    )
    clear = np.exp(-distance / weather.haze_m)[:, None]
    out[hit] = albedo * (weather.sun * (slope * lit)[:, None] + ambient) * clear + 0.7 * weather.horizon * (1 - clear)
    return out


def _albedo(stage: Stage, p: np.ndarray, triangle: IntArray, footprint: np.ndarray) -> np.ndarray:
    """Look the pattern up at places p (N, 3) about the origin: once fine, once broad against repetition."""
    body = stage.tracer.body[triangle]
    u, v = (p * stage.along[triangle]).sum(1), (p * stage.across[triangle]).sum(1)
    bent = stage.is_round[body] & (np.abs(stage.tracer.normal[triangle][:, 2]) < 0.5)
    r = p[bent, :2] - stage.axis[body[bent]]
    u[bent] = np.arctan2(r[:, 1], r[:, 0]) * np.linalg.norm(r, axis=1)
    u += stage.shift[body, 0]
    level = np.abs(stage.tracer.normal[triangle][:, 2]) > 0.75
    v[level] += stage.shift[body[level], 1]
    out = np.zeros((len(p), 3), np.float32)
    look = stage.look[body]
    for k in np.unique(look):
        at = np.flatnonzero(look == k)
        own = stage.looks[k]
        s, t, f = u[at] / own.scale, v[at] / own.scale, footprint[at] / own.scale
        broad = own.tile.look_up(0.217 * t + 3.1, 0.217 * s + 1.7, 0.217 * f + 0.03)
        out[at] = own.tile.look_up(s, t, f) * (0.65 + 0.35 * broad / own.tile.levels[-1].mean((0, 1))) * own.gain
    return np.asarray(np.clip(out * stage.tone[body], 0.01, 0.95), np.float32)


def _openness(stage: Stage, p: np.ndarray, normal: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the share of short rays over the surface (N,) that meet nothing."""
    start = p + stage.origin_m + 3e-3 * normal
    free = np.zeros(len(p), np.float32)
    for k in range(_OPEN_RAYS):
        z = (k + rng.random(len(p), np.float32)) / _OPEN_RAYS
        a = rng.random(len(p), np.float32) * np.float32(2 * np.pi)
        r = np.sqrt(1 - z * z)
        d = np.stack([r * np.cos(a), r * np.sin(a), z], 1) + 1.05 * normal
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        free += ~stage.tracer.is_dark(start, d.astype(np.float32), stage.weather.open_reach_m)
    return np.asarray(0.15 + 0.85 * free / _OPEN_RAYS, np.float32)


def _smoothed(value: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """Average over neighbours on the same piece of surface, twice and wider the second time: few rays leave grain."""
    h, w = value.shape
    for step in (1, 3, 7):
        total, count = value.copy(), np.ones_like(value)
        for dy, dx in ((0, step), (step, 0), (step, step), (step, -step)):
            a = (slice(dy, None), slice(max(dx, 0), w + min(dx, 0)))
            b = (slice(None, h - dy), slice(max(-dx, 0), w + min(-dx, 0)))
            same = (surface[a] == surface[b]).astype(np.float32)
            total[a] += same * value[b]
            total[b] += same * value[a]
            count[a] += same
            count[b] += same
        value = total / count
    return np.asarray(value, np.float32)
