"""Real stereo pairs with a rig and with points whose place is known by other means than the program's own stereo.

Points come from a laser, from structured light, or from corners matched between photos whose poses were published or
follow from surveyed targets. All are in the left camera's frame, in metres.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from asbuilt_bim.geometry.arrays import ByteImage, FloatArray
from benchmarks.real.whole_matches import aligned_plane, matched_points, pose_between
from benchmarks.sites import DATA

HERZ_SCALE = 0.5
"""The two photos stand 3.2 m apart, and the program refuses a base of over 3 m: all lengths are halved."""
ETH3D_WIDE = np.array([[542.019, 0.0, 541.836], [0.0, 542.019, 255.198], [0.0, 0.0, 1.0]])
"""ETH3D's wide pair as another of its scenes states it; of the pairs without calib.txt nobody states more."""
ETH3D_BASE_M = 0.0595549
ZED_F_PX = 700.0
"""Nobody states what the vendor's rectified pair has; 700 is the vendor's round figure for 1280 x 720."""

Walls = tuple[tuple[tuple[int, int, int, int], tuple[float, float]], ...]
WALLS: dict[str, Walls] = {
    "electro": (((165, 5, 335, 455), (8.0, 8.0)), ((862, 60, 920, 440), (9.5, 9.5))),
    "delivery_area": (((505, 262, 712, 480), (18.0, 13.0)), ((424, 275, 480, 420), (14.0, 18.0))),
    "zed_corridor": (((790, 200, 1060, 560), (16.0, 40.5)), ((100, 50, 340, 300), (60.0, 30.0))),
}
"""Plain walls with too few corners: a box of the left photo that shows nothing else, and about what disparity its left
and right side have. The truth of their place is one plane that aligns all of the box's pixels."""

Paint = Literal["as it is", "grey", "red-brown"]
GAMMA = 2.2  # light is what a lens blurs and a paint takes away; a photo's grey is its root
RED_BROWN_BGR = (0.25, 0.40, 0.85)
"""What red sandstone and brick reflect of white light."""
SKY_LIGHT = 0.5  # of white; what is brighter keeps more and more of its own colour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A pair of photos, the rig that took it, and points of known place."""

    name: str
    left: ByteImage
    right: ByteImage
    left_k: FloatArray
    right_k: FloatArray
    distortion: FloatArray  # of both lenses, (4,)
    right_from_left: FloatArray  # (4, 4)
    points_m: FloatArray  # (N, 3)
    up: FloatArray | None = None  # in the left camera's frame, where it was published

    @property
    def in_colour(self) -> bool:
        """Say whether the photos have colour at all."""
        return bool(np.ptp(self.left.astype(np.int16), axis=2).mean() > 1.0)

    def pixels(self, points_m: FloatArray, right: bool = False) -> FloatArray:
        """Project points of the left camera's frame into one of the photos, lens and all."""
        pose = self.right_from_left if right else np.eye(4)
        turn = cv2.Rodrigues(pose[:3, :3])[0]
        k = self.right_k if right else self.left_k
        at, _ = cv2.projectPoints(np.ascontiguousarray(points_m), turn, pose[:3, 3], k, self.distortion)
        return np.asarray(at, dtype=np.float64).reshape(-1, 2)

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Return the rays (x, y, 1) of pixels of the left photo."""
        flat = cv2.undistortPoints(np.asarray(pixels, dtype=np.float64).reshape(-1, 1, 2), self.left_k, self.distortion)
        return np.column_stack([np.asarray(flat).reshape(-1, 2), np.ones(len(flat))])


def repainted(scene: Scene, paint: Paint) -> Scene:
    """Return the scene as a grey camera would show it, or as if all in it but the sky were of red-brown stone."""
    if paint == "as it is":
        return scene
    return replace(scene, left=_repainted(scene.left, paint), right=_repainted(scene.right, paint))


def _repainted(photo: ByteImage, paint: Paint) -> ByteImage:
    grey = np.asarray(cv2.cvtColor(cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    if paint == "grey":
        return grey
    light = (photo / 255.0) ** GAMMA
    sky = np.clip((light.mean(axis=2, keepdims=True) - SKY_LIGHT) / (1.0 - SKY_LIGHT), 0.0, 1.0)
    painted = light * (sky + (1.0 - sky) * RED_BROWN_BGR)
    return np.asarray(np.round(255.0 * painted ** (1.0 / GAMMA)), dtype=np.uint8)


def read_scene(name: str) -> Scene | None:
    """Read one of the scenes; None where its data is absent."""
    folder, reader = SCENES[name]
    return reader(name, DATA / folder) if (DATA / folder).is_dir() else None


def _photo(path: Path) -> ByteImage:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR), dtype=np.uint8)


def _rectified(name: str, folder: Path) -> Scene:
    """Read a pair of ETH3D or Middlebury: calib.txt and a dense disparity map."""
    text = (folder / "calib.txt").read_text(encoding="utf-8")
    given = dict(one.split("=", 1) for one in text.splitlines())
    cameras = [np.array(re.findall(r"[\d.]+", given[key]), dtype=np.float64).reshape(3, 3) for key in ("cam0", "cam1")]
    base_m = float(given["baseline"]) / 1000.0
    disparity = _pfm(next(iter(folder.glob("disp0*.pfm"))))
    rows, columns = np.nonzero(np.isfinite(disparity) & (disparity > 0.0))
    z = cameras[0][0, 0] * base_m / (disparity[rows, columns] + float(given["doffs"]))
    rays = np.column_stack([columns, rows, np.ones(len(rows))]) @ np.linalg.inv(cameras[0]).T
    pose = np.eye(4)
    pose[0, 3] = -base_m
    return Scene(
        name=name, left=_photo(folder / "im0.png"), right=_photo(folder / "im1.png"), left_k=cameras[0],
        right_k=cameras[1], distortion=np.zeros(4), right_from_left=pose, points_m=rays * z[:, None],
    )  # fmt: skip


def _pfm(path: Path) -> FloatArray:
    """Read a PFM as it is written: OpenCV divides by its scale, which here only tells the order of the bytes."""
    _, size, _, data = path.read_bytes().split(b"\n", 3)
    width, height = (int(one) for one in size.split())
    return np.frombuffer(data, dtype="<f4").reshape(height, width)[::-1].astype(np.float64)


def _surveyed_wall(name: str, folder: Path) -> Scene:
    """Place two photos of the stone wall by their matched corners, and scale them by two surveyed targets."""
    k, distortion = np.array([[2168.0, 0, 750], [0, 2168.0, 500], [0, 0, 1]]), np.array([-0.0185, 0.0, 0.0, 0.0])
    names = ("DSC_5003_acr.jpg", "DSC_5006_acr.jpg")
    photos = [_photo(folder / one) for one in names]
    pixels = matched_points(photos[0], photos[1])
    rays = [_flat(at, k, distortion) for at in pixels]
    pose, kept = pose_between(rays[0], rays[1], 0.5 / k[0, 0])
    targets = [np.loadtxt(folder / f"{one}.txt", usecols=(1, 2)) / 4.032 for one in names]
    ends = triangulated(pose, *(_flat(at, k, distortion) for at in targets))
    surveyed = np.loadtxt(folder / "Ground_Truth.txt", delimiter=",")
    true_m = float(np.linalg.norm(np.diff(surveyed[np.isin(surveyed[:, 0], (37, 38)), 1:], axis=0)))
    pose[:3, 3] *= true_m / float(np.linalg.norm(ends[0] - ends[1]))
    return Scene(
        name=name, left=photos[0], right=photos[1], left_k=k, right_k=k, distortion=distortion, right_from_left=pose,
        points_m=triangulated(pose, rays[0][kept], rays[1][kept]),
    )  # fmt: skip


def _herz_jesus(name: str, folder: Path) -> Scene:
    """Read two photos of the facade with their published cameras; the left one is that from further left."""
    k, first = _strecha(folder / "0006.jpg.camera")
    _, second = _strecha(folder / "0007.jpg.camera")
    pose = second @ np.linalg.inv(first)
    photos = [_photo(folder / one) for one in ("0006.jpg", "0007.jpg")]
    swapped = bool(pose[0, 3] > 0.0)
    if swapped:
        pose, photos = np.linalg.inv(pose), photos[::-1]
    pose[:3, 3] *= HERZ_SCALE
    half = np.diag([0.5, 0.5, 1.0]) @ k  # photos at half size: a station of 6 megapixels says no more of the wall
    photos = [
        np.asarray(cv2.resize(one, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8) for one in photos
    ]
    half[:2, 2] -= 0.25
    left = second if swapped else first
    return _matched(name, photos, half, pose, up=-left[:3, 2])


def _strecha(path: Path) -> tuple[FloatArray, FloatArray]:
    """Return K and camera_from_world (4, 4): a file has K, three zeros, R of world_from_camera, the centre."""
    numbers = np.array(path.read_text(encoding="utf-8").split(), dtype=np.float64)
    world_from_camera = np.eye(4)
    u, _, v = np.linalg.svd(numbers[12:21].reshape(3, 3))  # six digits leave it no rotation to the program's liking
    world_from_camera[:3, :3], world_from_camera[:3, 3] = u @ v, numbers[21:24]
    return numbers[:9].reshape(3, 3), np.asarray(np.linalg.inv(world_from_camera), dtype=np.float64)


def _zed(name: str, folder: Path) -> Scene:
    """Read the pair that the vendor's program rectified, with the factory's base."""
    left = _photo(folder / "indoor_720/INDOOR-ZED-720-L1-05.png")
    right = _photo(folder / "indoor_720/INDOOR-ZED-720-R1-05.png")
    height, width = left.shape[:2]
    k = np.array([[ZED_F_PX, 0, width / 2 - 0.5], [0, ZED_F_PX, height / 2 - 0.5], [0, 0, 1]])
    pose = np.eye(4)
    pose[0, 3] = -0.119997
    return _with_walls(_matched(name, [left, right], k, pose), WALLS[name])


def _eth3d_bare(name: str, folder: Path) -> Scene:
    """Read a rectified pair that came without its numbers, with those of the same rig elsewhere."""
    pose = np.eye(4)
    pose[0, 3] = -ETH3D_BASE_M
    scene = _matched(name, [_photo(folder / "im0.png"), _photo(folder / "im1.png")], ETH3D_WIDE, pose)
    return _with_walls(scene, WALLS[name])


def _with_walls(scene: Scene, walls: Walls) -> Scene:
    """Add a grid of points on plain walls, which have too few corners: (box, disparities of its two sides to start)."""
    f, base_m, points = scene.left_k[0, 0], -scene.right_from_left[0, 3], [scene.points_m]
    for box, start_px in walls:
        plane = aligned_plane(scene.left, scene.right, box, start_px)
        x, y = (one.ravel() for one in np.meshgrid(np.arange(box[0], box[2], 5), np.arange(box[1], box[3], 5)))
        pixels = np.column_stack([x, y]).astype(np.float64)
        points.append(scene.rays(pixels) * (f * base_m / (pixels @ plane[:2] + plane[2]))[:, None])
    return replace(scene, points_m=np.concatenate(points))


def _matched(
    name: str, photos: list[ByteImage], k: FloatArray, pose: FloatArray, up: FloatArray | None = None
) -> Scene:
    """Make a scene whose points are corners matched between the photos, near each other's epipolar line."""
    rays = [_flat(at, k, np.zeros(4)) for at in matched_points(photos[0], photos[1])]
    skew = np.cross(np.eye(3), pose[:3, 3] / np.linalg.norm(pose[:3, 3]))
    lines = rays[0] @ (skew.T @ pose[:3, :3]).T
    off = np.abs(np.sum(lines * rays[1], axis=1)) / np.linalg.norm(lines[:, :2], axis=1)
    near = off < 1.5 / k[0, 0]
    points = triangulated(pose, rays[0][near], rays[1][near])
    return Scene(
        name=name, left=photos[0], right=photos[1], left_k=k, right_k=k, distortion=np.zeros(4), right_from_left=pose,
        points_m=points[points[:, 2] > 0.0], up=up,
    )  # fmt: skip


def triangulated(pose: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the points of two photos' rays, in the left camera's frame."""
    found = cv2.triangulatePoints(np.eye(3, 4), pose[:3], left[:, :2].T.copy(), right[:, :2].T.copy())
    return np.asarray((found[:3] / found[3]).T, dtype=np.float64)


def _flat(pixels: FloatArray, k: FloatArray, distortion: FloatArray) -> FloatArray:
    at = cv2.undistortPoints(pixels.reshape(-1, 1, 2), k, distortion)
    return np.column_stack([np.asarray(at).reshape(-1, 2), np.ones(len(pixels))])


SCENES: dict[str, tuple[str, Callable[[str, Path], Scene]]] = {
    "playground": ("stereo/eth3d_playground", _rectified),
    "surveyed_wall": ("photos/surveyed_wall", _surveyed_wall),
    "electro": ("stereo/eth3d_pairs/electro_1l", _eth3d_bare),
    "delivery_area": ("stereo/eth3d_pairs/delivery_area_1l", _eth3d_bare),
    "motorcycle": ("stereo/middlebury_motorcycle", _rectified),
    "herz_jesus": ("stereo/herz_jesus", _herz_jesus),
    "zed_corridor": ("stereo/zed_corridor", _zed),
}
