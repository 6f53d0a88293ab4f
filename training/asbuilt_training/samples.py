"""Training pictures turned into what the network learns from: crops, flips, stereo, and answers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array
from asbuilt_bim.vision.networks.geometry_input import geometry_channels

from asbuilt_training.augment import cut_out, disturbed
from asbuilt_training.classes import CONCRETE
from asbuilt_training.shards import Picture
from asbuilt_training.stereo import stereo_of

OFFSET_UNIT_PX = 32.0
"""Offsets are given in units of this many input pixels: numbers near one."""
BORDER_WEIGHT = 2
"""Pixels at a border count this many times more: they are few, and areas are decided there."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """One example: inputs of (h, w), answers at half that size where they are smooth.

    `image` uint8 (h, w, 3); `geometry` float16 (5, h, w); `kind` uint8 (h, w), 255 where nothing is asked; `weight`
    uint8 (h, w); `offsets` float16 (2, h/2, w/2), NaN where nothing is asked; `thing` int32 (h/2, w/2), the number of
    a wall or column, else 0; `inverse_depth` (h/2, w/2) in 1/m.
    """

    image: ByteImage
    geometry: np.ndarray
    kind: np.ndarray
    weight: np.ndarray
    offsets: np.ndarray
    thing: np.ndarray
    inverse_depth: Float32Array
    has_geometry: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """How examples are made of pictures."""

    width_px: int = 384
    height_px: int = 288
    without_geometry: float = 0.45  # share of the examples
    least_crop: float = 0.5  # of a picture's width


def training_sample(rng: np.random.Generator, picture: Picture, recipe: Recipe) -> Sample:
    """Return a picture, cropped, stretched, flipped and disturbed, with what a stereo rig would know of it."""
    crop = _crop(rng, picture.mirrored() if rng.random() < 0.5 else picture, recipe)
    rgb = disturbed(rng, crop.rgb, crop.inverse_depth_per_m)
    kind = crop.kind.copy()
    if rng.random() < 0.2:
        cut_out(rng, rgb, kind)
    has_geometry = bool(rng.random() >= recipe.without_geometry)
    geometry = np.zeros((5, *kind.shape), dtype=np.float16)
    if has_geometry:
        geometry = _geometry(rng, crop, rgb)
    return answers(rgb, geometry, kind, crop.instance, crop.inverse_depth_per_m, has_geometry)


def plain_sample(rng: np.random.Generator, picture: Picture, *, with_geometry: bool) -> Sample:
    """Return a whole picture as it is, for validation; its stereo input is drawn with `rng`."""
    geometry = np.zeros((5, *picture.kind.shape), dtype=np.float16)
    if with_geometry:
        geometry = _geometry(rng, picture, picture.rgb)
    return answers(picture.rgb, geometry, picture.kind, picture.instance, picture.inverse_depth_per_m, with_geometry)


def answers(
    rgb: ByteImage,
    geometry: np.ndarray,
    kind: np.ndarray,
    instance: np.ndarray,
    inverse_depth_per_m: Float32Array,
    has_geometry: bool,
) -> Sample:
    """Return the example with all that is asked of the network."""
    height, width = kind.shape
    half = (width // 2, height // 2)
    return Sample(
        image=rgb,
        geometry=geometry,
        kind=kind,
        weight=border_weight(kind, instance),
        offsets=centre_offsets(kind[::2, ::2], instance[::2, ::2]),
        thing=np.where(np.isin(kind[::2, ::2], CONCRETE), instance[::2, ::2], 0).astype(np.int32),
        inverse_depth=cv2.resize(inverse_depth_per_m, half, interpolation=cv2.INTER_AREA),
        has_geometry=has_geometry,
    )


def centre_offsets(kind: np.ndarray, instance: np.ndarray) -> np.ndarray:
    """Return float16 (2, h, w): (dx, dy) from each pixel of a half-size map to its thing's centroid, else NaN."""
    height, width = kind.shape
    number = np.where(np.isin(kind, CONCRETE), instance, 0).ravel().astype(np.int64)
    x, y = np.tile(np.arange(width), height), np.repeat(np.arange(height), width)
    count = np.maximum(np.bincount(number), 1)
    dx = (np.bincount(number, x) / count)[number] - x
    dy = (np.bincount(number, y) / count)[number] - y
    found = np.stack([dx, dy]).reshape(2, height, width) * (2.0 / OFFSET_UNIT_PX)
    found[:, (number == 0).reshape(height, width)] = np.nan
    return found.astype(np.float16)


def border_weight(kind: np.ndarray, instance: np.ndarray) -> np.ndarray:
    """Return uint8 (h, w): how much each pixel counts, more within two pixels of where one thing ends."""
    thing = (instance.astype(np.int32) * 8 + np.minimum(kind, 7)).astype(np.float32)
    square = np.ones((5, 5), dtype=np.uint8)
    border = cv2.dilate(thing, square) != cv2.erode(thing, square)
    return np.where(border, np.uint8(BORDER_WEIGHT), np.uint8(1))


def _crop(rng: np.random.Generator, picture: Picture, recipe: Recipe) -> Picture:
    """Return a part of a picture at the recipe's size, with its camera."""
    height, width = picture.kind.shape
    share = min(rng.uniform(recipe.least_crop, 1.3), 1.0)  # a good part of the examples show the whole picture
    w = max(int(share * width), 8)
    h = min(int(w * recipe.height_px / recipe.width_px * np.exp(rng.uniform(-0.12, 0.12))), height)
    x0, y0 = int(rng.integers(0, width - w + 1)), int(rng.integers(0, height - h + 1))
    box = (slice(y0, y0 + h), slice(x0, x0 + w))
    size = (recipe.width_px, recipe.height_px)
    sx, sy = size[0] / w, size[1] / h

    def nearest(of: np.ndarray) -> np.ndarray:
        return np.asarray(cv2.resize(np.ascontiguousarray(of[box]), size, interpolation=cv2.INTER_NEAREST_EXACT))

    smooth = cv2.INTER_AREA if sx < 1.0 else cv2.INTER_LINEAR
    rgb = cv2.resize(np.ascontiguousarray(picture.rgb[box]), size, interpolation=smooth)
    return Picture(
        rgb=np.asarray(rgb, dtype=np.uint8),
        kind=nearest(picture.kind),
        instance=nearest(picture.instance),
        inverse_depth_per_m=nearest(picture.inverse_depth_per_m),
        fx_px=picture.fx_px * sx,
        fy_px=picture.fy_px * sy,
        cx_px=(picture.cx_px - x0 + 0.5) * sx - 0.5,
        cy_px=(picture.cy_px - y0 + 0.5) * sy - 0.5,
        left_px=np.asarray((np.arange(size[0]) + 0.5) + x0 * sx, dtype=np.float32),
        baseline_m=picture.baseline_m,
        up=picture.up,
    )


def _geometry(rng: np.random.Generator, picture: Picture, rgb: ByteImage) -> np.ndarray:
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    measured = stereo_of(
        rng,
        picture.inverse_depth_per_m,
        grey,
        bf_px_m=picture.fx_px * picture.baseline_m,
        left_px=picture.left_px,
    )
    up = np.array([0.0, -1.0, 0.0]) if rng.random() < 0.25 else picture.up + rng.normal(0.0, 0.03, 3)
    channels = geometry_channels(
        measured,
        fx_px=picture.fx_px,
        fy_px=picture.fy_px,
        cx_px=picture.cx_px,
        cy_px=picture.cy_px,
        up=up / np.linalg.norm(up),
    )
    return channels.astype(np.float16)
