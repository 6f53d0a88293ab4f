"""What every face of a station is worked on with: both photos made ready, and what the scene says of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.measure.outline.edges import Gradients, gradients
from asbuilt_bim.measure.planes.refine import Pictures, pictures
from asbuilt_bim.vision.scene.read import Scene
from asbuilt_bim.vision.stereo.matching import grey

FRAME_MARGIN_PX = 4
ENOUGH_SAMPLES = 4000
"""Pixels of a piece that its distance from a plane is the median of."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Workbench:
    """What every face of a station is worked on with."""

    pair: RectifiedPair
    scene: Scene
    both: Pictures
    slopes: Gradients
    grey_levels: tuple[Float32Array, Float32Array]
    marks: BoolArray  # (H, W) print on boards: holds no plane and no edge
    frame: BoolArray  # (H, W) within a few px of where the left photo ends
    disparity_px: Float32Array  # (H, W) as measured, NaN where not
    samples: Mapping[int, tuple[FloatArray, FloatArray]]  # of each flat piece: some pixels' rays (N, 3), disparity (N,)


def workbench(pair: RectifiedPair, scene: Scene, marks: BoolArray | None = None) -> Workbench:
    """Lay out the pair for measuring: smoothed pictures, gradients, and where the frame ends."""
    left, right = grey(pair.left), grey(pair.right)
    return Workbench(
        pair=pair,
        scene=scene,
        both=pictures(left, right, pair.valid_right),
        slopes=gradients(left, right, pair.valid_right),
        grey_levels=(left, right),
        marks=marks if marks is not None else np.zeros(pair.valid_left.shape, dtype=bool),
        frame=_frame(pair.valid_left),
        disparity_px=scene.level.disparity_px.astype(np.float32),
        samples=samples_of(scene),
    )


def samples_of(scene: Scene) -> dict[int, tuple[FloatArray, FloatArray]]:
    """Return some measured pixels of each flat piece, by its number: rays (N, 3) and disparity (N,)."""
    found: dict[int, tuple[FloatArray, FloatArray]] = {}
    for number, piece in enumerate(scene.pieces):
        if piece.circle is not None or scene.sizes[number] == 0:
            continue
        rows, columns = scene.pixels(number)
        some = slice(None, None, max(1, len(rows) // ENOUGH_SAMPLES))
        disparity, rays = (
            scene.level.disparity_px[rows[some], columns[some]],
            scene.level.rays[rows[some], columns[some]],
        )
        known = np.isfinite(disparity)
        found[number] = rays[known], disparity[known]
    return found


def _frame(valid: BoolArray) -> BoolArray:
    """Say which left pixels lie within a few px of the photo's end, or beyond it."""
    kernel = np.ones((2 * FRAME_MARGIN_PX + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(valid.astype(np.uint8), kernel, borderValue=0) == 0)
