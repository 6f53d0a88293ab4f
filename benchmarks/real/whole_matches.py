"""Corners matched between two photos, and the second photo's pose from them: geometry apart from the program's own."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.optimize import least_squares

from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray

BLUR_PX = 12.0
CORNERS, RATIO = 20000, 0.75
"""Corners sought in each photo; a match is kept where the second best is a third worse, as its author has it."""


def matched_points(left: ByteImage, right: ByteImage) -> tuple[FloatArray, FloatArray]:
    """Return the pixels (N, 2) of corners matched between the photos."""
    finder = cv2.SIFT.create(CORNERS, contrastThreshold=0.02)
    found = [finder.detectAndCompute(np.asarray(cv2.cvtColor(one, cv2.COLOR_BGR2GRAY)), None) for one in (left, right)]
    pairs = cv2.BFMatcher().knnMatch(found[0][1], found[1][1], k=2)
    sure = [first for first, second in pairs if first.distance < RATIO * second.distance]
    ends = [[found[0][0][one.queryIdx].pt for one in sure], [found[1][0][one.trainIdx].pt for one in sure]]
    return np.array(ends[0], dtype=np.float64), np.array(ends[1], dtype=np.float64)


def pose_between(left: FloatArray, right: FloatArray, most_off: float) -> tuple[FloatArray, BoolArray]:
    """Return right_from_left (4, 4) with a base of one, and which rays it explains.

    RANSAC's answer is adjusted to all its rays: its rows would be a third of a pixel off.
    """
    first, second = left[:, :2].copy(), right[:, :2].copy()
    essential, mask = cv2.findEssentialMat(first, second, np.eye(3), method=cv2.RANSAC, prob=0.9999, threshold=most_off)
    _, turn, base, good = cv2.recoverPose(essential, first, second, np.eye(3), mask=mask)
    kept = np.asarray(good).ravel() > 0
    start = np.concatenate([np.asarray(cv2.Rodrigues(turn)[0]).ravel(), np.asarray(base).ravel()])
    done = least_squares(lambda at: _off(at, left[kept], right[kept]) / most_off, start, loss="soft_l1")
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(done.x[:3])[0]
    pose[:3, 3] = done.x[3:] / np.linalg.norm(done.x[3:])
    off = np.abs(_off(done.x, left, right))
    return pose, np.asarray(kept & (off < most_off), dtype=bool)


def _off(at: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return how far rays are from each other's epipolar line (Sampson)."""
    turn, base = np.asarray(cv2.Rodrigues(at[:3])[0]), at[3:] / np.linalg.norm(at[3:])
    essential = np.cross(np.eye(3), base).T @ turn
    onto, back = left @ essential.T, right @ essential
    slope = np.sqrt(np.sum(onto[:, :2] ** 2, axis=1) + np.sum(back[:, :2] ** 2, axis=1))
    return np.asarray(np.sum(onto * right, axis=1) / slope)


def aligned_plane(
    left: ByteImage, right: ByteImage, box: tuple[int, int, int, int], start_px: tuple[float, float]
) -> FloatArray:
    """Return (a, b, c) of the disparity a x + b y + c that aligns a whole plain wall, a box of the left photo.

    It starts with the disparities of the box's left and right side.

    All its pixels at once decide, where single corners can't. Both photos lose what is wider than `BLUR_PX`: shading.
    """
    first, second = (_without_shading(one) for one in (left, right))
    x0, y0, x1, y1 = box
    columns, rows = (one.astype(np.float32) for one in np.meshgrid(np.arange(x0, x1), np.arange(y0, y1)))
    own = first[y0:y1, x0:x1]
    noise = 1.4826 * float(np.median(np.abs(own - np.median(own))))

    def off(at: FloatArray) -> FloatArray:
        across, down = (columns - x0) / (x1 - x0), (rows - y0) / (y1 - y0)
        disparity = at[0] * (1.0 - across) + at[1] * across + (at[2] - at[0]) * down
        other = cv2.remap(second, columns - disparity.astype(np.float32), rows, cv2.INTER_CUBIC)
        return np.asarray((own - other) / noise, dtype=np.float64).ravel()

    done = least_squares(off, np.array([*start_px, start_px[0]]), loss="soft_l1", diff_step=5e-3, x_scale=0.3)
    a, b = (done.x[1] - done.x[0]) / (x1 - x0), (done.x[2] - done.x[0]) / (y1 - y0)
    return np.array([a, b, done.x[0] - a * x0 - b * y0])


def _without_shading(photo: ByteImage) -> Float32Array:
    grey = np.asarray(cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY), dtype=np.float32)
    fine = cv2.GaussianBlur(grey, (0, 0), 1.0)
    return np.asarray(fine - cv2.GaussianBlur(grey, (0, 0), BLUR_PX), dtype=np.float32)
