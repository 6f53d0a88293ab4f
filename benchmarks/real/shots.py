"""Photo pairs of other people's rigs as the program takes them: photos, rig, and the truth's disparity where known.

A pair that its publisher rectified is a rig without turn and without distortion. The truth's disparity is that of two
cameras with one principal point, so that a plane is linear in it: d = q . r, as everywhere in the program.
"""

from __future__ import annotations

import json
import re
from configparser import ConfigParser
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.picture_file import look_at
from asbuilt_bim.camera.photo.read import Photo, decode, photo_from_bytes, read_photo
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.errors import PhotoError
from asbuilt_bim.geometry.arrays import Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.measure.station import StationPhotos
from asbuilt_bim.vision.stereo.rig_health import RigVerdict
from asbuilt_bim.vision.stereo.rig_health import refined_rig as refined
from benchmarks.real.rig_verdict import verdict_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """One pair of a rig; `truth_px` (H, W) is the left photo's true disparity, NaN where unknown.

    None where the scene has no truth.
    """

    photos: StationPhotos
    rig: StereoRig
    truth_px: Float32Array | None = None

    @property
    def focal_baseline(self) -> float:
        """Return f b in px m of a rectified pair."""
        return float(self.rig.left.K[0, 0]) * self.rig.baseline_m

    def rays(self) -> FloatArray:
        """Return the ray (H, W, 3) of each pixel of the left photo, z = 1, in the left frame."""
        camera = self.rig.left
        rows, columns = np.indices((camera.height_px, camera.width_px))
        return camera.rays(np.stack([columns, rows], axis=-1).astype(np.float64))


def rectified_rig(
    f_px: float, centre_px: tuple[float, float], baseline_m: float, size_px: tuple[int, int], apart_px: float = 0.0
) -> StereoRig:
    """Return the rig of an already rectified pair; `apart_px`: the right principal point's x less the left one's."""
    left = np.array([[f_px, 0.0, centre_px[0]], [0.0, f_px, centre_px[1]], [0.0, 0.0, 1.0]])
    right = left.copy()
    right[0, 2] += apart_px
    cameras = [
        Intrinsics(K=frozen(K), distortion=frozen(np.zeros(5)), width_px=size_px[0], height_px=size_px[1])
        for K in (left, right)
    ]
    return rig_of_unknown_sigma(*cameras, rigid(np.eye(3), np.array([-baseline_m, 0.0, 0.0])))


def middlebury_shot(folder: Path, truth: str) -> Shot:
    """Read a folder in Middlebury's layout, as ETH3D has it too: calib.txt, im0.png, im1.png and the truth's file."""
    text = (folder / "calib.txt").read_text(encoding="utf-8")
    f, _, cx, _, _, cy = (float(word) for word in re.findall(r"[-\d.]+", text.split("[")[1])[:6])
    known = {key: float(value) for key, value in re.findall(r"^(\w+)=([-\d.]+)\s*$", text, flags=re.MULTILINE)}
    disparity = read_pfm(folder / truth)
    height, width = disparity.shape
    rig = rectified_rig(f, (cx, cy), known["baseline"] / 1000.0, (width, height), known["doffs"])
    seen = np.isfinite(disparity) & (disparity > 0.0)
    truth_px = np.where(seen, disparity + np.float32(known["doffs"]), np.nan).astype(np.float32)
    return Shot(photos=photos_of(folder.name, folder / "im0.png", folder / "im1.png"), rig=rig, truth_px=truth_px)


def read_pfm(path: Path) -> Float32Array:
    """Read a grey PFM as it is written; OpenCV divides by the scale in its header, which 2014's files fill in."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    if kind != b"Pf":
        raise ValueError(f"{path}: this is no grey PFM; its first line is {kind[:10]!r}")
    width, height = map(int, size.split())
    order = "<f4" if float(scale) < 0.0 else ">f4"
    return np.frombuffer(data, dtype=order).reshape(height, width)[::-1].astype(np.float32)


def photos_of(name: str, left: Path, right: Path) -> StationPhotos:
    """Read both photos of a pair."""
    return StationPhotos(name=name, left=read_photo(left), right=read_photo(right))


def size_of(photo: Photo) -> tuple[int, int]:
    """Return a photo's width and height as its file says them."""
    outside = look_at(photo.data)
    return outside.width_px, outside.height_px


def zed_rig(path: Path) -> StereoRig:
    """Read the HD part of a Stereolabs file: the right camera turned by (RX, CV, RZ), the baseline in mm."""
    conf = ConfigParser()
    conf.read(path)
    stereo = conf["STEREO"]
    turn = rotation_from_vector(np.array([float(stereo[key]) for key in ("RX_HD", "CV_HD", "RZ_HD")]))
    apart = -np.array([float(stereo[key]) for key in ("Baseline", "TY", "TZ")]) / 1000.0
    cameras = []
    for side in ("LEFT_CAM_HD", "RIGHT_CAM_HD"):
        one = {key: float(value) for key, value in conf[side].items()}
        K = np.array([[one["fx"], 0.0, one["cx"]], [0.0, one["fy"], one["cy"]], [0.0, 0.0, 1.0]])
        lens = np.array([one["k1"], one["k2"], one["p1"], one["p2"], 0.0])
        cameras.append(Intrinsics(K=frozen(K), distortion=frozen(lens), width_px=1280, height_px=720))
    return rig_of_unknown_sigma(*cameras, rigid(turn, apart))


def oak_rig(path: Path) -> StereoRig:
    """Read an OAK-D's own memory: sockets 1 and 2 are the left and the right camera, lengths in cm."""
    sockets = {int(number): camera for number, camera in json.loads(path.read_text(encoding="utf-8"))["cameraData"]}
    cameras = [
        Intrinsics(
            K=frozen(np.array(sockets[number]["intrinsicMatrix"])),
            distortion=frozen(np.array(sockets[number]["distortionCoeff"][:8])),
            width_px=int(sockets[number]["width"]),
            height_px=int(sockets[number]["height"]),
        )
        for number in (1, 2)
    ]
    to_right = sockets[1]["extrinsics"]
    apart = np.array([to_right["translation"][axis] for axis in "xyz"]) / 100.0
    return rig_of_unknown_sigma(*cameras, rigid(np.array(to_right["rotationMatrix"]), apart))


def video_photos(left: Path, right: Path, frames: range) -> list[StationPhotos]:
    """Read frames of two synchronous videos as losslessly stored photos; none where they can't be decoded."""
    both = [_frames(path, frames) for path in (left, right)]
    return [StationPhotos(name=f"frame {k}", left=both[0][k], right=both[1][k]) for k in both[0] if k in both[1]]


def _frames(path: Path, frames: range) -> dict[int, Photo]:
    video, found = cv2.VideoCapture(str(path)), dict[int, Photo]()
    for number in range(frames.stop):
        if not video.grab():
            break
        if number not in frames:
            continue
        read, image = video.retrieve()
        if read:
            _, data = cv2.imencode(".png", image)
            found[number] = photo_from_bytes(f"{path.stem} {number}", bytes(data))
    video.release()
    return found


def by_refined_rig(photos: list[StationPhotos], rig: StereoRig) -> list[Shot]:
    """Give all pairs of a visit the one rig that `--refine-rig` would measure them with: its own, or refined."""
    prepared = rectification(rig)
    pairs = [rectify(prepared, decode(one.left), decode(one.right), one.name) for one in photos]
    verdict: RigVerdict | None = verdict_of(pairs, rig)
    if verdict is not None and verdict.state in ("doubtful", "knocked"):
        rig = refined(rig, verdict, prepared.camera)
    return [Shot(photos=one, rig=rig) for one in photos]


def readable(shots: list[Shot]) -> list[Shot]:
    """Return the shots whose photos the program takes at all."""

    def taken(photo: Photo) -> bool:
        try:
            decode(photo)
        except PhotoError:
            return False
        return True

    return [shot for shot in shots if taken(shot.photos.left) and taken(shot.photos.right)]
