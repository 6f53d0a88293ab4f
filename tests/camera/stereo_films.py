"""Small stereo videos with known motion: a window that pans over a wide picture, both eyes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage

SIZE = 320, 240
DISPARITY_PX = 12


def wall(seed: int = 1, width: int = 1400, height: int = 300) -> ByteImage:
    """A wide picture with blobs of many sizes."""
    rng = np.random.default_rng(seed)
    layers = [cv2.resize(rng.normal(0.0, 1.0, (height // s, width // s)), (width, height)) for s in (4, 12, 40)]
    grey = np.clip(128.0 + 40.0 * np.sum(layers, axis=0), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def eyes(at_px: float, shake_px: float = 0.0) -> tuple[ByteImage, ByteImage]:
    """Both eyes where the window stands at a column of the wall."""
    whole = wall()
    left = cv2.getRectSubPix(whole, SIZE, (at_px + SIZE[0] / 2, 150.0 + shake_px))
    right = cv2.getRectSubPix(whole, SIZE, (at_px + SIZE[0] / 2 + DISPARITY_PX, 150.0 + shake_px))
    return np.asarray(left, dtype=np.uint8), np.asarray(right, dtype=np.uint8)


def write_film(path: Path, frames: Sequence[ByteImage], rate: float = 24.0) -> Path:
    """Write frames as a video: of single pictures in an AVI, of MPEG-4 in an MP4."""
    height, width = frames[0].shape[:2]
    codec = "MJPG" if path.suffix == ".avi" else "mp4v"
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), rate, (width, height))
    assert film.isOpened()
    for frame in frames:
        film.write(frame)
    film.release()
    return path


def still(_: int) -> float:
    """A tripod's motion."""
    return 0.0


def panned(count: int, step_px: float, shake: Callable[[int], float] = still) -> list[tuple[ByteImage, ByteImage]]:
    """A pan of so many frames."""
    return [eyes(10.0 + step_px * number, shake(number)) for number in range(count)]
