"""Fits how high an element is built by what its sides show: four numbers, over elements of sites that are known.

python benchmarks/site/fit_pour.py --seeds 20 31 --write   fit on the sample and these sites, write pour.json
python benchmarks/site/fit_pour.py --seeds 20 31           only tell what each number buys, and how true the chances are
python benchmarks/site/fit_pour.py --quick                 the sample's first visit, nothing written

The best numbers are those that give what is true of each row of samples the most of likelihood (logarithms, each
element weighs the same). What is told of them is judged on sites that had no part in them. `doubt` is the most at which
so few truths lie outside their bounds, `limit` the least at which so few states are wrong, judged likewise.
Reference: Gneiting and Raftery 2007, proper scores.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project


from asbuilt_bim.bim.cells import element_cells
from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.flow import pipeline
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.progress.completion import element as of_element
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.states.cell_states import CellStates, cell_states, decided_cells, shown_rows
from asbuilt_bim.progress.states.pour import DATA, Model, Shown, levels
from asbuilt_bim.progress.surface import SurfaceState
from benchmarks.site.fit_evidence import rounded
from benchmarks.site.rules import Site, fitting_options, fitting_sites
from benchmarks.site.site import ROUNDED, VISIBLE
from benchmarks.table import Line, report, told, write_model

START = Model(
    built_weight=0.05, face_weight=0.15, open_weight=0.15, not_begun=0.3, doubt=0.02, limit=0.7
)  # fmt: skip
WITHOUT = {"built_weight": 1.0, "face_weight": 1.0, "open_weight": 1.0, "not_begun": 0.01}
"""What stands for each number where it is left out: rows err each for itself, and any level is as likely."""
DOUBTS = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1)
LIMITS = np.arange(0.7, 0.96, 0.05)  # less likely than that no state is named, however seldom it is wrong on sites
MOST_OUTSIDE, MOST_WRONG = 0.03 / 3.0, 0.007 / 3.0
"""Of the truths, and of the states: a third of what is allowed, since sites that are new are worse."""
FOLDS = 4
LEAST = 1e-4  # that a chance counts as: one row never outweighs all others


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """What an element showed after a visit, and what is true of it; `built` (rows,) in shares.

    `before` is the evidence of earlier visits, by the model that lies in the package.
    """

    site: str
    element: BimElement
    options: ProgressOptions
    shown: Shown
    before: FloatArray | None
    built: FloatArray
    truth: Mapping[str, Any]


def rows_of(site: Site) -> Iterator[Row]:
    """Judge a site, note what each element's faces showed, and lay the truth beside it."""
    history = EMPTY_HISTORY
    for measured, rejections, survey, design, day, of, placing in site.asked:
        noted: dict[str, tuple[BimElement, Sequence[SurfaceState], FloatArray | None]] = {}

        def judging(
            element: BimElement, surfaces: Sequence[SurfaceState], of: ProgressOptions,
            before: FloatArray | None = None, keep: Any = noted,
        ) -> CellStates:  # fmt: skip
            keep[element.global_id] = (element, surfaces, before)
            return cell_states(element, surfaces, of, before)

        with patch.object(of_element, "cell_states", judging):
            judged = pipeline.monitor(measured, rejections, survey, design, history, day, of, **placing)
        history = remember(history, judged)
        displaced = {one.global_id for one in judged.elements if one.state == "displaced"}
        visit = next(one for one in site.truth["visits"] if one["date"] == day.isoformat())
        for truth in visit["elements"]:
            element, surfaces, before = noted[truth["global_id"]]
            shown = shown_rows(element, surfaces, of.progress)
            if truth["global_id"] not in displaced:
                rows = shown.built.shape[2]
                built = np.clip(truth["height_fraction"] * rows - np.arange(rows), 0.0, 1.0)
                yield Row(
                    site=site.name, element=element, options=of.progress, shown=shown, before=before, built=built,
                    truth=truth,
                )  # fmt: skip


def score(rows: Sequence[Row], fitted: Model) -> float:
    """Return the mean over elements that show something of the logarithms of what the truth was given."""
    total = []
    for chance, built in (_chances(row, fitted) for row in rows if row.shown.decided.any()):
        sure = np.clip(chance, LEAST, 1.0 - LEAST)
        total.append(np.mean(built * np.log(sure) + (1.0 - built) * np.log(1.0 - sure)))
    return float(np.mean(total)) if total else 0.0


def _chances(row: Row, fitted: Model) -> tuple[FloatArray, FloatArray]:
    """Return how likely each row of an element's cells is built (M,), and what share of it is."""
    chance = levels(row.shown, (row.element.length_m, row.element.height_m), fitted, row.before).built()
    real = element_cells(row.element).weight > 0.0
    of_cells = np.repeat(real, chance.shape[1] // real.shape[1], axis=1)
    return chance[of_cells], np.broadcast_to(row.built, chance.shape)[of_cells]


def fitted_to(rows: Sequence[Row]) -> Model:
    """Return the numbers under which what is true is likeliest: one after the other, by ever smaller steps."""
    best, step = START, 1.6
    reached = score(rows, best)
    while step > 1.05:
        before = reached
        for name in WITHOUT:
            for factor in (step, 1.0 / step):
                while True:
                    tried = _moved(best, name, factor)
                    given = score(rows, tried) if tried is not None else -np.inf
                    if tried is None or given <= reached + 1e-6:
                        break
                    best, reached = tried, given
        step = step**0.6 if reached - before < 1e-4 else step
    return best


def _moved(of: Model, name: str, factor: float) -> Model | None:
    """Return a model with one number larger or smaller; of "not begun" what is left over for parts."""
    value = getattr(of, name)
    new = 0.5 * (1.0 - (1.0 - 2.0 * value) * factor) if name == "not_begun" else value * factor
    inside = 1e-6 < new < (50.0 if name != "not_begun" else 0.499)
    return replace(of, **{name: new}) if inside else None


def left_out(rows: Sequence[Row]) -> list[tuple[Row, Model]]:
    """Return each row with numbers that its own site had no part in; its own, where there is one site alone."""
    sites = sorted({row.site for row in rows})
    folds = [set(sites[start::FOLDS]) for start in range(min(FOLDS, len(sites)))]
    found = []
    for fold in folds:
        others = [row for row in rows if row.site not in fold] or rows
        model = fitted_to(others)
        found += [(row, model) for row in rows if row.site in fold]
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What is said of an element by a model, beside what is true."""

    state: str
    lower: float
    upper: float
    truth: Mapping[str, Any]

    @property
    def outside(self) -> bool:
        """Say whether the truth lies outside the bounds."""
        return not self.lower - ROUNDED <= self.truth["completion"] <= self.upper + ROUNDED

    @property
    def wrong(self) -> bool:
        """Say whether a state is named, and another one is true."""
        return self.state not in ("unknown", self.truth["state"])


def said(row: Row, fitted: Model) -> Said:
    """Judge an element as the program does."""
    cells = decided_cells(row.element, row.shown, fitted, row.before)
    of = of_element.completion_by_cells(cells, row.options)
    state, _ = of_element.state_of(cells, row.element.height_m, of, row.options, fitted.limit)
    return Said(state=state, lower=of.lower, upper=of.upper, truth=row.truth)


def with_limits(of: Model, judged: Sequence[tuple[Row, Model]]) -> Model:
    """Return numbers with the doubt and the limit at which so few truths lie outside, and so few states are wrong."""

    def share(what: str, **changed: float) -> float:
        return float(np.mean([getattr(said(row, replace(fitted, **changed)), what) for row, fitted in judged]))

    doubts = [doubt for doubt in DOUBTS if share("outside", doubt=doubt) <= MOST_OUTSIDE]
    limits = [float(limit) for limit in LIMITS if share("wrong", limit=float(limit)) <= MOST_WRONG]
    return replace(of, doubt=max(doubts, default=DOUBTS[0]), limit=round(min(limits, default=float(LIMITS[-1])), 2))


def document_of(rows: Sequence[Row], judged: Sequence[tuple[Row, Model]]) -> dict[str, Any]:
    """Return all that pour.json holds."""
    best = with_limits(fitted_to(rows), judged)
    reached = score(rows, best)
    return {
        "format": "asbuilt-bim/pour", "version": 1,
        "model": dict(zip(asdict(best), rounded(np.array(list(asdict(best).values()))), strict=True)),
        "buys": {name: round(reached - score(rows, replace(best, **{name: to})), 5) for name, to in WITHOUT.items()},
        "fitted_on": {
            "sites": sorted({row.site for row in rows}), "elements": len(rows), "log_likelihood": round(reached, 5),
        },
    }  # fmt: skip


def lines_of(document: Mapping[str, Any], judged: Sequence[tuple[Row, Model]]) -> list[Line]:
    """Tell what was fitted, what it is worth, and how true it is, each site by the numbers of others."""
    lines = [
        told(f"{name}: {document['model'][name]}, buys", f"{value:+.5f}", len(judged))
        for name, value in document["buys"].items()
    ]
    of = {key: document["model"][key] for key in ("doubt", "limit")}
    all_said = [said(row, replace(fitted, **of)) for row, fitted in judged]
    n = len(all_said)
    visible = [one for one in all_said if one.truth["half_visible_share"] > VISIBLE]
    right = sum(one.state == one.truth["state"] for one in visible)
    lines += [
        told(f"truth outside bounds, by a doubt of {of['doubt']}", f"{np.mean([o.outside for o in all_said]):.2%}", n),
        told("mean width of the bounds", f"{100 * np.mean([o.upper - o.lower for o in all_said]):.1f} points", n),
        told(f"states wrong, by a limit of {of['limit']}", f"{np.mean([o.wrong for o in all_said]):.2%}", n),
        told("states right, of elements over half visible", f"{right / max(len(visible), 1):.1%}", len(visible)),
    ]
    pairs = [_chances(row, fitted) for row, fitted in judged if row.shown.decided.any()]
    chance, built = (np.concatenate(one) for one in zip(*pairs, strict=True))
    for low, high in pairwise((0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0)):
        some = (chance >= low) & (chance <= high)
        if some.any():
            figure = f"{chance[some].mean():.3f}, {built[some].mean():.3f}"
            lines.append(told(f"P(built) {low:.2f} to {high:.2f}: mean P, and built", figure, int(some.sum())))
    return lines


def main() -> int:
    """Judge the sites, fit and tell; write the model where asked to."""
    args = fitting_options(__doc__ or "").parse_args()
    rows = [row for _, site in fitting_sites(args) for row in rows_of(site)]
    judged = [(row, START) for row in rows] if args.quick else left_out(rows)
    document = document_of(rows, judged)
    write_model(args, DATA, document)
    return report("How high it is built, by what its sides show", lines_of(document, judged), args)


if __name__ == "__main__":
    sys.exit(main())
