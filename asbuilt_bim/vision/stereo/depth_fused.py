"""Stereo first, network second: relative depth brought to stereo by scale and shift fills what stereo can't see."""

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, freeze
from asbuilt_bim.geometry.robust_least_squares import reweighted_linear
from asbuilt_bim.vision.stereo.depth import DepthMap, RelativeDepth
from asbuilt_bim.vision.stereo.depth_paper import checked_estimate, value_at
from asbuilt_bim.vision.target.find import TargetSighting

LEAST_PIXELS = 500
"""A scale and a shift from fewer pixels rest on one patch of one surface."""
LEAST_EXPLAINED = 0.5
"""Of stereo's variance: a network that explains less of it has not understood the picture."""
MOST_SAMPLES = 40_000
"""Pixels that the two numbers are fitted to, spread evenly: more change neither."""
MOST_DISTANCE_FACTOR = 2.0
"""Filled things may lie this much further than what stereo measured; beyond, a shift's error is all there is."""
WINDOW_SHARE = 1.0 / 20.0
"""Of the photo's width: how near stereo must be to say how well the network does at a place."""
_LEAST_SIGMA_PX = 1e-3


def fused_depth(
    pair: RectifiedPair, stereo: DepthMap, relative: RelativeDepth, target: TargetSighting | None = None
) -> DepthMap:
    """Fill the holes of a stereo map from a network's; what stereo measured stays as it is.

    A network's map is defined up to scale and shift, and larger is nearer: both are fitted in disparity, robustly, to
    stereo and to the target. A filled pixel's sigma is the scatter about stereo near it, never under the whole fit's.

    Raises:
        ValueError: there is too little stereo, or the network's map doesn't follow it.
    """
    nearness = checked_estimate(pair, relative)
    if not np.isfinite(nearness[pair.valid_left]).all():
        raise ValueError(f"the depth network {relative.name} gives numbers that are not finite")
    scale, shift, sigma = _fitted(nearness, stereo, target)
    predicted = (scale * nearness + np.float32(shift)).astype(np.float32)
    furthest = float(np.quantile(stereo.disparity_px[stereo.valid], 0.01)) / MOST_DISTANCE_FACTOR
    holes = pair.valid_left & ~stereo.valid & (predicted > max(furthest, 3.0 * sigma))
    disparity = np.where(holes, predicted, stereo.disparity_px).astype(np.float32)
    spread = np.maximum(_local_scatter(predicted, stereo), np.float32(sigma))
    sigmas = np.where(holes, spread, stereo.sigma_px).astype(np.float32)
    valid = stereo.valid | holes
    freeze(disparity), freeze(sigmas), freeze(valid)
    return DepthMap(
        disparity_px=disparity, sigma_px=sigmas, valid=valid, f_px=stereo.f_px, baseline_m=stereo.baseline_m,
        method="fused",
    )  # fmt: skip


def _fitted(nearness: Float32Array, stereo: DepthMap, target: TargetSighting | None) -> tuple[float, float, float]:
    """Return scale, shift and robust sigma of `disparity = scale * nearness + shift`."""
    known = np.flatnonzero(stereo.valid)
    if known.size < LEAST_PIXELS:
        raise ValueError(f"stereo measured {known.size} pixels, limit {LEAST_PIXELS}: too few to scale a network by")
    known = known[:: max(1, known.size // MOST_SAMPLES)]
    x = nearness.ravel()[known].astype(np.float64)
    y = stereo.disparity_px.ravel()[known].astype(np.float64)
    weight = 1.0 / np.square(np.maximum(stereo.sigma_px.ravel()[known].astype(np.float64), 0.1))
    if target is not None:
        # the disc is triangulated far better than a pixel, but a network errs there as elsewhere: a patch's weight
        x = np.append(x, value_at(nearness, target.left_px))
        y = np.append(y, target.disparity_px)
        weight = np.append(weight, weight.sum() / 20.0)
    scale, shift, sigma = _robust_line(x, y, weight)
    miss = y - scale * x - shift
    total = float(np.average((y - np.average(y, weights=weight)) ** 2, weights=weight))
    near = np.abs(miss) < 4.0 * sigma
    explained = 1.0 - float(np.average(np.minimum(miss**2, (4.0 * sigma) ** 2), weights=weight)) / max(total, 1e-12)
    if not (scale > 0.0 and explained >= LEAST_EXPLAINED and np.count_nonzero(near) >= 0.5 * near.size):
        raise ValueError(
            f"the network's map explains {100.0 * max(explained, 0.0):.0f} % of what stereo sees, limit "
            f"{100.0 * LEAST_EXPLAINED:.0f} %: it doesn't follow this picture"
        )
    return scale, shift, sigma


def _robust_line(x: FloatArray, y: FloatArray, weight: FloatArray) -> tuple[float, float, float]:
    """Fit y = scale x + shift; returns the scatter's robust sigma too."""
    middle = float(np.average(x, weights=weight))
    if not float(np.ptp(x)) > 0.0:
        raise ValueError("the network's map is the same everywhere that stereo measured")
    fit = reweighted_linear(np.stack([x - middle, np.ones_like(x)], axis=-1), y, _LEAST_SIGMA_PX, weight)
    scale, level = fit.parameters.tolist()
    return scale, level - scale * middle, fit.scale * _LEAST_SIGMA_PX


def _local_scatter(predicted: Float32Array, stereo: DepthMap) -> Float32Array:
    """Return the root mean square (H, W) of stereo less network in a window round each pixel."""
    side = max(3, int(WINDOW_SHARE * predicted.shape[1])) | 1
    known: BoolArray = stereo.valid
    miss = np.where(known, stereo.disparity_px - predicted, np.float32(0.0)).astype(np.float32)
    count = cv2.boxFilter(known.astype(np.float32), cv2.CV_32F, (side, side), normalize=False)
    total = cv2.boxFilter(miss * miss, cv2.CV_32F, (side, side), normalize=False)
    far = float(np.sqrt(np.mean(np.square(miss[known])))) if known.any() else np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.sqrt(total / count)
    # where no stereo is near, the whole picture's scatter, outliers and all, stands for it
    return np.where(count > 0.5, near, np.float32(far)).astype(np.float32)
