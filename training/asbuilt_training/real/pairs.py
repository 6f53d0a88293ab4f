"""The real stereo pairs: ETH3D's playground with laser truth, EuRoC's padded room by its published rig."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from asbuilt_bim.camera.photo.read import decode, read_photo
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from numpy.typing import NDArray

ETH3D, EUROC = Path("stereo/eth3d_playground"), Path("stereo/euroc")
NEAREST_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RealPair:
    """A rectified pair, our stereo of it, and the depth (h, w) in metres that a network's is held against."""

    name: str
    file: str  # the left photo, below the data folder
    truth_is: str
    pair: RectifiedPair
    stereo: DepthMap
    truth_m: NDArray[np.float64]  # NaN where unknown


def real_pairs(data: Path) -> list[RealPair]:
    """Return the pairs that the data folder has."""
    found = []
    if (data / ETH3D / "disp0.pfm").is_file():
        found.append(_playground(data))
    if (data / EUROC / "LeftCameraParams.yaml").is_file():
        found.append(_room(data))
    return found


def _playground(data: Path) -> RealPair:
    folder = data / ETH3D
    text = (folder / "calib.txt").read_text(encoding="utf-8")
    f, _, cx, _, _, cy = (float(word) for word in re.findall(r"[-\d.]+", text.split("[")[1])[:6])
    baseline_m = float(re.findall(r"baseline=([\d.]+)", text)[0]) / 1000.0
    left, right = (decode(read_photo(folder / name)) for name in ("im0.png", "im1.png"))
    height, width = left.shape[:2]
    every = np.ones((height, width), dtype=bool)
    camera = RectifiedCamera(
        f_px=f, cx_px=cx, cy_px=cy, baseline_m=baseline_m, width_px=width, height_px=height,
        rectified_from_left=frozen(np.eye(3)),
    )  # fmt: skip
    pair = RectifiedPair(name="playground", left=left, right=right, valid_left=every, valid_right=every, camera=camera)
    disparity = np.asarray(cv2.imread(str(folder / "disp0.pfm"), cv2.IMREAD_UNCHANGED), dtype=np.float64)
    known = np.isfinite(disparity) & (disparity > 0)
    truth = np.full(disparity.shape, np.nan)
    truth[known] = f * baseline_m / disparity[known]
    return _with_stereo("playground (ETH3D)", str(ETH3D / "im0.png"), "laser", pair, truth)


def _room(data: Path) -> RealPair:
    """Return the first pair of EuRoC's room: the rig stood still, the others show the same."""
    folder = data / EUROC
    left = min((folder / "pairs/cam0").glob("*.png"))
    rig = read_rig(folder / "LeftCameraParams.yaml", folder / "RightCameraParams.yaml")
    photos = [decode(read_photo(path)) for path in (left, folder / "pairs/cam1" / left.name)]
    pair = rectify(rectification(rig), photos[0], photos[1], "room")
    return _with_stereo("padded room (EuRoC)", str(left.relative_to(data)), "our stereo", pair, None)


def _with_stereo(
    name: str, file: str, truth_is: str, pair: RectifiedPair, truth_m: NDArray[np.float64] | None
) -> RealPair:
    stereo = depth_map(pair, SemiGlobalMatcher(nearest_m=NEAREST_M))
    if truth_m is None:
        truth_m = np.where(stereo.valid & pair.valid_left, stereo.depth_m, np.nan).astype(np.float64)
    return RealPair(name=name, file=file, truth_is=truth_is, pair=pair, stereo=stereo, truth_m=truth_m)
