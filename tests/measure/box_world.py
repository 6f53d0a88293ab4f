"""A small world of textured quads and round columns, ray cast into a rectified pair with exact truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from asbuilt_bim.geometry.transform import rotation_from_vector


@dataclass(frozen=True, kw_only=True)
class Quad:
    """A rectangle: a corner, two edge vectors (m), in the level frame (x right, y down, z forward, camera at 0)."""

    name: str
    corner: FloatArray
    u: FloatArray
    v: FloatArray
    grey: float = 150.0
    seed: int = 0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Round:
    """A vertical round column: axis foot (x, z), radius, top and bottom y (down)."""

    name: str
    x: float
    z: float
    radius: float
    top: float
    bottom: float
    grey: float = 150.0
    seed: int = 0


@dataclass
class World:
    """What stands there, and the sky's grey."""

    quads: list[Quad] = field(default_factory=list)
    rounds: list[Round] = field(default_factory=list)
    sky: tuple[float, float, float] = (235.0, 215.0, 195.0)

    def box(self, name: str, x: float, z: float, wx: float, wz: float, top: float, bottom: float, turn: float) -> None:
        """Add an upright box centred at (x, z), turned by `turn` rad, its four sides named name/0..3 (0 faces -z)."""
        ex = np.array([np.cos(turn), 0.0, np.sin(turn)])
        ez = np.array([-np.sin(turn), 0.0, np.cos(turn)])
        centre = np.array([x, top, z])
        down = np.array([0.0, bottom - top, 0.0])
        for i, (out, along, half, width) in enumerate(
            [(-ez, ex, wz / 2, wx), (ex, ez, wx / 2, wz), (ez, -ex, wz / 2, wx), (-ex, -ez, wx / 2, wz)]
        ):
            corner = centre + out * half - along * width / 2
            grey = 150.0 + 45.0 * float(out @ np.array([0.6, 0.0, -0.8]))
            self.quads.append(
                Quad(name=f"{name}/{i}", corner=corner, u=along * width, v=down, grey=grey, seed=len(self.quads) + 7)
            )
        top_corner = centre - ex * wx / 2 - ez * wz / 2
        self.quads.append(Quad(name=f"{name}/top", corner=top_corner, u=ex * wx, v=ez * wz, grey=190.0, seed=3))

    def ground(self, y: float) -> None:
        """Add the ground at height y (down positive)."""
        self.quads.append(
            Quad(
                name="ground",
                corner=np.array([-60.0, y, -5.0]),
                u=np.array([120.0, 0.0, 0.0]),
                v=np.array([0.0, 0.0, 95.0]),
                grey=105.0,
                seed=99,
                tint=(0.8, 0.95, 1.1),
            )
        )


@lru_cache(maxsize=32)
def _noise(seed: int, size: int = 512) -> FloatArray:
    """Make a tileable texture, mean 0, sigma about 1, with power at 2 to 60 texels."""
    rng = np.random.default_rng(seed)
    total = np.zeros((size, size))
    for sigma, weight in ((0.8, 0.6), (2.5, 0.6), (8.0, 0.5), (25.0, 0.5)):
        octave = cv2.GaussianBlur(rng.standard_normal((size, size)), (0, 0), sigma, borderType=cv2.BORDER_REFLECT_101)
        total += weight * octave / octave.std()
    return total


def _shade(u_m: FloatArray, v_m: FloatArray, seed: int, texel_m: float = 0.0035) -> FloatArray:
    texture = _noise(seed).astype(np.float32)
    size = texture.shape[0] - 1
    mx = np.abs((u_m / texel_m) % (2 * size) - size).astype(np.float32)
    my = np.abs((v_m / texel_m) % (2 * size) - size).astype(np.float32)
    return cv2.remap(texture, mx, my, cv2.INTER_LINEAR)


def _window(
    quad: Quad, camera: RectifiedCamera, level_from_rect: FloatArray, origin: FloatArray, ss: int
) -> tuple[slice, slice] | None:
    """Return the part of the supersampled frame that a quad can cover; all of it where it reaches behind the camera."""
    h, w = camera.height_px * ss, camera.width_px * ss
    corners = np.array([quad.corner + a * quad.u + b * quad.v for a in (0, 1) for b in (0, 1)]) - origin
    seen = corners @ level_from_rect
    if seen[:, 2].min() < 0.2:
        return slice(0, h), slice(0, w)
    px = seen[:, :2] / seen[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    low, high = np.floor((px.min(axis=0) - 1) * ss), np.ceil((px.max(axis=0) + 2) * ss)
    x0, y0 = np.clip(low, 0, [w, h]).astype(int)
    x1, y1 = np.clip(high, 0, [w, h]).astype(int)
    return (slice(y0, y1), slice(x0, x1)) if x1 > x0 and y1 > y0 else None


def _draw(quad: Quad, rays: FloatArray, origin: FloatArray, depth: FloatArray, image: np.ndarray, grain: float) -> None:
    normal = np.cross(quad.u, quad.v)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((quad.corner - origin) @ normal) / (rays @ normal)
    hit = origin + rays * t[..., None] - quad.corner
    s, r = hit @ quad.u / (quad.u @ quad.u), hit @ quad.v / (quad.v @ quad.v)
    inside = (t > 0.05) & (t < depth) & (s >= 0) & (s <= 1) & (r >= 0) & (r <= 1)
    if inside.any():
        depth[inside] = t[inside]
        tone = quad.grey + grain * _shade(s * np.linalg.norm(quad.u), r * np.linalg.norm(quad.v), quad.seed)
        image[inside] = tone[inside][:, None] * np.array(quad.tint)


def _view(
    world: World, camera: RectifiedCamera, level_from_rect: FloatArray, shift: float, ss: int, grain: float
) -> np.ndarray:
    h, w = camera.height_px * ss, camera.width_px * ss
    ys, xs = np.mgrid[0:h, 0:w].astype(np.float64)
    xs = (xs + 0.5) / ss - 0.5
    ys = (ys + 0.5) / ss - 0.5
    rays = np.stack([(xs - camera.cx_px) / camera.f_px, (ys - camera.cy_px) / camera.f_px, np.ones_like(xs)], -1)
    rays = rays @ level_from_rect.T
    origin = level_from_rect @ np.array([shift, 0.0, 0.0])
    depth = np.full((h, w), np.inf)
    image = np.empty((h, w, 3), dtype=np.float32)
    image[:] = world.sky
    for quad in world.quads:
        window = _window(quad, camera, level_from_rect, origin, ss)
        if window is None:
            continue
        _draw(quad, rays[window], origin, depth[window], image[window], grain)
    for one in world.rounds:
        ox, oz = origin[0] - one.x, origin[2] - one.z
        a = rays[..., 0] ** 2 + rays[..., 2] ** 2
        b = rays[..., 0] * ox + rays[..., 2] * oz
        c = ox**2 + oz**2 - one.radius**2
        with np.errstate(invalid="ignore"):
            t = (-b - np.sqrt(b * b - a * c)) / a
        y = origin[1] + rays[..., 1] * t
        inside = (t > 0.05) & (t < depth) & (y >= one.top) & (y <= one.bottom)
        depth[inside] = t[inside]
        angle = np.arctan2(ox + rays[..., 0] * t, -(oz + rays[..., 2] * t))
        tone = (
            one.grey
            + 40 * np.sin(angle)
            + grain * _shade(np.nan_to_num(angle) * one.radius, np.nan_to_num(y), one.seed)
        )
        image[inside] = tone[inside][:, None]
    small = cv2.resize(image, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (0, 0), 0.55)


def make_camera(width: int = 640, height: int = 480, f: float = 525.0, b: float = 0.25) -> RectifiedCamera:
    """Return a rectified camera whose left frame IS the rectified frame."""
    return RectifiedCamera(
        f_px=f,
        cx_px=width / 2 - 3.3,
        cy_px=height / 2 + 2.1,
        baseline_m=b,
        width_px=width,
        height_px=height,
        rectified_from_left=np.eye(3),
    )


def photograph(
    world: World,
    camera: RectifiedCamera,
    pitch_rad: float = 0.0,
    roll_rad: float = 0.0,
    noise: float = 1.5,
    supersample: int = 3,
    seed: int = 5,
    grain: float = 14.0,
) -> tuple[RectifiedPair, FloatArray]:
    """Return the pair and `level_from_rectified` (3, 3); a positive pitch looks down."""
    level_from_rect = rotation_from_vector([0.0, 0.0, roll_rad]) @ rotation_from_vector([-pitch_rad, 0.0, 0.0])
    rng = np.random.default_rng(seed)
    pictures: list[ByteImage] = []
    for shift in (0.0, camera.baseline_m):
        clean = _view(world, camera, level_from_rect, shift, supersample, grain)
        noisy = clean + rng.normal(0.0, noise, clean.shape)
        pictures.append(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    valid = np.ones((camera.height_px, camera.width_px), dtype=bool)
    return (
        RectifiedPair(
            name="T", left=pictures[0], right=pictures[1], valid_left=valid, valid_right=valid, camera=camera
        ),
        level_from_rect,
    )


@lru_cache(maxsize=1)
def site() -> tuple[World, RectifiedPair, FloatArray]:
    """Return a small site: a column corner-on, a round column, a wall with its end, a far wall; photographed once."""
    world = World()
    world.ground(1.5)
    world.box("column", -0.95, 4.2, 0.45, 0.45, -1.15, 1.5, 0.55)
    world.box("wall", 1.35, 5.2, 1.7, 0.3, -1.1, 1.5, 0.35)
    world.rounds.append(Round(name="round", x=0.05, z=4.6, radius=0.2, top=-1.1, bottom=1.5, seed=44))
    world.quads.append(
        Quad(
            name="far", corner=np.array([-20.0, -2.0, 18.0]), u=np.array([40.0, 0.0, 1.0]), v=np.array([0.0, 3.5, 0.0]),
            grey=120.0, seed=61, tint=(0.75, 0.95, 1.15),
        )
    )  # fmt: skip
    kept = [quad for quad in world.quads if np.cross(quad.u, quad.v) @ quad.corner > 0.0 or quad.name == "ground"]
    world.quads[:] = kept
    pair, level_from_rectified = photograph(
        world, make_camera(800, 600, 640.0), pitch_rad=0.03, roll_rad=0.015, supersample=2
    )
    return world, pair, level_from_rectified


def true_q(world: World, name: str, camera: RectifiedCamera, level_from_rectified: FloatArray) -> FloatArray:
    """Return the plane of a quad as q (3,): d = q . r."""
    quad = next(quad for quad in world.quads if quad.name == name)
    normal = np.cross(quad.u, quad.v)
    normal = normal / np.linalg.norm(normal)
    return camera.f_px * camera.baseline_m * (level_from_rectified.T @ normal) / float(normal @ quad.corner)


def true_area(world: World, name: str) -> float:
    """Return the area of a quad in m2."""
    quad = next(quad for quad in world.quads if quad.name == name)
    return float(np.linalg.norm(np.cross(quad.u, quad.v)))
