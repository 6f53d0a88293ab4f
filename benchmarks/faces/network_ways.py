"""The shipped networks as ways of `faces.py`: the program with their masks, and the published method on their depth.

The published method takes a segmenter's masks and a depth network's map as they are; so do its ways here.
`paper_ways.py` has the same with the truth in both places.
"""

from __future__ import annotations

from collections.abc import Callable

from asbuilt_bim.measure.faces import MeasuredFace
from asbuilt_bim.measure.paper import paper_faces
from asbuilt_bim.measure.station_faces import FaceOptions, measure_faces
from asbuilt_bim.vision.masks.fusion import agree
from asbuilt_bim.vision.networks.bundled import bundled_card
from asbuilt_bim.vision.networks.kinds import NetworkDepth, NetworkSegmenter, load
from asbuilt_bim.vision.scene.geometric import GeometricOptions
from asbuilt_bim.vision.stereo.depth_paper import Inversion, paper_depth
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.faces.paper_ways import true_face_masks
from benchmarks.faces.twins import Read, by_truth

Way = Callable[[Read], dict[int, MeasuredFace]]


def agreed_masks(read: Read) -> dict[int, MeasuredFace]:
    """Measure with the masks that network and geometry agree on, as a run with `segment: bundled` does."""
    pair = read.twin.pair
    segmenter = NetworkSegmenter(loaded=load(bundled_card("segment"), "segment"))
    stereo = depth_map(pair, SemiGlobalMatcher())
    instances = agree(pair, read.scene, stereo, segmenter, GeometricOptions()).instances
    return by_truth(
        read.twin, measure_faces(pair, read.scene, instances, read.twin.rig, FaceOptions(), read.marks, read.sky).faces
    )


def published(inversion: Inversion, true_masks: bool) -> Way:
    """Return the published way on the shipped networks' depth, with the truth's masks or with the network's."""

    def measure(read: Read) -> dict[int, MeasuredFace]:
        pair = read.twin.pair
        if read.target is None:
            return {}
        try:
            depth = paper_depth(pair, NetworkDepth(loaded=load(bundled_card("depth"), "depth")), read.target, inversion)
        except ValueError:  # the map has no scale at the target
            return {}
        if true_masks:
            return {
                number: face
                for number, instance in true_face_masks(read.twin)
                for face in paper_faces(pair, depth, [instance], FaceOptions()).faces
            }
        segmenter = NetworkSegmenter(loaded=load(bundled_card("segment"), "segment"))
        instances = segmenter.segment(pair, depth_map(pair, SemiGlobalMatcher()))
        return by_truth(read.twin, paper_faces(pair, depth, instances, FaceOptions()).faces)

    return measure


NETWORK_WAYS: dict[str, Way] = {
    "network and geometry": agreed_masks,
    "paper, network depth, true masks, complement": published("complement", true_masks=True),
    "paper, network depth, true masks, reciprocal": published("reciprocal", true_masks=True),
    "paper, network depth and masks, complement": published("complement", true_masks=False),
    "paper, network depth and masks, reciprocal": published("reciprocal", true_masks=False),
}
