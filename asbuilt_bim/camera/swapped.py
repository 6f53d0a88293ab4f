"""Were the two photos of a pair exchanged? Taken the other way round, they would fit the rig as it was calibrated."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.overlap import BEHIND_LIMIT, ROW_LIMIT_PX, PairMatches
from asbuilt_bim.camera.rectify import RectifiedCamera, turns
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import FloatArray

_FEWEST = 25
_BETTER = 3.0
"""Exchanged, the rows must correspond this many times better: two cameras that are alike fit both ways round."""


def swapped_rejection(what: str, matches: PairMatches, rig: StereoRig, camera: RectifiedCamera) -> Rejection | None:
    """Return the rejection of a pair whose photos are exchanged; None where they aren't.

    Each photo is given the other camera's lens and place. Rows that correspond then, with the scene before the rig,
    can't be chance; a camera that was turned doesn't give them. `rig` is that of the `matches`' size.
    """
    if len(matches.left_px) < _FEWEST:
        return None
    left_turn, right_turn = turns(rig)
    left = _through(matches.right_px, rig.right, right_turn, rig.left, left_turn, camera)
    right = _through(matches.left_px, rig.left, left_turn, rig.right, right_turn, camera)
    known = np.all(np.isfinite(left) & np.isfinite(right), axis=1)
    if np.count_nonzero(known) < _FEWEST:
        return None
    rows = float(np.median(np.abs(left[known, 1] - right[known, 1])))
    behind = float(np.mean(left[known, 0] - right[known, 0] < -1.0))
    as_given = float(np.median(np.abs(matches.rows_px)))
    if rows > ROW_LIMIT_PX or behind > BEHIND_LIMIT or as_given < _BETTER * rows:
        return None
    return Rejection(
        what=what,
        reason="left and right are swapped: exchanged, their rows correspond",
        value=f"vertical residual {as_given:.1f} px, exchanged {rows:.1f} px",
        limit=f"{ROW_LIMIT_PX:g} px",
        remedy="exchange the left and the right photo",
    )


def _through(
    pixels: FloatArray, taken: Intrinsics, turn: FloatArray, given: Intrinsics, given_turn: FloatArray,
    camera: RectifiedCamera,
) -> FloatArray:  # fmt: skip
    """Carry pixels (N, 2), rectified with the camera `taken`, to where they are rectified with the camera `given`."""
    rays = np.ones((len(pixels), 3))
    rays[:, :2] = (pixels - [camera.cx_px, camera.cy_px]) / camera.f_px
    turned = given.rays(taken.project(rays @ turn)) @ given_turn.T
    carried: FloatArray = turned[:, :2] / turned[:, 2:] * camera.f_px + [camera.cx_px, camera.cy_px]
    return carried
