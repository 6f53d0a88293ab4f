"""Pictures of flat things in space, by the exact pinhole, for tests: supersampled, mixed in linear light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray, frozen

CAMERA = RectifiedCamera(
    f_px=1050.0, cx_px=640.0, cy_px=480.0, baseline_m=0.25, width_px=1280, height_px=960, rectified_from_left=np.eye(3)
)
RED_BGR = (28, 22, 196)
GAMMA = 2.2


@dataclass(frozen=True, kw_only=True)
class Flat:
    """A flat thing: `paint(uv_m)` gives linear BGR (N, 3), NaN where it is not; it spans +-reach_m about its centre."""

    centre_m: FloatArray
    u: FloatArray
    v: FloatArray
    reach_m: float
    paint: Callable[[FloatArray], FloatArray]


def light(bgr: Sequence[float]) -> FloatArray:
    return (np.asarray(bgr, dtype=np.float64) / 255.0) ** GAMMA


def axes(yaw_deg: float, pitch_deg: float) -> tuple[FloatArray, FloatArray]:
    """Axes u (right), v (down) of a plane that faces the camera, turned by yaw and pitch."""
    yaw, pitch = np.deg2rad([yaw_deg, pitch_deg])
    u = np.array([np.cos(yaw), 0.0, np.sin(yaw)])
    v = np.array([np.sin(yaw) * np.sin(pitch), np.cos(pitch), -np.cos(yaw) * np.sin(pitch)])
    return u, v


def disc(centre_m, radius_m=0.15, yaw_deg=0.0, pitch_deg=0.0, bgr=RED_BGR, hidden_share=0.0) -> Flat:
    """A disc; `hidden_share` of its width is cut off on the right."""
    u, v = axes(yaw_deg, pitch_deg)

    def paint(uv: FloatArray) -> FloatArray:
        on = np.hypot(uv[:, 0], uv[:, 1]) < radius_m
        on &= uv[:, 0] < radius_m * (1.0 - 2.0 * hidden_share)
        return np.where(on[:, None], light(bgr), np.nan)

    return Flat(centre_m=np.asarray(centre_m, float), u=u, v=v, reach_m=radius_m, paint=paint)


def rectangle(centre_m, width_m, height_m, bgr=RED_BGR) -> Flat:
    u, v = axes(0.0, 0.0)

    def paint(uv: FloatArray) -> FloatArray:
        on = (np.abs(uv[:, 0]) < width_m / 2) & (np.abs(uv[:, 1]) < height_m / 2)
        return np.where(on[:, None], light(bgr), np.nan)

    return Flat(centre_m=np.asarray(centre_m, float), u=u, v=v, reach_m=0.75 * max(width_m, height_m), paint=paint)


def printed(centre_m, picture, side_m, yaw_deg=0.0, pitch_deg=0.0) -> Flat:
    """A square grey picture printed on a sheet of `side_m`."""
    u, v = axes(yaw_deg, pitch_deg)
    cells = len(picture)

    def paint(uv: FloatArray) -> FloatArray:
        at = np.floor((uv / side_m + 0.5) * cells).astype(int)
        on = ((at >= 0) & (at < cells)).all(axis=1)
        grey = picture[np.clip(at[:, 1], 0, cells - 1), np.clip(at[:, 0], 0, cells - 1)]
        return np.where(on[:, None], light(np.stack([grey * 0.8 + 20] * 3, axis=-1)), np.nan)

    return Flat(centre_m=np.asarray(centre_m, float), u=u, v=v, reach_m=0.75 * side_m, paint=paint)


def picture(things: Sequence[Flat], shift_m: float, seed: int, ground: float = 140.0, noise: float = 2.0):
    """One photo, the camera moved `shift_m` to the right."""
    empty, grain, photo = _ground(seed, ground, noise)
    canvas, shown = empty.copy(), photo.copy()
    for thing in things:
        _draw(canvas, thing, shift_m)
    for thing in things:
        box = _box(thing, shift_m)
        shown[box] = _shown(canvas[box], grain[box])
    return shown


@lru_cache(maxsize=2)  # 60 MB each
def _ground(seed: int, ground: float, noise: float) -> tuple[FloatArray, FloatArray, ByteImage]:
    """The light of a photo without a thing in it, the noise of its grey levels, and the photo: slow to draw."""
    rng = np.random.default_rng(seed)
    coarse = np.kron(rng.normal(ground, 12.0, (30, 40)), np.ones((32, 32)))
    canvas = light(np.clip(coarse, 20, 235))[..., None].repeat(3, axis=-1)
    grain = rng.normal(0.0, noise, canvas.shape)
    return canvas, grain, _shown(canvas, grain)


def _shown(canvas: FloatArray, grain: FloatArray) -> ByteImage:
    return np.clip(np.rint(255.0 * canvas ** (1.0 / GAMMA) + grain), 0, 255).astype(np.uint8)


def _box(thing: Flat, shift_m: float) -> tuple[slice, slice]:
    """The rows and columns that a thing may reach; empty where it is out of the picture."""
    centre = thing.centre_m - [shift_m, 0.0, 0.0]
    reach = 1.15 * CAMERA.f_px * thing.reach_m / centre[2] + 4
    middle = CAMERA.f_px * centre[:2] / centre[2] + [CAMERA.cx_px, CAMERA.cy_px]
    x0, y0 = np.maximum(np.floor(middle - reach), 0).astype(int)
    x1, y1 = np.minimum(np.ceil(middle + reach), [CAMERA.width_px, CAMERA.height_px]).astype(int)
    return slice(y0, max(y0, y1)), slice(x0, max(x0, x1))


def _draw(canvas: FloatArray, thing: Flat, shift_m: float) -> None:
    samples = 5 if thing.reach_m < 0.4 else 2  # large things are only background
    centre = thing.centre_m - [shift_m, 0.0, 0.0]
    rows, columns = _box(thing, shift_m)
    old = canvas[rows, columns]
    if not old.size:
        return
    total = np.zeros_like(old)
    normal = np.cross(thing.u, thing.v)
    for sub in np.ndindex(samples, samples):
        dy, dx = (np.array(sub) + 0.5) / samples - 0.5
        x, y = np.meshgrid(np.arange(columns.start, columns.stop) + dx, np.arange(rows.start, rows.stop) + dy)
        rays = np.stack([(x - CAMERA.cx_px) / CAMERA.f_px, (y - CAMERA.cy_px) / CAMERA.f_px, np.ones_like(x)], -1)
        met = rays * ((centre @ normal) / (rays @ normal))[..., None] - centre
        colour = thing.paint(np.stack([met @ thing.u, met @ thing.v], -1).reshape(-1, 2)).reshape(total.shape)
        total += np.where(np.isnan(colour), old, colour)
    canvas[rows, columns] = total / samples**2


def pair_of(things: Sequence[Flat], seed: int = 1, only: str = "both", **light_of_day: float) -> RectifiedPair:
    """A rectified pair of the things; `only` left or right leaves them out of the other photo."""
    valid = np.ones((CAMERA.height_px, CAMERA.width_px), dtype=bool)
    return RectifiedPair(
        name="T1",
        left=picture(things if only != "right" else [], 0.0, seed, **light_of_day),
        right=picture(things if only != "left" else [], CAMERA.baseline_m, seed, **light_of_day),
        valid_left=valid,
        valid_right=valid,
        camera=CAMERA,
    )


def centre_px(thing: Flat) -> FloatArray:
    return frozen(CAMERA.project(thing.centre_m))
