"""What every face of a station is worked on with: both photos made ready, where print hides concrete, and the scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, Float32Array, FloatArray
from asbuilt_bim.measure.outline.edges import Gradients, gradients
from asbuilt_bim.measure.planes.refine import Pictures, pictures
from asbuilt_bim.vision.markers.find import MarkerSighting
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.scene.read import Scene
from asbuilt_bim.vision.stereo.matching import grey
from asbuilt_bim.vision.stereo.rows_apart import rows_apart_px
from asbuilt_bim.vision.target.find import TargetSighting

FRAME_MARGIN_PX = 4
BOARD_SHARE = 1.75
"""A tag's board over its black square: the quiet zone is one or two of its eight to ten cells on each side."""
DISC_SHARE = 1.25
MOST_COVERED = 0.4
"""An instance that is print for this share is a board on a stand."""


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
    rows_px: float  # how far rows lie apart over the frame: columns do as much
    sky: BoolArray  # (H, W) what is plainly sky: further than any face, whatever the matcher carried over it


def workbench(
    pair: RectifiedPair, scene: Scene, marks: BoolArray | None = None, sky: BoolArray | None = None
) -> Workbench:
    """Lay out the pair for measuring: smoothed pictures, gradients, and where the frame ends."""
    nowhere = np.zeros(pair.valid_left.shape, dtype=bool)
    left, right = grey(pair.left), grey(pair.right)
    return Workbench(
        pair=pair,
        scene=scene,
        both=pictures(left, right, pair.valid_right),
        slopes=gradients(left, right, pair.valid_right),
        grey_levels=(left, right),
        marks=marks if marks is not None else nowhere,
        sky=sky if sky is not None else nowhere,
        frame=_frame(pair.valid_left),
        disparity_px=scene.level.disparity_px.astype(np.float32),
        rows_px=rows_apart_px(left, right, scene.level.disparity_px.astype(np.float32), scene.level.measured),
    )


def _frame(valid: BoolArray) -> BoolArray:
    """Say which left pixels lie within a few px of the photo's end, or beyond it."""
    kernel = np.ones((2 * FRAME_MARGIN_PX + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(valid.astype(np.uint8), kernel, borderValue=0) == 0)


def marks_mask(shape: tuple[int, ...], markers: Sequence[MarkerSighting], target: TargetSighting | None) -> BoolArray:
    """Return the pixels (H, W) that boards of markers and the target cover in the rectified left photo."""
    canvas = np.zeros(shape[:2], dtype=np.uint8)
    for marker in markers:
        centre = marker.left_px.mean(axis=0)
        quad: FloatArray = centre + BOARD_SHARE * (marker.left_px - centre)
        cv2.fillPoly(canvas, [np.round(quad).astype(np.int32)], 1)
    if target is not None:
        cx, cy, major, minor, angle = target.ellipse_left
        axes = (max(1, round(0.5 * DISC_SHARE * major)), max(1, round(0.5 * DISC_SHARE * minor)))
        cv2.ellipse(canvas, (round(cx), round(cy)), axes, float(np.degrees(angle)), 0, 360, 1, -1)
    return canvas > 0


def without_boards(instances: Sequence[Instance], marks: BoolArray) -> list[Instance]:
    """Drop the instances that are boards on stands."""
    kept: list[Instance] = []
    for instance in instances:
        x0, y0, x1, y1 = instance.box_px
        mask = instance.mask[y0:y1, x0:x1]
        covered = np.count_nonzero(mask & marks[y0:y1, x0:x1])
        if covered < MOST_COVERED * np.count_nonzero(mask):
            kept.append(instance)
    return kept
