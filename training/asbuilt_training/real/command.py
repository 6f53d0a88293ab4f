"""Hold the networks against our labels of real photographs, and write a page that shows where they fail."""

from __future__ import annotations

import argparse
from pathlib import Path

from asbuilt_bim.errors import NetworkError
from asbuilt_bim.vision.networks.bundled import BUNDLED

from asbuilt_training.real.figures import DATA, measure
from asbuilt_training.real.page import write_page
from asbuilt_training.real.score import by_view, mean_iou


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--out", type=Path, required=True, help="folder of the page; its pictures aren't ours to share")
    parser.add_argument("--segment", default=BUNDLED, help="card of the segmenter, or bundled")
    parser.add_argument("--depth", default=BUNDLED, help="card of the depth network, or bundled")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the real data (ASBUILT_BIM_DATA)")


def run(given: argparse.Namespace) -> int:
    """Measure, write the page, say the two means."""
    try:
        figures = measure(given.segment, given.depth, given.data)
    except NetworkError as problem:
        print(problem)
        return 1
    if not figures.scored:
        print(f"no labelled photograph in {given.data}: set ASBUILT_BIM_DATA or --data")
        return 1
    for distance in ("far", "ground"):
        mean, n = mean_iou(by_view(figures.scored, distance))
        print(f"{distance}: mean IoU {mean:.3f} over {n} views")
    print(write_page(figures, given.out))
    return 0
