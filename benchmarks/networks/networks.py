"""Masks and relative depth of the shipped networks against the truth, and what they cost beside a published one.

python benchmarks/networks/networks.py --check --json figures.json  200 pairs of unseen seeds, 18 of another renderer
python benchmarks/networks/networks.py --quick                      two pairs of the sample, not judged

--segment and --depth take other cards. What is counted how: figures.py.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.rectify import RectifiedPair
from asbuilt_bim.vision.networks.bundled import bundled_card
from asbuilt_bim.vision.networks.kinds import LoadedNetwork, NetworkDepth, NetworkSegmenter, answers, load
from asbuilt_bim.vision.stereo.matching import SemiGlobalMatcher, depth_map
from benchmarks.networks.figures import KINDS, DepthTally, Tally
from benchmarks.networks.judge import FILLED, NETWORK, QUICK_PARTS, UNSEEN, Cards, all_parts, judge
from benchmarks.networks.pictures import REPORTING_SEEDS, sample_shots
from benchmarks.sites import DATA
from benchmarks.table import Line, line, options, report, told

LEAST_PAIRS = 200
MOST_TIMES = 1.5
MOST_MB = 20.0
PUBLISHED_CARD = """\
format: asbuilt-bim/network
version: 1
name: yolov8n-seg
file: yolov8n-seg_int8.onnx
layout: yolo-seg
input: {width_px: 320, height_px: 320, resize: letterbox, pad_value: 114}
classes: [{id: 72, name: refrigerator, label: wall}, {id: 0, name: person, label: other}]
"""


def mask_lines(where: str, name: str, tally: Tally, pairs: int, judged: bool) -> list[Line]:
    """Return one way's figures."""
    rows: list[tuple[str, str, str, bool]] = [
        (f"AP50 of {kind}s ({tally.wanted[kind]})", f"{tally.precision(kind):.3f}", ">= 0.85",
         tally.precision(kind) >= 0.85)
        for kind in KINDS
    ]  # fmt: skip
    rows.append(("mean IoU of the matched", f"{tally.overlap:.3f}", ">= 0.92", tally.overlap >= 0.92))
    rows.append(("border off, median, at 640 px", f"{tally.border:.2f} px", "<= 1.5 px", tally.border <= 1.5))
    lines = [
        line(f"{where}, {name}: {what}", figure, limit, pairs, holds, LEAST_PAIRS)
        if judged
        else told(f"{where}, {name}: {what}", figure, pairs)
        for what, figure, limit, holds in rows
    ]
    return [*lines, told(f"{where}, {name}: IoU of concrete against the rest", f"{tally.concrete:.3f}", pairs)]


def depth_lines(where: str, name: str, tally: DepthTally, judged: bool) -> list[Line]:
    """Return what one way to depth came to."""
    error, close, n = float(np.mean(tally.errors)), float(np.mean(tally.close)), len(tally.errors)
    rows = [
        (f"{where}, {name}: AbsRel after scale and shift", f"{error:.3f}", "<= 0.08", error <= 0.08),
        (f"{where}, {name}: ratio under 1.25", f"{close:.3f}", ">= 0.95", close >= 0.95),
    ]
    return [
        line(what, figure, limit, n, holds, LEAST_PAIRS) if judged else told(what, figure, n)
        for what, figure, limit, holds in rows
    ]


def cost_lines(
    pair: RectifiedPair, loaded: LoadedNetwork | None, depths: NetworkDepth | None, scratch: Path
) -> list[Line]:
    """Compare the processor time of a photo with that of the published network, all in turn, the least of ten."""
    source = DATA / "networks" / "yolov8n-seg_int8.onnx"
    stereo = depth_map(pair, SemiGlobalMatcher())
    works: dict[str, Callable[[], object]] = {}
    files: list[Path] = []
    if loaded is not None and depths is not None:
        segmenter = NetworkSegmenter(loaded=loaded)
        works["ours, all"] = lambda: (segmenter.segment(pair, stereo), depths.estimate(pair.left))
        works["ours, networks only"] = lambda: (bare(loaded), bare(depths.loaded))
        files = [loaded.network.path, depths.loaded.network.path]
    if source.exists():
        (scratch / source.name).write_bytes(source.read_bytes())
        (scratch / "card.yaml").write_text(PUBLISHED_CARD, encoding="utf-8")
        published = NetworkSegmenter(loaded=load(scratch / "card.yaml", "segment"))
        works["published, all"] = lambda: published.sightings(pair.left)
        works["published, network only"] = lambda: bare(published.loaded)
    spent = least_seconds(works)
    lines = [
        told(f"{name}: processor time of a photo, one thread", f"{1e3 * s:.0f} ms", 10) for name, s in spent.items()
    ]
    for ours, theirs, judged in (("all", "all", True), ("networks only", "network only", False)):
        if {f"ours, {ours}", f"published, {theirs}"} <= spent.keys():
            times = spent[f"ours, {ours}"] / spent[f"published, {theirs}"]
            what, figure = f"both networks, {ours}: times the published one", f"{times:.2f}"
            holds = times <= MOST_TIMES
            lines.append(line(what, figure, f"<= {MOST_TIMES}", 10, holds, 10) if judged else told(what, figure, 10))
    for path in files:
        size = path.stat().st_size / 1e6
        lines.append(line(f"{path.name}: MB", f"{size:.1f}", f"< {MOST_MB:.0f}", 1, size < MOST_MB, 1))
    return lines


def bare(loaded: LoadedNetwork) -> object:
    """Run a network on nothing in particular."""
    card = loaded.card.input
    shapes = [3, 5] if loaded.card.geometry is not None else [3]
    empty = tuple(np.zeros((1, channels, card.height_px, card.width_px), np.float32) for channels in shapes)
    return answers(loaded.network, loaded.card, empty)


def least_seconds(works: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the least processor time of ten rounds in which all have their turn."""
    least = dict.fromkeys(works, float("inf"))
    for _, (name, work) in itertools.product(range(11), works.items()):
        start = time.process_time()
        work()
        least[name] = min(least[name], time.process_time() - start)
    return least


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = options(__doc__.splitlines()[0])
    parser.add_argument("--segment", type=Path, help="another segmenter's card")
    parser.add_argument("--depth", type=Path, help="another relative-depth network's card")
    parser.add_argument("--geometry", action="store_true", help="without any network")
    parser.add_argument("--seeds", type=int, nargs="+", default=REPORTING_SEEDS, help="of the pairs to look at")
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    chosen = Cards(
        segment=None if args.geometry else args.segment or bundled_card("segment"),
        depth=None if args.geometry else args.depth or bundled_card("depth"),
    )
    parts = QUICK_PARTS if args.quick else all_parts(tuple(args.seeds))
    lines: list[Line] = []
    for where, judged in judge(parts, chosen, args.workers).items():
        counts = where == UNSEEN and tuple(args.seeds) == REPORTING_SEEDS
        for name, tally in judged.masks.items():
            lines += mask_lines(where, name, tally, judged.pairs, counts and name == NETWORK)
        for name, errors in judged.depths.items():
            lines += depth_lines(where, name, errors, counts and name != FILLED)
    (shot,) = sample_shots((0,), (0,))
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        lines += cost_lines(shot.pair, *chosen.opened(), Path(scratch))
    return report("Walls, columns and relative depth by the shipped networks", lines, args)


if __name__ == "__main__":
    sys.exit(main())
