"""Everything that is measured on real photographs, in one result that the page and the benchmark both show."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from asbuilt_bim.geometry.arrays import ByteImage
from asbuilt_bim.vision.networks.bundled import BUNDLED, bundled_card
from asbuilt_bim.vision.networks.card import ROLES, Task
from asbuilt_bim.vision.networks.kinds import LoadedNetwork, NetworkDepth, NetworkSegmenter, load
from numpy.typing import NDArray

from asbuilt_training.real.depth import DepthErrors, depth_errors, flat, ramp
from asbuilt_training.real.labels import LabelledPhoto, read_labels
from asbuilt_training.real.pairs import RealPair, real_pairs
from asbuilt_training.real.score import Counts, Finder, Mask, Scored, counts_of, everything, greyish, in_quarters, score

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).resolve().parents[3] / "../shared/data"))
PLAIN: dict[str, Finder] = {"every pixel called concrete": everything, "grey pixels called concrete": greyish}
"""What needs no network: a figure means something only above these."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WithStereo:
    """What a segmenter answers to a real pair's left photo alone and with the pair's stereo."""

    name: str
    alone: Counts
    with_stereo: Counts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DepthFigure:
    """A depth network on one real pair, beside guesses that look at nothing."""

    name: str
    truth_is: str
    image: ByteImage
    relative: NDArray[np.float64]
    truth_m: NDArray[np.float64]
    errors: DepthErrors
    guesses: dict[str, DepthErrors]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Figures:
    """All figures; `absent` names the labelled photos that the data folder doesn't have."""

    network: str
    scored: tuple[Scored, ...]  # the network's class of each pixel
    beside: dict[str, tuple[Scored, ...]]  # the same photos as a run takes them, by quarters, and by what is no network
    stereo: tuple[WithStereo, ...]
    depth: tuple[DepthFigure, ...]
    absent: tuple[str, ...]


def card_of(name: str, task: Task) -> Path:
    """Return the path of a card, or of the one that is shipped where the name is `bundled`.

    Raises:
        NetworkError: none is shipped.
    """
    return bundled_card(task) if name == BUNDLED else Path(name)


def measure(segment: str, depth: str | None, data: Path = DATA, quick: bool = False) -> Figures:
    """Ask the networks, by the names of their cards, about every labelled photo that is there and the real pairs.

    Raises:
        NetworkError: a card or its network can't be used.
    """
    segmenter = NetworkSegmenter(loaded=load(card_of(segment, "segment"), "segment"))
    finder = finder_of(by_pixel(segmenter))
    others = {"the network's instances, as a run takes them": finder_of(segmenter), **PLAIN}
    if not quick:
        others = {"the network's classes on quarters of the photo": in_quarters(finder), **others}
    labels = read_labels()
    there = [photo for photo in labels if photo.is_there(data)]
    asked = _one_a_view(there) if quick else there
    pairs = [] if quick else real_pairs(data)
    estimator = None if depth is None else NetworkDepth(loaded=load(card_of(depth, "depth"), "depth"))
    by_file = {photo.file: photo for photo in there}
    return Figures(
        network=segmenter.name,
        scored=tuple(score(photo, data, finder) for photo in asked),
        beside={name: tuple(score(photo, data, other) for photo in asked) for name, other in others.items()},
        stereo=tuple(_with_stereo(one, segmenter, by_file[one.file]) for one in pairs if one.file in by_file),
        depth=() if estimator is None else tuple(_depth(one, estimator) for one in pairs),
        absent=tuple(photo.file for photo in labels if photo not in there),
    )


def finder_of(segmenter: NetworkSegmenter) -> Finder:
    """Return what a segmenter calls wall or column in a single photo, without geometry, as one mask."""

    def found(image: ByteImage) -> Mask:
        mask = np.zeros(image.shape[:2], dtype=bool)
        for meaning, sighting in segmenter.sightings(image):
            if meaning != "other":
                mask |= sighting.mask
        return mask

    return found


def by_pixel(segmenter: NetworkSegmenter) -> NetworkSegmenter:
    """Return the same network read pixel by pixel: what it is sure of and how it groups it left aside."""
    card = segmenter.loaded.card
    if "logits" not in ROLES[card.layout] or "masks" in ROLES[card.layout]:
        return segmenter
    outputs = {role: name for role, name in card.outputs.items() if role == "logits"}
    read = replace(card, layout="semantic", outputs=outputs, least_score=0.0)
    return NetworkSegmenter(loaded=LoadedNetwork(card=read, network=segmenter.loaded.network))


def _one_a_view(photos: list[LabelledPhoto]) -> list[LabelledPhoto]:
    return list({photo.view: photo for photo in reversed(photos)}.values())[::-1]


def _with_stereo(one: RealPair, segmenter: NetworkSegmenter, photo: LabelledPhoto) -> WithStereo:
    """Compare on the rectified left photo; the pairs' labels are all rest, wherever a pixel was carried."""
    if photo.kinds().any():
        raise ValueError(f"labels of {photo.file}: a rectified pair's labels would have to be carried with its photo")
    masks = [finder_of(segmenter)(one.pair.left), np.zeros(one.pair.left.shape[:2], dtype=bool)]
    for instance in segmenter.segment(one.pair, one.stereo):
        masks[1] |= instance.mask
    kinds = np.where(one.pair.valid_left, 0, 255).astype(np.uint8)
    alone, with_stereo = (counts_of(mask, kinds) for mask in masks)
    return WithStereo(name=one.name, alone=alone, with_stereo=with_stereo)


def _depth(one: RealPair, network: NetworkDepth) -> DepthFigure:
    relative = network.estimate(one.pair.left).astype(np.float64)
    shape = (one.truth_m.shape[0], one.truth_m.shape[1])
    guesses = {"all equally far": flat(shape), "lower is nearer": ramp(shape)}
    return DepthFigure(
        name=one.name, truth_is=one.truth_is, image=one.pair.left, relative=relative, truth_m=one.truth_m,
        errors=depth_errors(relative, one.truth_m),
        guesses={name: depth_errors(guess, one.truth_m) for name, guess in guesses.items()},
    )  # fmt: skip
