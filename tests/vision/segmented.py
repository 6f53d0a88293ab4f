"""The geometric segmenter's instances of concrete's colour, for tests."""

from __future__ import annotations

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.scene.geometric import GeometricOptions, of_concretes_colour, upright_instances
from asbuilt_bim.vision.scene.read import Scene


def segment_scene(pair: RectifiedPair, scene: Scene, options: GeometricOptions | None = None) -> list[Instance]:
    """Group a scene's upright pieces to instances as grey as concrete, the largest first."""
    return of_concretes_colour(upright_instances(pair, scene, options), pair.name)[0]
