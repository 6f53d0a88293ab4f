"""Instances of walls and columns against the truth, and what a network costs beside the published one.

python benchmarks/networks.py --check --json figures.json [--card CARD.yaml]     60 pairs of the reporting seeds
python benchmarks/networks.py --quick                                            four pairs of the sample, not judged

Without --card only the geometric segmenter is measured: no network of our own is shipped yet.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from asbuilt_synthetic.model import Scene as TrueScene
from asbuilt_synthetic.model import Station
from asbuilt_synthetic.scene import scene as true_scene
from asbuilt_synthetic.truth import pixel_truth
from numpy.typing import NDArray
from sites import REPORTING_SEEDS, ROOT, SAMPLE, generated_site
from table import Line, line, options, report, told

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rectify import Rectification, RectifiedPair, rectification, rectify
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.vision.agreement import agree
from asbuilt_bim.vision.geometric import GeometricOptions, segment_scene
from asbuilt_bim.vision.networks.kinds import NetworkSegmenter, load
from asbuilt_bim.vision.scene import read_scene
from asbuilt_bim.vision.segment import Instance
from asbuilt_bim.vision.stereo import SemiGlobalMatcher, depth_map

VISITS = ("2026-03-02", "2026-03-16")
LEAST_PIXELS = 800
"""An element of fewer pixels is neither expected nor held against a segmenter."""
PUBLISHED_CARD = """\
format: asbuilt-bim/network
version: 1
name: yolov8n-seg
file: yolov8n-seg_int8.onnx
layout: yolo-seg
input: {width_px: 320, height_px: 320, resize: letterbox, pad_value: 114}
classes: [{id: 72, name: refrigerator, label: wall}, {id: 0, name: person, label: other}]
"""
Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What stands in one photo: class and mask of each element of enough pixels, and the mask of the small ones."""

    things: list[tuple[str, Mask]]
    ignored: Mask


@dataclass(frozen=True, kw_only=True)
class Shot:
    """One photo's pair with its truth."""

    pair: RectifiedPair
    truth: Truth


def rig_of(scene: TrueScene) -> StereoRig:
    """Return the rig as it was drawn."""
    left, right = (
        Intrinsics(K=c.K, distortion=c.distortion, width_px=c.width_px, height_px=c.height_px)
        for c in (scene.rig.left, scene.rig.right)
    )
    return StereoRig(left=left, right=right, right_from_left=scene.rig.right_from_left, covariance=np.zeros((14, 14)))


def shots(quick: bool) -> list[tuple[Path, int, int, int]]:
    """Return (site, seed, visit, station) of every pair to look at."""
    if quick:
        return [(SAMPLE, 7, visit, station) for visit in (0, 1) for station in (0, 3)]
    sites = [(SAMPLE, 7), *((generated_site(seed), seed) for seed in REPORTING_SEEDS)]
    return [(site, seed, visit, station) for site, seed in sites for visit in (0, 1) for station in range(5)]


def read_shot(site: Path, scene: TrueScene, visit: int, station: Station, prepared: Rectification) -> Shot:
    """Read a pair and carry its truth to the rectified frame."""
    folder = site / "visits" / VISITS[visit]
    left, right = (cv2.imread(str(folder / f"{station.name}_{side}.jpg")) for side in ("left", "right"))
    pair = rectify(prepared, left, right, station.name)
    owners = (pixel_truth(scene, station).element + 1).astype(np.float32)
    here = cv2.remap(owners, np.array(prepared.left_map), None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    things, ignored = [], np.zeros(here.shape, dtype=bool)
    for number in np.unique(here[here > 0]).astype(int):
        mask = (here == number) & pair.valid_left
        kind = "column" if "Column" in scene.elements[number - 1].ifc_class else "wall"
        if np.count_nonzero(mask) >= LEAST_PIXELS:
            things.append((kind, mask))
        else:
            ignored |= mask
    return Shot(pair=pair, truth=Truth(things=things, ignored=ignored))


@dataclass(kw_only=True)
class Tally:
    """What one segmenter made of all photos."""

    hits: dict[str, list[tuple[float, bool]]]
    wanted: dict[str, int]
    overlaps: list[float]
    borders_px: list[float]
    both: int = 0
    either: int = 0

    def add(self, found: list[Instance], truth: Truth) -> None:
        """Match a photo's instances to its elements, the surest first, at IoU 0.5."""
        free = set(range(len(truth.things)))
        for kind, _ in truth.things:
            self.wanted[kind] += 1
        for one in sorted(found, key=lambda i: -i.score):
            best, overlap = -1, 0.0
            for k in free:
                union = np.count_nonzero(one.mask | truth.things[k][1])
                share = np.count_nonzero(one.mask & truth.things[k][1]) / union
                if share > overlap:
                    best, overlap = k, share
            if overlap >= 0.5:
                free.discard(best)
                kind, mask = truth.things[best]
                self.hits[one.label].append((one.score, kind == one.label))
                self.overlaps.append(overlap)
                self.borders_px.append(border_px(one.mask, mask))
            elif np.count_nonzero(one.mask & truth.ignored) < 0.5 * np.count_nonzero(one.mask):
                self.hits[one.label].append((one.score, False))
        concrete = np.any([mask for _, mask in truth.things], axis=0) if truth.things else truth.ignored & False
        said = np.any([one.mask for one in found], axis=0) if found else truth.ignored & False
        self.both += int(np.count_nonzero(concrete & said & ~truth.ignored))
        self.either += int(np.count_nonzero((concrete | said) & ~truth.ignored))

    def precision(self, kind: str) -> float:
        """Return the average precision of a class at IoU 0.5, all points interpolated."""
        ranked = sorted(self.hits[kind], key=lambda hit: -hit[0])
        right = np.cumsum([hit[1] for hit in ranked]) if ranked else np.zeros(0)
        exact = right / np.arange(1, len(right) + 1)
        best_on = np.maximum.accumulate(exact[::-1])[::-1] if len(exact) else exact
        gains = np.diff(np.concatenate([[0], right]))
        return float(np.sum(best_on * gains) / max(self.wanted[kind], 1))


def border_px(one: Mask, other: Mask) -> float:
    """Return the median distance of a mask's border to the truth's, in pixels at 640 px of photo width."""
    rims = [m & ~(cv2.erode(m.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0) for m in (one, other)]
    away = cv2.distanceTransform((~rims[1]).astype(np.uint8), cv2.DIST_L2, 5)
    return float(np.median(away[rims[0]])) * 640.0 / one.shape[1]


def lines_of(name: str, tally: Tally, judged: bool) -> list[Line]:
    """Return one segmenter's figures."""
    say = [
        *((f"{name}: AP50 of {kind}s", tally.precision(kind), 0.85, tally.wanted[kind]) for kind in ("wall", "column")),
        (f"{name}: mean IoU of the matched", float(np.mean(tally.overlaps or [0.0])), 0.92, len(tally.overlaps)),
    ]
    lines = [
        line(what, f"{value:.3f}", f">= {limit}", n, value >= limit) if judged else told(what, f"{value:.3f}", n)
        for what, value, limit, n in say
    ]
    border = float(np.median(tally.borders_px or [np.inf]))
    what, n = f"{name}: border off, median, at 640 px", len(tally.borders_px)
    lines.append(
        line(what, f"{border:.2f} px", "<= 1.5 px", n, border <= 1.5) if judged else told(what, f"{border:.2f} px", n)
    )
    share = tally.both / max(tally.either, 1)
    lines.append(told(f"{name}: IoU of concrete against the rest", f"{share:.3f}", sum(tally.wanted.values())))
    return lines


def published(scratch: Path, image: NDArray[np.uint8]) -> list[Line]:
    """Run the published network through a card, and time it beside dense stereo's own time on the same photo."""
    data = Path(os.environ.get("ASBUILT_BIM_DATA", ROOT.parent / "shared" / "data"))
    network = data / "networks" / "yolov8n-seg_int8.onnx"
    if not network.exists():
        return [told("the published network (set ASBUILT_BIM_DATA)", "not here", 0)]
    (scratch / network.name).write_bytes(network.read_bytes())
    card = scratch / "card.yaml"
    card.write_text(PUBLISHED_CARD, encoding="utf-8")
    segmenter = NetworkSegmenter(loaded=load(card, "segment"))
    segmenter.sightings(image)
    seconds = []
    for _ in range(5):
        start = time.perf_counter()
        segmenter.sightings(image)
        seconds.append(time.perf_counter() - start)
    size = network.stat().st_size / 1e6
    return [told("the published network by its card: seconds a photo, MB", f"{min(seconds):.3f} s, {size:.1f} MB", 5)]


def main() -> int:
    """Run the benchmark; return the exit code."""
    import tempfile

    parser = options(__doc__.splitlines()[0])
    parser.add_argument("--card", type=Path, help="a segmenter's card, to be measured beside geometry")
    args = parser.parse_args()
    network = NetworkSegmenter(loaded=load(args.card, "segment")) if args.card else None
    names = ["geometry", *([network.name, f"geometry and {network.name}"] if network else [])]
    tallies = {
        name: Tally(hits={"wall": [], "column": []}, wanted={"wall": 0, "column": 0}, overlaps=[], borders_px=[])
        for name in names
    }
    scenes: dict[tuple[int, int], tuple[TrueScene, Rectification]] = {}
    image: NDArray[np.uint8] | None = None
    for site, seed, visit, number in shots(args.quick):
        if (seed, visit) not in scenes:
            drawn = true_scene(seed, visit)
            scenes = {(seed, visit): (drawn, rectification(rig_of(drawn)))}
        scene, prepared = scenes[(seed, visit)]
        shot = read_shot(site, scene, visit, scene.stations[number], prepared)
        image = shot.pair.left
        depth = depth_map(shot.pair, SemiGlobalMatcher())
        surfaces = read_scene(shot.pair, depth)
        tallies["geometry"].add(segment_scene(shot.pair, surfaces), shot.truth)
        if network is not None:
            tallies[names[1]].add(network.segment(shot.pair, depth), shot.truth)
            agreed = agree(shot.pair, surfaces, depth, network, GeometricOptions())
            tallies[names[2]].add(list(agreed.instances), shot.truth)
    lines = [
        row for name, tally in tallies.items() for row in lines_of(name, tally, name == names[-1] and not args.quick)
    ]
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        lines += published(Path(scratch), np.asarray(image))
    return report("Instances of walls and columns", lines, args)


if __name__ == "__main__":
    sys.exit(main())
