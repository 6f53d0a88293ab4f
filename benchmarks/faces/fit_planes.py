"""Fits how sure a refined plane is, by how its halves agree, over planes of twins whose truth is known.

python benchmarks/faces/fit_planes.py --write                      fit on the development seeds, write halves.json
python benchmarks/faces/fit_planes.py --seeds 1001 1002 --rows F   only measure these and keep their planes in F
python benchmarks/faces/fit_planes.py --read F G --write           fit on planes that were kept
python benchmarks/faces/fit_planes.py --quick                      two scenes, nothing written

A plane's covariance by residuals is off by a factor that nobody knows. Before its halves are compared that factor is
known to so many degrees of freedom, and each comparison adds three. The two numbers are those that give the planes'
errors the most likelihood (Student's t, as the factor's posterior says). Told with it: what the comparison buys in
natural logarithms, each half of the scenes judged by the numbers of the other half, and what stated tilts hold.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammaln

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.measure.planes import face_hypotheses as hypotheses
from asbuilt_bim.measure.planes.halves import DATA, NUMBERS, HalvesModel, splits_of
from asbuilt_bim.measure.planes.refine import PlaneFit
from asbuilt_bim.measure.station_faces import settled_faces
from asbuilt_bim.measure.workbench import workbench
from asbuilt_bim.vision.scene.geometric import segment_scene
from benchmarks.faces.fitting import fitting_options, left_out_sigmas, observed
from benchmarks.faces.twins import TwinPair, read_twin
from benchmarks.table import Line, quantiles, report, told, write_model

SEEDS = (*range(1001, 1014), *range(171, 183))
"""Crowded twins, and bare ones that nothing else is judged by."""
ITS_OWN = 0.9
"""A plane of whose pixels more than a tenth are another body's isn't this face's."""
START = np.log([5.0, 0.7])
SURE = 1e4
"""So many degrees of freedom are what halves can't change."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """One refined plane: its error of q (3,) px, its covariance by residuals (3, 3), and by what its halves differ."""

    scene: str
    error: FloatArray
    own: FloatArray
    splits: tuple[float, ...]


def planes_of(twin: TwinPair, scene: str) -> list[Plane]:
    """Measure a pair, listen to every plane that is refined inside its outline, and hold it against the truth."""
    heard: list[PlaneFit] = []

    def listening(fit: PlaneFit) -> PlaneFit:
        heard.append(fit)
        return fit

    read = read_twin(twin)
    bench = workbench(twin.pair, read.scene, read.marks, read.sky)
    with patch.object(hypotheses, "as_halves_agree", listening):
        settled_faces(bench, segment_scene(twin.pair, read.scene))
    true = {face["face"]: face for face in twin.truth["faces"] if face["kind"] == "plane"}
    camera = twin.pair.camera
    found: list[Plane] = []
    for fit in heard:
        counts = np.bincount(twin.labels[fit.compared.rows, fit.compared.columns], minlength=256)
        number = int(np.argmax(counts)) - 1
        if number not in true or counts[number + 1] < ITS_OWN * counts.sum():
            continue
        normal, origin = (camera.rectified_from_left @ np.array(true[number][key]) for key in ("normal", "origin_m"))
        q_px = camera.f_px * camera.baseline_m * normal / float(normal @ origin)
        found.append(Plane(scene=scene, error=fit.q_px - q_px, own=fit.covariance, splits=tuple(splits_of(fit))))
    return found


def log_likelihood(planes: Sequence[Plane], model: HalvesModel) -> float:
    """Return the logarithm of the likelihood of the planes' errors."""
    total = 0.0
    for plane in planes:
        covariance, freedom = plane.own * model.times(plane.splits), model.freedom + NUMBERS * len(plane.splits)
        squared = float(plane.error @ np.linalg.solve(covariance, plane.error))
        total += float(gammaln(0.5 * (freedom + NUMBERS)) - gammaln(0.5 * freedom)) - 0.5 * NUMBERS * np.log(freedom)
        total -= 0.5 * float(np.linalg.slogdet(covariance)[1])
        total -= 0.5 * (freedom + NUMBERS) * float(np.log1p(squared / freedom))
    return total


def fitted(planes: Sequence[Plane]) -> HalvesModel:
    """Return the likeliest model."""
    found = minimize(lambda logs: -log_likelihood(planes, _model(logs)), START, method="Nelder-Mead")
    return _model(found.x)


def _model(logarithms: FloatArray) -> HalvesModel:
    freedom, variance = np.exp(np.minimum(logarithms, np.log(SURE)))
    return HalvesModel(freedom=float(freedom), variance=float(variance))


def buys(planes: Sequence[Plane]) -> float:
    """Return what comparing halves buys: each half of the scenes judged by what the other half gives."""
    scenes = sorted({plane.scene for plane in planes})
    total = 0.0
    for turn in (0, 1):
        judged = [plane for plane in planes if scenes.index(plane.scene) % 2 == turn]
        others = [plane for plane in planes if scenes.index(plane.scene) % 2 != turn]
        if judged and others:
            total += log_likelihood(judged, fitted(others))
            total -= log_likelihood(_alone(judged), fitted(_alone(others)))
    return total


def _alone(planes: Sequence[Plane]) -> list[Plane]:
    return [Plane(scene=plane.scene, error=plane.error, own=plane.own, splits=()) for plane in planes]


def document_of(planes: Sequence[Plane], model: HalvesModel) -> dict[str, object]:
    """Return all that halves.json holds; the numbers' sigmas by leaving out each scene in turn."""
    scenes = sorted({plane.scene for plane in planes})
    others = (
        [fitted([plane for plane in planes if plane.scene != scene]) for scene in scenes] if len(scenes) > 2 else []
    )
    logs = np.log([[one.freedom, one.variance] for one in others] or [[1.0, 1.0]])
    sigmas = left_out_sigmas(logs)
    return {
        "format": "asbuilt-bim/halves", "version": 1,
        "freedom": round(model.freedom, 2), "variance": round(model.variance, 3),
        "sigmas_of_logarithms": [float(f"{sigma:.3g}") for sigma in sigmas], "buys": round(buys(planes), 2),
        "fitted_on": {
            "scenes": scenes, "planes": len(planes), "log_likelihood": round(log_likelihood(planes, model), 2),
        },
    }  # fmt: skip


def lines_of(planes: Sequence[Plane], model: HalvesModel, document: dict[str, object]) -> list[Line]:
    """Tell the numbers, what they buy, and what the stated tilts hold with and without them."""
    n = len(planes)
    lines = [
        told("a covariance by residuals is known to", f"{model.freedom:.1f} degrees of freedom", n),
        told("  times, before halves are compared", f"{model.variance:.2f}", n),
        told("comparing halves: buys", f"{document['buys']:+}", n),
    ]
    for name, times in (
        ("by residuals", np.ones(n)),
        ("as halves agree", np.array([model.times(plane.splits) for plane in planes])),
    ):
        tilts = np.array([plane.error[0] / np.sqrt(plane.own[0, 0]) for plane in planes]) / np.sqrt(times)
        held = ", ".join(f"{np.mean(np.abs(tilts) < limit):.0%}" for limit in (1.0, 2.0))
        lines.append(told(f"tilts within 1, 2 sigma {name}", held, n))
    return lines


def kept(planes: Sequence[Plane]) -> dict[str, object]:
    """Return planes as a document, to be read back by `read_back`."""
    return {
        "planes": [
            {"scene": p.scene, "error": p.error.tolist(), "own": p.own.tolist(), "splits": list(p.splits)}
            for p in planes
        ]
    }  # fmt: skip


def read_back(paths: Sequence[Path]) -> list[Plane]:
    """Return the planes that were kept in files."""
    held = [one for path in paths for one in json.loads(path.read_text(encoding="utf-8"))["planes"]]
    return [
        Plane(scene=one["scene"], error=np.array(one["error"]), own=np.array(one["own"]), splits=tuple(one["splits"]))
        for one in held
    ]


def main() -> int:
    """Measure the scenes, fit and tell; write the model where asked to."""
    args = fitting_options(__doc__ or "").parse_args()
    planes = observed(args, SEEDS, planes_of, read_back)
    model = fitted(planes)
    document = document_of(planes, model)
    write_model(args, DATA, document)
    summary: dict[str, object] = {"splits": quantiles(split for plane in planes for split in plane.splits)}
    return report("How sure a plane is, fitted", lines_of(planes, model, document), args, summary, kept(planes))


if __name__ == "__main__":
    sys.exit(main())
