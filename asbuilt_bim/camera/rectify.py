"""Rectification: rows of left and right correspond, and the whole frame is kept."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.lens import reach
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import PhotoError, RigError
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, FloatArray, freeze, frozen
from asbuilt_bim.geometry.transform import unit

MAX_GROWTH = 1.3
"""The rectified frame may be this much larger than the photo; a lens that asks for more is a fisheye."""
MAX_TURN_RAD = np.deg2rad(30.0)
"""A camera turned further than this to stand along the baseline is no stereo pair but a mistake."""
_BORDER_STEPS = 65
_BETWEEN_PX = 5  # where a lens draws things smaller than the middle of the photo does, its pixels are further apart
_LEAST_AHEAD = 0.1  # cosine: 84 degrees off the axis are out of every frame


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RectifiedCamera:
    """The left camera after rectification: same centre, turned by `rectified_from_left` (3, 3), one focal length.

    Disparity D = x_left - x_right >= 0 and Z_rectified = f b / D (eq. 2 and 3).
    """

    f_px: float
    cx_px: float
    cy_px: float
    baseline_m: float
    width_px: int
    height_px: int
    rectified_from_left: FloatArray  # (3, 3)

    @property
    def K(self) -> FloatArray:  # noqa: N802 - as in Intrinsics
        """Return the camera matrix (3, 3) of the rectified left photo."""
        return np.array([[self.f_px, 0.0, self.cx_px], [0.0, self.f_px, self.cy_px], [0.0, 0.0, 1.0]])

    def rectified_rays(self, pixels: ArrayLike) -> FloatArray:
        """Return directions (..., 3), z = 1, in the RECTIFIED frame of rectified pixels (..., 2)."""
        px = np.asarray(pixels, dtype=np.float64)
        rays = np.ones((*px.shape[:-1], 3))
        rays[..., 0] = (px[..., 0] - self.cx_px) / self.f_px
        rays[..., 1] = (px[..., 1] - self.cy_px) / self.f_px
        return rays

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """Return directions (..., 3) in the LEFT frame of rectified pixels (..., 2), with z = 1 before turning."""
        turned: FloatArray = self.rectified_rays(pixels) @ self.rectified_from_left  # left_from_rectified on rows
        return turned

    def project(self, points_left_m: ArrayLike) -> FloatArray:
        """Return rectified left pixels (..., 2) of points (..., 3) in the left frame; NaN behind the camera."""
        return self.pixels_of(np.asarray(points_left_m, dtype=np.float64) @ self.rectified_from_left.T)

    def pixels_of(self, rectified: FloatArray) -> FloatArray:
        """Return rectified pixels (..., 2) of points (..., 3) in a RECTIFIED camera's frame; NaN behind it."""
        z = np.where(rectified[..., 2] > 1e-6, rectified[..., 2], np.nan)
        return np.stack(
            [self.f_px * rectified[..., 0] / z + self.cx_px, self.f_px * rectified[..., 1] / z + self.cy_px], axis=-1
        )

    def points(self, pixels: ArrayLike, disparity_px: ArrayLike) -> FloatArray:
        """Return points (..., 3) in the left frame of pixels (..., 2) with disparities (...)."""
        depth = self.f_px * self.baseline_m / np.asarray(disparity_px, dtype=np.float64)
        points: FloatArray = self.rays(pixels) * depth[..., None]
        return points


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RectifiedPair:
    """Both photos after rectification, BGR uint8 (H, W, 3), the whole frame; `valid_*` tells where there is a photo."""

    name: str  # the station's name, for messages
    left: ByteImage
    right: ByteImage
    valid_left: BoolArray  # (H, W)
    valid_right: BoolArray
    camera: RectifiedCamera


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TakenPhoto:
    """A photo as it was taken (working size), BGR uint8 (h, w, 3), and what of it the rectified frame shows (h, w)."""

    image: ByteImage
    shown: BoolArray
    lens: Intrinsics
    turn: FloatArray  # (3, 3), rectified_from_left or rectified_from_right
    camera: RectifiedCamera

    def rectified(self, pixels: FloatArray) -> FloatArray:
        """Carry pixels (N, 2) of the photo to the rectified frame; NaN where the lens shows nothing."""
        return self.camera.pixels_of(self.lens.rays(pixels) @ self.turn.T)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rectification:
    """The maps that carry a rig's photos to rectified pairs: where each rectified pixel lies in its photo.

    `left_map`, `right_map` float32 (H, W, 2) in pixels of the original photos; valid masks bool (H, W).
    """

    rig: StereoRig
    camera: RectifiedCamera
    rectified_from_right: FloatArray  # (3, 3)
    left_map: Float32Array
    right_map: Float32Array
    valid_left: BoolArray
    valid_right: BoolArray
    shown_left: BoolArray  # (h, w) of the photo: what the rectified frame shows
    shown_right: BoolArray

    def taken(self, left_image: ByteImage, right_image: ByteImage) -> tuple[TakenPhoto, TakenPhoto]:
        """Return a station's photos as they were taken, with where they lie in the rectified frame."""
        camera, rig, turn = self.camera, self.rig, self.camera.rectified_from_left
        return (
            TakenPhoto(image=left_image, shown=self.shown_left, lens=rig.left, turn=turn, camera=camera),
            TakenPhoto(
                image=right_image, shown=self.shown_right, lens=rig.right, turn=self.rectified_from_right, camera=camera
            ),
        )


def rectification(rig: StereoRig) -> Rectification:
    """Prepare the rectification of a rig: both cameras turned as little as can be so that rows correspond.

    The frame holds every pixel of both photos, at the mean focal length, the same for both sides, so that points at
    infinity have no disparity.

    Raises: RigError where the right camera does not stand to the right of the left one.
    Reference: Fusiello, Trucco & Verri 2000, A compact algorithm for rectification of stereo pairs.
    """
    left_turn, right_turn = turns(rig)
    f_px = float(np.mean([rig.left.K[0, 0], rig.left.K[1, 1], rig.right.K[0, 0], rig.right.K[1, 1]]))
    left_border = _border(rig.left, left_turn) * f_px
    right_border = _border(rig.right, right_turn) * f_px
    (x0, y0), (x1, y1) = _frame(left_border, right_border, (rig.left.width_px, rig.left.height_px))
    camera = RectifiedCamera(
        f_px=f_px,
        cx_px=float(-x0 - 0.5),
        cy_px=float(-y0 - 0.5),
        baseline_m=rig.baseline_m,
        width_px=int(np.ceil(x1 - x0)),
        height_px=int(np.ceil(y1 - y0)),
        rectified_from_left=frozen(left_turn),
    )
    left_map, valid_left = rectified_map(camera, rig.left, left_turn)
    right_map, valid_right = rectified_map(camera, rig.right, right_turn)
    return Rectification(
        rig=rig,
        camera=camera,
        rectified_from_right=frozen(right_turn),
        left_map=left_map,
        right_map=right_map,
        valid_left=valid_left,
        valid_right=valid_right,
        shown_left=_shown(left_map[valid_left], rig.left),
        shown_right=_shown(right_map[valid_right], rig.right),
    )


def _shown(at: Float32Array, photo: Intrinsics) -> BoolArray:
    """Return the pixels (h, w) of a photo that pixels of the rectified frame lie `at` (N, 2), and those between."""
    shown = np.zeros((photo.height_px, photo.width_px), dtype=np.uint8)
    x, y = np.round(at).astype(int).T
    shown[y.clip(0, photo.height_px - 1), x.clip(0, photo.width_px - 1)] = 1
    return freeze(cv2.morphologyEx(shown, cv2.MORPH_CLOSE, np.ones((_BETWEEN_PX, _BETWEEN_PX), np.uint8)) > 0)


def rectify(prepared: Rectification, left_image: ByteImage, right_image: ByteImage, name: str) -> RectifiedPair:
    """Rectify both photos of the station `name` (BGR uint8, as decoded), cubic; black where there is no photo.

    Raises: PhotoError where a picture hasn't the rig's size.
    """
    for side, image, lens in (("left", left_image, prepared.rig.left), ("right", right_image, prepared.rig.right)):
        if image.shape[:2] != (lens.height_px, lens.width_px):
            raise PhotoError(
                f"station {name}: the {side} photo has {image.shape[1]} x {image.shape[0]} pixels, "
                f"the rig {lens.width_px} x {lens.height_px}; use photos of the rig as the camera stored them"
            )
    return RectifiedPair(
        name=name,
        left=_carry(left_image, prepared.left_map, prepared.valid_left),
        right=_carry(right_image, prepared.right_map, prepared.valid_right),
        valid_left=prepared.valid_left,
        valid_right=prepared.valid_right,
        camera=prepared.camera,
    )


def turns(rig: StereoRig) -> tuple[FloatArray, FloatArray]:
    """Return rectified_from_left and rectified_from_right (3, 3): x along the baseline, z between the two axes.

    Raises: RigError where the right camera does not stand to the right of the left one.
    """
    right_from_left = rig.right_from_left
    centre = -right_from_left[:3, :3].T @ right_from_left[:3, 3]  # of the right camera, in the left frame
    along = unit(centre)
    if along[0] < np.cos(MAX_TURN_RAD):
        reason = "left and right look swapped" if centre[0] < 0 else "it does not stand to the right"
        raise RigError(
            f"rig: the right camera stands at x {centre[0]:.4f}, y {centre[1]:.4f}, z {centre[2]:.4f} m of the left "
            f"one: {reason}; exchange the photos of the boards, or calibrate again"
        )
    forward = np.array([0.0, 0.0, 1.0]) + right_from_left[2, :3]  # both optical axes, in the left frame
    down = unit(np.cross(forward, along))
    left_turn = np.stack([along, down, np.cross(along, down)])
    return left_turn, left_turn @ right_from_left[:3, :3].T


def _border(camera: Intrinsics, turn: FloatArray) -> FloatArray:
    """Return where the outline of the photo's pixel area lies after turning, (N, 2), as x/z and y/z.

    Raises: RigError where the lens shows none of it.
    """
    across = np.linspace(-0.5, camera.width_px - 0.5, _BORDER_STEPS)
    along = np.linspace(-0.5, camera.height_px - 0.5, _BORDER_STEPS)
    top, left = np.full_like(across, -0.5), np.full_like(along, -0.5)
    outline = np.concatenate(
        [
            np.stack([across, top], axis=-1),
            np.stack([across, top + camera.height_px], axis=-1),
            np.stack([left, along], axis=-1),
            np.stack([left + camera.width_px, along], axis=-1),
        ]
    )
    turned = camera.rays(outline) @ turn.T
    ahead = turned[turned[:, 2] > _LEAST_AHEAD * np.linalg.norm(turned, axis=1)]  # False for NaN: a fisheye's corners
    if not len(ahead):
        raise RigError(
            "rig: the lens shows none of the photo's border, so there is nothing to rectify; calibrate again"
        )
    xy: FloatArray = ahead[:, :2] / ahead[:, 2:]
    return xy


def _frame(left: FloatArray, right: FloatArray, size: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Return the low and high corner (2,) of the frame round both borders, held to `MAX_GROWTH` round the left's."""
    both = np.concatenate([left, right])
    low, high = both.min(axis=0), both.max(axis=0)
    middle = 0.5 * (left.min(axis=0) + left.max(axis=0))
    reach = 0.5 * MAX_GROWTH * np.array(size, dtype=np.float64)
    return np.maximum(low, middle - reach), np.minimum(high, middle + reach)


def rectified_map(camera: RectifiedCamera, photo: Intrinsics, turn: FloatArray) -> tuple[Float32Array, BoolArray]:
    """Return where each rectified pixel lies in the original photo, float32 (H, W, 2), and whether the photo has it.

    `turn` (3, 3) is rectified_from_left, or rectified_from_right with the right photo's camera.
    """
    straight = np.array([[camera.f_px, 0.0, camera.cx_px], [0.0, camera.f_px, camera.cy_px], [0.0, 0.0, 1.0]])
    prepare = cv2.fisheye.initUndistortRectifyMap if photo.lens == "fisheye" else cv2.initUndistortRectifyMap
    maps = prepare(
        np.array(photo.K), np.array(photo.distortion), turn, straight, (camera.width_px, camera.height_px), cv2.CV_32FC1
    )
    at = np.stack(maps, axis=-1)
    inside = (at[..., 0] > -0.5) & (at[..., 0] < photo.width_px - 0.5)
    inside &= (at[..., 1] > -0.5) & (at[..., 1] < photo.height_px - 0.5)
    inside &= _within_reach(camera, photo, turn)
    return freeze(at), freeze(inside)


def _within_reach(camera: RectifiedCamera, photo: Intrinsics, turn: FloatArray) -> BoolArray:
    """Say which rectified pixels (H, W) the lens shows once: beyond its reach a polynomial folds back into the photo.

    The cone of the reach, met by each pixel's ray: no array larger than one number a pixel is made.
    """
    y, x = np.ogrid[0 : camera.height_px, 0 : camera.width_px]
    x, y = (x - camera.cx_px) / camera.f_px, (y - camera.cy_px) / camera.f_px
    ahead = turn[0, 2] * x + turn[1, 2] * y + turn[2, 2]  # z in the photo's camera of the ray (x, y, 1)
    limit = np.cos(np.arctan(reach(photo.distortion)))
    within: BoolArray = ahead > limit * np.sqrt(x * x + y * y + 1.0)
    return within


def _carry(image: ByteImage, at: Float32Array, valid: BoolArray) -> ByteImage:
    carried = cv2.remap(image, np.array(at), np.empty(0, np.float32), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.copyTo(carried, valid.astype(np.uint8)), dtype=np.uint8)
