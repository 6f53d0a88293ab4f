"""Fits where a face ends: one regression over the borders of twins whose truth is known, most of them crowded.

python benchmarks/faces/fit_ends.py --write                       fit on the development seeds, write ends.json
python benchmarks/faces/fit_ends.py --seeds 1001 1002 --rows F    only measure these and keep their sides in F
python benchmarks/faces/fit_ends.py --read F G --write            fit on sides that were kept
python benchmarks/faces/fit_ends.py --quick                       two scenes, nothing written

A side is an end where it lies on the concrete's true end along most of it; hidden, cut or drawn across, it is none. A
face is whole where its outline holds all of it but what narrow faces' borders may err by. Every feature is told with
what it buys: what leaving it out costs in natural logarithms of likelihood, each scene judged by weights of the others
(a little ridge keeps them finite).
Reference: Cox 1958, the regression of binary sequences; Platt 1999, for a face's probability from its sides'.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import BoolArray, FloatArray
from asbuilt_bim.measure.outline.border import (
    FEATURES,
    BorderSide,
    Surface,
    border_sides,
    flat_surface,
    shown_by,
)
from asbuilt_bim.measure.outline.edges import pixel_plane
from asbuilt_bim.measure.outline.ends import DATA, face_probability, odds_of_mean, side_probabilities
from asbuilt_bim.measure.planes.face_hypotheses import filled, pieces_of
from asbuilt_bim.measure.round.column import (
    fit_round_column,
    frame_of_column,
    lateral_surface,
    sides_of_column,
    visible_ring,
)
from asbuilt_bim.measure.station_faces import settled_faces
from asbuilt_bim.measure.workbench import Workbench, workbench
from asbuilt_bim.vision.scene.geometric import segment_scene
from benchmarks.faces.border_truth import TrueFace, is_whole, true_faces
from benchmarks.faces.fitting import fitting_options, observed
from benchmarks.faces.twins import Read, TwinPair, read_twin
from benchmarks.table import Line, quantiles, report, told, write_model

SEEDS = (*range(1001, 1014), *range(1022, 1038), *range(171, 183))
"""Crowded twins, and bare ones that nothing else is judged by."""
SITES = (20, 21, 31, *range(151, 161))
"""Sites whose stations are learned from, too: there slabs, tags, formwork and other bodies lie about a face."""
LEAST_SIDE_PX = 8.0
RIDGE = 1.0  # of standardised features
END_SHARE = 0.7  # of a side must lie on the true end
LEAST_SHARE = 0.1  # of an outline, from which it shows a body's face: where two are one outline, the end is either's
FALSE_COSTS = 10.0
"""Whole faces that may be lost for one that is falsely called whole: people are paid by it, a part is a lower bound."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Face:
    """One measured face of a true body: its scene, its sides' features (N, K), which are true ends (N,), what it holds.

    `held` is the share of the true face within its outline, `narrow_px` the true face's narrow side in the photo.
    """

    scene: str
    features: FloatArray
    ends: BoolArray
    held: float
    narrow_px: float

    @property
    def whole(self) -> bool:
        """Say whether its outline holds all of the true face, within what its borders may err."""
        return is_whole(self.held, 1.0, self.narrow_px)


def faces_of(twin: TwinPair, scene: str) -> list[Face]:
    """Measure a pair and hold every side of its outlines against the truth."""
    read = read_twin(twin)
    bench = workbench(twin.pair, read.scene, read.marks, read.sky)
    truth = true_faces(twin)
    found = [_face(bench, read, scene, truth, rings, sides, own) for rings, sides, own in _outlines(bench, read)]
    return [face for face in found if face is not None]


def _outlines(bench: Workbench, read: Read) -> list[tuple[Sequence[FloatArray], Sequence[BorderSide], Surface]]:
    """Return the outline, the sides and the surface of every face that the program finds."""
    instances = segment_scene(read.twin.pair, read.scene)
    found: list[tuple[Sequence[FloatArray], Sequence[BorderSide], Surface]] = []
    for settled in settled_faces(bench, instances)[0]:
        plane = flat_surface(pixel_plane(settled.q_px, bench.pair.camera), settled.hypothesis.piece)
        found.append((settled.outline.rings, border_sides(settled.outline), plane))
    for instance in instances:
        for piece in pieces_of(read.scene, instance):
            fit = fit_round_column(bench, piece, read.scene.mask(piece) & instance.mask)
            if fit is not None:
                ring = bench.pair.camera.project(frame_of_column(bench, fit).from_uv(visible_ring(fit)))
                found.append(([ring], sides_of_column(ring, fit), lateral_surface(bench, fit)))
    return found


def _face(
    bench: Workbench, read: Read, scene: str, truth: dict[int, TrueFace], rings: Sequence[FloatArray],
    sides: Sequence[BorderSide], own: Surface,
) -> Face | None:  # fmt: skip
    """Return a face's sides with their truth; None where half of its outline is no one body's face."""
    inside = filled(rings, read.twin.labels.shape)
    counts = np.bincount(read.twin.labels[inside], minlength=256)
    counts[0] = 0
    best = int(np.argmax(counts))
    kept = [side for side in sides if side.length_px >= LEAST_SIDE_PX]
    if best - 1 not in truth or counts[best] < 0.5 * np.count_nonzero(inside) or not kept:
        return None
    true = truth[best - 1]
    shown = [truth[n - 1] for n in np.flatnonzero(counts >= LEAST_SHARE * np.count_nonzero(inside)) if n - 1 in truth]
    ends = [
        max(float(side.steps_px @ one.at_end(side.points, side.sigma_px)) for one in shown)
        >= END_SHARE * side.length_px
        for side in kept
    ]
    features = np.array([shown_by(bench, side, own).features for side in kept])
    held = true.within_m2(inside) / true.area_m2 if true.area_m2 > 0.0 else 0.0
    return Face(scene=scene, features=features, ends=np.array(ends), held=held, narrow_px=true.narrow_px)


def regression(rows: FloatArray, answers: FloatArray, ridge: float = RIDGE) -> tuple[FloatArray, FloatArray]:
    """Return the weights (K + 1,) of raw rows (N, K), the base last, that explain answers 0..1 best; covariance."""
    middle, spread = rows.mean(axis=0), rows.std(axis=0) + 1e-6
    design = np.column_stack([(rows - middle) / spread, np.ones(len(rows))])
    weights, held = np.zeros(design.shape[1]), ridge * np.eye(design.shape[1])
    held[-1, -1] = 1e-6
    for _ in range(50):
        chance = 1.0 / (1.0 + np.exp(-design @ weights))
        bend = (design * (chance * (1.0 - chance))[:, None]).T @ design + held
        step = np.linalg.solve(bend, design.T @ (answers - chance) - held @ weights)
        weights += step
        if np.abs(step).max() < 1e-8:
            break
    raw = np.diag(np.append(1.0 / spread, 1.0))
    raw[-1, :-1] = -middle / spread
    return raw @ weights, raw @ np.linalg.inv(bend) @ raw.T


def left_out(faces: Sequence[Face], columns: Sequence[int]) -> list[FloatArray]:
    """Return each face's sides' probabilities by weights that its own scene had no part in."""
    rows = {
        scene: regression(
            np.concatenate([f.features[:, columns] for f in faces if f.scene != scene]),
            np.concatenate([f.ends for f in faces if f.scene != scene]).astype(float),
        )[0]
        for scene in {f.scene for f in faces}
    }
    return [side_probabilities(f.features[:, columns], rows[f.scene]) for f in faces]


def log_likelihood(faces: Sequence[Face], chances: Sequence[FloatArray]) -> float:
    """Return the sum of the logarithms of what the sides' answers were given."""
    given = np.concatenate([np.where(f.ends, p, 1.0 - p) for f, p in zip(faces, chances, strict=True)])
    return float(np.sum(np.log(np.maximum(given, 1e-6))))


def fitted(faces: Sequence[Face]) -> dict[str, object]:
    """Return all that ends.json holds."""
    every = list(range(len(FEATURES)))
    rows, answers = np.concatenate([f.features for f in faces]), np.concatenate([f.ends for f in faces]).astype(float)
    weights, covariance = regression(rows, answers)
    chances = left_out(faces, every)
    base = log_likelihood(faces, chances)
    buys = {
        name: base - log_likelihood(faces, left_out(faces, [c for c in every if c != k]))
        for k, name in enumerate(FEATURES)
    }
    whole = np.array([f.whole for f in faces])
    sums = np.array([odds_of_mean(p) for p in chances])
    face, face_covariance = regression(sums[:, None], whole.astype(float), ridge=1e-3)
    return {
        "format": "asbuilt-bim/ends", "version": 1, "features": list(FEATURES),
        "weights": _rounded(weights), "covariance": [_rounded(row) for row in covariance],
        "buys": {name: round(value, 2) for name, value in buys.items()},
        "face": _rounded(face), "face_covariance": [_rounded(row) for row in face_covariance],
        "limit": round(FALSE_COSTS / (FALSE_COSTS + 1.0), 4), "least_side_px": LEAST_SIDE_PX,
        "fitted_on": {
            "scenes": sorted({f.scene for f in faces}), "faces": len(faces), "whole": int(whole.sum()),
            "sides": len(answers), "ends": int(answers.sum()), "log_likelihood": round(base, 2),
        },
    }  # fmt: skip


def _rounded(values: FloatArray) -> list[float]:
    return [float(f"{value:.6g}") for value in values]


def lines_of(document: dict[str, object], faces: Sequence[Face]) -> list[Line]:
    """Tell what was fitted and what it is worth."""
    chances = left_out(faces, range(len(FEATURES)))
    face = np.array(document["face"])
    total = np.array([face_probability(p, face) for p in chances])
    whole = np.array([f.whole for f in faces])
    called = total >= float(str(document["limit"]))
    n = len(faces)
    lines = [told(f"{name}: buys", f"{value:+.2f}", n) for name, value in dict(document["buys"]).items()]  # type: ignore[call-overload]
    lines += [
        told("faces that are whole", f"{whole.sum()}", n),
        told("  called whole, of scenes left out", f"{(called & whole).sum()}", int(whole.sum())),
        told("  called whole, and not", f"{(called & ~whole).sum()}", int(called.sum())),
    ]
    for low, high in ((0.0, 0.05), (0.05, 0.25), (0.25, 0.5), (0.5, 0.75), (0.75, 0.95), (0.95, 1.01)):
        some = (total >= low) & (total < high)
        if some.any():
            lines.append(told(f"  P {low:.2f} to {min(high, 1.0):.2f}: mean P, and whole",
                              f"{total[some].mean():.2f}, {whole[some].mean():.2f}", int(some.sum())))  # fmt: skip
    return lines


def kept(faces: Sequence[Face]) -> dict[str, object]:
    """Return faces as a document, to be read back by `read_back`."""
    return {
        "features": list(FEATURES),
        "faces": [
            {
                "scene": f.scene,
                "sides": f.features.tolist(),
                "ends": f.ends.tolist(),
                "held": f.held,
                "narrow_px": f.narrow_px,
            }
            for f in faces
        ],
    }


def read_back(paths: Sequence[Path]) -> list[Face]:
    """Return the faces that were kept in files."""
    found: list[Face] = []
    for path in paths:
        held = json.loads(path.read_text(encoding="utf-8"))
        columns = [held["features"].index(name) for name in FEATURES]
        found += [
            Face(
                scene=one["scene"],
                features=np.array(one["sides"])[:, columns],
                ends=np.array(one["ends"]),
                held=one["held"],
                narrow_px=one["narrow_px"],
            )
            for one in held["faces"]
        ]
    return found


def main() -> int:
    """Measure the scenes, fit and tell; write the model where asked to."""
    args = fitting_options(__doc__ or "").parse_args()
    faces = observed(args, SEEDS, faces_of, read_back, SITES)
    document = fitted(faces)
    write_model(args, DATA, document)
    summary: dict[str, object] = {"sides_a_face": quantiles(len(f.ends) for f in faces)}
    return report("Where a face ends, fitted", lines_of(document, faces), args, summary, kept(faces))


if __name__ == "__main__":
    sys.exit(main())
