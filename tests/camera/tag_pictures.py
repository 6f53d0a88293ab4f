"""Pairs of photos of single tags, as corners and as pictures, by a rig whose lenses bend straight lines."""

from __future__ import annotations

import cv2
import numpy as np

from asbuilt_bim.camera.calibration.tags import Tag, TagSighting
from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.read import Photo, photo_from_bytes
from asbuilt_bim.camera.rig import PARAMETERS, StereoRig
from asbuilt_bim.geometry.arrays import ByteImage, FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, inverse, rigid
from tests.camera.virtual import exif_block, with_exif

SIZE = (960, 720)
TAG = Tag(size_m=0.2)
FAMILY = "apriltag_36h11"
_FINER = 3  # pixels of the light in one of the photo, each way
_MODULE = 16  # of the print's picture
_MARGIN = 1.25  # the white border, in halves of the black square


def camera(f: float, cx: float, cy: float, k1: float) -> Intrinsics:
    K = frozen([[f, 0.0, cx], [0.0, f - 1.0, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen([k1, 0.03, 0.0, 0.0, 0.0]), width_px=SIZE[0], height_px=SIZE[1])


RIG = StereoRig(
    left=camera(800.0, 484.0, 355.0, -0.10),
    right=camera(796.0, 474.0, 364.0, -0.09),
    right_from_left=frozen(rigid([0.006, -0.008, 0.004], [-0.2496, 0.0021, -0.0013])),
    covariance=frozen(np.zeros((len(PARAMETERS), len(PARAMETERS)))),
)

Placed = list[list[tuple[int, FloatArray]]]
"""Of each pair: the tags and left_from_tag (4, 4)."""


def placed(
    pairs: int,
    each: int,
    seed: int,
    near_m: float = 1.0,
    far_m: float = 4.0,
    tilt_deg: float = 45.0,
    rig: StereoRig = RIG,
) -> Placed:
    """Tags all over both frames at all distances, each clear of the others in the photos."""
    rng = np.random.default_rng(seed)
    found: Placed = []
    for _ in range(pairs):
        tags: list[tuple[int, FloatArray]] = []
        taken: list[FloatArray] = []
        while len(tags) < each:
            ray = rig.left.rays(rng.uniform(0.03, 0.97, 2) * SIZE)
            tilt = np.deg2rad(rng.uniform([-0.6 * tilt_deg, -tilt_deg, -8.0], [0.6 * tilt_deg, tilt_deg, 8.0]))
            pose = rigid(tilt, ray * np.exp(rng.uniform(np.log(near_m), np.log(far_m))))
            around = apply(pose, TAG.points_m * _MARGIN)
            seen = [rig.left.project(around), rig.right.project(apply(rig.right_from_left, around))]
            inside = all(np.all((px > 4.0) & (px < np.array(SIZE) - 5.0)) for px in seen)
            boxes = [np.r_[px.min(axis=0), px.max(axis=0)] for px in seen]
            if inside and all(_apart(a, b) for other in taken for a, b in zip(boxes, other, strict=True)):
                taken.append(np.array(boxes))
                tags.append((len(tags), pose))
        found.append(tags)
    return found


def _apart(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.any(a[:2] > b[2:] + 6.0) or np.any(b[:2] > a[2:] + 6.0))


def sightings(
    tags: Placed, seed: int, noise_px: float = 0.05, scale: float = 1.0, rig: StereoRig = RIG
) -> list[TagSighting]:
    """What a detector would find, its corners off by noise and the prints by a scale."""
    rng = np.random.default_rng(seed)
    found = []
    for number, pair in enumerate(tags):
        for tag_id, pose in pair:
            at = apply(pose, TAG.points_m * scale)
            left, right = rig.left.project(at), rig.right.project(apply(rig.right_from_left, at))
            found.append(
                TagSighting(
                    pair=f"pair {number}", tag_id=tag_id,
                    left_px=frozen(left + rng.normal(0.0, noise_px, left.shape)),
                    right_px=frozen(right + rng.normal(0.0, noise_px, right.shape)),
                )
            )  # fmt: skip
    return found


def _printed(tag_id: int) -> FloatArray:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    black = cv2.aruco.generateImageMarker(dictionary, tag_id, 8 * _MODULE)
    return np.where(np.pad(black, _MODULE, constant_values=255) > 127, 0.8, 0.02)


def picture(pair: list[tuple[int, FloatArray]], side: int, seed: int) -> ByteImage:
    """A grey wall and the pair's tags, mixed in light and stored through a tone curve."""
    camera_here = RIG.left if side == 0 else RIG.right
    light = np.full((SIZE[1] * _FINER, SIZE[0] * _FINER), 0.25, dtype=np.float32)
    for tag_id, left_from_tag in pair:
        pose = left_from_tag if side == 0 else RIG.right_from_left @ left_from_tag
        border = np.concatenate(
            [np.linspace(a, b, 9) for a, b in zip(TAG.points_m, np.roll(TAG.points_m, -1, 0), strict=True)]
        )
        px = camera_here.project(apply(pose, border * _MARGIN))
        low, high = (
            np.floor((px.min(axis=0) - 1) * _FINER).astype(int),
            np.ceil((px.max(axis=0) + 2) * _FINER).astype(int),
        )
        box = slice(low[1], high[1]), slice(low[0], high[0])
        to_tag = inverse(pose)
        finer = (np.arange(*ends) for ends in zip(low, high, strict=True))
        rays = camera_here.rays(np.stack(np.meshgrid(*((n + 0.5) / _FINER - 0.5 for n in finer)), axis=-1))
        directions, eye = rays @ to_tag[:3, :3].T, to_tag[:3, 3]
        on_tag = eye[:2] - directions[..., :2] * (eye[2] / directions[..., 2])[..., None]
        at = ((on_tag / (TAG.size_m / 8.0) + 5.0) * _MODULE - 0.5).astype(np.float32)
        inside = np.all((at > 0.0) & (at < 10 * _MODULE - 1.0), axis=-1)
        print_light = cv2.remap(_printed(tag_id).astype(np.float32), at[..., 0], at[..., 1], cv2.INTER_LINEAR)
        light[box] = np.where(inside, print_light, light[box])
    grey = 255.0 * cv2.resize(light, SIZE, interpolation=cv2.INTER_AREA) ** (1.0 / 2.2)
    noisy = grey + np.random.default_rng(seed).normal(0.0, 1.5, grey.shape)
    return np.repeat(np.clip(np.rint(noisy), 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


def photos(tags: Placed, seed: int) -> list[tuple[Photo, Photo]]:
    """The pairs as JPEG photos with the serials of two cameras."""
    made = []
    for number, pair in enumerate(tags):
        both = []
        for side, name in enumerate(("left", "right")):
            image = picture(pair, side, 1000 * seed + 2 * number + side)
            jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
            both.append(photo_from_bytes(f"S{number:02d}_{name}.jpg", with_exif(jpeg, exif_block(serial=name))))
        made.append((both[0], both[1]))
    return made
