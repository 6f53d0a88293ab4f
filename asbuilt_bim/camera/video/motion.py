"""What moves from frame to frame: how much of a frame is still in view, how sharp one is, and whether eyes agree."""

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray

LOOK_WIDTH_PX = 480
"""Frames are followed at this width: enough for corners, and a hundred frames a second on one processor."""
SHIFT_ERROR_PX = 0.5
"""A whole frame's shift is wrong by so much where things pass at several distances."""
_POINTS = 300
_BACK_PX = 1.0  # followed there and back, a point is where it was, or it was lost


def small_grey(image: ByteImage, width_px: int = LOOK_WIDTH_PX) -> ByteImage:
    """Return a frame's grey levels at a small width."""
    scale = width_px / image.shape[1]
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else image
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def sharpness(image: ByteImage) -> float:
    """Return how sharp a frame is against others of the same things: curvature of its grey levels over their slope."""
    grey = cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (0, 0), 0.8).astype(np.float32)  # noise isn't
    bent = float(np.mean(np.square(cv2.Laplacian(grey, cv2.CV_32F))))
    slope = float(np.mean(np.square(np.diff(grey, axis=1)))) + float(np.mean(np.square(np.diff(grey, axis=0))))
    return bent / max(slope, 1e-6)


def points_of(grey: ByteImage) -> Float32Array:
    """Return points (n, 1, 2) of a frame that can be followed, well apart."""
    found = cv2.goodFeaturesToTrack(grey, _POINTS, 0.001, LOOK_WIDTH_PX / 40.0)
    return np.zeros((0, 1, 2), dtype=np.float32) if found is None else np.asarray(found, dtype=np.float32)


def followed(before: ByteImage, after: ByteImage, points: Float32Array) -> Float32Array:
    """Return where points (n, 1, 2) of one frame are in the next; those that left it or were lost are left out."""
    if not len(points):
        return points
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, points, np.zeros_like(points), winSize=(15, 15))
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(after, before, there, np.zeros_like(points), winSize=(15, 15))
    height, width = after.shape
    x, y = there[:, 0].T
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    same = np.linalg.norm((back - points)[:, 0], axis=1) < _BACK_PX
    kept: Float32Array = there[inside & same & (found[:, 0] == 1) & (found_back[:, 0] == 1)]
    return kept


def whole_shift(before: Float32Array, after: Float32Array) -> tuple[float, float]:
    """Return by how many pixels one small frame is shifted against the one before, in x and y."""
    window = cv2.createHanningWindow((before.shape[1], before.shape[0]), cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(before, after, window)
    return float(x), float(y)


def frames_behind(left: FloatArray, right: FloatArray, most: int) -> int:
    """Return by how many frames the right eye's motion (n, 2) runs behind the left eye's; 0 where nothing says so.

    Both eyes are held by one hand. Where they agree twice as well (in squares) with a lag as without one, they were
    not triggered together. A steady motion says nothing: what varies then is the error of the shifts, which repeats
    when the right eye comes to see what the left one saw.
    """
    n = len(left)
    if n < 3 * most:
        return 0
    off = {}
    for lag in range(-most, most + 1):
        a, b = left[max(0, -lag) : n - max(0, lag)], right[max(0, lag) : n - max(0, -lag)]
        off[lag] = float(np.mean(np.minimum(np.square(a - b).sum(axis=1), np.var(left, axis=0).sum())))
    best = min(off, key=lambda lag: (off[lag], abs(lag)))
    moved = float(np.var(left, axis=0).sum())
    return best if moved > SHIFT_ERROR_PX**2 and off[best] < 0.5 * min(off[0], moved) else 0
