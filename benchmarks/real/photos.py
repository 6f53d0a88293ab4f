"""Walls and columns in real photographs that nobody trained on, and relative depth against a laser.

python benchmarks/real/photos.py --check --json figures.json [--segment CARD] [--depth CARD] [--page FOLDER]
python benchmarks/real/photos.py --quick                      one photo a view, no stereo

The labels are the project's own (training/real/labels); the photographs are not part of the project: ASBUILT_BIM_DATA
names their folder (default ../shared/data). What is absent is named and not judged. IoU is of wall and column together
against the rest, the mean over a view's frames, then over the views. Judged is cast concrete from 3 to 20 m, where the
program measures. Far views and columns of dressed stone are told apart from it: nobody measures them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_training.real.figures import DepthFigure, Figures, measure
from asbuilt_training.real.labels import COLUMN, STONE, WALL
from asbuilt_training.real.page import write_page
from asbuilt_training.real.score import Counts, Scored, by_view, mean_iou, view_iou

from asbuilt_bim.vision.networks.bundled import BUNDLED
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told

NEAR_LIMIT = 0.55
NEAR_VIEWS = 1
"""All the views of cast concrete at 3 to 20 m that the data folder has; a retaining wall and a pier in one photo."""


SORTS = {
    "near": "cast concrete at 3 to 20 m, mean IoU",
    "far": "concrete in far views, mean IoU (nobody measures there)",
    "stone": "columns of dressed stone, mean IoU (no concrete: none is asked for)",
    "none": "no concrete in the photo",
}


def concrete_lines(figures: Figures) -> list[Line]:
    """Judge cast concrete from 3 to 20 m; tell far views, stone columns, and what needs no network."""
    lines: list[Line] = []
    for sort, words in SORTS.items():
        views = _views(figures.scored, sort)
        mean, n = mean_iou(views)
        if sort == "near":
            lines.append(line(words, f"{mean:.3f}", f">= {NEAR_LIMIT}", n, mean >= NEAR_LIMIT, NEAR_VIEWS))
        elif n:
            lines.append(told(words, f"{mean:.3f}", n))
        lines += [_view_line(view, views[view]) for view in views]
        for name, scored in figures.beside.items():
            lines += [told(f"  {name}", f"{mean_iou(_views(scored, sort))[0]:.3f}", n)] if n else []
    return lines


def _views(scored: Sequence[Scored], sort: str) -> dict[str, list[Counts]]:
    return by_view([one for one in scored if sort_of(one) == sort], "far" if sort == "far" else "ground")


def sort_of(one: Scored) -> str:
    """Return what a photo shows: all `far`, columns of dressed `stone` alone, `none`, or cast concrete `near`."""
    if one.photo.distance == "far":
        return "far"
    kinds = set(np.unique(one.kinds).tolist()) & {WALL, COLUMN, STONE}
    return "none" if not kinds else "stone" if kinds == {STONE} else "near"


def _view_line(view: str, counts: list) -> Line:  # type: ignore[type-arg]
    value = view_iou(counts)
    if np.isfinite(value):
        found, right = (np.mean([getattr(one, key) for one in counts]) for key in ("recall", "precision"))
        return told(f"  {view}: IoU; found, right", f"{value:.2f}; {found:.0%}, {right:.0%}", len(counts))
    alarms = float(np.mean([one.alarms for one in counts]))
    return told(f"  {view}: no concrete in it; called concrete", f"{alarms:.1%} of it", len(counts))


def stereo_lines(figures: Figures) -> list[Line]:
    """Tell what stereo takes away from what is called concrete where there is none."""
    return [
        told(f"{one.name}: called concrete, photo alone / with stereo (is none)",
             f"{one.alone.alarms:.1%} / {one.with_stereo.alarms:.1%}", 1)
        for one in figures.stereo
    ]  # fmt: skip


def depth_lines(figure: DepthFigure) -> list[Line]:
    """Judge a depth network by whether it says more than a guess that doesn't look."""
    best = min(guess.abs_rel for guess in figure.guesses.values())
    e, name = figure.errors, f"depth, {figure.name}, against {figure.truth_is}"
    lines = [
        line(f"{name}: AbsRel", f"{e.abs_rel:.3f}", f"< {best:.3f}", e.pixels, e.abs_rel < best),
        told("  within a factor of 1.25", f"{e.within:.1%}", e.pixels),
    ]
    for guess, errors in figure.guesses.items():
        lines.append(told(f"  {guess}: AbsRel, within", f"{errors.abs_rel:.3f}, {errors.within:.1%}", errors.pixels))
    return lines


def main() -> int:
    """Measure what is there and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--segment", default=BUNDLED, help="card of the segmenter, or bundled")
    parser.add_argument("--depth", default=BUNDLED, help="card of the depth network, or bundled")
    parser.add_argument("--page", type=Path, help="write a page with pictures into this folder, outside the project")
    args = parser.parse_args()
    if absent(DATA / "photos"):
        return 0
    figures = measure(args.segment, args.depth, quick=args.quick)
    if not figures.scored:
        print(f"none of the {len(figures.absent)} labelled photographs is in the data folder; nothing was judged")
        return 0
    lines = [*concrete_lines(figures), *stereo_lines(figures)]
    lines += [one for figure in figures.depth for one in depth_lines(figure)]
    lines += [told(f"absent: {file}", "", 0) for file in figures.absent]
    if args.page:
        print(write_page(figures, args.page))
    return report(f"Real photographs, by {figures.network}", lines, args)


if __name__ == "__main__":
    sys.exit(main())
