"""A plane refined on the pixels of both photos: the homography it induces is fitted by Gauss-Newton.

The right photo read at x - q . r must look like the left one. Hundredths of a pixel, without the matcher's locking.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, median
from asbuilt_bim.geometry.masks import at_pixels, nonzero
from asbuilt_bim.geometry.robust_least_squares import robust_sigma, tukey
from asbuilt_bim.vision.stereo.warp import sample_sharp, with_slope

IndexArray = NDArray[np.intp]

BLOCK_PX = 16
"""Residuals within a block are taken as one observation: texture and interpolation err together over that far."""
LEAST_PIXELS = 40
"""Fewer hold no plane, nor does a half of them."""
MOST_PIXELS = 40_000
"""Enough for thousandths of a pixel; more only costs time."""
ENOUGH_COARSE = 8_000
"""For the coarse level, which only has to lead into the fine one's basin."""
MOST_STEEP = 5.0
STILL_PX = 0.002
"""A step that moves no pixel further than this is the last one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pictures:
    """Both photos of a pair as grey levels, as they are; a coarse level beside.

    Neither is the fine level smoothed nor a local mean taken off: near a face's border both would carry the background,
    which lies elsewhere in each photo. On twins a blur of 0.8 px doubled the planes' error.
    """

    fine: tuple[Float32Array, Float32Array]  # left (H, W), right with its slope (H, W, 2)
    coarse: tuple[Float32Array, Float32Array]
    valid_right: Float32Array  # (H, W), 1 where the right photo and its neighbours are


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compared:
    """The pixels (N,) that a plane was refined on, as both photos compare there, about the pixels' own middle.

    `slope` and `rate` (N, 3) are the left photo's change of grey by the plane's three numbers, and the right one's.
    """

    rows: IndexArray
    columns: IndexArray
    slope: FloatArray
    rate: FloatArray
    residual: FloatArray
    weight: FloatArray

    def of(self, some: IndexArray) -> "Compared":
        """Return these of the pixels."""
        return Compared(
            rows=self.rows[some], columns=self.columns[some], slope=self.slope.take(some, axis=0),
            rate=self.rate.take(some, axis=0), residual=self.residual[some], weight=self.weight[some],
        )  # fmt: skip

    def after(self, change: FloatArray) -> "Compared":
        """Return them as they compare after a small change (3,) of the plane."""
        return replace(self, residual=self.residual + self.rate @ change)

    def step(self) -> tuple[FloatArray, FloatArray] | None:
        """Return the change (3,) of the plane that fits these pixels best and the Hessian (3, 3), or None.

        The left photo's slope weighs, the right one's tells the rate: noise is in both, but not the same, so their
        product counts texture only. Squared, grain would pass for texture, and sigma come out too small by half.
        None: there is no texture.
        """
        weighted = (self.slope * self.weight[:, None]).T
        hessian = weighted @ self.rate
        spread = np.linalg.eigvalsh(hessian + hessian.T)
        if spread[0] < 1e-10 * spread[2] or spread[2] < 1.0:
            return None
        change = np.asarray(-np.linalg.solve(hessian, weighted @ self.residual), dtype=np.float64)
        return change, hessian


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneFit:
    """q (3,) and its covariance (3, 3) from the pictures alone, and the pixels that it was refined on.

    `doubt` 0..1 is the share of what halves of the pixels differ by that isn't chance; 1 where they weren't compared.
    """

    q_px: FloatArray
    covariance: FloatArray
    compared: Compared
    doubt: float = 1.0


def pictures(left_grey: Float32Array, right_grey: Float32Array, valid_right: BoolArray) -> Pictures:
    """Prepare both photos: smoothing by 2 px widens the basin."""

    def level(image: Float32Array, sigma: float) -> Float32Array:
        return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), dtype=np.float32)

    inner = cv2.erode(valid_right.astype(np.uint8), np.ones((9, 9), np.uint8), borderValue=0).astype(np.float32)
    return Pictures(
        fine=(left_grey, with_slope(right_grey)),
        coarse=(level(left_grey, 2.0), with_slope(level(right_grey, 2.0))),
        valid_right=inner,
    )


def refine_plane(
    both: Pictures, rays: FloatArray, mask: BoolArray, start_px: FloatArray, most_px: float = 2.5, again: bool = False
) -> PlaneFit | None:
    """Refine q (3,) on the pixels of `mask` (H, W); None where the pictures don't hold it.

    `again`: the start was refined before, on other pixels, and needs no wide basin. Refused where it diverges: a
    disparity inside the mask that moves by over `most_px`, or a picture without texture.

    Reference: the plane-induced homography, x_right = x - q . r.
    """
    rows, columns = nonzero(mask)
    if rows.size < LEAST_PIXELS:
        return None
    if rows.size > MOST_PIXELS:  # the steepest pixels of each neighbourhood hold the plane best
        rows, columns = _steepest(both.fine[0], rows, columns)
    r = at_pixels(rays, rows, columns)
    partner = np.round(columns - r @ np.asarray(start_px)).astype(np.intp)
    paired = np.flatnonzero((partner >= 0) & (both.valid_right[rows, np.clip(partner, 0, mask.shape[1] - 1)] > 0.5))
    rows, columns, r = rows[paired], columns[paired], r.take(paired, axis=0)
    if rows.size < LEAST_PIXELS:
        return None
    q = np.asarray(start_px, dtype=np.float64)
    some = slice(None, None, max(1, rows.size // ENOUGH_COARSE))
    levels = [(*both.coarse, some, 4), (*both.fine, slice(None), 6)]
    for left, right, used, steps in levels[1 if again else 0 :]:
        found = _gauss_newton(left, right, rows[used], columns[used], r[used], q, steps)
        if found is None or float(np.max(np.abs(r @ (found[0] - start_px)))) > most_px:
            return None
        q, lift, compared, hessian = found
    return PlaneFit(q_px=q, covariance=lift @ sandwich(compared, hessian) @ lift.T, compared=compared)


def _gauss_newton(
    left: Float32Array,
    right: Float32Array,
    rows: IndexArray,
    columns: IndexArray,
    r: FloatArray,
    q: FloatArray,
    steps: int,
) -> tuple[FloatArray, FloatArray, Compared, FloatArray] | None:
    """Return q (3,), what carries the patch's own three numbers to it (3, 3), the pixels, and the Hessian (3, 3)."""
    x, y = columns.astype(np.float32), rows.astype(np.float32)
    seen = left[rows, columns].astype(np.float64)
    ahead, behind = np.minimum(columns + 1, left.shape[1] - 1), np.maximum(columns - 1, 0)
    left_slope = 0.5 * (left[rows, ahead] - left[rows, behind]).astype(np.float64)
    usual_slope = median(np.abs(left_slope))
    # q is solved about the patch's own middle: well-conditioned however far off the axis it lies
    middle, basis = _basis(r)
    own = (r - middle) @ basis.T
    own = np.concatenate([own, np.ones((len(own), 1))], axis=1)
    weight = np.ones_like(seen)
    slope = left_slope[:, None] * own
    # a few very steep pixels (a stain's rim, a tag) mustn't outvote the surface
    steep = np.maximum(1.0, np.square(left_slope / (MOST_STEEP * usual_slope + 1e-6)))
    for _ in range(steps):
        at = x - (r @ q).astype(np.float32)
        there, right_slope = _line(right, at, y)
        gain, offset = _exposure(seen, there, weight)
        residual = seen - gain * there - offset
        scale = max(robust_sigma(residual), 0.5)
        weight = tukey(residual / scale) / steep
        compared = Compared(
            rows=rows, columns=columns, slope=slope, rate=gain * right_slope[:, None] * own, residual=residual,
            weight=weight,
        )  # fmt: skip
        found = compared.step()
        if found is None:
            return None
        change, hessian = found
        moved = float(np.max(np.abs(own @ change)))
        q = q + _q_change(change / max(moved, 1.0), middle, basis)  # a px a step: beyond, the slope means nothing
        if moved < STILL_PX:
            break
    lift = np.stack([_q_change(e, middle, basis) for e in np.eye(3)], axis=1)
    return q, lift, compared, hessian


def _exposure(seen: FloatArray, there: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Return gain and offset that carry the right photo's grey levels to the left one's."""
    total = float(weight.sum()) + 1e-9
    mean_seen, mean_there = float(weight @ seen) / total, float(weight @ there) / total
    spread = float(weight @ np.square(there - mean_there))
    gain = float(weight @ ((seen - mean_seen) * (there - mean_there))) / max(spread, 1e-9)
    gain = float(
        np.clip(gain, 0.8, 1.25)
    )  # noise pulls it towards 0, exposure of a synchronised rig doesn't differ more
    return gain, mean_seen - gain * mean_there


def _steepest(image: Float32Array, rows: IndexArray, columns: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Keep `MOST_PIXELS` pixels: of each run of neighbours the one with the steepest slope along x."""
    step = -(-rows.size // MOST_PIXELS)
    slope = np.abs(image[rows, np.minimum(columns + 1, image.shape[1] - 1)] - image[rows, np.maximum(columns - 1, 0)])
    count = rows.size // step
    picked = np.arange(count) * step + np.argmax(slope[: count * step].reshape(count, step), axis=1)
    return rows[picked], columns[picked]


def _basis(r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rays' mean (3,) and two axes (2, 3) of the image plane scaled to the patch's spread."""
    spread = np.maximum(r[:, :2].std(axis=0), 1e-6)
    return r.mean(axis=0), np.array([[1.0 / spread[0], 0.0, 0.0], [0.0, 1.0 / spread[1], 0.0]])


def _q_change(change: FloatArray, middle: FloatArray, basis: FloatArray) -> FloatArray:
    """Turn (slope x, slope y, offset at the middle) into a change of q: d = c0 (x-mx)/sx + c1 (y-my)/sy + c2."""
    sloped: FloatArray = change[0] * basis[0] + change[1] * basis[1]
    sloped[2] = change[2] - sloped[:2] @ middle[:2]
    return sloped


def _line(image: Float32Array, x: Float32Array, y: Float32Array) -> tuple[FloatArray, FloatArray]:
    """Sample a picture with its slope (H, W, 2) at (N,) places; remap wants an image, so they are laid out in rows."""
    width, count = 64, len(x)
    places = np.zeros((2, -(-count // width) * width), dtype=np.float32)
    places[:, :count] = x, y
    laid = sample_sharp(image, *places.reshape(2, -1, width)).reshape(-1, 2)[:count]
    return laid[:, 0].astype(np.float64), laid[:, 1].astype(np.float64)


def sandwich(compared: Compared, hessian: FloatArray) -> FloatArray:
    """Return the covariance (3, 3) with the residuals' own correlation in it: scores are summed by block first."""
    weight, residual = compared.weight, compared.residual
    score = compared.slope * (weight * residual)[:, None]
    across = compared.columns // BLOCK_PX
    block = compared.rows // BLOCK_PX * (int(across.max()) + 1) + across
    sums = np.stack([np.bincount(block, weights=score[:, i]) for i in range(3)], axis=1)[np.bincount(block) > 0]
    inverse = np.linalg.inv(hessian)
    blocks = len(sums)
    together = sums.T @ sums * (blocks / max(blocks - 3, 1))
    # slow shading joins blocks, and a handful can't show their scatter: half of what independent pixels give on top
    alone = (
        (compared.slope * weight[:, None]).T @ compared.slope * float(np.average(residual**2, weights=weight + 1e-12))
    )
    covariance: FloatArray = inverse @ (together + 0.5 * alone) @ inverse.T
    return covariance
