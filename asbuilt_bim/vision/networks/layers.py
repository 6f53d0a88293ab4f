"""Things that vote for one place but stand behind each other, separated by stereo: a column before a wall's middle."""

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array

JUMP = 0.12
"""A change of 1/Z between neighbours but one, as a share of it, that one surface doesn't make.

At 80 degrees off the front a wall changes by 7 per cent over two pixels of a map 192 wide.
"""
SAME_PLANE = 0.08
"""Two parts lie on one surface when the larger one's plane gives the other's 1/Z within this share."""
LEAST_PART = 0.04
"""A part of fewer of the thing's pixels is noise."""
LEAST_PIXELS = 12


def layers(number: NDArray[np.int32], inverse_depth: Float32Array) -> NDArray[np.int32]:
    """Return `number` (h, w) with things that lie on clearly different surfaces cut apart, numbered on from the last.

    `inverse_depth` (h, w) is 1/Z, 0 where not measured. A thing keeps its number for its largest surface.
    """
    cut = number.copy()
    known = inverse_depth > 0.0
    calm = known & ~_jumps(inverse_depth, known)
    count = int(number.max()) + 1
    for thing in range(count):
        own = number == thing
        if not own.any():
            continue
        x, y, w, h = cv2.boundingRect(own.view(np.uint8))
        window = (slice(y, y + h), slice(x, x + w))
        surface = _surfaces(own[window], calm[window], inverse_depth[window])
        for part in range(1, int(surface.max()) + 1):
            cut[window][own[window] & (surface == part)] = count
            count += 1
    return cut


def _jumps(inverse: Float32Array, known: BoolArray) -> BoolArray:
    """Say where 1/Z changes abruptly between measured neighbours."""
    square = np.ones((3, 3), np.uint8)
    high = cv2.dilate(inverse, square)
    low = cv2.erode(np.where(known, inverse, np.float32(np.inf)), square)
    jump: BoolArray = known & (np.asarray(high) - np.asarray(low) > JUMP * inverse)
    return jump


def _surfaces(own: BoolArray, calm: BoolArray, inverse: Float32Array) -> NDArray[np.int32]:
    """Number a thing's surfaces (h, w), the largest 0; every pixel gets that of the nearest part."""
    count, found_parts, stats, _ = cv2.connectedComponentsWithStats((own & calm).astype(np.uint8), connectivity=4)
    parts = np.asarray(found_parts, dtype=np.int32)
    sizes = stats[:, cv2.CC_STAT_AREA].copy()
    sizes[0] = 0
    least = max(LEAST_PIXELS, LEAST_PART * np.count_nonzero(own))
    large = [int(k) for k in np.argsort(-sizes) if sizes[k] >= least]
    found = np.zeros(own.shape, dtype=np.int32)
    if len(large) < 2:
        return found
    planes: list[NDArray[np.float64]] = []
    of_part = np.full(count, -1)
    for part in large:
        rows, columns = np.nonzero(parts == part)
        values, at = inverse[rows, columns].astype(np.float64), np.stack([columns, rows, np.ones(len(rows))], axis=1)
        misses = [float(np.median(np.abs(at @ plane - values) / values)) for plane in planes]
        if misses and min(misses) < SAME_PLANE:
            of_part[part] = int(np.argmin(misses))
            continue
        of_part[part] = len(planes)
        planes.append(np.asarray(np.linalg.lstsq(at, values, rcond=None)[0], dtype=np.float64))
    if len(planes) < 2:
        return found
    return np.asarray(of_part[_nearest(parts, of_part >= 0)], dtype=np.int32)


def _nearest(parts: NDArray[np.int32], kept: BoolArray) -> NDArray[np.int32]:
    """Return for each pixel the nearest kept part."""
    empty = (~kept[parts]).astype(np.uint8)
    _, seeds = cv2.distanceTransformWithLabels(empty, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    seeds = np.asarray(seeds)
    part_of_seed = np.zeros(int(seeds.max()) + 1, dtype=np.int32)
    part_of_seed[seeds[empty == 0]] = parts[empty == 0]
    return np.asarray(part_of_seed[seeds])
