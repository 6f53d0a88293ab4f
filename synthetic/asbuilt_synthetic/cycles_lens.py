"""From a pinhole render on a larger canvas to the photo that the real lens takes, without a sub-pixel lost."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_synthetic.lens import directions
from asbuilt_synthetic.model import CameraTruth

_MARGIN_PX = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Canvas:
    """The pinhole picture that is rendered: square pixels of focal length `f_px`, centres at integers."""

    f_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int

    @property
    def blender_shift(self) -> tuple[float, float]:
        """Blender's shift_x, shift_y (in units of the width, which must be the longer side)."""
        return (
            (self.width_px / 2.0 - (self.cx_px + 0.5)) / self.width_px,
            ((self.cy_px + 0.5) - self.height_px / 2.0) / self.width_px,
        )


def canvas_for(camera: CameraTruth, supersample: float) -> Canvas:
    """Choose the pinhole canvas that holds the whole distorted photo, `supersample` times as fine."""
    across = np.linspace(-0.5, camera.width_px - 0.5, 129)
    down = np.linspace(-0.5, camera.height_px - 0.5, 97)
    border = np.concatenate(
        [
            np.column_stack([across, np.full_like(across, down[0])]),
            np.column_stack([across, np.full_like(across, down[-1])]),
            np.column_stack([np.full_like(down, across[0]), down]),
            np.column_stack([np.full_like(down, across[-1]), down]),
        ]
    )
    rays = directions(camera, border)[:, :2]
    f_px = supersample * float(max(camera.K[0, 0], camera.K[1, 1]))
    low, high = rays.min(axis=0) * f_px - _MARGIN_PX, rays.max(axis=0) * f_px + _MARGIN_PX
    width, height = (int(np.ceil(extent)) for extent in high - low)
    return Canvas(f_px=f_px, cx_px=float(-low[0]), cy_px=float(-low[1]), width_px=width, height_px=height)


def photo_map(camera: CameraTruth, canvas: Canvas) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give, per photo pixel, the canvas column and row (H, W) whose ray it sees."""
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    rays = directions(camera, np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64))
    shape = (camera.height_px, camera.width_px)
    return (
        (rays[:, 0] * canvas.f_px + canvas.cx_px).reshape(shape).astype(np.float32),
        (rays[:, 1] * canvas.f_px + canvas.cy_px).reshape(shape).astype(np.float32),
    )


def through_lens(pinhole: NDArray[np.float32], camera: CameraTruth, canvas: Canvas) -> NDArray[np.float32]:
    """Resample the pinhole radiance (h, w, 3) to the distorted photo (H, W, 3), still linear.

    The canvas is finer than the photo, so it is first blurred to the photo's pixel (a Gaussian that
    adds up with the render's own filter), and interpolated by Lanczos.
    """
    finer = canvas.f_px / float(camera.K[0, 0])
    sigma = 0.40 * float(np.sqrt(max(finer**2 - 1.0, 0.0)))
    smooth = cv2.GaussianBlur(pinhole, (0, 0), sigma) if sigma > 0.15 else pinhole
    columns, rows = photo_map(camera, canvas)
    photo = cv2.remap(smooth, columns, rows, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.maximum(photo, 0.0), dtype=np.float32)
