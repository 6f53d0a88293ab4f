"""A board of known squares measured with the EuRoC rig as it was published; what a turn of the rig would make of it.

The rig stood still: the pairs are one view, and their scatter is no measure of the error. The board is 51 px wide at
the right edge of the frame, where the disparity's slope over it disagrees with the board's own perspective by 0.4 px.
The published lenses (k1 k2 p1 p2) leave that there, whichever way the corners are found (windows of 2 to 4 px, in light
or in grey: -2.4 to -3.6 %). No turn of the right camera mends that. The three ways to measure ask for yaws of opposite
signs, each within twice of what a published rig is trusted to. The turn that the photos' own rows ask for makes the
size 7 % too large. The program calls the rig undetermined, warns, and measures with it as it is, with `--refine-rig`
too.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from asbuilt_bim.camera.calibration.boards import Board
from asbuilt_bim.camera.photo.read import Photo, decode, read_photo
from asbuilt_bim.camera.rectify import rectification, rectify
from asbuilt_bim.camera.rig import OTHER_PROGRAMS, StereoRig
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.vision.stereo.rig_fit import corrected_rig
from benchmarks.real.board_areas import errors_by, size_error
from benchmarks.real.rig_verdict import verdict_lines, verdict_of
from benchmarks.table import Line, line, told

SCALE_LIMIT = 0.02
_STEP_RAD = 1e-4
Pairs = Sequence[tuple[Photo, Photo]]


def published_lines(folder: Path, board: Board) -> list[Line]:
    """Measure the board in all pairs of the folder, with the rig as published and as its photos show it."""
    lefts = sorted((folder / "pairs/cam0").glob("*.png"))
    if not lefts:
        return [told("euroc: absent, not judged", "", 0)]
    pairs = [(read_photo(left), read_photo(folder / "pairs/cam1" / left.name)) for left in lefts]
    published = read_rig(folder / "LeftCameraParams.yaml", folder / "RightCameraParams.yaml")
    errors = errors_by(published, pairs, board)
    n = len(errors)
    if not n:
        return [line("euroc: the board is found in no pair", "", f"<= {SCALE_LIMIT:.0%}", 0, False)]
    corners, pixels, size = _three(published, pairs, board)
    worst = np.nanmax(np.abs(errors), axis=0)
    return [
        line("euroc: board of 60 mm squares by the published rig, median", f"{corners:+.2%}", f"<= {SCALE_LIMIT:.0%}",
             n, abs(corners) <= SCALE_LIMIT, least_n=1),
        told("  plane from the pixels of both photos instead", f"{pixels:+.2%}", n),
        told("  its size fitted with its pose to both photos' corners", f"{size:+.2%}", n),
        told("  worst, corners / pixels", f"{worst[0]:.2%} / {worst[1]:.2%}", n),
        told("  pairs in which the board was found", f"{n} of {len(pairs)}", len(pairs)),
        *_turn_lines(published, pairs, board),
    ]  # fmt: skip


def _turn_lines(rig: StereoRig, pairs: Pairs, board: Board) -> list[Line]:
    """Tell what the program says of the rig, the board by the turn that rows ask for, and the yaw that would do."""
    prepared = rectification(rig)
    rectified = [rectify(prepared, decode(left), decode(right), left.name) for left, right in pairs]
    verdict = verdict_of(rectified, rig)
    if verdict is None:
        return [told("  the photos say nothing of the rig", "", len(pairs))]
    turned = _three(corrected_rig(rig, prepared.camera, verdict.correction_rad), pairs, board)
    yaw = np.array([0.0, _STEP_RAD, 0.0, 0.0, 0.0])
    now, moved = (np.array(_three(one, pairs, board)) for one in (rig, corrected_rig(rig, prepared.camera, yaw)))
    needed = -now * _STEP_RAD / (moved - now)
    trusted = f"{1e3 * OTHER_PROGRAMS.turn_rad[1]:.2f} mrad"
    return [
        *verdict_lines(verdict),
        told("  board by the turn that the rows ask for: corners, pixels, size", _shown(turned), len(pairs)),
        told(f"  yaw that would explain each (a published rig is trusted to {trusted})",
             ", ".join(f"{1e3 * one:+.2f}" for one in needed) + " mrad", len(pairs)),
    ]  # fmt: skip


def _three(rig: StereoRig, pairs: Pairs, board: Board) -> tuple[float, float, float]:
    """Return the median area errors: plane from corners, plane from pixels, size fitted with its pose."""
    corners, pixels = np.nanmedian(errors_by(rig, pairs, board), axis=0)
    sizes = [size for pair in pairs if (size := size_error(pair, board, rig)) is not None]
    return float(corners), float(pixels), float(np.median(sizes))


def _shown(errors: tuple[float, float, float]) -> str:
    return ", ".join(f"{error:+.2%}" for error in errors)
