"""Dense stereo: a rectified pair becomes a disparity and its sigma per pixel of the left photo."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, freeze, median
from asbuilt_bim.geometry.robust_least_squares import MEDIAN_TO_SIGMA
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.even_places import jumps_without_edge
from asbuilt_bim.vision.stereo.rows_apart import rows_apart_px
from asbuilt_bim.vision.stereo.warp import right_at, warp_right

SIXTEENTHS = 16.0
NEAREST_M = 1.5
"""Nothing that is measured stands nearer than an arm and a board."""

PRIOR_SIGMA_PX = 0.25
"""How far off the matcher's own answer is where it is right: it counts in sixteenths, and prefers whole pixels."""
LEAST_COMMON_PX = 0.05
"""What rectified photos leave at least: each pixel's own noise smoothed over its neighbours."""
ROUGH_SHARE, ROUGH_WINDOW_PX = 1.3, 9
"""A pixel errs by so many times what its window scatters. These and the prior are fitted by `real/depth.py --fit`."""
CARRIED_SHARE = 0.015
"""Of how far matching carries a disparity over an even place, from where the photos say more than it does: its error.

On renderings 0.4 to 0.7 px over 32 to 64 px. So nothing is known amid a wall of bare paint.
"""
MOST_MOVED_PX = 0.75
"""No pixel is moved further from the answer given; of a network's, no more is known."""
MOST_APART_PX = 2.0
"""What left and right say of one pixel: further apart, they speak of two things, one behind the other."""
ALIKE_PX = 4.0
"""Neighbouring residuals are correlated over about 2 x 2 px."""


class StereoMatcher(Protocol):
    """Matches a rectified pair densely; version 1 of the interface."""

    @property
    def name(self) -> str:
        """Return the method's name, for reports."""
        ...

    def match(self, pair: RectifiedPair) -> tuple[Float32Array, Float32Array]:
        """Return disparity and sigma in pixels, float32 (H, W); NaN disparity where nothing was measured."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SemiGlobalMatcher:
    """Semi-global matching as a prior, and the photos' evidence in a window about each pixel: their posterior.

    On an even wall the photos say nothing of a pixel, and what matching carried there from its texture stands. The left
    border is padded so that the near things at the photo's left edge are measured as well.
    """

    nearest_m: float = NEAREST_M
    block_px: int = 5  # smallest window that bridges the pores of concrete
    refine_window_px: int = 5  # wider smears narrow columns
    refine_steps: int = 2  # the second moves by under 0.05 px
    most_sigma_px: float = 1.0  # beyond, the match is a guess of the smoothness term
    speckle_px: int = 120  # a patch of 11 x 11 px that agrees with nothing around it is noise
    name: str = "semi-global"

    def match(self, pair: RectifiedPair) -> tuple[Float32Array, Float32Array]:
        """Return disparity and sigma in pixels, float32 (H, W); NaN disparity where nothing was measured."""
        left, right = grey(pair.left), grey(pair.right)
        raw = self._semi_global(left, right, pair)
        return _polished(pair, raw, (left, right), self, PRIOR_SIGMA_PX)

    def _semi_global(self, left: Float32Array, right: Float32Array, pair: RectifiedPair) -> Float32Array:
        camera = pair.camera
        steps = disparity_steps(camera.f_px * camera.baseline_m / self.nearest_m, camera.width_px)
        return semi_global(left, right, steps, self.block_px, self.speckle_px)


def disparity_steps(most_px: float, width_px: int) -> int:
    """Return how many whole disparities are looked through, a multiple of 16, so that `most_px` is among them."""
    steps = int(np.ceil(most_px / 16.0)) * 16
    return min(max(steps, 32), max(16, width_px // 2 // 16 * 16))


def semi_global(
    left: Float32Array, right: Float32Array, steps: int, block_px: int = 5, speckle_px: int = 120
) -> Float32Array:
    """Match grey pictures (H, W) of 0 to 255; disparity in pixels, NaN where none was found.

    Reference: Hirschmueller 2008, Stereo processing by semiglobal matching and mutual information.
    """
    area = block_px**2
    engine = cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=steps, blockSize=block_px, P1=8 * area, P2=32 * area, disp12MaxDiff=1,
        preFilterCap=63, uniquenessRatio=10, speckleWindowSize=speckle_px, speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )  # fmt: skip
    padded = [
        cv2.copyMakeBorder(np.clip(img, 0, 255).astype(np.uint8), 0, 0, steps, 0, cv2.BORDER_REPLICATE)
        for img in (left, right)
    ]
    fixed = np.asarray(engine.compute(padded[0], padded[1]))[:, steps:]
    columns = np.arange(left.shape[1], dtype=np.float32)
    disparity = fixed.astype(np.float32) / SIXTEENTHS
    seen = (fixed > 0) & (disparity < columns + 1.0)
    return np.where(seen, disparity, np.float32(np.nan)).astype(np.float32)


def disparity_sigma(
    pair: RectifiedPair, disparity_px: Float32Array, of_right_px: Float32Array
) -> tuple[Float32Array, Float32Array]:
    """Polish another's disparity (H, W), NaN where there is none, on the photos; return it with its sigma in pixels.

    `of_right_px` is what the same matcher says of the right photo's pixels. Where both see a thing, they differ by
    their errors: over the pair the prior's sigma, over a window its own. What they don't both see isn't measured.
    An error that both share isn't seen so: the prior is never narrower than that of semi-global matching.
    """
    apart = left_against_right(disparity_px, of_right_px)
    known = np.abs(apart) <= MOST_APART_PX
    if not known.any():
        return np.full_like(disparity_px, np.nan), np.full_like(disparity_px, np.inf)
    scatter = MEDIAN_TO_SIGMA * np.median(np.abs(apart[known])) / np.sqrt(2.0)
    prior = float(np.clip(scatter, PRIOR_SIGMA_PX, MOST_MOVED_PX))
    matcher = SemiGlobalMatcher(refine_window_px=9, refine_steps=4)
    seen = np.where(known, disparity_px, np.float32(np.nan)).astype(np.float32)
    disparity, sigma = _polished(pair, seen, (grey(pair.left), grey(pair.right)), matcher, prior)
    squared = np.where(known, apart * apart, 0.0).astype(np.float32)
    count = np.maximum(_summed(known.astype(np.float32), ROUGH_WINDOW_PX), 1.0)
    local = np.sqrt(0.5 * np.maximum(_summed(squared, ROUGH_WINDOW_PX), 0.0) / count)  # float32 sums may dip
    sigma = np.asarray(np.hypot(sigma, local), dtype=np.float32)
    fine = np.isfinite(disparity) & (sigma < matcher.most_sigma_px)
    return (
        np.where(fine, disparity, np.float32(np.nan)).astype(np.float32),
        np.where(fine, sigma, np.float32(np.inf)).astype(np.float32),
    )


def left_against_right(disparity_px: Float32Array, of_right_px: Float32Array) -> Float32Array:
    """Return how far (H, W) the right photo's disparity differs at a left pixel's partner, NaN where there is none."""
    height, width = disparity_px.shape
    at = np.arange(width, dtype=np.float32) - np.nan_to_num(disparity_px)
    low = np.floor(at).astype(np.int32)
    share = at - low
    rows = np.arange(height)[:, None]
    inside = (low >= 0) & (low < width - 1) & np.isfinite(disparity_px)
    low = np.clip(low, 0, width - 2)
    there = (1.0 - share) * of_right_px[rows, low] + share * of_right_px[rows, low + 1]
    return np.where(inside, there - disparity_px, np.nan).astype(np.float32)


def depth_map(pair: RectifiedPair, matcher: StereoMatcher) -> DepthMap:
    """Run the matcher and wrap its answer as a metric `DepthMap`."""
    disparity, sigma = matcher.match(pair)
    valid = np.isfinite(disparity) & (disparity > 0.0)
    freeze(disparity), freeze(sigma), freeze(valid)
    return DepthMap(
        disparity_px=disparity,
        sigma_px=sigma,
        valid=valid,
        f_px=pair.camera.f_px,
        baseline_m=pair.camera.baseline_m,
        method="stereo",
    )


def grey(image: np.ndarray) -> Float32Array:
    """Return the grey picture (H, W) float32 of a BGR or grey one."""
    one = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    return np.asarray(one, dtype=np.float32)


def _polished(
    pair: RectifiedPair,
    raw: Float32Array,
    greys: tuple[Float32Array, Float32Array],
    matcher: SemiGlobalMatcher,
    prior_sigma_px: float,
) -> tuple[Float32Array, Float32Array]:
    """Refine a matcher's disparity, and drop what stays a guess, jumps without an edge or leaves the right photo."""
    measured = np.isfinite(raw) & pair.valid_left & lands_inside(raw, pair.valid_right)
    start = np.where(measured, raw, 0.0).astype(np.float32)
    refined, posterior = _refine(*greys, start, measured, matcher, prior_sigma_px)
    common = max(LEAST_COMMON_PX, rows_apart_px(*greys, refined, measured))
    carried = CARRIED_SHARE * carried_px(posterior, prior_sigma_px)
    sigma = np.sqrt(
        posterior**2 + carried**2 + np.float32(common) ** 2 + (ROUGH_SHARE * _roughness(refined, measured)) ** 2
    )
    measured &= (sigma < matcher.most_sigma_px) & lands_inside(refined, pair.valid_right)
    measured &= ~jumps_without_edge(greys[0], refined, measured, matcher.most_sigma_px)
    disparity = np.where(measured, refined, np.float32(np.nan)).astype(np.float32)
    return disparity, np.where(measured, sigma, np.float32(np.inf)).astype(np.float32)


def lands_inside(disparity: Float32Array, valid_right: BoolArray) -> BoolArray:
    """Say which pixels' partners lie on the right photo, not on its padding."""
    height, width = disparity.shape
    partner = np.round(np.arange(width) - np.nan_to_num(disparity)).astype(np.int32)
    starts = (np.arange(height, dtype=np.int32) * width)[:, None]
    inside: BoolArray = (partner >= 0) & np.take(valid_right, starts + np.clip(partner, 0, width - 1))
    return inside


def _exposed(left: Float32Array, right: Float32Array, start: Float32Array, measured: BoolArray) -> Float32Array:
    """Bring the right photo to the left one's exposure, by the quartiles of what was matched.

    One gain for all: a local one would carry the background into the faces' borders.
    """
    if not measured.any():
        return right
    warped = right_at(right, start)
    low, middle, high = np.quantile(left[measured], [0.25, 0.5, 0.75])
    low_right, middle_right, high_right = np.quantile(warped[measured], [0.25, 0.5, 0.75])
    gain = float(np.clip((high - low) / max(high_right - low_right, 1.0), 0.8, 1.25))
    exposed: Float32Array = ((right - middle_right) * gain + middle).astype(np.float32)
    return exposed


def _refine(
    left: Float32Array,
    right: Float32Array,
    start: Float32Array,
    measured: BoolArray,
    matcher: SemiGlobalMatcher,
    prior_sigma_px: float,
) -> tuple[Float32Array, Float32Array]:
    """Return each disparity's most likely value and its sigma, given another's answer and both photos.

    The prior is that answer, give or take its sigma. The evidence is the window's squared difference, whose noise is
    the residual's own.
    """
    window = matcher.refine_window_px
    disparity = start.copy()
    left_flat, right_flat = left, _exposed(left, right, start, measured)
    weight = measured.astype(np.float32)
    count = np.maximum(_summed(weight, window), 1.0)
    prior = np.float32(prior_sigma_px**-2)
    evidence = np.zeros_like(start)
    for _ in range(matcher.refine_steps):
        warped, slope = warp_right(right_flat, disparity)
        difference = (left_flat - warped) * weight
        # moving d by +e samples the right photo e further left: the warped value changes by -slope * e
        top = _summed(-slope * difference, window)
        residual = _summed(difference * difference, window) / count
        noise = ALIKE_PX * (residual + 1.0)
        steepness = _summed(slope * slope * weight, window)
        step = (top / noise + (start - disparity) * prior) / (steepness / noise + prior)
        disparity += np.clip(step, -0.5, 0.5)
        # what the sensor's noise alone adds to the gradient is no evidence: half the residual's variance, per pixel
        grain = median(residual[measured]) if measured.any() else 1.0
        textured = np.maximum(steepness - np.float32(0.25 * (grain + 1.0)) * count, np.float32(0.0))
        evidence = np.asarray(textured / noise, dtype=np.float32)
    low, high = np.maximum(start - MOST_MOVED_PX, 0.05), start + MOST_MOVED_PX
    disparity = np.asarray(np.clip(disparity, low, high), dtype=np.float32)
    return disparity, np.asarray(1.0 / np.sqrt(evidence + prior), dtype=np.float32)


def carried_sigma_px(left: Float32Array, right: Float32Array, disparity_px: Float32Array) -> Float32Array:
    """Return what matching's own answer (H, W), NaN where there is none, errs by for how far it was carried."""
    measured = np.isfinite(disparity_px)
    start = np.where(measured, disparity_px, np.float32(0.0)).astype(np.float32)
    _, posterior = _refine(left, right, start, measured, SemiGlobalMatcher(refine_steps=1), PRIOR_SIGMA_PX)
    return np.asarray(CARRIED_SHARE * carried_px(posterior, PRIOR_SIGMA_PX), dtype=np.float32)


def carried_px(posterior_px: Float32Array, prior_sigma_px: float) -> Float32Array:
    """Return how far each pixel (H, W) is from the next one of which the photos say more than the prior."""
    told = posterior_px < prior_sigma_px * np.sqrt(0.5)
    furthest = np.float32(np.hypot(*posterior_px.shape))  # where nothing is told, OpenCV's answer is no number
    apart = cv2.distanceTransform((~told).view(np.uint8), cv2.DIST_L2, 5)
    return np.asarray(np.minimum(apart, furthest), dtype=np.float32)


def _roughness(disparity: Float32Array, measured: BoolArray) -> Float32Array:
    """Return how far the disparities of a window scatter about their plane, root mean square (H, W).

    Where it is large a depth edge runs through, or matching guesses: which of its values is the pixel's isn't known.
    """
    reach = ROUGH_WINDOW_PX // 2
    along, ones = np.arange(-reach, reach + 1.0), np.ones(ROUGH_WINDOW_PX)
    weight = measured.astype(np.float64)  # a sum of squares less another one: float32 leaves 0.1 px of 200
    values = np.where(measured, disparity, 0.0).astype(np.float64)

    def moment(image: FloatArray, across: FloatArray, down: FloatArray) -> FloatArray:
        return np.asarray(cv2.sepFilter2D(image, cv2.CV_64F, across, down), dtype=np.float64)

    count = np.maximum(moment(weight, ones, ones), 1.0)
    mean = moment(values, ones, ones) / count
    left = moment(values * values, ones, ones) - count * mean * mean
    for across, down in ((along, ones), (ones, along)):
        slope = moment(values, across, down) - mean * moment(weight, across, down)
        left -= slope * slope / np.maximum(moment(weight, across * across, down * down), 1.0)
    return np.sqrt(np.maximum(left, 0.0) / count).astype(np.float32)


def _summed(values: Float32Array, window: int) -> Float32Array:
    return np.asarray(cv2.boxFilter(values, cv2.CV_32F, (window, window), normalize=False), dtype=np.float32)
