"""Dense stereo: a rectified pair becomes a disparity and its sigma per pixel of the left photo."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, freeze
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.warp import right_at, warp_right

SIXTEENTHS = 16.0
NEAREST_M = 1.5
"""Nothing that is measured stands nearer than an arm and a board."""


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
    """Semi-global matching, then a Gauss-Newton step per pixel that takes the pixel-locking out.

    The left border is padded so that the near things at the photo's left edge are measured as well.
    """

    nearest_m: float = NEAREST_M
    block_px: int = 5  # smallest window that bridges the pores of concrete
    refine_window_px: int = 9  # 81 pixels give 0.05 px on concrete; wider smears narrow columns
    refine_steps: int = 2  # the second moves by under 0.05 px
    most_sigma_px: float = 1.0  # beyond, the match is a guess of the smoothness term: sky, white board
    speckle_px: int = 120  # a patch of 11 x 11 px that agrees with nothing around it is noise
    name: str = "semi-global"

    def match(self, pair: RectifiedPair) -> tuple[Float32Array, Float32Array]:
        """Return disparity and sigma in pixels, float32 (H, W); NaN disparity where nothing was measured."""
        left, right = grey(pair.left), grey(pair.right)
        raw = self._semi_global(left, right, pair)
        return _polished(pair, raw, left, right, (self.refine_window_px, self.refine_steps), self.most_sigma_px)

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
        preFilterCap=63, uniquenessRatio=5, speckleWindowSize=speckle_px, speckleRange=2,
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


def disparity_sigma(pair: RectifiedPair, disparity_px: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Polish another's disparity (H, W), NaN where there is none, on the photos; return it with its sigma in pixels."""
    matcher = SemiGlobalMatcher()
    window = (matcher.refine_window_px, matcher.refine_steps)
    return _polished(pair, disparity_px, grey(pair.left), grey(pair.right), window, matcher.most_sigma_px)


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
    left: Float32Array,
    right: Float32Array,
    window: tuple[int, int],
    most_sigma_px: float,
) -> tuple[Float32Array, Float32Array]:
    """Refine a matcher's disparity in a window (px, steps), and drop what stays a guess or leaves the right photo."""
    measured = np.isfinite(raw) & pair.valid_left & lands_inside(raw, pair.valid_right)
    start = np.where(measured, raw, 0.0).astype(np.float32)
    refined, sigma = _refine(left, right, start, measured, *window)
    measured &= (sigma < most_sigma_px) & lands_inside(refined, pair.valid_right)
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
    left: Float32Array, right: Float32Array, start: Float32Array, measured: BoolArray, window: int, steps: int
) -> tuple[Float32Array, Float32Array]:
    """Move each disparity to the minimum of its window's squared difference; sigma from gradient and residual."""
    disparity = start.copy()
    left_flat, right_flat = left, _exposed(left, right, start, measured)
    size = (window, window)
    weight = measured.astype(np.float32)
    count = np.maximum(cv2.boxFilter(weight, cv2.CV_32F, size, normalize=False), 1.0)
    residual_mean = np.zeros_like(start)
    steepness = np.ones_like(start)
    for _ in range(steps):
        warped, slope = warp_right(right_flat, disparity)
        difference = (left_flat - warped) * weight
        # moving d by +e samples the right photo e further left: the warped value changes by -slope * e
        top = cv2.boxFilter(-slope * difference, cv2.CV_32F, size, normalize=False)
        steepness = np.asarray(cv2.boxFilter(slope * slope * weight, cv2.CV_32F, size, normalize=False), np.float32)
        squares = cv2.boxFilter(difference * difference, cv2.CV_32F, size, normalize=False)
        residual_mean = np.asarray(squares / count, dtype=np.float32)
        disparity += np.clip(top / (steepness + 4.0 * count), -0.5, 0.5)
    disparity = np.asarray(np.clip(disparity, np.maximum(start - 0.75, 0.05), start + 0.75), dtype=np.float32)
    # what the sensor's noise alone adds to the gradient is no evidence: half the residual's variance, per pixel
    grain = float(np.median(residual_mean[measured])) if measured.any() else 1.0
    evidence = np.maximum(steepness - 0.5 * 0.5 * (grain + 1.0) * count, 1e-3)
    # neighbouring residuals are correlated over about 2 px, hence the factor 2
    sigma = 2.0 * np.sqrt((residual_mean + 1.0) / evidence)
    return disparity, np.clip(np.hypot(sigma, 0.05), 0.05, 4.0).astype(np.float32)
