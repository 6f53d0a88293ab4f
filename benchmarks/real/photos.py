"""Walls and columns in real photographs that nobody trained on, and relative depth against a laser.

python benchmarks/real/photos.py --check --json figures.json [--segment CARD] [--depth CARD] [--page FOLDER]
python benchmarks/real/photos.py --quick                      one photo a view, no stereo

The labels are the project's own (training/real/labels); the photographs are not part of the project: ASBUILT_BIM_DATA
names their folder (default ../shared/data). What is absent is named and not judged. IoU is of wall and column together
against the rest, the mean over a view's frames, then over the views.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_training.real.figures import DepthFigure, Figures, measure
from asbuilt_training.real.page import write_page
from asbuilt_training.real.score import by_view, mean_iou, view_iou

from asbuilt_bim.vision.networks.bundled import BUNDLED
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, report, told

FAR_LIMIT = 0.55
FAR_VIEWS = 7
"""All the far views that the data folder has."""


def concrete_lines(figures: Figures) -> list[Line]:
    """Judge the far views' mean; tell the views, the ground-level ones, and what needs no network."""
    far, ground = (by_view(figures.scored, distance) for distance in ("far", "ground"))
    mean, n = mean_iou(far)
    lines = [
        line("concrete in far views, mean IoU", f"{mean:.3f}", f">= {FAR_LIMIT}", n, mean >= FAR_LIMIT, FAR_VIEWS),
        *(_view_line(view, far[view]) for view in far),
    ]
    for name, scored in figures.beside.items():
        lines.append(told(f"  {name}", f"{mean_iou(by_view(scored, 'far'))[0]:.3f}", n))
    mean, n = mean_iou(ground)
    lines.append(told("concrete at ground level, mean IoU (too few to judge)", f"{mean:.3f}", n))
    lines += [_view_line(view, ground[view]) for view in ground]
    for name, scored in figures.beside.items():
        lines.append(told(f"  {name}", f"{mean_iou(by_view(scored, 'ground'))[0]:.3f}", n))
    return lines


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
