"""What stands in the photo as one piece: the `Segmenter` interface and its answer."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, Protocol, runtime_checkable

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage
from asbuilt_bim.vision.scene.read import Scene
from asbuilt_bim.vision.stereo.depth import DepthMap

InstanceClass = Literal["wall", "column"]


class InstanceSource(StrEnum):
    """Who found a wall or column in the photo."""

    GEOMETRY = "geometry"  # and no other segmenter was used
    GEOMETRY_ALONE = "geometry alone"  # of two opinions: a network saw nothing there
    NETWORK = "network"  # or another program's plugin
    BOTH = "both"  # geometry and a network
    GIVEN = "given"  # a mask that somebody drew

    @property
    def border_from_depth(self) -> bool:
        """Say whether the mask's border is that of the depth's surfaces."""
        return self in (InstanceSource.GEOMETRY, InstanceSource.GEOMETRY_ALONE, InstanceSource.BOTH)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Instance:
    """One segmented wall or column: mask bool (H, W) in the RECTIFIED left frame, box (x0, y0, x1, y1) in pixels."""

    label: InstanceClass
    score: float  # 0..1
    mask: BoolArray
    box_px: tuple[int, int, int, int]
    source: InstanceSource
    segmenter: str = ""  # the network's or plugin's name, or that of a given mask; "" for geometry alone


@runtime_checkable
class Refuter(Protocol):
    """What a network with a card has beside, no plugin is asked: it knows things that are no wall and no column."""

    def refuted(self, pair: RectifiedPair) -> tuple[BoolArray, ...]:
        """Return masks bool (H, W) of what is something else: formwork, hoardings, people, machines."""
        ...


@runtime_checkable
class Blurrer(Protocol):
    """What a network with a card has beside, no plugin is asked: it finds people."""

    def people(self, image: ByteImage) -> BoolArray | None:
        """Return where people are in a BGR picture, bool (H, W); None where it isn't asked to look for any."""
        ...


@runtime_checkable
class SurfaceSegmenter(Protocol):
    """What a network with a card has beside, no plugin is asked: it tells things apart by the photo's surfaces."""

    def segment_on(self, pair: RectifiedPair, depth: DepthMap | None, scene: Scene) -> list[Instance]:
        """Return the instances as `Segmenter.segment` does, the photo's surfaces being known."""
        ...


class Segmenter(Protocol):
    """Finds walls and columns in a rectified pair; version 1 of the interface."""

    @property
    def name(self) -> str:
        """Return the segmenter's name, for reports."""
        ...

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Return the instances, masks in pixels of the rectified left photo, integers being pixel centres."""
        ...
