"""Networks in the places that the flow has for them: a second opinion on instances, relative depth, dense stereo."""

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.errors import NetworkError
from asbuilt_bim.geometry.arrays import BoolArray, ByteImage, Float32Array, freeze
from asbuilt_bim.vision.masks.colour_guide import ColourGuide
from asbuilt_bim.vision.masks.refinement import COARSE_SHARE
from asbuilt_bim.vision.masks.segment import Instance, InstanceSource
from asbuilt_bim.vision.networks.card import Meaning, NetworkCard, Task, model_path, read_card
from asbuilt_bim.vision.networks.detection import Sighting
from asbuilt_bim.vision.networks.files import Stamp, network_stamp
from asbuilt_bim.vision.networks.geometry_input import NEAR_M, geometry_of_pair, no_geometry
from asbuilt_bim.vision.networks.layouts import read_sightings
from asbuilt_bim.vision.networks.map_geometry import Relief
from asbuilt_bim.vision.networks.picture import Fit, input_of
from asbuilt_bim.vision.networks.session import Network, open_network
from asbuilt_bim.vision.scene.read import NOTHING, Scene
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.matching import SIXTEENTHS, disparity_sigma

LEAST_PIXELS = 150
"""A smaller mask is a crumb, whatever its class: no face is measured on it."""
CELLS_OFF = 3.0
"""How far the border of a network's own mask may be off, in cells of its map."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedNetwork:
    """A card with its network."""

    card: NetworkCard
    network: Network


def load(card_path: Path, task: Task) -> LoadedNetwork:
    """Load a card's network, once a process unless a file of it changes; its task must be the one that is asked for.

    Raises:
        NetworkError: the card or the network can't be used, or is for something else.
    """
    loaded = _loaded(card_path.resolve(), network_stamp(card_path))
    if loaded.card.task != task:
        raise NetworkError(
            f"network card {card_path}: layout {loaded.card.layout} is for {loaded.card.task}, it is named for {task}"
        )
    return loaded


@lru_cache(maxsize=6)
def _loaded(card_path: Path, stamp: Stamp) -> LoadedNetwork:
    card = read_card(card_path)
    return LoadedNetwork(card=card, network=open_network(card, model_path(card, card_path)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetworkSegmenter:
    """Finds walls and columns by a network; `Segmenter`, version 1."""

    loaded: LoadedNetwork
    _last: list[Any] = field(default_factory=list, repr=False)  # the pair seen last, and what was seen in it

    @property
    def name(self) -> str:
        """Return the network's name."""
        return self.loaded.card.name

    def sightings(
        self, image: ByteImage, measured: tuple[RectifiedPair, DepthMap] | None = None, scene: Scene | None = None
    ) -> list[tuple[Meaning, Sighting]]:
        """Return all that the network sees in a BGR photo, also what is no concrete, the surest first; disjoint.

        `measured` is the pair whose left photo this is, with its depth, for a network that takes geometry; `scene` its
        surfaces, which help to tell what is one instance.
        """
        card = self.loaded.card
        picture, fit = input_of(image, card.input)
        pictures: tuple[Float32Array, ...] = (picture,)
        relief: Relief | None = None
        if card.geometry is not None:
            geometry = geometry_of_pair(*measured, fit) if measured is not None else no_geometry(fit)
            pictures = (picture, geometry[None])
            relief = relief_of(geometry, measured[0], scene, fit) if measured is not None else None
        found: list[tuple[Meaning, Sighting]] = []
        taken = np.zeros(image.shape[:2], dtype=bool)
        guide = ColourGuide.of(image, CELLS_OFF * COARSE_SHARE) if card.layout == "centres" else None
        for one in read_sightings(answers(self.loaded.network, card, pictures), card, fit, relief):
            meaning = card.meaning(one.number)
            drawn = guide.drawn(one.mask) if guide is not None and meaning != "other" else one.mask
            mask = drawn & ~taken
            if meaning is None or np.count_nonzero(mask) < LEAST_PIXELS:
                continue
            taken |= mask
            freeze(mask)
            found.append((meaning, Sighting(number=one.number, score=one.score, mask=mask)))
        return found

    def segment(self, pair: RectifiedPair, depth: DepthMap | None) -> list[Instance]:
        """Return the walls and columns, masks in pixels of the rectified left photo, integers being pixel centres."""
        return self._instances(pair, self.sightings(pair.left, (pair, depth) if depth is not None else None))

    def segment_on(self, pair: RectifiedPair, depth: DepthMap | None, scene: Scene) -> list[Instance]:
        """Return the walls and columns with the photo's surfaces known; `SurfaceSegmenter`, version 1."""
        return self._instances(pair, self.sightings(pair.left, (pair, depth) if depth is not None else None, scene))

    def _instances(self, pair: RectifiedPair, found: list[tuple[Meaning, Sighting]]) -> list[Instance]:
        self._last[:] = [pair, found]
        return [instance_of(one, meaning, self.name) for meaning, one in found if meaning != "other"]

    def refuted(self, pair: RectifiedPair) -> tuple[BoolArray, ...]:
        """Return masks bool (H, W) of what the network knows to be something else; `Refuter`, version 1."""
        return tuple(one.mask for meaning, one in self._seen(pair) if meaning == "other")

    @property
    def finds_concrete(self) -> bool:
        """Say whether it knows walls or columns, or only what is neither."""
        return self.loaded.card.finds_concrete

    def people(self, image: ByteImage) -> BoolArray | None:
        """Return where what the card blurs is, bool (H, W), None where it blurs nothing; `Blurrer`, version 1."""
        card = self.loaded.card
        blurred = {one.id for one in card.classes if one.blur}
        if not blurred:
            return None
        found = np.zeros(image.shape[:2], dtype=bool)
        if self._last and self._last[0].left is image:  # it was looked at a moment ago
            for _, one in self._last[1]:
                found |= one.mask if one.number in blurred else False
            freeze(found)
            return found
        picture, fit = input_of(image, card.input)
        pictures: tuple[Float32Array, ...] = (picture,) if card.geometry is None else (picture, no_geometry(fit)[None])
        for one in read_sightings(answers(self.loaded.network, card, pictures), card, fit):
            if one.number in blurred:
                found |= one.mask
        freeze(found)
        return found

    @property
    def finds_things(self) -> bool:
        """Say whether a sighting is one wall or column, or all the pixels of a class."""
        return self.loaded.card.layout != "semantic"

    def _seen(self, pair: RectifiedPair) -> list[tuple[Meaning, Sighting]]:
        """Return what was seen in a pair's left photo; one that wasn't looked at yet is, without its depth."""
        if not self._last or self._last[0] is not pair:
            self._last[:] = [pair, self.sightings(pair.left)]
        found: list[tuple[Meaning, Sighting]] = self._last[1]
        return found


def relief_of(geometry: Float32Array, pair: RectifiedPair, scene: Scene | None, fit: Fit) -> Relief | None:
    """Return what stereo says of each pixel of the input, of its geometry (5, h, w); None where it says nothing."""
    if not geometry[4].any():
        return None
    surface: NDArray[np.int16] | None = None
    if scene is not None:
        upright = np.where(scene.labels < len(scene.pieces), scene.labels, np.int16(NOTHING))
        surface = fit.to_input(upright, NOTHING)
    inverse = geometry[0] * np.float32(1.0 / NEAR_M)
    return Relief(inverse_depth_per_m=inverse, f_px=pair.camera.f_px * fit.scale_x, surface=surface)


def instance_of(sighting: Sighting, meaning: Meaning, segmenter: str) -> Instance:
    """Return a sighting of a wall or column as an instance."""
    mask = sighting.mask
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return Instance(
        label="column" if meaning == "column" else "wall", score=min(max(sighting.score, 0.0), 1.0), mask=mask,
        box_px=(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1),
        source=InstanceSource.NETWORK, segmenter=segmenter,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetworkDepth:
    """Estimates relative depth by a network; `RelativeDepth`, version 1."""

    loaded: LoadedNetwork

    @property
    def name(self) -> str:
        """Return the network's name."""
        return self.loaded.card.name

    def estimate(self, image: ByteImage) -> Float32Array:
        """Return float32 (H, W): larger is nearer, defined up to scale and shift; of a metric network, 1/Z.

        Raises:
            NetworkError: the output is no map, or metric depths that aren't positive.
        """
        card = self.loaded.card
        picture, fit = input_of(image, card.input)
        small = _map_of(answers(self.loaded.network, card, (picture,))["depth"], card)
        if card.layout == "metric-depth":
            if small.min() <= 0.0:
                raise NetworkError(
                    f"network {card.name}: metric depths of {small.min():.3g} m; metric ones are positive"
                )
            small = 1.0 / small
        step = (card.input.width_px / small.shape[1], card.input.height_px / small.shape[0])
        return fit.to_photo(small.astype(np.float32), *step)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetworkMatcher:
    """Matches a pair by a stereo network; `StereoMatcher`, version 1. Its sigma is learned on the pair."""

    loaded: LoadedNetwork

    @property
    def name(self) -> str:
        """Return the network's name."""
        return self.loaded.card.name

    def match(self, pair: RectifiedPair) -> tuple[Float32Array, Float32Array]:
        """Return disparity and sigma in pixels, float32 (H, W); NaN disparity where nothing was measured.

        The network is asked twice: for the left photo, and for the right one, both mirrored. What the two say of one
        thing differs by its errors: they give the pair its sigma.
        """
        from_left = self.raw(pair.left, pair.right)
        mirrored = [np.ascontiguousarray(photo[:, ::-1]) for photo in (pair.right, pair.left)]
        from_right = np.ascontiguousarray(self.raw(*mirrored)[:, ::-1])
        return disparity_sigma(pair, from_left, from_right)

    def raw(self, left: ByteImage, right: ByteImage) -> Float32Array:
        """Return the network's own answer in pixels of the photo, float32 (H, W); NaN where it says none.

        Raises:
            NetworkError: the output is no map.
        """
        card = self.loaded.card
        (first, fit), (second, _) = input_of(left, card.input), input_of(right, card.input)
        small = _map_of(self.loaded.network.run((first, second))["disparity"], card)
        step = (card.input.width_px / small.shape[1], card.input.height_px / small.shape[0])
        disparity = fit.to_photo(small.astype(np.float32), *step) / np.float32(fit.scale_x)
        return np.where(disparity > 1.0 / SIXTEENTHS, disparity, np.nan).astype(np.float32)


def _map_of(answer: np.ndarray, card: NetworkCard) -> np.ndarray:
    """Return a single map (h, w) of an answer with leading axes of one."""
    if answer.ndim < 2 or any(size != 1 for size in answer.shape[:-2]) or min(answer.shape[-2:]) < 2:
        raise NetworkError(f"network {card.name}: the layout {card.layout} wants one map (1, h, w), got {answer.shape}")
    return np.asarray(answer.reshape(answer.shape[-2:]))


def answers(
    network: Network, card: NetworkCard, pictures: tuple[NDArray[np.float32], ...]
) -> dict[str, NDArray[np.float64]]:
    """Run a network on its inputs (1, c, h, w); with `mirror` in its card, return the mean of both ways to look.

    Raises:
        NetworkError: it failed, or answered with NaN.
    """
    seen = network.run(pictures)
    if not card.mirror:
        return seen
    other = network.run(tuple(np.ascontiguousarray(picture[..., ::-1]) for picture in pictures))
    for role, array in seen.items():
        back = other[role][..., ::-1]
        if role == "offsets" and array.ndim == 4:
            back = back * np.array([-1.0, 1.0])[: array.shape[1], None, None]  # what is right is left there
        array += back
        array *= 0.5
    return seen
