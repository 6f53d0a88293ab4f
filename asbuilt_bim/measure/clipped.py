"""What is clipped white vouches for nothing: no depth is known there, and a face that ends there may go on."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from asbuilt_bim.camera.photo.quality import CLIPPED_PX
from asbuilt_bim.geometry.arrays import BoolArray, freeze
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.vision.stereo.depth import DepthMap


def unclipped(depth: DepthMap, blind: BoolArray) -> DepthMap:
    """Return a depth map without what is `blind` (H, W): there the matcher carries on what lies beside."""
    return replace(depth, valid=freeze(depth.valid & ~blind)) if blind.any() else depth


def ends_clipped(faces: Sequence[MeasuredFace], blind: BoolArray) -> tuple[MeasuredFace, ...]:
    """Return the faces, those open whose outline runs along what is `blind` (H, W): nothing proves an end there."""
    if not blind.any():
        return tuple(faces)
    around = cv2.dilate(blind.astype(np.uint8), np.ones((2 * CLIPPED_PX + 1, 2 * CLIPPED_PX + 1), np.uint8))
    return tuple(replace(face, open_edge=True) if _runs_along(face, around) else face for face in faces)


def _runs_along(face: MeasuredFace, around: np.ndarray) -> bool:
    drawn = np.zeros_like(around)
    cv2.polylines(drawn, [np.round(ring).astype(np.int32) for ring in face.outline_px], isClosed=True, color=1)
    return int(cv2.countNonZero(drawn & around)) > CLIPPED_PX
