"""Turns ray hits into radiance: texture, sun with shadow, sky with ambient occlusion, decals and the disc."""

from __future__ import annotations

import numpy as np

from asbuilt_synthetic.materials import MATERIALS
from asbuilt_synthetic.model import FloatArray, IntArray, Scene
from asbuilt_synthetic.textures import linear, tile
from asbuilt_synthetic.tracer import Tracer

_AO_REACH_M = 2.5
_MATERIALS = tuple(MATERIALS)
_LINEAR = linear(np.arange(256))


class Shader:
    """Shades hits of one scene; everything is float32 about the scene's origin."""

    def __init__(self, scene: Scene, tracer: Tracer) -> None:
        self.scene, self.tracer = scene, tracer
        bodies = tracer.bodies
        self.material = np.array([_MATERIALS.index(b.material) for b in bodies])
        shift = [np.random.default_rng([7, b.texture_seed]).uniform(0, 40, 2) * (b.texture_seed > 0) for b in bodies]
        self.shift = np.array(shift, np.float32)
        self.is_round = np.array([b.round_axis_m is not None for b in bodies])
        self.axis = np.array(
            [(0, 0) if b.round_axis_m is None else (b.round_axis_m - scene.origin_m)[:2] for b in bodies]
        )
        sun = scene.light.sun_strength
        self.sky = linear(np.array(scene.light.sky_srgb)) * (0.75 + 0.25 * (1 - sun))
        self.sun = np.array([1.0, 0.95, 0.86], np.float32) * 1.5 * sun
        self.towards_sun = scene.light.towards_sun.astype(np.float32)
        self.mean_grey = 0.16  # what the surroundings throw back

    def radiance(
        self,
        eye_m: FloatArray,
        ray: np.ndarray,
        triangle: IntArray,
        t: FloatArray,
        pixel_angle: float,
        seed: int,
        occlusion_rays: int = 6,
    ) -> np.ndarray:
        """Return linear RGB (N, 3) of rays (N, 3) with their hits; `pixel_angle` in radians."""
        out = self._sky(ray)
        hit = np.flatnonzero(triangle >= 0)
        tri = triangle[hit]
        unit = ray[hit] / np.linalg.norm(ray[hit], axis=1, keepdims=True)
        p = (eye_m - self.scene.origin_m + ray[hit] * t[hit, None]).astype(np.float32)
        normal = self.tracer.normal[tri].copy()
        body = self.tracer.body[tri]
        smooth = (body >= 0) & self.is_round[body] & (np.abs(normal[:, 2]) < 0.5)
        if smooth.any():
            r = p[smooth, :2] - self.axis[body[smooth]]
            normal[smooth] = np.c_[r / np.linalg.norm(r, axis=1, keepdims=True), np.zeros(len(r))]
        facing = -(normal * unit).sum(1)
        normal[facing < 0] *= -1
        distance = (t[hit] * np.linalg.norm(ray[hit], axis=1)).astype(np.float32)
        footprint = distance * pixel_angle / np.sqrt(np.clip(np.abs(facing), 0.15, 1))
        albedo = self._albedo(p, normal, tri, body, footprint)
        out[hit] = albedo * self._light(p, normal, distance, seed, occlusion_rays)
        return out

    def _sky(self, ray: np.ndarray) -> np.ndarray:
        up = np.clip(ray[:, 2] / np.linalg.norm(ray, axis=1), 0, 1)[:, None].astype(np.float32)
        return np.asarray(self.sky * 1.15 + (np.float32(1.1) - self.sky * 1.15) * np.exp(-6 * up), np.float32)

    def _albedo(
        self, p: np.ndarray, normal: np.ndarray, tri: IntArray, body: IntArray, footprint: np.ndarray
    ) -> np.ndarray:
        albedo = np.zeros((len(p), 3), np.float32)
        u, v = self._surface_coordinates(p, normal, body)
        kinds = np.where(body >= 0, self.material[body], -1)
        for k in np.unique(kinds[kinds >= 0]):
            pick = np.flatnonzero(kinds == k)
            surface = tile(_MATERIALS[k])
            albedo[pick] = surface.look_up(u[pick], v[pick], footprint[pick])
            # a second, larger and turned look-up breaks up the repetition
            far = surface.levels[min(3, len(surface.levels) - 1)].mean((0, 1))
            broad = surface.look_up(0.217 * v[pick] + 3.1, 0.217 * u[pick] + 1.7, 0.217 * footprint[pick] + 0.02)
            albedo[pick] *= 0.4 + 0.6 * broad / far
        if self.tracer.disc is not None:
            albedo[self.tracer.is_disc[tri]] = linear(np.array(self.tracer.disc.colour_srgb))
        decal = self.tracer.decal[tri]
        for d in np.unique(decal[decal >= 0]):
            pick = np.flatnonzero(decal == d)
            albedo[pick] = self._print(int(d), p[pick])
        return albedo

    def _print(self, index: int, p: np.ndarray) -> np.ndarray:
        decal = self.tracer.decals[index]
        c = decal.corners_m - self.scene.origin_m
        across, down = c[1] - c[0], c[3] - c[0]
        h, w = decal.image_srgb.shape[:2]
        s = ((p - c[0]) @ across / (across @ across) * w - 0.5).astype(np.float32)
        t = ((p - c[0]) @ down / (down @ down) * h - 0.5).astype(np.float32)
        x = np.clip(np.round(s), 0, w - 1).astype(np.int32)
        y = np.clip(np.round(t), 0, h - 1).astype(np.int32)
        return np.asarray(_LINEAR[decal.image_srgb[y, x]])

    def _surface_coordinates(self, p: np.ndarray, normal: np.ndarray, body: IntArray) -> tuple[np.ndarray, np.ndarray]:
        """Lay (u, v) on every surface: along the wall and up; x and y on floors; round the axis on columns."""
        tangent = np.c_[-normal[:, 1], normal[:, 0]]
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-6)
        u, v = (p[:, :2] * tangent).sum(1), -p[:, 2].copy()
        flat = np.abs(normal[:, 2]) > 0.75
        u[flat], v[flat] = p[flat, 0], p[flat, 1]
        owned = body >= 0
        round_ = owned & self.is_round[body] & ~flat
        r = p[round_, :2] - self.axis[body[round_]]
        u[round_] = np.arctan2(r[:, 1], r[:, 0]) * np.linalg.norm(r, axis=1)
        u[owned] += self.shift[body[owned], 0]
        v[owned & flat] += self.shift[body[owned & flat], 1]
        return u, v

    def _light(self, p: np.ndarray, normal: np.ndarray, distance: np.ndarray, seed: int, rays: int) -> np.ndarray:
        world = p + self.scene.origin_m + normal * np.float64(2e-3)
        slope = normal @ self.towards_sun
        lit = slope > 0
        if self.scene.light.sun_strength > 0 and lit.any():
            to_sun = np.broadcast_to(self.towards_sun, (int(lit.sum()), 3))
            lit[lit] = ~self.tracer.is_dark(world[lit], to_sun, 120.0)
        sun = self.sun * (np.maximum(slope, 0) * lit)[:, None]
        open_ = self._openness(world, normal, seed, rays)[:, None]
        dome = 0.5 + 0.5 * normal[:, 2:3]
        ambient = open_ * (self.sky * (0.30 + 0.70 * dome) + self.mean_grey * (1 - dome)) + 0.10 * (1 - open_)
        haze = np.exp(-distance / 400.0)[:, None]
        return np.asarray((sun + ambient) * haze + 0.3 * (1 - haze), np.float32)

    def _openness(self, world: np.ndarray, normal: np.ndarray, seed: int, rays: int) -> np.ndarray:
        """Return the share of short rays over the surface that meet nothing, by a few random ones a hit."""
        rng = np.random.default_rng(seed)
        free = np.zeros(len(world), np.float32)
        for k in range(rays):
            z = (k + rng.random(len(world), np.float32)) / rays
            a = rng.random(len(world), np.float32) * np.float32(2 * np.pi)
            r = np.sqrt(1 - z * z)
            d = np.c_[r * np.cos(a), r * np.sin(a), z].astype(np.float32) + 1.05 * normal
            d /= np.linalg.norm(d, axis=1, keepdims=True)
            free += ~self.tracer.is_dark(world, d, _AO_REACH_M)
        return np.asarray(0.15 + 0.85 * free / rays, np.float32)
