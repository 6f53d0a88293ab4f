"""Photos of a rig whose right camera was turned about its own centre after its calibration, from an untouched rig's."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.overlap import match_pair
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.vision.stereo.rig_health import StationHealth, station_health
from benchmarks.sites import SAMPLE, benchmark_folder
from benchmarks.target.pictures import true_rig

DEVELOPING_SITES = (20, 1, 21)
_GRID = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visit:
    """A visit's photo pairs, the rig as it was calibrated from its boards, and the true one."""

    name: str
    pairs: tuple[tuple[str, ByteImage, ByteImage], ...]  # station, left, right
    calibrated: StereoRig
    true: StereoRig


def visits(seeds: tuple[int, ...] = DEVELOPING_SITES) -> Iterator[Visit]:
    """Give the first visit of each generated site that is there, else of the sample."""
    folders = [benchmark_folder() / f"site-{seed}" for seed in seeds]
    for folder in [folder for folder in folders if (folder / "complete").exists()] or [SAMPLE]:
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        project = read_project(folder / "project.yaml")
        calibrated = rig_of(project, Cache(folder=None), lambda *_: None).rig
        pairs = tuple(
            (station.name, _read(station.left), _read(station.right)) for station in project.visits[0].stations
        )
        yield Visit(name=folder.name, pairs=pairs, calibrated=calibrated, true=true_rig(truth))


def turned_rig(rig: StereoRig, axis: int, degrees: float) -> StereoRig:
    """Return a rig whose right camera was turned about its own centre: about its x (pitch), y (yaw) or z (roll)."""
    vector = np.zeros(3)
    vector[axis] = np.deg2rad(degrees)
    return replace(rig, right_from_left=frozen(rigid(vector, np.zeros(3)) @ rig.right_from_left))


def turned_photo(image: ByteImage, lens: Intrinsics, axis: int, degrees: float) -> ByteImage:
    """Return what a camera sees after such a turn, exact but for the resampling: no parallax arises at its centre."""
    vector = np.zeros(3)
    vector[axis] = np.deg2rad(degrees)
    at = _source(lens, rotation_from_vector(vector))
    return np.asarray(cv2.remap(image, at, np.empty(0, np.float32), cv2.INTER_CUBIC), dtype=np.uint8)


def healths(visit: Visit, used: StereoRig, turn: tuple[int, float] | None = None) -> list[StationHealth]:
    """Return what each station says of the rig `used`, its right photo turned by `turn` (axis, degrees)."""
    prepared = rectification(used)
    found = []
    for name, left, right in visit.pairs:
        seen = right if turn is None else turned_photo(right, visit.true.right, *turn)
        pair = rectify(prepared, left, seen, name)
        health = station_health(pair, match_pair(pair), used)
        if health is not None:
            found.append(health)
    return found


def area_error(true: StereoRig, used: StereoRig) -> float:
    """Return the relative error of 1 m2 at 5 m when photos of the true rig are triangulated with the one used.

    The mean over five places: the middle of the left frame, and half-way to each side.
    """
    errors = []
    for x, y in ((0.0, 0.0), (-1.4, 0.0), (1.4, 0.0), (0.0, -1.0), (0.0, 1.0)):
        square = np.array([[x - 0.5, y - 0.5, 5], [x + 0.5, y - 0.5, 5], [x + 0.5, y + 0.5, 5], [x - 0.5, y + 0.5, 5]])
        in_right = square @ true.right_from_left[:3, :3].T + true.right_from_left[:3, 3]
        met = _triangulated(used, true.left.project(square), true.right.project(in_right))
        errors.append(0.5 * np.linalg.norm(np.cross(met[2] - met[0], met[3] - met[1])) - 1.0)
    return float(np.mean(errors))


def _triangulated(rig: StereoRig, left_px: FloatArray, right_px: FloatArray) -> FloatArray:
    """Return the points (N, 3) in the left frame that lie nearest to both rays."""
    turn = rig.right_from_left[:3, :3]
    centre = -turn.T @ rig.right_from_left[:3, 3]
    points = []
    for a, b in zip(rig.left.rays(left_px), rig.right.rays(right_px) @ turn, strict=True):
        (s, t), *_ = np.linalg.lstsq(np.stack([a, -b], axis=-1), centre, rcond=None)
        points.append(0.5 * (s * a + t * b + centre))
    return np.array(points)


def _source(lens: Intrinsics, turn: FloatArray) -> Float32Array:
    """Return where each pixel (H, W, 2) of the turned camera lay in the photo before; smooth, so made on a grid."""
    x = np.arange(0, lens.width_px + _GRID, _GRID, dtype=np.float64)
    y = np.arange(0, lens.height_px + _GRID, _GRID, dtype=np.float64)
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    coarse = lens.project(lens.rays(grid) @ turn).astype(np.float32)  # before = turn^T after, for rows
    columns, rows = np.meshgrid(np.arange(lens.width_px) / _GRID, np.arange(lens.height_px) / _GRID)
    fine = cv2.remap(coarse, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR)
    return np.asarray(fine, dtype=np.float32)


def _read(path: Path) -> ByteImage:
    image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise SystemExit(f"{path}: no picture")
    return np.asarray(image, dtype=np.uint8)
