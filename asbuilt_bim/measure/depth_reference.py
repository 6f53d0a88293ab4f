"""The station's disparity kept small: at most 640 px wide, two PNGs, fore- and background never mixed."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array
from asbuilt_bim.vision.stereo.depth import DepthMap

MOST_WIDTH_PX = 640
SKY = 65535
DISPARITY_STEPS, SIGMA_STEPS = 64.0, 32.0
PNG = (cv2.IMWRITE_PNG_COMPRESSION, 6, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE)
"""Runs alone, no other repeats: a map of depths has none. That takes a fifth of the time, and comes out smaller."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DepthReference:
    """The station's disparity at no more than 640 px width, as compressed bytes; `unpack` reads it.

    `scale` is full-size pixels per reference pixel: reference pixel i covers full pixels i*scale .. (i+1)*scale - 1.
    """

    png: bytes  # 16 bit: disparity in 1/64 px of full size, 0 = not measured, 65535 = sky (further than anything)
    sigma_png: bytes  # 8 bit: sigma in 1/32 px of full size
    scale: int
    occluder_free_png: bytes = b""  # as `png`: what is seen past thin dark things; empty where not measured


def pack(depth: DepthMap, sky: BoolArray, occluder_free_px: Float32Array | None = None) -> DepthReference:
    """Compress a depth map; `sky` (H, W) marks what is further than anything.

    `occluder_free_px` (H, W) is the disparity past thin things, NaN not found, 0 sky. Its blocks keep their middle
    pixel.

    Each block keeps the lower median of its measured disparities: a value that was measured, not a mean across an edge.
    A block with under half of its pixels measured counts as not measured, and as sky where sky is the most of it.
    """
    height, width = depth.disparity_px.shape
    scale = max(1, -(-width // MOST_WIDTH_PX))
    known = depth.valid & (depth.disparity_px > 0.0)
    values = np.sort(_blocks(np.where(known, depth.disparity_px, np.inf), scale, np.inf), axis=-1)
    spread = np.sort(_blocks(np.where(known, depth.sigma_px, np.inf), scale, np.inf), axis=-1)
    count = np.isfinite(values).sum(axis=-1)
    middle = np.maximum(count - 1, 0)[..., None] // 2
    median = np.take_along_axis(values, middle, axis=-1)[..., 0]
    sigma = np.take_along_axis(spread, middle, axis=-1)[..., 0]
    down, across = (np.minimum(scale, side - np.arange(0, side, scale)) for side in (height, width))
    full = down[:, None] * across  # pixels of each block: fewer at the right and at the foot
    measured = count >= 0.5 * full
    heaven = _blocks(sky, scale, 0.0).sum(axis=-1) > 0.5 * full
    coded = np.where(measured, np.clip(np.round(np.where(measured, median, 0.0) * DISPARITY_STEPS), 1, SKY - 1), 0)
    coded = np.where(heaven & ~measured, SKY, coded).astype(np.uint16)
    sigma_coded = np.clip(np.round(np.where(measured, sigma, 0.0) * SIGMA_STEPS), 0, 255).astype(np.uint8)
    occluder_free = b"" if occluder_free_px is None else _png(_coded(_middles(occluder_free_px, scale)))
    return DepthReference(png=_png(coded), sigma_png=_png(sigma_coded), scale=scale, occluder_free_png=occluder_free)


def unpack(reference: DepthReference) -> tuple[Float32Array, Float32Array, int]:
    """Return disparity and sigma (h, w) float32 in FULL-size pixels, and the scale.

    NaN where nothing was measured, 0.0 where there is sky; `DepthReference.scale` says what a pixel covers.

    Raises: ValueError where the bytes are no picture.
    """
    disparity = _decoded(_read(reference.png, "disparity"))
    sigma = _read(reference.sigma_png, "sigma").astype(np.float32) / np.float32(SIGMA_STEPS)
    sigma = np.maximum(sigma, np.float32(1.0 / SIGMA_STEPS))
    return disparity, sigma.astype(np.float32), reference.scale


def unpack_occluder_free(reference: DepthReference) -> Float32Array | None:
    """Return the disparity past thin things (h, w) as `unpack` does the other; None where it wasn't measured.

    Raises: ValueError where the bytes are no picture.
    """
    return _decoded(_read(reference.occluder_free_png, "disparity past bars")) if reference.occluder_free_png else None


def _coded(disparity: Float32Array) -> NDArray[np.uint16]:
    steps = np.clip(np.round(np.nan_to_num(disparity) * DISPARITY_STEPS), 1, SKY - 1)
    steps = np.where(np.isfinite(disparity), steps, 0)
    return np.where(disparity == 0.0, SKY, steps).astype(np.uint16)


def _decoded(coded: NDArray[np.uint16]) -> Float32Array:
    disparity = coded.astype(np.float32) / np.float32(DISPARITY_STEPS)
    disparity[coded == 0] = np.nan
    disparity[coded == SKY] = 0.0
    return disparity


def _blocks(image: NDArray[np.floating] | BoolArray, scale: int, fill: float) -> NDArray[np.float32]:
    """Lay an image (H, W) out as blocks (h, w, scale * scale), padded with `fill`."""
    height, width = image.shape
    padded = np.full((-(-height // scale) * scale, -(-width // scale) * scale), fill, dtype=np.float32)
    padded[:height, :width] = image
    h, w = padded.shape[0] // scale, padded.shape[1] // scale
    return padded.reshape(h, scale, w, scale).transpose(0, 2, 1, 3).reshape(h, w, scale * scale)


def _middles(image: Float32Array, scale: int) -> Float32Array:
    rows, columns = (np.minimum(np.arange(scale // 2, n + scale // 2, scale), n - 1) for n in image.shape)
    return image[np.ix_(rows, columns)]


def _png(image: NDArray[np.uint16] | NDArray[np.uint8]) -> bytes:
    done, data = cv2.imencode(".png", image, list(PNG))
    if not done:
        raise ValueError("the depth reference could not be compressed")
    return bytes(data)


def _read(data: bytes, what: str) -> NDArray[np.uint16]:
    image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if image is None:
        raise ValueError(f"the depth reference's {what} is no PNG: the result file is damaged; run the station again")
    return np.asarray(image, dtype=np.uint16)
