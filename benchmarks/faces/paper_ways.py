"""The published method as ways of `faces.py`: on true masks, with the depth map of an all but perfect network.

The network is the truth: the inverse depth of every pixel, sharp to the pixel, with 1 % of low-frequency error, known
up to scale and shift. No real one is as good, so what is left of the published method's error is its own. (A network
that smears edges by 2 px, as real ones do, puts boundary pixels half-way to the background: areas are then off by
factors.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from asbuilt_synthetic.truth import pixel_truth
from asbuilt_synthetic.twins_scene import twin_scene

from asbuilt_bim.camera.rectify import rectification
from asbuilt_bim.geometry.arrays import ByteImage, Float32Array
from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.paper import paper_faces
from asbuilt_bim.measure.station_faces import FaceOptions
from asbuilt_bim.vision.masks.segment import Instance, InstanceClass, InstanceSource
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.depth_paper import Inversion, paper_depth
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.faces.twins import Read, TwinPair

ERROR = 0.01
ERROR_PX = 40.0


@dataclass(frozen=True, kw_only=True)
class TruthNetwork:
    """A `RelativeDepth` that knows the truth."""

    answer: Float32Array
    name: str = "truth"

    def estimate(self, image: ByteImage) -> Float32Array:
        """Return the truth's relative depth, larger is nearer."""
        return self.answer


@lru_cache(maxsize=1)
def truth_network(twin: TwinPair) -> TruthNetwork:
    """Return the network that knows a twin's depth."""
    scene = twin_scene(twin.truth["seed"])
    z = pixel_truth(scene, scene.stations[0]).depth_m
    inverse = np.where(np.isfinite(z), 1.0 / np.maximum(z, 0.1), 0.0).astype(np.float32)
    prepared = rectification(twin.rig)
    carried = cv2.remap(inverse, np.array(prepared.left_map), None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    rng = np.random.default_rng(twin.truth["seed"])
    bend = cv2.GaussianBlur(rng.standard_normal(carried.shape).astype(np.float32), (0, 0), ERROR_PX)
    bent = carried * (1.0 + ERROR * bend / bend.std())
    return TruthNetwork(answer=(3.0 * bent + 0.5).astype(np.float32))


def true_face_masks(twin: TwinPair) -> Iterator[tuple[int, Instance]]:
    """Give the number of each true face in view, and its exact mask."""
    for truth in twin.truth["faces"]:
        mask = twin.labels == truth["face"] + 1
        label: InstanceClass = "wall" if twin.truth["objects"][truth["object"]]["kind"] == "wall" else "column"
        box = (0, 0, mask.shape[1], mask.shape[0])
        if mask.any():
            yield truth["face"], Instance(label=label, score=1.0, mask=mask, box_px=box, source=InstanceSource.GIVEN)


def published(inversion: Inversion | None) -> Callable[[Read], dict[int, MeasuredFace]]:
    """Return the published way with one reading of the inversion; None: stereo in the place of the network."""

    def measure(read: Read) -> dict[int, MeasuredFace]:
        pair = read.twin.pair
        depth: DepthMap | None = None
        if inversion is None:
            depth = depth_map(pair, SemiGlobalMatcher())
        elif read.target is not None:
            try:
                depth = paper_depth(pair, truth_network(read.twin), read.target, inversion)
            except (
                ValueError
            ):  # the target is the nearest thing: as a complement its depth is 0, and nothing has a scale
                return {}
        if depth is None:
            return {}
        return {
            number: face
            for number, instance in true_face_masks(read.twin)
            for face in paper_faces(pair, depth, [instance], FaceOptions()).faces
        }

    return measure


PAPER_WAYS = {
    "paper, complement": published("complement"),
    "paper, reciprocal": published("reciprocal"),
    "paper on stereo": published(None),
}
