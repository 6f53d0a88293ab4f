"""Fits what a station's evidence is worth: one regression over the samples of sites whose every sample is known.

python benchmarks/site/fit_evidence.py --seeds 20 31 --write   fit on the sample and these sites, write evidence.json
python benchmarks/site/fit_evidence.py --seeds 20 31           only tell what each feature buys, and how true odds are
python benchmarks/site/fit_evidence.py --quick                 the sample's first visit, nothing written
python benchmarks/site/fit_evidence.py --with FILE             with a new kind of evidence, a Python file that enters
                                                               itself in FEATURES: see benchmarks/site/aslant.py

A ray from the station to a sample tells whether its place is seen: built, open, or neither, where something stands
before it. Of a site's samples every third along and up counts. Each element weighs the same, large or small: its
samples err alike. For the same reason the covariance is that of whole elements, not of samples. Every feature is told
with what it buys: the natural logarithms of likelihood that leaving it out costs an element, each site judged by the
weights of the others. The limit is the least at which so few of the decided samples are wrong, judged likewise.
Reference: Cox 1958, the regression of binary sequences; Liang and Zeger 1986, the covariance of what errs alike.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_synthetic.in_view import points_in_view
from asbuilt_synthetic.model import Scene, Station
from asbuilt_synthetic.scene import scene
from asbuilt_synthetic.surface import Samples
from asbuilt_synthetic.tracer import Tracer

from asbuilt_bim.bim.cells import cell_samples
from asbuilt_bim.flow import pipeline
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, IntArray
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.states import votes
from asbuilt_bim.progress.states.features import FEATURES, Shown, features_of
from asbuilt_bim.progress.states.likelihood import DATA, Model, chances, odds_of
from asbuilt_bim.progress.states.sample_grid import share_around
from benchmarks.site.rules import Site, fitting_options, fitting_sites
from benchmarks.table import Line, report, told, write_model

RIDGE = 1.0  # of standardised features, beside hundreds of elements
EVERY = 3  # samples along and up: those between them err alike
MOST_WRONG = 0.002  # of the decided samples: an element has two thousand, and its bounds hold for all
LIMITS = np.arange(0.5, 6.0, 0.1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Samples that stations face, one row a station and sample: features (N, K), what is seen (N,), its weight (N,).

    `seen` is 0 neither, 1 built, 2 open; `built` says what is true, seen or not. `sample` numbers a visit's samples,
    and `element` its elements, so that stations can be put together. Weights of one station and element sum up to 1.
    """

    site: str
    features: FloatArray
    seen: IntArray
    built: BoolArray
    weight: FloatArray
    sample: IntArray
    element: IntArray


def rows_of(site: Site, seed: int) -> Rows:
    """Judge a site, note what each station shows of each element, and lay the truth beside it."""
    parts: list[tuple[NDArray[Any], ...]] = []
    first, number = 0, 0
    history = EMPTY_HISTORY
    for visit, (measured, rejections, survey, design, day, of, placing) in enumerate(site.asked):
        with noting() as shown:
            judged = pipeline.monitor(measured, rejections, survey, design, history, day, of, **placing)
        history = remember(history, judged)
        truth = scene(seed, visit)
        fractions = {one.global_id: one.built_height_fraction for one in truth.elements}
        for element in design.elements:
            samples = cell_samples(element, of.progress.spacing_m)
            foot_m = samples.points_m[:, 2] - element.vertices_m[:, 2].min()
            built = foot_m <= fractions[element.global_id] * element.height_m
            for seen in (one for one in shown if one.samples is samples):
                parts.append(_of_station(seen, built, _in_view(truth, seen), first, number))
            first, number = first + len(built), number + 1
    features, answers, of_built, weight, sample, element_number = (
        np.concatenate(one) for one in zip(*parts, strict=True)
    )
    return Rows(
        site=site.name, features=features, seen=answers, built=of_built, weight=weight, sample=sample,
        element=element_number,
    )  # fmt: skip


@contextmanager
def noting() -> Iterator[list[Shown]]:
    """Note for a while all that stations show."""
    noted: list[Shown] = []
    kept = votes.log_odds

    def odds(seen: Shown) -> FloatArray:
        noted.append(seen)
        return kept(seen)

    votes.log_odds = odds
    try:
        yield noted
    finally:
        votes.log_odds = kept


def _in_view(truth: Scene, seen: Shown) -> BoolArray:
    """Say of which samples (N,) a station sees most of what lies round them."""
    station = next(one for one in truth.stations if one.name == seen.station)
    tracer = _tracer(truth, station)
    of, count = seen.samples, len(seen.samples.face)
    points = Samples(
        points_m=of.points_m, normals=of.normals, area_m2=of.area_m2, side=of.face, cell=of.cell,
        built=np.zeros(count, dtype=bool), exposed=np.ones(count, dtype=bool), height_m=np.zeros(count),
    )  # fmt: skip
    free = points_in_view((tracer,), truth.rig, station, "left", points)
    in_view: BoolArray = share_around(of, free & seen.faced, seen.faced) > 0.5
    return in_view


@lru_cache(maxsize=8)
def _tracer(truth: Scene, station: Station) -> Tracer:
    return Tracer(truth.origin_m, (*truth.bodies, *station.bodies), (), station.disc)


def _of_station(seen: Shown, built: BoolArray, in_view: BoolArray, first: int, number: int) -> tuple[NDArray[Any], ...]:
    """Return a station's rows of one element, whose samples are numbered from `first` on: where it shows anything."""
    features = features_of(seen)
    shows = np.any(features[:, [list(FEATURES).index(name) for name in ("near", "behind")]] > 0.0, axis=1)
    chosen = np.flatnonzero(seen.faced & shows & np.all(seen.samples.place % EVERY == 0, axis=1))
    answers = np.where(in_view, np.where(built, 1, 2), 0)[chosen]
    weight = np.full(len(chosen), EVERY**2 / len(built))
    return features[chosen], answers, built[chosen], weight, first + chosen, np.full(len(chosen), number)


def joined(parts: Sequence[Rows]) -> Rows:
    """String the rows of sites together."""
    samples = np.cumsum([0, *(int(one.sample.max()) + 1 for one in parts)])
    numbers = np.cumsum([0, *(int(one.element.max()) + 1 for one in parts)])
    return Rows(
        site=" ".join(one.site for one in parts),
        **{
            name: np.concatenate([getattr(one, name) for one in parts])
            for name in ("features", "seen", "built", "weight")
        },
        sample=np.concatenate([one.sample + more for one, more in zip(parts, samples, strict=False)]),
        element=np.concatenate([one.element + more for one, more in zip(parts, numbers, strict=False)]),
    )


def regression(rows: Rows, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Return the weights (K + 1, 2) of raw features, the base last, and their covariance (2 K + 2, 2 K + 2).

    The covariance is that of whole elements, built's weights first, then open's.
    """
    raw = rows.features[:, columns]
    middle, spread = raw.mean(axis=0), raw.std(axis=0) + 1e-6
    design = np.column_stack([(raw - middle) / spread, np.ones(len(raw))])
    size = design.shape[1]
    weights, held = np.zeros((size, 2)), np.tile(np.append(np.full(size - 1, RIDGE), 1e-6), 2)
    answers = rows.seen[:, None] == np.array([1, 2])
    for _ in range(50):
        chance = chances(design[:, :-1], weights)[:, 1:]
        bend = np.diag(held)
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            share = rows.weight * chance[:, i] * ((i == j) - chance[:, j])
            bend[i * size : (i + 1) * size, j * size : (j + 1) * size] += (design * share[:, None]).T @ design
        slopes = rows.weight[:, None] * (answers - chance)
        step = np.linalg.solve(bend, (design.T @ slopes).T.ravel() - held * weights.T.ravel())
        weights += step.reshape(2, size).T
        if np.abs(step).max() < 1e-8:
            break
    of_rows = np.concatenate([design * slopes[:, :1], design * slopes[:, 1:]], axis=1)
    of_elements = np.zeros((rows.element.max() + 1, 2 * size))
    np.add.at(of_elements, rows.element, of_rows)
    inverse = np.linalg.inv(bend)
    scale = np.diag(np.append(1.0 / spread, 1.0))
    scale[-1, :-1] = -middle / spread
    both = np.kron(np.eye(2), scale)
    return scale @ weights, both @ inverse @ (of_elements.T @ of_elements) @ inverse @ both.T


def often(rows: Rows) -> FloatArray:
    """Return how often (3,) a sample is seen as neither, built and open."""
    total = np.bincount(rows.seen, weights=rows.weight, minlength=3)
    return np.asarray(total / total.sum())


def left_out(sites: Sequence[Rows], columns: Sequence[int]) -> list[Model]:
    """Return for each site the model of the others; the first one's own, where there are no others."""
    models = []
    for one in sites:
        others = joined([other for other in sites if other is not one] or [one])
        models.append(Model(weights=regression(others, columns)[0], often=often(others), limit=0.0))
    return models


def log_likelihood(sites: Sequence[Rows], columns: Sequence[int], models: Sequence[Model]) -> float:
    """Return the mean over stations and elements of the logarithms of what the samples' answers were given."""
    total = 0.0
    for one, fitted in zip(sites, models, strict=True):
        given = chances(one.features[:, columns], fitted.weights)[np.arange(len(one.seen)), one.seen]
        total += float(one.weight @ np.log(np.maximum(given, 1e-6)))
    return total / sum(len(np.unique(one.element)) for one in sites)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Together:
    """Log-odds (M,) of all stations together that samples are built, whether they are, and their weights."""

    odds: FloatArray
    built: BoolArray
    weight: FloatArray


def together(sites: Sequence[Rows], models: Sequence[Model]) -> Together:
    """Add up what the stations say of each sample."""
    parts = []
    for one, fitted in zip(sites, models, strict=True):
        _, first, number = np.unique(one.sample, return_index=True, return_inverse=True)
        odds = np.bincount(number, weights=odds_of(one.features, fitted))
        parts.append((odds, one.built[first], one.weight[first]))
    odds, built, weight = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Together(odds=odds, built=built, weight=weight)


def wrong_share(given: Together, limit: float) -> float:
    """Return the share of the samples decided by a limit that are wrong."""
    decided = np.abs(given.odds) > limit
    wrong = decided & ((given.odds > 0.0) != given.built)
    return float(given.weight[wrong].sum() / max(given.weight[decided].sum(), 1e-12))


def limit_of(given: Together) -> float:
    """Return the least limit from which on at most `MOST_WRONG` of what is decided is wrong."""
    bad = [limit for limit in LIMITS if wrong_share(given, limit) > MOST_WRONG]
    return float(round(LIMITS[max(bad, default=0.0) < LIMITS][0], 1))


def document_of(sites: Sequence[Rows]) -> dict[str, object]:
    """Return all that evidence.json holds."""
    every = list(range(len(FEATURES)))
    rows, models = joined(sites), left_out(sites, every)
    weights, covariance = regression(rows, every)
    base = log_likelihood(sites, every, models)
    buys = {}
    for k, name in enumerate(FEATURES):
        others = [column for column in every if column != k]
        buys[name] = round(base - log_likelihood(sites, others, left_out(sites, others)), 5)
    return {
        "format": "asbuilt-bim/evidence", "version": 1, "features": list(FEATURES),
        "weights": [rounded(row) for row in weights], "often": rounded(often(rows)),
        "limit": limit_of(together(sites, models)), "buys": buys,
        "fitted_on": {
            "sites": [one.site for one in sites], "elements": len(np.unique(rows.element)), "samples": len(rows.seen),
            "log_likelihood": round(base, 5),
        },
        "covariance": [rounded(row) for row in covariance],
    }  # fmt: skip


def rounded(values: FloatArray) -> list[float]:
    """Return numbers to five places that count."""
    return [float(f"{value:.5g}") for value in values]


def lines_of(document: dict[str, object], sites: Sequence[Rows]) -> list[Line]:
    """Tell what was fitted, what it is worth, and how true the odds are, each site by the weights of the others."""
    elements_seen = sum(len(np.unique(one.element)) for one in sites)
    lines = [
        told(f"{name}: buys", f"{value:+.5f}", elements_seen)
        for name, value in dict(document["buys"]).items()  # type: ignore[call-overload]
    ]
    given = together(sites, left_out(sites, list(range(len(FEATURES)))))
    limit = float(str(document["limit"]))
    lines.append(told(f"wrong of what is decided from {limit} on", f"{wrong_share(given, limit):.2%}", len(given.odds)))
    chance = 1.0 / (1.0 + np.exp(-given.odds))
    edges = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
    for low, high in pairwise(edges):
        some = (chance >= low) & (chance <= high) & (given.odds != 0.0)
        if some.any():
            weight = given.weight[some] / given.weight[some].sum()
            figure = f"{weight @ chance[some]:.3f}, {weight @ given.built[some]:.3f}"
            lines.append(told(f"P(built) {low:.2f} to {high:.2f}: mean P, and built", figure, int(some.sum())))
    return lines


def main() -> int:
    """Judge the sites, fit and tell; write the model where asked to."""
    parser = fitting_options(__doc__ or "")
    parser.add_argument("--with", dest="more", metavar="FILE", help="a Python file with a new kind of evidence")
    args = parser.parse_args()
    if args.more:
        runpy.run_path(args.more)
    sites = [rows_of(site, seed) for seed, site in fitting_sites(args)]
    document = document_of(sites)
    write_model(args, DATA, document)
    return report("What a station's evidence is worth, fitted", lines_of(document, sites), args)


if __name__ == "__main__":
    sys.exit(main())
