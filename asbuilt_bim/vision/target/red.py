"""What is red in a photo, in sun and in shade: a score that light cancels out of, and the blobs it makes."""

from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray, IntArray

LEVELS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""Redness at which blobs are cut out; which one gives a disc's outline depends on light, dirt and what is behind."""
_NOISE_LEVEL = 12.0  # grey levels: what the score of a black pixel is made of
_HUE_BAND = 0.45  # of the chroma: green and blue may differ by this, orange and magenta don't pass
_WORKING_WIDTH = 640  # blobs only say where to look: a target within 10 m has a radius of 8 px and more at this width
_MIN_AREA_PX = 25  # here and below in pixels of the working size: a radius of under 3 px leaves no shape
_MAX_SHARE = 0.2  # of the frame
_ELLIPTIC = 0.8  # a rectangle has 0.88, a disc with a third cut off 0.9
_MIN_PIECE_PX = 12  # of a disc that something before it has cut in two
_MOST_PIECES = 24
_LEAST_OF_BOX = 0.25  # two pieces of a disc that is a third hidden and lies askew fill so much of their common box
_LEAST_OF_HULL = 0.6  # and of their hull, from which 30 % may be hidden
_TWO_LIGHTS = 0.78  # of the variance lies between two parts: of an even spread 0.75 does, of a bell 0.64
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
    joined: bool = False  # of two pieces


def redness(image: ByteImage) -> Float32Array:
    """Return float32 (H, W) in 0..1: the share of a pixel's red that neither green nor blue matches; 0 for other hues.

    Light scales red, green and blue together and so cancels; the sensor's noise is kept from making black pixels red.
    """
    blue, green, red = cv2.split(image)
    chroma = cv2.subtract(red, cv2.max(blue, green))
    score = chroma.astype(np.float32) / (red.astype(np.float32) + np.float32(_NOISE_LEVEL))
    score[cv2.absdiff(green, blue) > _HUE_BAND * chroma] = 0.0
    return np.asarray(score, dtype=np.float32)


def red_blobs(image: ByteImage, score: Float32Array, limit: int) -> list[RedBlob]:
    """Cut the redness (H, W) of a photo (BGR) at every level and return the blobs that may hold a disc.

    First at most `limit` that are elliptic by themselves, the best first. Then as many that are so when two pieces are
    joined: a brick wall's many pairs must not crowd a whole disc out. Then half as many large odd ones, the largest
    first: a disc may have grown together with something red behind it.
    """
    found: list[RedBlob] = []
    step = max(1, score.shape[1] // _WORKING_WIDTH)
    size = (round(score.shape[1] / step), round(score.shape[0] / step))
    small = np.asarray(cv2.resize(score, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    # red: what is in another light differs in it most
    light = np.asarray(
        cv2.resize(np.ascontiguousarray(image[..., 2]), size, interpolation=cv2.INTER_AREA), dtype=np.uint8
    )
    for level in LEVELS:
        for blob in _blobs_at(small, light, level, step):
            twin = next((i for i, other in enumerate(found) if _are_twins(blob, other)), None)
            if twin is None:
                found.append(blob)
            elif blob.elliptic > found[twin].elliptic:
                found[twin] = blob
    elliptic = sorted((b for b in found if b.elliptic >= _ELLIPTIC), key=lambda b: -b.elliptic * np.sqrt(b.area_px))
    whole, joined = [b for b in elliptic if not b.joined], [b for b in elliptic if b.joined]
    odd = sorted((b for b in found if b.elliptic < _ELLIPTIC), key=lambda b: -b.area_px)
    return whole[:limit] + joined[:limit] + odd[: limit // 2]


def _blobs_at(score: Float32Array, light: ByteImage, level: float, step: int) -> list[RedBlob]:
    """Return the blobs of one level: whole patches, parts of them in one light, and what pairs of them make."""
    patches = _patches((score >= level).astype(np.uint8))
    pieces = patches.whole[np.argsort(-patches.area[patches.whole], kind="stable")][:_MOST_PIECES]
    blobs = [
        _blob(some, int(label), step)
        for some in (patches, *_in_one_light(patches, pieces, light))
        for label in some.likely
    ]
    blobs.extend(_joined([_outline(patches, int(label)) for label in pieces], patches.area[pieces], step))
    return [blob for blob in blobs if blob is not None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Patches:
    """Connected pixels: `labels` (H, W), of each label its `box` (L, 4) and `area` (L,).

    `likely` are the labels that may hold a disc, `whole` those that lie inside the frame.
    """

    labels: IntArray
    box: IntArray
    area: IntArray
    likely: IntArray
    whole: IntArray


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
        area=np.asarray(area, dtype=np.int32),
        likely=np.flatnonzero(likely).astype(np.int32),
        whole=np.flatnonzero(inside & (area >= _MIN_PIECE_PX)).astype(np.int32),
    )


def _in_one_light(patches: _Patches, pieces: IntArray, light: ByteImage) -> list[_Patches]:
    """Return the bright and the dark parts of patches that have both: a disc before a red thing in another light.

    Reference: Otsu 1979, where to part them and how well that does.
    """
    bright, dark = np.zeros_like(light), np.zeros_like(light)
    for label in pieces[patches.area[pieces] >= _GROWN_TOGETHER_PX]:
        x, y, width, height = patches.box[label]
        part = (slice(y, y + height), slice(x, x + width))
        mask = patches.labels[part] == label
        limit, _ = cv2.threshold(light[part][mask], 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        over = mask & (light[part] > limit)
        if _parted(light[part][over], light[part][mask & ~over]):
            bright[part] |= over
            dark[part] |= mask & ~over
    return [_patches(some) for some in (bright, dark) if some.any()]


def _parted(bright: ByteImage, dark: ByteImage) -> bool:
    """Say whether two parts' grey levels differ by far more than those within each."""
    if min(len(bright), len(dark)) < _MIN_AREA_PX:
        return False
    share = len(bright) / (len(bright) + len(dark))
    between = share * (1.0 - share) * float(bright.mean() - dark.mean()) ** 2
    within = share * float(bright.var()) + (1.0 - share) * float(dark.var())
    return between >= _TWO_LIGHTS * max(between + within, 1.0)


def _joined(outlines: list[FloatArray], areas: IntArray, step: int) -> list[RedBlob | None]:
    """Return what pairs of pieces make together: a bar before a disc cuts it in two, and their hull is the disc's."""
    found: list[RedBlob | None] = []
    boxes = [(*outline.min(axis=0).tolist(), *outline.max(axis=0).tolist()) for outline in outlines]
    for i, j in combinations(range(len(outlines)), 2):
        (x0, y0, x1, y1), (u0, v0, u1, v1) = boxes[i], boxes[j]
        area = float(areas[i] + areas[j])
        if (max(x1, u1) - min(x0, u0) + 1.0) * (max(y1, v1) - min(y0, v0) + 1.0) > area / _LEAST_OF_BOX:
            continue
        both = np.concatenate([outlines[i], outlines[j]])
        hull = np.asarray(cv2.convexHull(both.astype(np.float32)), dtype=np.float64).reshape(-1, 2)
        if area >= _LEAST_OF_HULL * float(cv2.contourArea(hull.astype(np.float32))):
            found.append(_hull_blob(hull, step))
    return found


def _hull_blob(hull: FloatArray, step: int) -> RedBlob | None:
    """Return a blob with a hull (N, 2) as its outline; None where the hull is no ellipse."""
    corner = np.floor(hull.min(axis=0)).astype(int)
    width, height = (np.ceil(hull.max(axis=0)).astype(int) + 1 - corner).tolist()
    filled = np.zeros((height, width), dtype=np.uint8)
    cv2.fillPoly(filled, [np.rint(hull - corner).astype(np.int32).reshape(-1, 1, 2)], 1)
    elliptic = _elliptic(filled.astype(bool))
    if elliptic < _ELLIPTIC or width * 3.5 < height or height * 3.5 < width:
        return None
    return _whole_blob(_longest(filled) + corner, filled, corner, elliptic, step, joined=True)


def _blob(patches: _Patches, label: int, step: int) -> RedBlob | None:
    """Return a patch, its holes filled, as a blob; None where it is small and no ellipse."""
    corner, crop = _crop(patches, label)
    outline, filled = _longest(crop), np.zeros(crop.shape, dtype=np.uint8)
    cv2.drawContours(filled, [outline.astype(np.int32).reshape(-1, 1, 2)], -1, 1, cv2.FILLED)
    elliptic = _elliptic(filled.astype(bool))
    if len(outline) < 12 or (elliptic < _ELLIPTIC and filled.sum() < _GROWN_TOGETHER_PX):
        return None
    return _whole_blob(outline + corner, filled, corner, elliptic, step)


def _whole_blob(
    outline: FloatArray, filled: ByteImage, corner: IntArray, elliptic: float, step: int, joined: bool = False
) -> RedBlob:
    """Return a blob in pixels of the photo."""
    (x, y), (height, width) = (corner * step).tolist(), filled.shape
    return RedBlob(
        outline=(outline + 0.5) * step - 0.5,
        area_px=float(filled.sum()) * step**2,
        elliptic=elliptic,
        box_px=(x, y, width * step, height * step),
        joined=joined,
    )


def _outline(patches: _Patches, label: int) -> FloatArray:
    """Return the outline (N, 2) of a patch, in pixels of the labels."""
    corner, crop = _crop(patches, label)
    return _longest(crop) + corner


def _crop(patches: _Patches, label: int) -> tuple[IntArray, ByteImage]:
    """Return a patch's corner (2,), and its mask (0 or 1) within its box."""
    x, y, width, height = patches.box[label].tolist()
    mask = patches.labels[y : y + height, x : x + width] == label
    return patches.box[label, :2], mask.astype(np.uint8)


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
    return one.joined == other.joined and _overlap(one.box_px, other.box_px) > 0.8


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> float:
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(across, 0) * max(down, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)
