"""Fits the odds of `vision/networks/part_affinity.py`: which parts of walls and columns are one instance, with truth.

python benchmarks/networks/odds.py 20 21 24        prints the odds, feature by feature; --segment takes another card
python benchmarks/networks/odds.py --quick         on two pairs of the sample, nothing drawn

Logistic regression over all pairs of parts of these seeds' pairs, larger parts weighing more: with stereo, with the
photo's surfaces too, and without either. Both the network's map of classes and the true one are used, so that the odds
hold for a better network too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.vision.networks.bundled import bundled_card
from asbuilt_bim.vision.networks.centres import grouped
from asbuilt_bim.vision.networks.geometry_input import geometry_of_pair
from asbuilt_bim.vision.networks.instances import parts_of
from asbuilt_bim.vision.networks.kinds import LoadedNetwork, answers, load, relief_of
from asbuilt_bim.vision.networks.map_geometry import Relief
from asbuilt_bim.vision.networks.part_affinity import FEATURES, features
from asbuilt_bim.vision.networks.parts import gaps
from asbuilt_bim.vision.networks.picture import input_of
from asbuilt_bim.vision.scene.read import read_scene
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.networks.pictures import DEVELOPMENT_SEEDS, Shot, drawn_shots, sample_shots

PURE = 0.6
"""A part of which no element has this share says nothing."""
SURE = 0.98
Rows = list[tuple[NDArray[np.float64], bool, float]]  # features, one instance or two, weight


def rows_of(shot: Shot, loaded: LoadedNetwork) -> Iterator[tuple[NDArray[np.float64], bool, float]]:
    """Give every pair of parts of a photo, for each way of seeing it."""
    card, stereo = loaded.card, depth_map(shot.pair, SemiGlobalMatcher())
    picture, fit = input_of(shot.pair.left, card.input)
    geometry = geometry_of_pair(shot.pair, stereo, fit)
    outputs = answers(loaded.network, card, (picture, geometry[None]))
    raised = np.exp(outputs["logits"][0] - outputs["logits"][0].max(axis=0))
    likely = (raised / raised.sum(axis=0)).astype(np.float32)
    shape = likely.shape[1:]
    step = card.input.width_px / shape[1]
    arrows = (outputs["offsets"][0] * (card.offset_px / step)).astype(np.float32)
    owner = fit.to_input(shot.element.astype(np.int16), 0)[:: round(step), :: round(step)]
    column = np.isin(owner, [k + 1 for k, kind in enumerate(shot.kinds) if kind == "column"])
    true = tuple(np.where(own, SURE, 0.5 - 0.5 * SURE).astype(np.float32) for own in ((owner > 0) & ~column, column))
    ids = {one.label: one.id for one in card.classes}
    scene = read_scene(shot.pair, stereo)
    for seen in (relief_of(geometry, shot.pair, None, fit), relief_of(geometry, shot.pair, scene, fit), None):
        relief = seen.shrunk(shape) if seen is not None else None
        for wall, as_column in ((likely[ids["wall"]], likely[ids["column"]]), true):
            yield from _pairs(arrows, wall, as_column, relief, owner)


def _pairs(
    arrows: NDArray[np.float32],
    wall: NDArray[np.float32],
    column: NDArray[np.float32],
    relief: Relief | None,
    owner: NDArray[np.int16],
) -> Iterator[tuple[NDArray[np.float64], bool, float]]:
    number, parts = parts_of(grouped(wall + column > 0.5, arrows), arrows, wall, column, relief)
    apart = gaps(number, len(parts))
    counts = [np.bincount(owner[number == k]) for k in range(len(parts))]
    classes = [int(c.argmax()) if c.max() > PURE * c.sum() else 0 for c in counts]
    for one, other in combinations(range(len(parts)), 2):
        if classes[one] and classes[other]:
            row = features(parts[one], parts[other], apart[one, other], relief.f_px if relief is not None else 1.0)
            yield row, classes[one] == classes[other], min(parts[one].size, parts[other].size) ** 0.5


def fitted(rows: Rows, ridge: float = 1.0) -> NDArray[np.float64]:
    """Return the log-odds of each feature by Newton's method, held a little to 0."""
    x, same = np.array([row for row, _, _ in rows]), np.array([float(one) for _, one, _ in rows])
    weight = np.array([w for _, _, w in rows])
    weight /= weight.mean()
    odds = np.zeros(x.shape[1])
    for _ in range(30):
        chance = 1.0 / (1.0 + np.exp(-x @ odds))
        slope = x.T @ (weight * (same - chance)) - ridge * odds
        bend = (x.T * (weight * chance * (1.0 - chance))) @ x + ridge * np.eye(len(odds))
        odds += np.linalg.solve(bend, slope)
    return odds


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", type=int, nargs="*", default=DEVELOPMENT_SEEDS)
    parser.add_argument("--quick", action="store_true", help="on two pairs of the sample; nothing is drawn")
    parser.add_argument("--segment", type=Path, default=bundled_card("segment"), help="another segmenter's card")
    args = parser.parse_args()
    loaded = load(args.segment, "segment")
    shots = sample_shots((0,)) if args.quick else drawn_shots(tuple(args.seeds))
    rows = [row for shot in shots for row in rows_of(shot, loaded)]
    for name, odds in zip(FEATURES, fitted(rows), strict=True):
        print(f"{name:<16} {odds:6.2f}")
    print(f"{len(rows)} pairs of parts")


if __name__ == "__main__":
    main()
