"""The published depth map: a network's relative depth, inverted, times one scalar from the target (eq. 4)."""

from typing import Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, freeze
from asbuilt_bim.vision.stereo.depth import DepthMap, RelativeDepth
from asbuilt_bim.vision.target.find import TargetSighting

Inversion = Literal["complement", "reciprocal"]
"""The paper inverts its map and doesn't say how; both readings give values from 0 to 1, small ones near the camera."""

LEAST_NEARNESS = 1.0 / 255.0
"""The reciprocal of the furthest thing's 0 is not defined: one grey level of an 8-bit map is the least nearness."""
LEAST_AT_TARGET = 1.0 / 255.0
"""A relative depth under one grey level at the target leaves nothing to divide by."""


def relative_distance(nearness: ArrayLike, seen: BoolArray, inversion: Inversion) -> Float32Array:
    """Return R (H, W), 0 to 1, larger is further, of a network's map (H, W), larger is nearer.

    The map is first brought to 0..1 over the pixels `seen` (H, W), as the paper shows it; R is NaN elsewhere.

    Raises:
        ValueError: the map holds a number that isn't finite, or is the same everywhere.
    Reference: Perez & Tah 2023, section 3.2 ("by inverting this dense map").
    """
    values = np.asarray(nearness, dtype=np.float32)
    inside = values[seen]
    if inside.size == 0 or not np.isfinite(inside).all():
        raise ValueError("the depth network's map holds numbers that are not finite")
    low, high = float(inside.min()), float(inside.max())
    if not high > low:
        raise ValueError(f"the depth network's map is {low:g} everywhere")
    unit = (values - np.float32(low)) / np.float32(high - low)
    if inversion == "complement":
        inverted = 1.0 - unit
    else:
        inverted = LEAST_NEARNESS / np.maximum(unit, np.float32(LEAST_NEARNESS))
    return np.where(seen, inverted, np.float32(np.nan)).astype(np.float32)


def scale_from_target(depth_m: float, relative: float) -> float:
    """Return S, metres per unit of relative depth, of the target's distance and its value in the inverted map.

    Raises:
        ValueError: the target is the nearest thing in the map, whose relative depth is 0.
    Reference: Perez & Tah 2023, eq. 4, 8 and 9.
    """
    if not relative > LEAST_AT_TARGET:
        raise ValueError(f"the target's relative depth is {relative:.4f}, limit {LEAST_AT_TARGET:.4f}")
    return depth_m / relative


def value_at(values: Float32Array, pixel: FloatArray) -> float:
    """Return a map's value at a sub-pixel place (2,), x and y, between its four neighbours."""
    patch = cv2.getRectSubPix(values, (1, 1), (float(pixel[0]), float(pixel[1])))
    return float(np.asarray(patch)[0, 0])


def paper_depth(
    pair: RectifiedPair, relative: RelativeDepth, target: TargetSighting, inversion: Inversion = "complement"
) -> DepthMap:
    """Return the published absolute depth map of the rectified left photo: S times the inverted relative depth.

    Its sigma is infinite everywhere: the method states none.

    Raises:
        ValueError: the network's map can't be scaled by this target.
    Reference: Perez & Tah 2023, eq. 2 to 4, 7.
    """
    seen = pair.valid_left
    distance = relative_distance(checked_estimate(pair, relative), seen, inversion)
    scale = scale_from_target(target.depth_m, value_at(distance, target.left_px))
    depth_m = scale * distance
    valid = seen & np.isfinite(depth_m) & (depth_m > 0.0)
    camera = pair.camera
    with np.errstate(divide="ignore", invalid="ignore"):
        disparity = np.where(valid, camera.f_px * camera.baseline_m / depth_m, np.nan).astype(np.float32)
    sigma = np.full(disparity.shape, np.inf, dtype=np.float32)
    freeze(disparity), freeze(sigma), freeze(valid)
    return DepthMap(
        disparity_px=disparity, sigma_px=sigma, valid=valid, f_px=camera.f_px, baseline_m=camera.baseline_m,
        method="paper",
    )  # fmt: skip


def checked_estimate(pair: RectifiedPair, relative: RelativeDepth) -> Float32Array:
    """Ask a network for its map of the rectified left photo.

    Raises:
        ValueError: the map hasn't the photo's size.
    """
    nearness = np.asarray(relative.estimate(pair.left), dtype=np.float32)
    if nearness.shape != pair.valid_left.shape:
        got, wanted = (" x ".join(map(str, shape)) for shape in (nearness.shape, pair.valid_left.shape))
        raise ValueError(
            f"the depth network {relative.name} gives a map of {got}, the photo has {wanted} (rows, columns)"
        )
    return nearness
