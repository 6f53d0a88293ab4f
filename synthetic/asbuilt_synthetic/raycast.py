"""Renders a photo in seconds by casting rays: exact edges by supersampling, textures fixed to the surfaces."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from asbuilt_synthetic.lens import camera_of, directions, world_from_camera
from asbuilt_synthetic.model import CameraTruth, FloatArray, Scene, Station
from asbuilt_synthetic.shading import Shader
from asbuilt_synthetic.tracer import Tracer

Key = tuple[tuple[float, ...], tuple[float, ...], int, int]
# Samples of an edge pixel: one in each column and each row of an 8 x 8 grid. So upright and level edges, too, are
# covered to an eighth of a pixel before roll and lens average that away.
_EDGE_ROOKS = (4, 1, 6, 3, 0, 5, 2, 7)
_FULL_WELL_E = 9000.0
_READ_NOISE_E = 9.0
_BLUR_PX = 0.45
_SENSITIVITY = 0.8  # sunlit white paper stays below clipping


def render(scene: Scene, station: Station, side: str) -> np.ndarray:
    """Take the photo of one camera at a station: uint8 RGB (H, W, 3), distorted as the lens does."""
    camera = camera_of(scene.rig, side)
    pose = world_from_camera(scene.rig, station, side)
    tracer, shader = _prepare(scene, station)
    seed = hash_of(scene, station, side)
    h, w = camera.height_px, camera.width_px
    angle = 1.0 / float(camera.K[0, 0])
    ray = _rays(_key(camera))[0] @ pose[:3, :3].T.astype(np.float32)
    triangle, t = tracer.first_hit(pose[:3, 3], ray)
    image = shader.radiance(pose[:3, 3], ray, triangle, t, angle, seed)
    fine = np.flatnonzero(_needs_more(tracer, triangle.reshape(h, w), t.reshape(h, w), image.mean(1).reshape(h, w)))
    if len(fine):
        image[fine] = _supersampled(shader, tracer, camera, pose, fine, angle, seed)
    return _develop(image.reshape(h, w, 3) * scene.light.exposure * _SENSITIVITY, seed)


def hash_of(scene: Scene, station: Station, side: str) -> int:
    """Return the noise seed of a photo."""
    index = next((i for i, s in enumerate(scene.stations) if s is station or s.name == station.name), 0)
    return (scene.seed * 1000 + scene.visit * 100 + index) * 2 + (side == "right")


@lru_cache(maxsize=2)
def _prepare(scene: Scene, station: Station) -> tuple[Tracer, Shader]:
    tracer = Tracer(scene.origin_m, (*scene.bodies, *station.bodies), scene.decals, station.disc)
    return tracer, Shader(scene, tracer)


def _needs_more(tracer: Tracer, triangle: np.ndarray, t: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Mark pixels at edges: another surface, a jump in depth or, on prints, in tone within a pixel."""
    owner = np.where(
        triangle >= 0, tracer.body[triangle] * 4096 + tracer.face[triangle] + 4 * tracer.is_disc[triangle], -9
    )
    normal = np.where((triangle >= 0)[..., None], tracer.normal[triangle], 0)
    print_ = (triangle >= 0) & (tracer.decal[triangle] >= 0)
    with np.errstate(invalid="ignore"):
        edge = np.zeros(triangle.shape, bool)
        for axis in (0, 1):
            a, b = (slice(1, None), slice(None)), (slice(None, -1), slice(None))
            if axis == 1:
                a, b = (a[1], a[0]), (b[1], b[0])
            jump = (owner[a] != owner[b]) | (np.abs(1 / t[a] - 1 / t[b]) * np.minimum(t[a], t[b]) > 0.01)
            jump |= (normal[a] * normal[b]).sum(-1) < 0.95
            edge[a] |= jump
            edge[b] |= jump
    square = np.ones((3, 3), np.uint8)
    grey = grey.astype(np.float32)
    edge |= print_ & (cv2.dilate(grey, square) > 1.25 * cv2.erode(grey, square))
    return np.asarray(cv2.dilate(edge.astype(np.uint8), square).astype(bool).ravel())


def _supersampled(
    shader: Shader, tracer: Tracer, camera: CameraTruth, pose: FloatArray, pixels: np.ndarray, angle: float, seed: int
) -> np.ndarray:
    total = np.zeros((len(pixels), 3), np.float64)
    middle, per_x, per_y = (r[pixels] @ pose[:3, :3].T.astype(np.float32) for r in _rays(_key(camera)))
    n = len(_EDGE_ROOKS)
    for k, row in enumerate(_EDGE_ROOKS):
        dx, dy = (k + 0.5) / n - 0.5, (row + 0.5) / n - 0.5
        ray = middle + np.float32(dx) * per_x + np.float32(dy) * per_y
        triangle, t = tracer.first_hit(pose[:3, 3], ray)
        total += shader.radiance(pose[:3, 3], ray, triangle, t, angle, seed + 17 * (k + 1), 1)
    return total / n


def _key(camera: CameraTruth) -> Key:
    return (tuple(camera.K.ravel().tolist()), tuple(camera.distortion.tolist()), camera.width_px, camera.height_px)


@lru_cache(maxsize=4)
def _rays(key: Key) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the camera-frame rays (H*W, 3) through every pixel, and their change per pixel in x and in y."""
    matrix, distortion, w, h = key
    camera = CameraTruth(K=np.array(matrix).reshape(3, 3), distortion=np.array(distortion), width_px=w, height_px=h)
    y, x = np.mgrid[0:h, 0:w].astype(np.float64)
    ray = directions(camera, np.c_[x.ravel(), y.ravel()]).reshape(h, w, 3)
    per_y, per_x = np.asarray(np.gradient(ray, axis=0)), np.asarray(np.gradient(ray, axis=1))
    flat = [r.reshape(-1, 3).astype(np.float32) for r in (ray, per_x, per_y)]
    return flat[0], flat[1], flat[2]


def _develop(radiance: np.ndarray, seed: int) -> np.ndarray:
    """Turn radiance into an 8-bit photo: vignetting, optical blur, photon and read noise, tone curve."""
    rng = np.random.default_rng([seed, 11])
    h, w = radiance.shape[:2]
    y, x = np.mgrid[0:h, 0:w].astype(np.float32)
    r2 = ((x - w / 2) ** 2 + (y - h / 2) ** 2) / (w * w / 4)
    light = cv2.GaussianBlur((radiance * (1 - 0.13 * r2)[..., None]).astype(np.float32), (0, 0), _BLUR_PX)
    electrons = np.clip(light, 0, 4) * _FULL_WELL_E
    noise = rng.standard_normal(light.shape, np.float32) * np.sqrt(electrons + _READ_NOISE_E**2)
    value = np.clip((electrons + noise) / _FULL_WELL_E, 0, None)
    value = value * (1 + value * 0.12) / (1 + value * 0.42)  # a soft shoulder
    srgb = np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055)
    return np.asarray(np.clip(srgb * 255 + 0.5, 0, 255), np.uint8)
