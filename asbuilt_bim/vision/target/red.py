"""What is red in a photo, in sun and in shade: a score that light cancels out of, and the blobs it makes."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray, IntArray

LEVELS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""Redness at which blobs are cut out; which one gives a disc's outline depends on light, dirt and what is behind."""
MAX_BLOBS = 16
_NOISE_LEVEL = 12.0  # grey levels: what the score of a black pixel is made of
_HUE_BAND = 0.45  # of the chroma: green and blue may differ by this, orange and magenta don't pass
_WORKING_WIDTH = 640  # blobs only say where to look: a target within 10 m has a radius of 8 px and more at this width
_MIN_AREA_PX = 25  # here and below in pixels of the working size: a radius of under 3 px leaves no shape
_MAX_SHARE = 0.2  # of the frame
_ELLIPTIC = 0.8  # a rectangle has 0.88, a disc with a third cut off 0.9
_GROWN_TOGETHER_PX = 125  # a disc before another red thing makes one large odd blob; small odd ones are clutter


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RedBlob:
    """A red patch that might be a disc: its outline (N, 2) in pixels; `elliptic` 0..1 tells how elliptic it is.

    Found in a reduced picture, so that the outline is only good to a pixel or two.
    """

    outline: FloatArray
    area_px: float
    elliptic: float
    box_px: tuple[int, int, int, int]  # x, y, width, height


def redness(image: ByteImage) -> Float32Array:
    """Return float32 (H, W) in 0..1: the share of a pixel's red that neither green nor blue matches; 0 for other hues.

    Light scales red, green and blue together and so cancels; the sensor's noise is kept from making black pixels red.
    """
    blue, green, red = cv2.split(image)
    chroma = cv2.subtract(red, cv2.max(blue, green))
    score = chroma.astype(np.float32) / (red.astype(np.float32) + np.float32(_NOISE_LEVEL))
    score[cv2.absdiff(green, blue) > _HUE_BAND * chroma] = 0.0
    return np.asarray(score, dtype=np.float32)


def red_blobs(score: Float32Array) -> list[RedBlob]:
    """Cut the redness (H, W) of a photo at every level and return the blobs that may hold a disc.

    First at most `MAX_BLOBS` that are elliptic by themselves, the best first. Then half as many large odd ones, the
    largest first: a disc may have grown together with something red behind it.
    """
    found: list[RedBlob] = []
    step = max(1, score.shape[1] // _WORKING_WIDTH)
    size = (round(score.shape[1] / step), round(score.shape[0] / step))
    small = np.asarray(cv2.resize(score, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    for level in LEVELS:
        patches = _patches((small >= level).astype(np.uint8))
        for blob in (_blob(patches, int(label), step) for label in patches.likely):
            if blob is None:
                continue
            twin = next((i for i, other in enumerate(found) if _are_twins(blob, other)), None)
            if twin is None:
                found.append(blob)
            elif blob.elliptic > found[twin].elliptic:
                found[twin] = blob
    elliptic = sorted((b for b in found if b.elliptic >= _ELLIPTIC), key=lambda b: -b.elliptic * np.sqrt(b.area_px))
    odd = sorted((b for b in found if b.elliptic < _ELLIPTIC), key=lambda b: -b.area_px)
    return elliptic[:MAX_BLOBS] + odd[: MAX_BLOBS // 2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Patches:
    """Connected pixels: `labels` (H, W), of each label its `box` (L, 4); `likely` are those that may hold a disc."""

    labels: IntArray
    box: IntArray
    likely: IntArray


def _patches(mask: ByteImage) -> _Patches:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    x, y, width, height, area = np.asarray(stats).T
    fill = area / np.maximum(width * height, 1)
    inside = (x > 0) & (y > 0) & (x + width < mask.shape[1]) & (y + height < mask.shape[0])
    inside &= area <= _MAX_SHARE * mask.size
    inside[0] = False
    likely = inside & (area >= _MIN_AREA_PX) & ((fill > 0.4) | (area >= _GROWN_TOGETHER_PX))
    likely &= (width < 3.5 * height) & (height < 3.5 * width)
    return _Patches(
        labels=np.asarray(labels, dtype=np.int32),
        box=np.stack([x, y, width, height], axis=-1).astype(np.int32),
        likely=np.flatnonzero(likely).astype(np.int32),
    )


def _blob(patches: _Patches, label: int, step: int) -> RedBlob | None:
    """Return a patch, its holes filled, as a blob in pixels of the photo; None where it is small and no ellipse."""
    x, y, width, height = patches.box[label].tolist()
    crop = (patches.labels[y : y + height, x : x + width] == label).astype(np.uint8)
    outline, filled = _longest(crop), np.zeros(crop.shape, dtype=np.uint8)
    cv2.drawContours(filled, [outline.astype(np.int32).reshape(-1, 1, 2)], -1, 1, cv2.FILLED)
    elliptic = _elliptic(filled.astype(bool))
    if len(outline) < 12 or (elliptic < _ELLIPTIC and filled.sum() < _GROWN_TOGETHER_PX):
        return None
    return RedBlob(
        outline=(outline + [x, y] + 0.5) * step - 0.5,
        area_px=float(filled.sum()) * step**2,
        elliptic=elliptic,
        box_px=(x * step, y * step, width * step, height * step),
    )


def _longest(mask: ByteImage) -> FloatArray:
    """Return the longest outline (N, 2) of a mask."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(max(outlines, key=len), dtype=np.float64).reshape(-1, 2)


def _elliptic(mask: BoolArray) -> float:
    """Return the overlap (intersection over union) of a patch with the ellipse of its own moments."""
    rows, columns = np.nonzero(mask)
    x, y = np.arange(mask.shape[1]) - columns.mean(), np.arange(mask.shape[0]) - rows.mean()
    along, down = x[columns], y[rows]
    xx, yy, xy = along @ along / len(rows) + 1.0 / 12.0, down @ down / len(rows) + 1.0 / 12.0, along @ down / len(rows)
    value = (yy * x**2 - 2.0 * xy * x * y[:, None] + (xx * y**2)[:, None]) / (xx * yy - xy**2)
    inside = value <= 4.0
    both = np.count_nonzero(inside & mask)
    return float(both / (np.count_nonzero(inside) + len(rows) - both))


def _are_twins(one: RedBlob, other: RedBlob) -> bool:
    return _overlap(one.box_px, other.box_px) > 0.8


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> float:
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(across, 0) * max(down, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)
