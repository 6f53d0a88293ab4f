"""A segmenter, as simple as one can be: the left half of the photo is a wall."""

from __future__ import annotations

import numpy as np

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.stereo.depth import DepthMap


class Halves:
    """Says that a wall fills the left half of every photo."""

    name = "example-halves"

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Return one instance; its mask is in pixels of the rectified left photo."""
        height, width = pair.left.shape[:2]
        mask = np.zeros((height, width), bool)
        mask[:, : width // 2] = True
        box = (0, 0, width // 2, height)
        return [Instance(label="wall", score=1.0, mask=mask, box_px=box, source=InstanceSource.NETWORK)]
