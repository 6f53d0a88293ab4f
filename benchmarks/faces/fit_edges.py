"""Fits what a line's evidence and its place say of an edge, over sides of twins whose true place is known.

python benchmarks/faces/fit_edges.py --write                      fit on the development seeds, write edges.json
python benchmarks/faces/fit_edges.py --seeds 1001 1002 --rows F   only measure these and keep their sides in F
python benchmarks/faces/fit_edges.py --read F G --write           fit on sides that were kept
python benchmarks/faces/fit_edges.py --quick                      two scenes, nothing written

Each side that the program looks for is one choice among all lines within reach: the three numbers are those that give
the true line the most likelihood (conditional choice, McFadden 1974). Each is told with what it buys: what the fit
without it costs in natural logarithms of likelihood, each half of the scenes judged by the numbers of the other half.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline import fit as outline
from asbuilt_bim.measure.outline.edges import (
    CREST_PX,
    DATA,
    REACH_PX,
    EdgeFit,
    EdgeModel,
    Gradients,
    Line,
    find_edge,
    profiles,
)  # fmt: skip
from asbuilt_bim.measure.station_faces import settled_faces
from asbuilt_bim.measure.workbench import workbench
from asbuilt_bim.vision.scene.geometric import segment_scene
from benchmarks.faces.border_truth import BEYOND_PX, TrueFace, true_faces
from benchmarks.faces.fitting import fitting_options, observed
from benchmarks.faces.twins import TwinPair, read_twin
from benchmarks.table import Line as Told
from benchmarks.table import quantiles, report, told, write_model

SEEDS = (*range(1001, 1014), *range(171, 183))
"""Crowded twins, and bare ones that nothing else is judged by."""
NUMBERS = ("clear", "faint", "spread_px")
START = np.log([7.0, 2.0, 0.7])
NONE = {"clear": 1e-9, "spread_px": 1e3}
"""What each number is where its part of the model says nothing; `faint` is nothing without `clear`."""
STRAIGHT_PX = 0.7
"""A true end that lies further off a line, in the median, isn't straight along this side."""
SEEN_SHARE, HAS_SHARE = 0.8, 0.8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Choice:
    """One side that was looked for: the scores of the lines beside it (T,), how far off they lie, and the true end."""

    scene: str
    scores: FloatArray
    off_px: FloatArray
    true_px: float


def choices_of(twin: TwinPair, scene: str) -> list[Choice]:
    """Measure a pair, listen to every side that is looked for in both photos, and hold it against the truth."""
    heard: list[tuple[Line, FloatArray, FloatArray]] = []

    def listening(
        both: Gradients, line: Line, disparity: FloatArray, texture_grey: float, least: float, alone: bool = False
    ) -> EdgeFit | None:
        read = None if alone else profiles(both, line, disparity, texture_grey)
        if read is not None:
            within = np.abs(read.across) <= REACH_PX
            heard.append((line, read.scores()[1][within], read.across[within]))
        return find_edge(both, line, disparity, texture_grey, least, alone)

    read = read_twin(twin)
    bench = workbench(twin.pair, read.scene, read.marks, read.sky)
    with patch.object(outline, "find_edge", listening):
        settled_faces(bench, segment_scene(twin.pair, read.scene))
    truth = true_faces(twin)
    places = [(true_place_px(line, twin.labels, truth), scores, off) for line, scores, off in heard]
    return [
        Choice(scene=scene, scores=scores, off_px=off, true_px=place)
        for place, scores, off in places
        if place is not None and abs(place) < REACH_PX - CREST_PX
    ]


def true_place_px(line: Line, labels: NDArray[Any], truth: dict[int, TrueFace]) -> float | None:
    """Return how far off a line the end of the face inside it lies; None where it isn't seen, or isn't straight."""
    along = np.linspace(0.1, 0.9, 41)[:, None]
    base = line.start + along * (line.stop - line.start)
    for back_px in (5.0, 12.0):
        inside = _labels_at(labels, base - back_px * line.normal)
        counts = np.bincount(inside, minlength=256)
        counts[0] = 0
        number = int(np.argmax(counts)) - 1
        if counts[number + 1] >= 0.6 * len(base) and number in truth:
            break
    else:
        return None
    across = np.arange(-80, 81) * 0.25
    x, y = np.moveaxis(np.round(base[:, None] + across[:, None] * line.normal).astype(np.intp) + BEYOND_PX, -1, 0)
    height, width = truth[number].extent.shape
    off = truth[number].off_end_px[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
    ends = (off[:, :-1] > 0.0) & (off[:, 1:] <= 0.0)
    nearest = np.argmin(np.where(ends, np.abs(across[:-1]), np.inf), axis=1)
    rows = np.flatnonzero(ends.any(axis=1))
    if len(rows) < HAS_SHARE * len(base):
        return None
    at = nearest[rows]
    places = 0.5 * (across[at] + off[rows, at] + across[at + 1] + off[rows, at + 1])
    slope, middle = np.polyfit(along[rows, 0] - 0.5, places, 1)
    if np.median(np.abs(places - middle - slope * (along[rows, 0] - 0.5))) > STRAIGHT_PX:
        return None
    just_inside = middle + slope * (along - 0.5) - CREST_PX
    seen = _labels_at(labels, base + just_inside * line.normal) == number + 1
    return float(middle) if seen.mean() >= SEEN_SHARE else None


def _labels_at(labels: NDArray[Any], points: FloatArray) -> NDArray[np.intp]:
    x, y = np.round(points).astype(np.intp).T
    inside = (x >= 0) & (x < labels.shape[1]) & (y >= 0) & (y < labels.shape[0])
    found = np.zeros(len(points), dtype=np.intp)
    found[inside] = labels[y[inside], x[inside]]
    return found


def model_of(logarithms: FloatArray) -> EdgeModel:
    """Return the model with these logarithms of its numbers."""
    return EdgeModel(**dict(zip(NUMBERS, np.exp(logarithms).tolist(), strict=True)))


def loss(model: EdgeModel, choices: Sequence[Choice]) -> float:
    """Return the negative log-likelihood of the true lines: those within a crest of the true end."""
    total = 0.0
    for one in choices:
        odds = model.odds(one.scores, one.off_px)
        chances = np.exp(odds - odds.max())
        near = np.abs(one.off_px - one.true_px) <= CREST_PX
        total -= float(np.log(chances[near].sum() / chances.sum() + 1e-9))
    return total


def fitted(choices: Sequence[Choice], without: str = "") -> FloatArray:
    """Return the logarithms of the numbers that explain the choices best, one of them left out where named."""
    free = np.array([name != without for name in NUMBERS])
    start = np.where(free, START, np.log(NONE.get(without, 1.0)))

    def at(values: FloatArray) -> FloatArray:
        all_of: FloatArray = start.copy()
        all_of[free] = values
        return all_of

    done = minimize(lambda v: loss(model_of(at(v)), choices), start[free], method="Nelder-Mead",
                    options={"xatol": 0.005, "fatol": 0.01, "maxfev": 2000})  # fmt: skip
    return at(done.x)


def left_out(choices: Sequence[Choice], without: str = "") -> float:
    """Return the loss of each half of the scenes by the numbers of the other half."""
    scenes = sorted({one.scene for one in choices})
    halves = [[one for one in choices if (scenes.index(one.scene) % 2) == k] for k in (0, 1)]
    return sum(loss(model_of(fitted(halves[1 - k], without)), halves[k]) for k in (0, 1))


def covariance(logarithms: FloatArray, choices: Sequence[Choice], step: float = 0.05) -> FloatArray:
    """Return the covariance (3, 3) of the numbers' logarithms, by the loss' bend."""
    count = len(NUMBERS)
    bend, steps = np.zeros((count, count)), step * np.eye(count)
    for i in range(count):
        for j in range(i + 1):
            values = [
                loss(model_of(logarithms + a * steps[i] + b * steps[j]), choices) for a in (1, -1) for b in (1, -1)
            ]
            bend[i, j] = bend[j, i] = (values[0] - values[1] - values[2] + values[3]) / (4.0 * step**2)
    return np.asarray(np.linalg.pinv(bend))


def document(choices: Sequence[Choice]) -> dict[str, object]:
    """Return all that edges.json holds."""
    found = fitted(choices)
    base = left_out(choices)
    return {
        "format": "asbuilt-bim/edges", "version": 1,
        **{name: float(f"{value:.4g}") for name, value in zip(NUMBERS, np.exp(found), strict=True)},
        "covariance_of_logarithms": [[float(f"{v:.3g}") for v in row] for row in covariance(found, choices)],
        "buys": {name: round(left_out(choices, name) - base, 2) for name in NONE},
        "fitted_on": {"scenes": sorted({one.scene for one in choices}), "sides": len(choices),
                      "log_likelihood": round(-base, 2)},
    }  # fmt: skip


def lines_of(found: dict[str, object], choices: Sequence[Choice]) -> list[Told]:
    """Tell what was fitted and what it buys, and how often another line is taken for the edge beside what was said."""
    held = EdgeModel(**{name: float(str(found[name])) for name in NUMBERS})
    n = len(choices)
    lines = [told(name, f"{found[name]}", n) for name in NUMBERS]
    lines += [told(f"{name}: buys", f"{value:+.2f}", n) for name, value in dict(found["buys"]).items()]  # type: ignore[call-overload]
    said, other = np.zeros(n), np.zeros(n, dtype=bool)
    for k, one in enumerate(choices):
        odds = held.odds(one.scores, one.off_px)
        top = int(np.argmax(odds))
        chances = np.exp(odds - odds[top])
        said[k] = float(chances[np.abs(one.off_px - one.off_px[top]) > CREST_PX].sum() / chances.sum())
        other[k] = abs(one.off_px[top] - one.true_px) > CREST_PX
    lines.append(told("another line taken for the edge, and as said", f"{other.sum()}, {said.sum():.1f}", n))
    for low, high in ((0.0, 0.02), (0.02, 0.1), (0.1, 0.3), (0.3, 1.01)):
        some = (said >= low) & (said < high)
        if some.any():
            text = f"{other[some].mean():.3f}, {said[some].mean():.3f}"
            lines.append(told(f"  where {low:g} to {min(high, 1.0):g} was said: found, said", text, int(some.sum())))
    return lines


def kept(choices: Sequence[Choice]) -> dict[str, object]:
    """Return choices as a document, to be read back by `read_back`."""
    return {
        "choices": [
            {"scene": one.scene, "scores": np.round(one.scores, 4).tolist(), "off_px": one.off_px.tolist(),
             "true_px": one.true_px}
            for one in choices
        ]
    }  # fmt: skip


def read_back(paths: Sequence[Path]) -> list[Choice]:
    """Return the choices that were kept in files."""
    return [
        Choice(
            scene=one["scene"], scores=np.array(one["scores"]), off_px=np.array(one["off_px"]), true_px=one["true_px"]
        )
        for path in paths
        for one in json.loads(path.read_text(encoding="utf-8"))["choices"]
    ]  # fmt: skip


def main() -> int:
    """Measure the scenes, fit and tell; write the model where asked to."""
    args = fitting_options(__doc__ or "").parse_args()
    choices = observed(args, SEEDS, choices_of, read_back)
    found = document(choices)
    write_model(args, DATA, found)
    summary: dict[str, object] = {"true_px": quantiles(one.true_px for one in choices)}
    return report("What a line says of an edge, fitted", lines_of(found, choices), args, summary, kept(choices))


if __name__ == "__main__":
    sys.exit(main())
