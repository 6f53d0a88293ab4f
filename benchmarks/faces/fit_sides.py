"""Fits what a side errs by beyond its own fit, over sides of twins whose true place is known.

python benchmarks/faces/fit_sides.py --write                      fit on the development seeds, write sides.json
python benchmarks/faces/fit_sides.py --seeds 1001 1002 --rows F   only measure these and keep their sides in F
python benchmarks/faces/fit_sides.py --read F G --write           fit on sides that were kept
python benchmarks/faces/fit_sides.py --quick                      two scenes, nothing written

A fit's scatter says how sure a line is; blur, tone and shade move all of it. The numbers in pixels are those that give
the errors the most likelihood, an edge in fifty taken for another line. Each is told with what it buys: what the fit
without it costs in natural logarithms of likelihood, each half of the scenes by the other half's numbers. The package
has the first two. Where two planes meet needs none, and sides that one photo alone shows are too few to tell.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.optimize import minimize

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.outline import fit as outline
from asbuilt_bim.measure.outline.contour import Side
from asbuilt_bim.measure.outline.edges import Line
from asbuilt_bim.measure.outline.fit import FaceEdge
from asbuilt_bim.measure.outline.side_sigmas import DATA, SideSigmas, side_sigmas
from asbuilt_bim.measure.outline.straight import Surroundings
from asbuilt_bim.measure.planes.crossing import Crossing
from asbuilt_bim.measure.station_faces import settled_faces
from asbuilt_bim.measure.workbench import workbench
from asbuilt_bim.vision.scene.geometric import segment_scene
from benchmarks.faces.fitting import fitting_options, left_out_sigmas, observed
from benchmarks.faces.twins import TwinPair, read_twin
from benchmarks.table import Line as Told
from benchmarks.table import quantiles, report, told, write_model

SEEDS = (*range(1001, 1014), *range(171, 183))
"""Crowded twins, and bare ones that nothing else is judged by."""
NUMBERS = ("edge", "level", "crossing", "alone")
KEPT = 2
START = np.log([0.1, 0.1, 0.1, 0.3])
NOTHING_PX = 1e-3
"""What each number is where its part of the model says nothing."""
PARALLEL, MOST_OFF_PX, LEAST_PX = 0.998, 3.0, 8.0
"""A true edge runs along a side, and no further off than another line would be."""
OTHER_SHARE, OTHER_PX = 0.02, 1.5
"""So many sides lie on another line, and that far off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Error:
    """How far off the truth a line lies, what its own fit leaves open, and what else it has: numbers of `NUMBERS`."""

    scene: str
    off_px: float
    own_px: float
    parts: tuple[str, ...]


def errors_of(twin: TwinPair, scene: str) -> list[Error]:
    """Measure a pair and hold each line that the photos or two planes give for a side against the true edge."""
    crossings: dict[int, tuple[FaceEdge, Crossing | None, Line | None, float]] = {}
    settle, between = outline._settle, outline.between

    def listening(side: Side, label: int, around: Surroundings) -> FaceEdge | None:
        met: list[tuple[Crossing, Line, float]] = []

        def meeting(planes: Crossing, shown: Line, shown_px: float) -> Crossing:
            met.append((planes, shown, shown_px))
            return between(planes, shown, shown_px)

        with patch.object(outline, "between", meeting):
            edge = settle(side, label, around)
        if edge is not None and edge.source in ("photo", "left"):
            crossing, shown, shown_px = met[0] if met else (None, edge.line, edge.sigma_px)
            crossings[id(edge)] = (edge, crossing, shown, shown_px)
        elif edge is not None and edge.source == "planes":
            crossings[id(edge)] = (edge, Crossing(line=edge.line, sigma_px=edge.sigma_px), None, 0.0)
        return edge

    read = read_twin(twin)
    bench = workbench(twin.pair, read.scene, read.marks, read.sky)
    with patch.object(outline, "_settle", listening):
        settled, _ = settled_faces(bench, segment_scene(twin.pair, read.scene))
    now = side_sigmas()
    true = {face["face"]: face for face in twin.truth["faces"] if face["kind"] == "plane"}
    found: list[Error] = []
    for face in settled:
        counts = np.bincount(twin.labels[face.hypothesis.mask], minlength=256)
        counts[0] = 0
        number = int(np.argmax(counts)) - 1
        if number not in true:
            continue
        ends = true_edges(twin, true[number])
        for edge, crossing, shown, shown_px in (crossings[id(e)] for e in face.outline.edges if id(e) in crossings):
            if shown is not None and (off := off_px(shown, ends)) is not None:
                parts = ["edge", *(["level"] if edge.course == "level" and edge.source == "photo" else []),
                         *(["alone"] if edge.source == "left" else [])]  # fmt: skip
                found.append(_error(scene, off, shown_px, parts, now))
            if crossing is not None and (off := off_px(crossing.line, ends)) is not None:
                found.append(_error(scene, off, crossing.sigma_px, ["crossing"], now))
    return found


def _error(scene: str, off: float, sigma_px: float, parts: Sequence[str], now: SideSigmas) -> Error:
    """Return an error, what is added now taken off its sigma."""
    px = {"edge": now.edge, "level": now.level, "crossing": 0.0, "alone": outline.ALONE_SIGMA_PX}
    added = sum(px[part] ** 2 for part in parts)
    return Error(scene=scene, off_px=off, own_px=float(np.sqrt(max(sigma_px**2 - added, 0.0))), parts=tuple(parts))


def true_edges(twin: TwinPair, face: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Return both ends (N, 2) px of all edges of a true face's triangles, as the rectified left photo shows them."""
    triangles = np.array(face["triangles_m"])
    starts, stops = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
    return twin.pair.camera.project(starts), twin.pair.camera.project(stops)


def off_px(line: Line, ends: tuple[FloatArray, FloatArray]) -> float | None:
    """Return how far off a line's middle the true edge lies that runs along it; None where none does."""
    starts, stops = ends
    lengths = np.linalg.norm(stops - starts, axis=1)
    along = (stops - starts) / np.maximum(lengths, 1e-9)[:, None]
    middle = 0.5 * (line.start + line.stop)
    at = np.sum((middle - starts) * along, axis=1)
    off = (starts + at[:, None] * along - middle) @ line.normal
    fits = (lengths > LEAST_PX) & (np.abs(along @ line.direction) > PARALLEL) & (at > 0.0) & (at < lengths)
    fits &= np.abs(off) < MOST_OFF_PX
    return float(off[fits][np.argmin(np.abs(off[fits]))]) if fits.any() else None


def log_likelihood(errors: Sequence[Error], numbers_px: FloatArray) -> float:
    """Return the logarithm of the likelihood of the errors."""
    squares = dict(zip(NUMBERS, np.square(numbers_px).tolist(), strict=True))
    variance = np.array([one.own_px**2 + sum(squares[part] for part in one.parts) for one in errors])
    off = np.square([one.off_px for one in errors])
    other = variance + OTHER_PX**2
    each = (1.0 - OTHER_SHARE) * np.exp(-0.5 * off / variance) / np.sqrt(variance)
    each += OTHER_SHARE * np.exp(-0.5 * off / other) / np.sqrt(other)
    return float(np.sum(np.log(each)))


def fitted(errors: Sequence[Error], without: str = "") -> FloatArray:
    """Return the likeliest numbers (4,) in px, one of them nothing where named."""
    free = np.array([name != without for name in NUMBERS])
    start = np.where(free, START, np.log(NOTHING_PX))

    def at(values: FloatArray) -> FloatArray:
        all_of: FloatArray = start.copy()
        all_of[free] = np.maximum(values, np.log(NOTHING_PX))
        return np.exp(all_of)

    done = minimize(lambda v: -log_likelihood(errors, at(v)), start[free], method="Nelder-Mead",
                    options={"xatol": 0.003, "fatol": 0.01, "maxfev": 4000})  # fmt: skip
    return at(done.x)


def left_out(errors: Sequence[Error], without: str = "") -> float:
    """Return the log-likelihood of each half of the scenes by the numbers of the other half."""
    scenes = sorted({one.scene for one in errors})
    halves = [[one for one in errors if (scenes.index(one.scene) % 2) == k] for k in (0, 1)]
    return sum(log_likelihood(halves[k], fitted(halves[1 - k], without)) for k in (0, 1) if halves[1 - k])


def document_of(errors: Sequence[Error], numbers_px: FloatArray) -> dict[str, object]:
    """Return all that sides.json holds; the numbers' sigmas by leaving out each scene in turn."""
    scenes = sorted({one.scene for one in errors})
    others = [fitted([one for one in errors if one.scene != scene]) for scene in scenes] if len(scenes) > 2 else []
    sigmas = left_out_sigmas(np.array(others or [numbers_px]))
    base = left_out(errors)
    return {
        "format": "asbuilt-bim/sides", "version": 1,
        **{f"{name}_px": float(f"{value:.3g}") for name, value in zip(NUMBERS[:KEPT], numbers_px, strict=False)},
        "sigmas_px": [float(f"{sigma:.2g}") for sigma in sigmas[:KEPT]],
        "buys": {name: round(base - left_out(errors, name), 2) for name in NUMBERS},
        "fitted_on": {"scenes": scenes, "lines": len(errors), "log_likelihood": round(base, 2)},
    }  # fmt: skip


def lines_of(errors: Sequence[Error], document: dict[str, Any], numbers: FloatArray) -> list[Told]:
    """Tell the numbers, what they buy, and what the lines' sigmas hold with them."""
    squares = dict(zip(NUMBERS, np.square(numbers).tolist(), strict=True))
    lines: list[Told] = []
    for name, value in zip(NUMBERS, numbers, strict=True):
        own = [one for one in errors if name in one.parts]
        lines.append(told(f"{name}: {value:.3f} px, buys", f"{document['buys'][name]:+.1f}", len(own)))
        pulls = np.array([one.off_px / np.sqrt(one.own_px**2 + sum(squares[p] for p in one.parts)) for one in own])
        if len(pulls):
            held = ", ".join(f"{np.mean(np.abs(pulls) < limit):.0%}" for limit in (1.0, 2.0))
            lines.append(told("  within 1, 2 sigma; mean error", f"{held}; {np.mean([o.off_px for o in own]):+.3f} px",
                              len(own)))  # fmt: skip
    return lines


def read_back(paths: Sequence[Path]) -> list[Error]:
    """Return the lines that were kept in files."""
    held = [one for path in paths for one in json.loads(path.read_text(encoding="utf-8"))["lines"]]
    return [Error(**{**one, "parts": tuple(one["parts"])}) for one in held]


def main() -> int:
    """Measure the scenes, fit and tell; write the model where asked to."""
    args = fitting_options(__doc__ or "").parse_args()
    errors = observed(args, SEEDS, errors_of, read_back)
    numbers = fitted(errors)
    document = document_of(errors, numbers)
    write_model(args, DATA, document)
    summary: dict[str, object] = {"off_px": quantiles(one.off_px for one in errors)}
    kept: dict[str, object] = {"lines": [asdict(one) for one in errors]}
    return report("What a side errs by, fitted", lines_of(errors, document, numbers), args, summary, kept)


if __name__ == "__main__":
    sys.exit(main())
