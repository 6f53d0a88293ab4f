"""Disparity against a laser: how far planar regions are off, and how many pixels are, beside plain SGBM.

What is off is the pair's cameras, not the matching. One turn of the right camera, fitted to the laser's points that are
on no planar region, brings the regions to 0.03 px of the laser. That holds near and far, upright and lying. But that
turn would put the rows apart by two to three times what they are and the other way round. The photos are sheared
against each other (by about 1 mrad), as a lens may leave it and no turn can. So `--refine-rig` doesn't mend it: the
program calls the rig undetermined, warns, and measures with it as it is, and the figures judged are those.
"""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.disparity_plane import fit_q
from asbuilt_bim.measure.planes.refine import Pictures, pictures, refine_plane
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, grey
from benchmarks.real.laser_turn import turn_lines, two
from benchmarks.table import Line, line, told

TILE_PX, STEP_PX = 48, 24
FLAT_PX = 0.1
"""A tile is planar when the laser's disparities leave a plane by less: half of what is asked of stereo there."""
LEAST_TRUTH = 0.4  # of a tile's pixels: the laser gives half of all
BIAS_PX, BAD_PX = 0.1, 1.0


def laser_lines(folder: Path) -> list[Line]:
    """Compare the matcher, and planes refined on the pixels, with the laser of an ETH3D two-view folder."""
    pair, truth = _read(folder)
    ours, _ = SemiGlobalMatcher(nearest_m=1.0).match(pair)
    plain = plain_sgbm(pair)
    regions = _planar_regions(pair, truth, ours, plain)
    off, refined, plain_off = (np.array([one for one in column if np.isfinite(one)]) for column in regions.T[:3])
    n, pixels = len(off), int(np.isfinite(truth).sum())
    bias, spread = float(np.median(off)), float(np.median(np.abs(off)))
    upright, lying = (regions[regions[:, 3] == one, 0] for one in (1.0, 0.0))
    return [
        line("laser: planar regions, bias of stereo", f"{bias:+.3f} px", f"<= {BIAS_PX} px", n, abs(bias) <= BIAS_PX),
        line("  the same, median of a region's own", f"{spread:.3f} px", f"<= {BIAS_PX} px", n, spread <= BIAS_PX),
        told("  upright regions only: both", two(upright), len(upright)),
        told("  lying or leaning regions only: both", two(lying), len(lying)),
        told("  plane refined on the pixels, as areas are: both", two(refined), len(refined)),
        told("  the same, upright regions only: both", two(regions[regions[:, 3] == 1.0, 1]), len(upright)),
        told("  stereo less refined plane: both", two(regions[:, 0] - regions[:, 1]), len(refined)),
        told("  rows of the photos apart, left and right quarter of the frame", _rows_apart(pair, ours), 1),
        *turn_lines(pair, truth, ours, regions[:, 0], regions[:, 4:], _in_regions(regions, truth.shape)),
        told("  plain SGBM: both", two(plain_off), len(plain_off)),
        told("pixels off by over 1 px, of those we give", _bad(ours, truth), pixels),
        told("  plain SGBM, of those it gives", _bad(plain, truth), pixels),
        told("  ours, of those that both give", _bad(np.where(np.isfinite(plain), ours, np.nan), truth), pixels),
        told("  plain SGBM, of those that both give", _bad(np.where(np.isfinite(ours), plain, np.nan), truth), pixels),
    ]


def _rows_apart(pair: RectifiedPair, ours: Float32Array) -> str:
    """Follow corners from where the disparity puts them in the right photo; say how far rows differ, by the median."""
    left, right = (np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) for image in (pair.left, pair.right))
    at = np.asarray(cv2.goodFeaturesToTrack(left, 6000, 0.002, 4.0), dtype=np.float32).reshape(-1, 2)
    disparity = ours[at[:, 1].astype(np.intp), at[:, 0].astype(np.intp)]
    at, disparity = at[np.isfinite(disparity)], disparity[np.isfinite(disparity)]
    start = (at - np.stack([disparity, np.zeros_like(disparity)], axis=1)).reshape(-1, 1, 2)
    found, good, _ = cv2.calcOpticalFlowPyrLK(
        left,
        right,
        at.reshape(-1, 1, 2),
        start.copy(),
        winSize=(21, 21),
        maxLevel=0,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    rows = at[:, 1] - found.reshape(-1, 2)[:, 1]
    kept = (good.ravel() > 0) & (np.abs(rows) < 1.5)
    width = left.shape[1]
    ends = (kept & (at[:, 0] < 0.25 * width), kept & (at[:, 0] > 0.75 * width))
    return ", ".join(f"{np.median(rows[end]):+.2f} px" for end in ends)


def _bad(disparity: Float32Array, truth: Float32Array) -> str:
    given = np.isfinite(disparity) & np.isfinite(truth)
    wrong = np.abs(disparity[given] - truth[given]) > BAD_PX
    return f"{wrong.mean():.2%} of {given.sum() / np.isfinite(truth).sum():.0%}"


def _planar_regions(pair: RectifiedPair, truth: Float32Array, ours: Float32Array, plain: Float32Array) -> FloatArray:
    """Return (N, 7): each planar tile's error in px by our disparities, by the refined plane, by plain SGBM; upright?

    Then its middle, x and y, and the laser's disparity there. An error is NaN where there is too little to judge. A
    tile is upright when its normal is within 20 degrees of level.
    """
    rows, columns = np.indices(truth.shape)
    camera = pair.camera
    rays = np.stack([(columns - camera.cx_px) / camera.f_px, (rows - camera.cy_px) / camera.f_px], axis=-1)
    rays = np.concatenate([rays, np.ones((*rows.shape, 1))], axis=-1)
    levels = pictures(grey(pair.left), grey(pair.right), pair.valid_right)
    regions = []
    for top in range(0, truth.shape[0] - TILE_PX, STEP_PX):
        for left in range(0, truth.shape[1] - TILE_PX, STEP_PX):
            tile = np.s_[top : top + TILE_PX, left : left + TILE_PX]
            flat = _flat(truth[tile], rays[tile])
            if flat is None:
                continue
            q, on_plane = flat
            upright = abs(q[1]) < np.sin(np.deg2rad(20.0)) * np.linalg.norm(q)
            middle = rays[tile][TILE_PX // 2, TILE_PX // 2]
            errors = [_median_error(found[tile], truth[tile], on_plane) for found in (ours, plain)]
            regions.append([errors[0], _refined(levels, rays, tile, q), errors[1], float(upright),
                            left + TILE_PX // 2, top + TILE_PX // 2, float(middle @ q)])  # fmt: skip
    return np.array(regions).reshape(-1, 7)


def _in_regions(regions: FloatArray, shape: tuple[int, ...]) -> BoolArray:
    """Return which pixels (H, W) lie in a planar tile."""
    inside = np.zeros(shape, dtype=bool)
    for x, y in regions[:, 4:6].astype(np.intp) - TILE_PX // 2:
        inside[y : y + TILE_PX, x : x + TILE_PX] = True
    return inside


def _median_error(found: Float32Array, truth: Float32Array, on_plane: BoolArray) -> float:
    both = on_plane & np.isfinite(found)
    return float(np.median((found - truth)[both])) if both.sum() > 0.2 * TILE_PX**2 else float("nan")


def _flat(truth: Float32Array, rays: FloatArray) -> tuple[FloatArray, BoolArray] | None:
    """Return the plane of a tile's laser points and which of them lie on it; None where the tile isn't planar."""
    seen = np.isfinite(truth)
    if seen.mean() < LEAST_TRUTH:
        return None
    q, _ = fit_q(rays[seen], truth[seen].astype(np.float64), np.full(int(seen.sum()), FLAT_PX))
    miss = np.abs(truth - rays @ q)
    on_plane = seen & (miss < 2.0 * FLAT_PX)
    if on_plane.sum() < 0.97 * seen.sum() or np.median(miss[seen]) > 0.5 * FLAT_PX:
        return None
    return q, on_plane


def _refined(levels: Pictures, rays: FloatArray, tile: tuple[slice, slice], q: FloatArray) -> float:
    """Start a third of a pixel off the laser's plane and refine on the pixels; the error at the tile's middle."""
    mask = np.zeros(rays.shape[:2], dtype=bool)
    mask[tile] = True
    fit = refine_plane(levels, rays, mask, q + np.array([0.0, 0.0, 0.3]))
    middle = rays[tile][TILE_PX // 2, TILE_PX // 2]
    return float(middle @ (fit.q_px - q)) if fit is not None else float("nan")


def plain_sgbm(pair: RectifiedPair, disparities: int = 128, filter_cap: int = 0) -> Float32Array:
    """Match as OpenCV's own example does: 5 x 5 costs, no refinement."""
    engine = cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=disparities, blockSize=5, P1=200, P2=800, disp12MaxDiff=1,
        preFilterCap=filter_cap, uniquenessRatio=10, speckleWindowSize=100, speckleRange=2,
    )  # fmt: skip
    grey_images = [np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) for image in (pair.left, pair.right)]
    fixed = np.asarray(engine.compute(grey_images[0], grey_images[1]))
    return np.where(fixed > 0, fixed / 16.0, np.nan).astype(np.float32)


def plain_disparity(pair: RectifiedPair) -> Float32Array:
    """Match plainly, and keep what lies in the left photo: rectifying leaves black round it."""
    return np.where(pair.valid_left, plain_sgbm(pair), np.nan).astype(np.float32)


def _read(folder: Path) -> tuple[RectifiedPair, Float32Array]:
    text = (folder / "calib.txt").read_text(encoding="utf-8")
    f, _, cx, _, _, cy = (float(word) for word in re.findall(r"[-\d.]+", text.split("[")[1])[:6])
    baseline_mm = float(re.findall(r"baseline=([\d.]+)", text)[0])
    left, right = (np.asarray(cv2.imread(str(folder / name)), dtype=np.uint8) for name in ("im0.png", "im1.png"))
    truth = np.asarray(cv2.imread(str(folder / "disp0.pfm"), cv2.IMREAD_UNCHANGED), dtype=np.float32)
    height, width = left.shape[:2]
    every = np.ones((height, width), dtype=bool)
    camera = RectifiedCamera(
        f_px=f, cx_px=cx, cy_px=cy, baseline_m=baseline_mm / 1000.0, width_px=width, height_px=height,
        rectified_from_left=frozen(np.eye(3)),
    )  # fmt: skip
    pair = RectifiedPair(name="laser", left=left, right=right, valid_left=every, valid_right=every, camera=camera)
    return pair, np.where(np.isfinite(truth) & (truth > 0), truth, np.nan).astype(np.float32)
