"""What a stereo matcher would see of a scene whose depth is known: the network's geometry input while it learns.

True depth would teach the network to trust what it never gets. So it gets disparity as semi-global matching hands it
over: noisy, in steps, fattened round what is near, absent where the other camera sees nothing, where nothing can be
matched, and now and then plainly wrong. Every strength is drawn anew for each picture, wider than one matcher's: what
is learned must hold for others too.
"""

from __future__ import annotations

import cv2
import numpy as np
from asbuilt_bim.geometry.arrays import Float32Array


def stereo_of(
    rng: np.random.Generator,
    inverse_depth_per_m: Float32Array,
    grey: np.ndarray,
    *,
    bf_px_m: float,
    left_px: Float32Array,
) -> Float32Array:
    """Return inverse depth (h, w) in 1/m as stereo would measure it, 0 where it wouldn't.

    `bf_px_m` is focal length times baseline in this picture's pixels, `left_px` (w,) how far each column is from the
    left edge of the WHOLE photo, `grey` uint8 (h, w) the picture that would be matched.
    """
    height, width = inverse_depth_per_m.shape
    disparity = inverse_depth_per_m * np.float32(bf_px_m)
    if rng.random() < 0.7:
        disparity = _fattened(rng, disparity)
    unknown = _hidden(disparity) | (disparity > left_px) | (disparity < rng.uniform(0.15, 0.6))
    unknown |= disparity > rng.uniform(0.15, 0.4) * 384.0  # the matcher's range; widths of whole pictures are 384
    unknown |= _featureless(rng, grey)
    coarse = _field(rng, height, width, rng.uniform(3.0, 9.0)) * np.float32(10.0 ** rng.uniform(-1.8, -0.7))
    fine = rng.standard_normal((height, width), dtype=np.float32) * np.float32(10.0 ** rng.uniform(-2.2, -1.0))
    disparity = disparity + coarse + fine
    if rng.random() < 0.3:
        step = np.float32(rng.choice([1 / 16, 1 / 8, 1 / 4]))
        disparity = np.round(disparity / step) * step
    if rng.random() < 0.5:
        disparity, unknown = _blunders(rng, disparity, unknown)
    if rng.random() < 0.3:  # a matcher that fills what it doesn't know from the left
        keep = _field(rng, height, width, 12.0) > rng.uniform(0.0, 1.5)
        unknown &= ~keep | (inverse_depth_per_m <= 0.0)
    disparity = cv2.medianBlur(np.ascontiguousarray(disparity), 3) if rng.random() < 0.5 else disparity
    measured = np.where(unknown | (disparity <= 0.05), np.float32(0.0), disparity) / np.float32(bf_px_m)
    return np.asarray(measured, dtype=np.float32)


def _field(rng: np.random.Generator, height: int, width: int, size_px: float) -> Float32Array:
    """Return a smooth random field (h, w), about standard normal, whose bumps have this size."""
    small = (max(int(height / size_px), 2), max(int(width / size_px), 2))
    noise = rng.standard_normal(small, dtype=np.float32)
    return np.asarray(cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC))


def _fattened(rng: np.random.Generator, disparity: Float32Array) -> Float32Array:
    """Widen what is near by a pixel or two, in parts of the picture: windows carry it over the edge."""
    reach = int(rng.integers(1, 4))
    wide = cv2.dilate(disparity, np.ones((reach, 2 * reach + 1), dtype=np.uint8))
    where = _field(rng, *disparity.shape, 14.0) > rng.uniform(-0.8, 1.0)
    return np.where(where, wide, disparity)


def _hidden(disparity: Float32Array) -> np.ndarray:
    """Return where the right camera sees something nearer: what is further right here, but not there."""
    across = np.arange(disparity.shape[1], dtype=np.float32) - disparity
    from_right = np.minimum.accumulate(across[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(disparity.shape, dtype=bool)
    hidden[:, :-1] = from_right[:, 1:] < across[:, :-1] - 0.5
    return hidden


def _featureless(rng: np.random.Generator, grey: np.ndarray) -> np.ndarray:
    """Return where nothing stands out enough to be matched, by a limit drawn at random; burnt-out and black too."""
    slope = cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3)
    strength = cv2.blur(np.abs(slope), (9, 5))
    limit = rng.uniform(0.0, 14.0) if rng.random() < 0.6 else 0.0
    bumps = _field(rng, *grey.shape, 20.0)
    return np.asarray((strength < limit) & (bumps > rng.uniform(-1.5, 1.0)))


def _blunders(
    rng: np.random.Generator, disparity: Float32Array, unknown: np.ndarray
) -> tuple[Float32Array, np.ndarray]:
    """Put in patches that were matched to the wrong place, and patches that were not matched at all."""
    height, width = disparity.shape
    disparity, unknown = disparity.copy(), unknown.copy()
    for _ in range(int(rng.integers(1, 7))):
        w, h = int(rng.integers(4, width // 4)), int(rng.integers(3, height // 5))
        x, y = int(rng.integers(0, width - w)), int(rng.integers(0, height - h))
        blob = np.zeros((h, w), dtype=np.uint8)
        cv2.ellipse(blob, (w // 2, h // 2), (max(w // 2, 1), max(h // 2, 1)), 0, 0, 360, 1, -1)
        if rng.random() < 0.5:
            unknown[y : y + h, x : x + w] |= blob > 0
        else:
            disparity[y : y + h, x : x + w] += blob * np.float32(rng.uniform(-12.0, 12.0))
    return disparity, unknown
