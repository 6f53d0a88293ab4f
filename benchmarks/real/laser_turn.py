"""Is it the matching or the cameras? Turns of the right camera held against a laser's disparities and the photos' rows.

Three angles fitted to the laser's points OFF the planar regions are judged on the regions. So is the turn that the
program itself fits to the photos' rows, which `--refine-rig` would use.
"""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import RectifiedCamera, RectifiedPair
from asbuilt_bim.camera.rig import StereoRig, rig_of_unknown_sigma
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray, frozen
from asbuilt_bim.geometry.transform import rigid, rotation_from_vector, unit
from benchmarks.real.rig_verdict import verdict_lines, verdict_of
from benchmarks.table import Line, told

_STEP_RAD = 1e-5
_ROUNDS = 12
_FOREIGN_PX = 1.0
"""What is further off is another surface, or none."""


def turn_lines(
    pair: RectifiedPair, truth: Float32Array, ours: Float32Array, regions: FloatArray, places: FloatArray,
    in_regions: BoolArray,
) -> list[Line]:  # fmt: skip
    """Tell what turns of the right camera make of the regions' errors (N,) at `places` (N, 3): x, y, true disparity."""
    camera = pair.camera
    off = (ours - truth).astype(np.float64)
    rows, columns = np.nonzero(~in_regions & (np.abs(off) < _FOREIGN_PX))
    elsewhere = np.stack([columns, rows, truth[rows, columns]], axis=-1).astype(np.float64)[::7]
    turn = _fitted(elsewhere, off[rows, columns][::7], camera)
    left_over = regions - _shift(turn, places, camera)[:, 0]
    ends = np.array([[0.125 * camera.width_px, camera.cy_px, 3.0], [0.875 * camera.width_px, camera.cy_px, 3.0]])
    apart = _shift(turn, ends, camera)[:, 1]
    angles = ", ".join(f"{1e3 * one:+.2f}" for one in turn[:3])
    lines = [
        told("  with the turn fitted to the laser's points elsewhere: both", two(left_over), len(places)),
        told("    it is, pitch, yaw, roll", f"{angles} mrad", len(elsewhere)),
        told("    rows that it would put apart, left and right", ", ".join(f"{one:+.2f} px" for one in apart), 1),
    ]
    verdict = verdict_of([pair], _rig(camera))
    if verdict is None:
        return lines
    by_rows = regions - _shift(verdict.correction_rad, places, camera)[:, 0]
    what = "  with the turn that the program fits to the photos' rows: both"
    return [*lines, *verdict_lines(verdict), told(what, two(by_rows), len(places))]


def _rig(camera: RectifiedCamera) -> StereoRig:
    """Return the rig of a pair that came rectified, as its file gives it."""
    K = np.array([[camera.f_px, 0.0, camera.cx_px], [0.0, camera.f_px, camera.cy_px], [0.0, 0.0, 1.0]])
    lens = Intrinsics(K=frozen(K), distortion=frozen(np.zeros(5)), width_px=camera.width_px, height_px=camera.height_px)
    return rig_of_unknown_sigma(lens, lens, rigid(np.zeros(3), [-camera.baseline_m, 0.0, 0.0]))


def _fitted(places: FloatArray, off: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Fit the right camera's three angles to disparities that are `off` (N,); foreign ones count less and less."""
    slopes = np.stack([_shift(step, places, camera)[:, 0] for step in _STEP_RAD * np.eye(5)[:3]], axis=-1) / _STEP_RAD
    weight, angles = np.ones(len(off)), np.zeros(3)
    for _ in range(_ROUNDS):
        angles = np.linalg.lstsq(slopes * weight[:, None], off * weight, rcond=None)[0]
        miss = off - slopes @ angles
        spread = 1.4826 * float(np.median(np.abs(miss)))
        weight = np.clip(1.0 - np.square(miss / (4.685 * spread)), 0.0, None)  # the root of Tukey's
    return np.concatenate([angles, np.zeros(2)])


def _shift(correction: FloatArray, places: FloatArray, camera: RectifiedCamera) -> FloatArray:
    """Return by how much disparities and rows (left less right) change (N, 2) in a right camera that stands so."""
    rays = np.concatenate([(places[:, :2] - [camera.cx_px, camera.cy_px]) / camera.f_px, np.ones((len(places), 1))], 1)
    points = rays * (camera.f_px * camera.baseline_m / places[:, 2])[:, None]
    eye = camera.baseline_m * unit(np.array([1.0, correction[3], correction[4]]))
    right = (points - eye) @ rotation_from_vector(correction[:3]).T
    seen = camera.f_px * (rays[:, :2] - right[:, :2] / right[:, 2:])
    seen[:, 0] -= places[:, 2]
    return np.asarray(seen)


def two(off: FloatArray) -> str:
    """Write the median of errors in px, and of their sizes."""
    off = off[np.isfinite(off)]
    return f"{np.median(off):+.3f}, {np.median(np.abs(off)):.3f} px" if len(off) else "none"
