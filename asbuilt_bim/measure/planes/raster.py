"""A face seen straight on: both photos, labels and disparities carried to the face's own plane, plumb lines upright."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedCamera
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.geometry.disparity_plane import plane_of
from asbuilt_bim.geometry.masks import box_of, nonzero
from asbuilt_bim.geometry.plane import frame_on_plane
from asbuilt_bim.measure.outline.edges import pixel_plane

MARGIN_PX = 26
MOST_SIDE_PX = 1400


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceRaster:
    """A raster laid on a face's plane, u to the right and v down, about one raster pixel to a pixel of the photo.

    `photo_from_raster` (3, 3) carries raster pixels to the rectified left photo, `right_from_raster` to the right one
    along the plane.
    """

    photo_from_raster: FloatArray
    right_from_raster: FloatArray
    width: int
    height: int
    step_m: FloatArray  # (2,) metres per raster pixel along u and v

    def lay(self, image: NDArray[Any], right: bool = False, nearest: bool = False) -> NDArray[Any]:
        """Carry a picture of the left (or right) photo's frame to the raster; the border is repeated."""
        matrix = self.right_from_raster if right else self.photo_from_raster
        flags = (cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR) | cv2.WARP_INVERSE_MAP
        return np.asarray(
            cv2.warpPerspective(image, matrix, (self.width, self.height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        )

    def from_photo(self, points: FloatArray) -> FloatArray:
        """Carry places (N, 2) of the rectified left photo to the raster."""
        return _carried(np.asarray(np.linalg.inv(self.photo_from_raster), dtype=np.float64), points)

    def to_photo(self, points: FloatArray) -> FloatArray:
        """Carry raster places (N, 2) to the rectified left photo."""
        return _carried(self.photo_from_raster, points)


def _carried(matrix: FloatArray, points: FloatArray) -> FloatArray:
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ matrix.T
    carried: FloatArray = homogeneous[:, :2] / homogeneous[:, 2:]
    return carried


def face_raster(mask: BoolArray, q_px: FloatArray, camera: RectifiedCamera, down: FloatArray) -> FaceRaster | None:
    """Lay a raster over the pixels of `mask` (H, W) on the plane q; None where the plane is seen edge-on."""
    rows, columns = nonzero(mask)
    if rows.size == 0:
        return None
    frame = frame_on_plane(plane_of(q_px, camera.f_px * camera.baseline_m), np.zeros(3), -down)
    border = np.concatenate([_ends(rows, columns), _ends(columns, rows)[:, ::-1]])
    rays = np.ones((len(border), 3))
    rays[:, :2] = (border - [camera.cx_px, camera.cy_px]) / camera.f_px
    disparity = rays @ q_px
    if np.any(disparity < 0.5):
        return None
    uv = frame.to_uv(rays * (camera.f_px * camera.baseline_m / disparity)[:, None])
    low, high = uv.min(axis=0), uv.max(axis=0)
    middle = rays.mean(axis=0)
    step = _steps(frame.u, frame.v, middle * camera.f_px * camera.baseline_m / float(middle @ q_px), camera)
    step = np.maximum(step, (high - low) / (MOST_SIDE_PX - 2 * MARGIN_PX))
    size = np.ceil((high - low) / step).astype(int) + 2 * MARGIN_PX
    # the corner is top left: the frame's v points up, the raster's down
    corner = frame.origin_m + (low[0] - MARGIN_PX * step[0]) * frame.u + (high[1] + MARGIN_PX * step[1]) * frame.v
    k = np.array([[camera.f_px, 0.0, camera.cx_px], [0.0, camera.f_px, camera.cy_px], [0.0, 0.0, 1.0]])
    photo_from_raster = k @ np.stack([frame.u * step[0], -frame.v * step[1], corner], axis=1)
    p = pixel_plane(q_px, camera)
    along_plane = np.array([[1.0 - p[0], -p[1], -p[2]], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return FaceRaster(
        photo_from_raster=photo_from_raster, right_from_raster=along_plane @ photo_from_raster, width=int(size[0]),
        height=int(size[1]), step_m=step,
    )  # fmt: skip


def shrunk(mask: BoolArray, border_px: int) -> BoolArray:
    """Return a mask (H, W) less a border of so many pixels; beyond the photo there is nothing."""
    box, inner = box_of(mask), np.zeros_like(mask)
    if mask[box].size:
        square = np.ones((2 * border_px + 1, 2 * border_px + 1), np.uint8)
        inner[box] = cv2.erode(mask[box].view(np.uint8), square, borderValue=0) > 0
    return inner


def _ends(keys: NDArray[np.intp], values: NDArray[np.intp]) -> FloatArray:
    """Return, per key, its first and last value: points (2 K, 2) as (value, key)."""
    order = np.argsort(keys, kind="stable")
    unique, starts = np.unique(keys[order], return_index=True)
    low = np.minimum.reduceat(values[order], starts)
    high = np.maximum.reduceat(values[order], starts)
    return np.concatenate([np.stack([low, unique], axis=1), np.stack([high, unique], axis=1)]).astype(np.float64)


def _steps(u: FloatArray, v: FloatArray, point: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return metres per photo pixel along u and v at a point."""

    def pixels_per_metre(axis: FloatArray) -> float:
        moved = camera.f_px * (axis[:2] * point[2] - point[:2] * axis[2]) / point[2] ** 2
        return max(float(np.linalg.norm(moved)), 1e-3)

    return np.array([1.0 / pixels_per_metre(u), 1.0 / pixels_per_metre(v)])
