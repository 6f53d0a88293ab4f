"""Where an edge lies to a fraction of a pixel: the place on a profile across it where it is half-way."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray

DISPLAY_GAMMA = 2.2
"""Pixels mix light, not numbers: half of an edge's contrast is at its place in light, so the tone curve is undone."""
COLOUR_WEIGHT = 0.5
"""JPEG keeps colour at half the resolution of brightness: a colour edge is twice as blurred and weighs half."""
_STEP_PX = 0.25
_BRIGHTNESS = ((np.arange(256) / 255.0) ** DISPLAY_GAMMA).astype(np.float32)
_COLOUR = (np.arange(256) / 255.0 * COLOUR_WEIGHT).astype(np.float32)
_CHANNELS = np.stack([_BRIGHTNESS, _COLOUR, _COLOUR], axis=-1)[None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Edges:
    """Edge places along N profiles: `points` (N, 2) in pixels, NaN where none was found.

    `inside`, `outside` (N, 3) are the mean edge channels on both sides.
    """

    points: FloatArray
    inside: FloatArray
    outside: FloatArray

    @property
    def contrast(self) -> FloatArray:
        """Return the distance (N,) between both sides."""
        distance: FloatArray = np.linalg.norm(self.inside - self.outside, axis=-1)
        return distance


def edge_channels(image: ByteImage) -> Float32Array:
    """Turn a BGR picture into what edges are found in: brightness in linear light, and two colours at half weight.

    float32 (H, W, 3), 0..1.
    """
    return np.asarray(cv2.LUT(cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb), _CHANNELS), dtype=np.float32)


def find_edges(channels: Float32Array, points: FloatArray, outward: FloatArray, reach_px: float) -> Edges:
    """Find the edge nearest to each of `points` (N, 2) along its `outward` unit direction (N, 2).

    `channels` are those of `edge_channels`. A profile reaches `reach_px` to both sides; its outer thirds show inside
    and outside. The edge is where the mix of both passes one half: symmetric blur leaves it there.
    """
    steps = int(np.ceil(reach_px / _STEP_PX))
    offsets: FloatArray = np.linspace(-steps * _STEP_PX, steps * _STEP_PX, 2 * steps + 1)
    at = points[:, None, :] + offsets[None, :, None] * outward[:, None, :]
    values = cv2.remap(
        channels,
        np.ascontiguousarray(at[..., 0], dtype=np.float32),
        np.ascontiguousarray(at[..., 1], dtype=np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    profiles = np.asarray(values, dtype=np.float64).reshape(len(points), len(offsets), -1)
    third = max(2, len(offsets) // 3)
    inside, outside = profiles[:, :third].mean(axis=1), profiles[:, -third:].mean(axis=1)
    along = inside - outside
    length2 = np.maximum(np.sum(along * along, axis=-1), 1e-12)
    share = np.einsum("nsc,nc->ns", profiles - outside[:, None, :], along) / length2[:, None]
    where = _crossing(share, offsets)
    return Edges(points=points + where[:, None] * outward, inside=inside, outside=outside)


def _crossing(share: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return the offset (N,) where `share` (N, S) falls through one half, nearest to offset 0; NaN where it doesn't."""
    before, after = share[:, :-1], share[:, 1:]
    falls = (before >= 0.5) & (after < 0.5)
    part = (before - 0.5) / np.where(falls, before - after, 1.0)
    place = offsets[None, :-1] + part * (offsets[1] - offsets[0])
    distance = np.where(falls, np.abs(place), np.inf)
    best = np.argmin(distance, axis=1)
    rows = np.arange(len(share))
    found: FloatArray = np.where(np.isfinite(distance[rows, best]), place[rows, best], np.nan)
    return found
