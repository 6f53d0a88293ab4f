"""Runs every way of segmenting, and relative depth, on pairs with truth: part by part, in several processes."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision.masks.fusion import agree
from asbuilt_bim.vision.masks.segment import Instance
from asbuilt_bim.vision.networks.kinds import LoadedNetwork, NetworkDepth, NetworkSegmenter, load
from asbuilt_bim.vision.scene.geometric import GeometricOptions, segment_scene
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.stereo.depth import DepthMap
from asbuilt_bim.vision.stereo.depth_fused import fused_depth
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.faces.twins import cycles_seeds
from benchmarks.networks.figures import DepthTally, Tally, filled, true_things
from benchmarks.networks.pictures import Shot, drawn_shots, sample_shots, twin_shots
from benchmarks.networks.rows import rows_as_one, said_by_truth

UNSEEN = "unseen sites"
GEOMETRY, NETWORK, BLIND, AGREED = "geometry alone", "network", "network without geometry", "network and geometry"
SURFACES = "network, the photo's surfaces known"
ALONE, FUSED = "depth, photo alone", "depth, stereo and in its holes the network (fused)"
FILLED = "depth, stereo and in its holes the nearest"
PIXELS, BLIND_PIXELS = "network, class by pixel", "network without geometry, class by pixel"
ROWS, ROWS_TRUE = "network, walls in one plane as one", "no mistake but walls in one plane as one"
SAMPLE, SPECIMENS = "path-traced sample", "path-traced specimens"


@dataclass(frozen=True, kw_only=True)
class Part:
    """Some pairs of a set: of the drawn sites or specimens the seeds, of the sample the stations."""

    where: str
    numbers: tuple[int, ...]

    def shots(self) -> Iterator[Shot]:
        """Give the part's pairs."""
        return {UNSEEN: drawn_shots, SAMPLE: sample_shots, SPECIMENS: twin_shots}[self.where](self.numbers)


QUICK_PARTS = (Part(where=SAMPLE, numbers=(0,)),)


def all_parts(seeds: tuple[int, ...]) -> tuple[Part, ...]:
    """Return all that is judged, long parts first."""
    specimens = cycles_seeds()
    return (
        Part(where=SAMPLE, numbers=(0, 1, 2, 3, 4)),
        *(Part(where=SPECIMENS, numbers=some) for some in (specimens[:4], specimens[4:]) if some),
        *(Part(where=UNSEEN, numbers=(seed,)) for seed in seeds),
    )


@dataclass(frozen=True, kw_only=True)
class Cards:
    """The networks to be judged, None for geometry alone."""

    segment: Path | None
    depth: Path | None

    def opened(self) -> tuple[LoadedNetwork | None, NetworkDepth | None]:
        """Open both, once a process."""
        return (
            load(self.segment, "segment") if self.segment else None,
            NetworkDepth(loaded=load(self.depth, "depth")) if self.depth else None,
        )


def judge(parts: Sequence[Part], cards: Cards, workers: int) -> dict[str, Judged]:
    """Judge all parts; return what came of each set, in the order of its first part."""
    found: dict[str, Judged] = {UNSEEN: Judged()} if any(part.where == UNSEEN for part in parts) else {}
    with ProcessPoolExecutor(max_workers=workers) as pool:
        for part, judged in zip(parts, pool.map(judged_part, parts, [cards] * len(parts)), strict=True):
            found.setdefault(part.where, Judged()).join(judged)
    return found


def judged_part(part: Part, cards: Cards) -> Judged:
    """Judge one part. Runs in a worker process."""
    loaded, depths = cards.opened()
    judged = Judged()
    for shot in part.shots():
        judged.add(shot, loaded, depths)
    return judged


@dataclass(kw_only=True)
class Judged:
    """What all ways made of some pairs."""

    masks: dict[str, Tally] = field(default_factory=dict)
    depths: dict[str, DepthTally] = field(default_factory=dict)
    pairs: int = 0

    def add(self, shot: Shot, loaded: LoadedNetwork | None, depths: NetworkDepth | None) -> None:
        """Run every way of segmenting, and relative depth, on a pair."""
        things = true_things(shot)
        stereo = depth_map(shot.pair, SemiGlobalMatcher())
        for name, instances in found_by(shot.pair, stereo, loaded).items():
            self.masks.setdefault(name, Tally()).add(instances, things)
            if name == NETWORK:
                rows = true_things(rows_as_one(shot))
                self.masks.setdefault(ROWS, Tally()).add(instances, rows)
                self.masks.setdefault(ROWS_TRUE, Tally()).add(said_by_truth(rows), things)
        for name, nearness in depths_by(shot.pair, stereo, depths).items():
            self.depths.setdefault(name, DepthTally()).add(nearness, shot)
        self.pairs += 1
        print(f"{shot.pair.name} ...", file=sys.stderr, flush=True)

    def join(self, other: Judged) -> None:
        """Take in what was made of further pairs."""
        for name, tally in other.masks.items():
            self.masks.setdefault(name, Tally()).join(tally)
        for name, errors in other.depths.items():
            self.depths.setdefault(name, DepthTally()).join(errors)
        self.pairs += other.pairs


def found_by(pair: RectifiedPair, stereo: DepthMap, loaded: LoadedNetwork | None) -> dict[str, list[Instance]]:
    """Return what every way of segmenting finds in a pair."""
    scene = read_scene(pair, stereo)
    found = {GEOMETRY: segment_scene(pair, scene)}
    if loaded is not None:
        whole = NetworkSegmenter(loaded=loaded)
        pixel = NetworkSegmenter(loaded=replace(loaded, card=replace(loaded.card, class_by="pixel")))
        found[NETWORK], found[BLIND] = whole.segment(pair, stereo), whole.segment(pair, None)
        found[PIXELS], found[BLIND_PIXELS] = pixel.segment(pair, stereo), pixel.segment(pair, None)
        found[SURFACES] = whole.segment_on(pair, stereo, scene)
        found[AGREED] = list(agree(pair, scene, stereo, whole, GeometricOptions()).instances)
    return found


def depths_by(pair: RectifiedPair, stereo: DepthMap, depths: NetworkDepth | None) -> dict[str, NDArray[np.float32]]:
    """Return what every way to depth says of a pair, larger is nearer."""
    found = {FILLED: filled(stereo)}
    if depths is not None:
        found[ALONE] = depths.estimate(pair.left)
        try:
            found[FUSED] = filled(fused_depth(pair, stereo, depths))
        except ValueError:  # the network doesn't follow this photo
            found[FUSED] = found[FILLED]
    return found
