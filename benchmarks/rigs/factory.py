"""How far the factory's numbers of bought stereo cameras are off: what `camera/rig_formats/factory.py` trusts them to.

python benchmarks/rigs/factory.py --check --json figures.json      half a minute

A ZED (SN21531) took a board on a chair at stated distances, at two resolutions; an OAK-D looks down on a terrace. From
a distance follows the yaw that would put it right, from matches follow pitch and roll. The ZED's owner calibrated
it with boards, too: his MATLAB file's numbers stand here. The photographs are not part of the project
(ASBUILT_BIM_DATA).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.overlap import match_pair
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.camera.rectify import RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.camera.rig_formats.factory import FACTORY
from asbuilt_bim.camera.rig_formats.opencv import Foreign
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.camera.triangulate import triangulate
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.geometry.transform import apply, rigid
from asbuilt_bim.vision.stereo.rig_health import station_health
from benchmarks.real.shots import video_photos
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told

ZED, OAK = DATA / "stereo/zed_corridor", DATA / "stereo/oak_terrace"
BOARDS = {
    ("720", "05"): ((606, 662), (417, 458)), ("720", "10"): ((609, 640), (381, 403)),
    ("1080", "05"): ((885, 1007), (655, 735)), ("1080", "10"): ((896, 962), (584, 626)),
}  # fmt: skip
"""Where the board is in the left photo as it was taken, columns and rows."""
SIZES = {"720": (1280, 720), "1080": (1920, 1080)}
OWNERS = {
    "left": (697.647, 700.123, 635.800, 379.902), "right": (697.456, 700.566, 641.322, 345.473),
    "turn_deg": (-0.64414, 0.49472, -0.11015), "shift_mm": (-120.7467, 0.2844, -0.6945),
}  # fmt: skip
"""Custom_Calibration_ZED_SN21531_HD_720.mat: fx fy cx cy less MATLAB's first pixel, the right eye's turn and shift."""
MOST_SIGMAS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What one source says: the turn that puts the factory's numbers right, and the length's error it explains."""

    what: str
    yaw_rad: float
    length: float
    rows_px: float


def pair_of(rig: StereoRig, left: Path, right: Path) -> RectifiedPair:
    """Read and rectify a pair."""
    return rectify(rectification(rig), decode(read_photo(left)), decode(read_photo(right)), left.stem)


def board_lines() -> tuple[list[Found], list[Line]]:
    """Hold the boards' distances against the stated ones."""
    found: list[Found] = []
    rows: list[Line] = []
    for (size, distance), (columns, across) in BOARDS.items():
        rig = read_rig(ZED / "SN21531_from_m.conf", None, Foreign(photo_px=SIZES[size]))
        name = f"indoor_{size}/INDOOR-ZED-{size}-{{}}1-UNREC-{distance}.png"
        pair = pair_of(rig, ZED / name.format("L"), ZED / name.format("R"))
        disparity, row = _patch(pair, rig, np.array([columns, across], dtype=float))
        camera, stated = pair.camera, float(distance)
        z = camera.f_px * camera.baseline_m / disparity
        one = Found(
            what=f"ZED {size}, board at {stated:.0f} m", length=z / stated - 1.0, rows_px=row,
            yaw_rad=(disparity - camera.f_px * camera.baseline_m / stated) / camera.f_px,
        )  # fmt: skip
        found.append(one)
        rows.append(_told(one, f"{z:.2f} m, "))
    return found, rows


def _patch(pair: RectifiedPair, rig: StereoRig, box: FloatArray) -> tuple[float, float]:
    """Return the disparity and the row offset of a box (2, 2) of the left photo, to a few hundredths of a pixel."""
    camera = pair.camera
    corners = rig.left.rays(np.array([[x, y] for x in box[0] for y in box[1]])) @ camera.rectified_from_left.T
    at = corners[:, :2] / corners[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    (x0, y0), (x1, y1) = np.round(at.min(axis=0)).astype(int), np.round(at.max(axis=0)).astype(int)
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (pair.left, pair.right))
    scores = cv2.matchTemplate(right[y0 - 6 : y1 + 6, x0 - 80 : x1 + 10], left[y0:y1, x0:x1], cv2.TM_CCOEFF_NORMED)
    _, _, _, (dx, dy) = cv2.minMaxLoc(scores)
    warp = np.array([[1.0, 0.0, dx - 80.0], [0.0, 1.0, dy - 6.0]], dtype=np.float32)
    window = right[y0 - 40 : y1 + 40, x0 - 120 : x1 + 40].astype(np.float32)
    warp[:, 2] += [120.0, 40.0]
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-7)
    _, warp = cv2.findTransformECC(
        left[y0:y1, x0:x1].astype(np.float32), window, warp, cv2.MOTION_TRANSLATION, criteria, None, 3
    )
    return float(120.0 - warp[0, 2]), float(warp[1, 2] - 40.0)


def owners_lines() -> tuple[list[Found], list[Line]]:
    """Hold the factory's numbers against the owner's calibration with boards: what one sees, the other measures."""
    factory = read_rig(ZED / "SN21531_from_m.conf", None, Foreign(photo_px=SIZES["720"]))
    cameras = [_straight(OWNERS["left"]), _straight(OWNERS["right"])]
    pose = rigid(np.deg2rad(OWNERS["turn_deg"]), np.array(OWNERS["shift_mm"]) / 1000.0)
    owners = rig_of_unknown_sigma(*cameras, pose)
    bare = [_straight((c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2])) for c in (factory.left, factory.right)]
    found: list[Found] = []
    rows: list[Line] = []
    for stated in (5.0, 10.0):
        point = np.array([[0.0, 0.0, stated]])
        seen = owners.left.project(point), owners.right.project(apply(owners.right_from_left, point))
        z = float(triangulate(bare[0], bare[1], factory.right_from_left, *seen)[0, 2])
        b = factory.baseline_m
        one = Found(what=f"ZED, owner's boards, {stated:.0f} m", length=z / stated - 1.0, rows_px=float("nan"),
                    yaw_rad=b / z - b / stated)  # fmt: skip
        found.append(one)
        rows.append(_told(one, ""))
    scale = factory.baseline_m / owners.baseline_m - 1.0
    focal = np.mean([a.K[k, k] / b.K[k, k] - 1.0 for a, b in zip(bare, cameras, strict=True) for k in (0, 1)])
    rows.append(told("  its baseline and focal lengths against the owner's", f"{scale:+.2%}, {focal:+.2%}", 1))
    return found, rows


def _straight(pinhole: tuple[float, ...]) -> Intrinsics:
    """Return a camera without its lens: in the frame's middle both calibrations bend by hundredths of a pixel."""
    fx, fy, cx, cy = pinhole
    K = frozen([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Intrinsics(K=K, distortion=frozen(np.zeros(5)), width_px=1280, height_px=720)


def match_lines() -> list[Line]:
    """Tell what matches say of pitch and roll, and of the rows."""
    zed = read_rig(ZED / "SN21531_from_m.conf", None, Foreign(photo_px=SIZES["720"]))
    name = "indoor_720/INDOOR-ZED-720-{}1-UNREC-05.png"
    pairs = [("ZED 720", zed, pair_of(zed, ZED / name.format("L"), ZED / name.format("R")))]
    oak = read_rig(OAK / "calib.json")
    for photos in video_photos(OAK / "left.mp4", OAK / "right.mp4", range(60, 61)):
        pair = rectify(rectification(oak), decode(photos.left), decode(photos.right), "terrace")
        pairs.append(("OAK-D", oak, pair))
    lines = []
    for what, rig, pair in pairs:
        health = station_health(pair, match_pair(pair), rig)
        if health is not None:
            pitch, yaw, roll = np.rad2deg(health.fit.correction_rad[:3])
            rows = abs(pair.camera.f_px * np.deg2rad(pitch))
            figure = f"{pitch:+.3f}, {roll:+.3f} deg ({rows:.2f} px); yaw {yaw:+.3f}, by lenses too"
            lines.append(told(f"{what}, {health.fit.matches} matches: pitch, roll", figure, 1))
    return lines


def _told(one: Found, more: str) -> Line:
    rows = "" if np.isnan(one.rows_px) else f", rows {one.rows_px:+.2f} px"
    return told(one.what, f"{more}{one.length:+.1%}, as a yaw {np.rad2deg(one.yaw_rad):+.3f} deg{rows}", 1)


def main() -> int:
    """Measure what is there and print the table."""
    args = options(__doc__ or "").parse_args()
    if absent(ZED):
        return 0
    boards, rows = board_lines()
    owners, more = owners_lines()
    yaws = np.array([one.yaw_rad for one in (*boards, *owners)])
    inside = float(np.mean(np.abs(yaws) <= MOST_SIGMAS * FACTORY.turn_rad[1]))
    rms = f"{np.rad2deg(np.sqrt(np.mean(yaws**2))):.3f} deg rms, {inside:.0%} within 2 sigma"
    lines = [
        line("distances by the factory's numbers, as a yaw", rms, "all", len(yaws), inside == 1.0, least_n=len(BOARDS)),
        told("  trusted to", f"{np.rad2deg(FACTORY.turn_rad[1]):.3f} deg, {FACTORY.scale_share:.1%} of lengths", 1),
        *rows, *more, *match_lines(),
    ]  # fmt: skip
    return report("Bought stereo cameras against their own numbers", lines, args)


if __name__ == "__main__":
    sys.exit(main())
