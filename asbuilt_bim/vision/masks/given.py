"""Masks that somebody gives: in pixels of the ORIGINAL left photo, carried through the lens to the rectified frame."""

from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair, rectified_map
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, freeze
from asbuilt_bim.geometry.polygon import Region, Rings, box, contains, intersection, polygon
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource
from asbuilt_bim.vision.stereo.depth import DepthMap

STEP_PX = 8.0
"""A straight edge in a photo is bent by the lens: a chord of 8 px strays from it by under 0.01 px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenMask:
    """One wall or column: polygons (the first ring outer, then holes) or `pixels` bool (H, W), of the ORIGINAL photo.

    Pixel centres have integer coordinates. `name` is what its file calls it, for messages.
    """

    label: InstanceClass
    name: str
    polygons: tuple[Rings, ...] = ()
    pixels: BoolArray | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenMasks:
    """A `Segmenter` that hands out masks that were given; `photo` is the left camera with its lens."""

    photo: Intrinsics
    masks: tuple[GivenMask, ...]
    name: str = "given masks"

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Return the masks in pixels of the rectified left photo; those that lie outside it are left out."""
        at = None
        if any(mask.pixels is not None for mask in self.masks):
            at, _ = rectified_map(pair.camera, self.photo, pair.camera.rectified_from_left)
        found: list[Instance] = []
        for given in self.masks:
            mask = mask_of(given, self.photo, pair.camera)
            if given.pixels is not None and at is not None:
                mask |= _carried(given.pixels, at)
            mask &= pair.valid_left
            if mask.any():
                freeze(mask)
                found.append(
                    Instance(
                        label=given.label, score=1.0, mask=mask, box_px=box_of(mask), source=InstanceSource.GIVEN,
                        segmenter=given.name,
                    )
                )  # fmt: skip
        return found


def box_of(mask: BoolArray) -> tuple[int, int, int, int]:
    """Return (x0, y0, x1, y1) of a mask that isn't empty, the last ones exclusive."""
    x, y, width, height = cv2.boundingRect(mask.astype(np.uint8))
    return int(x), int(y), int(x + width), int(y + height)


def photo_from_rectified(pixels: FloatArray, photo: Intrinsics, camera: RectifiedCamera) -> FloatArray:
    """Carry pixels (N, 2) of the rectified left photo to the original one."""
    return photo.project(camera.rays(pixels))


def region_mask(rings: Rings, shape: tuple[int, int]) -> BoolArray:
    """Return the pixels (H, W) whose CENTRES a polygon (rings in pixels) holds.

    OpenCV fills a polygon and its border too: half a pixel all round, which is decided here centre by centre.
    """
    canvas = np.zeros(shape, dtype=np.uint8)
    band = np.zeros(shape, dtype=np.uint8)
    fixed = [np.round(np.clip(ring, -1e6, 1e6) * 16.0).astype(np.int32) for ring in rings]
    cv2.fillPoly(canvas, fixed, (1,), lineType=cv2.LINE_8, shift=4)
    cv2.polylines(band, fixed, isClosed=True, color=(1,), thickness=3, lineType=cv2.LINE_8, shift=4)
    rows, columns = np.nonzero(band)
    inside = contains(polygon(rings), np.stack([columns, rows], axis=-1).astype(np.float64))
    canvas[rows, columns] = inside
    return canvas > 0


def mask_of(given: GivenMask, photo: Intrinsics, camera: RectifiedCamera) -> BoolArray:
    """Return the pixels (H, W) of the rectified frame that a mask's polygons hold."""
    shape = (camera.height_px, camera.width_px)
    mask = np.zeros(shape, dtype=bool)
    for rings in (inside for whole in given.polygons for inside in _in_photo(whole, photo)):
        carried = tuple(camera.project(photo.rays(_densified(ring))) for ring in rings)
        mask |= region_mask(carried, shape)
    return mask


def _in_photo(rings: Rings, photo: Intrinsics) -> Region:
    """Return what of a polygon lies in the photo, all of it as it is: a lens model says nothing of what is beyond."""
    right, low = photo.width_px - 0.5, photo.height_px - 0.5
    if all(((ring >= -0.5) & (ring <= [right, low])).all() for ring in rings):
        return (rings,)
    return intersection(polygon(rings), box(-0.5, -0.5, right, low))


def _densified(ring: FloatArray) -> FloatArray:
    """Put points on a ring's edges, at most `STEP_PX` apart."""
    ends = np.roll(ring, -1, axis=0)
    pieces = []
    for start, stop in zip(ring, ends, strict=True):
        count = max(1, int(np.ceil(np.linalg.norm(stop - start) / STEP_PX)))
        pieces.append(start + (np.arange(count) / count)[:, None] * (stop - start))
    return np.concatenate(pieces)


def _carried(pixels: BoolArray, at: Float32Array) -> BoolArray:
    x, y = np.array(at[..., 0]), np.array(at[..., 1])
    carried = cv2.remap(pixels.astype(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(carried) > 0
