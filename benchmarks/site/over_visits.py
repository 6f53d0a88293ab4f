"""What visits that see an element in part make of it, one after the other: the truth is known, and no photo is needed.

python benchmarks/site/over_visits.py --check --json figures.json     600 elements over 2 to 5 visits
python benchmarks/site/over_visits.py --quick                         60 elements

Walls and columns of the sample's design rise from visit to visit. Each visit shows some of their sides, in part, or
none. A share of the samples errs, and sides are measured as faces, or seen by depth alone. What was certain stays so as
long as no photo says otherwise, and nothing may be certain that isn't true.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date, timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.match.result import MatchResult
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.progress.states.decide import decide_element
from asbuilt_bim.progress.states.likelihood import decided, no_surer_than_learned
from asbuilt_bim.progress.states.votes import Votes
from asbuilt_bim.progress.surface import SurfaceState
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told, unjudged

SEED, MANY, FEW = 41, 600, 60
OPTIONS = ProgressOptions()
NO_MATCH = MatchResult(stations=(), matches=(), unmatched=(), unobserved=())
DAY = date(2026, 3, 2)
ROUNDED = 0.03
"""What a border between built and open is known to: a sample and a half of 5 cm, of a storey of 3 m."""
MOST_UNTRUE = 0.002
"""Where one sample in twenty errs, and is sure of it, a bound may lie past the truth now and then."""
RISES, SEES = (0.0, 0.0, 0.5, 1.0, 1.5, 3.0), 0.75
NATS, ERRS = (2.6, 4.0, 8.0), (0.0, 0.02, 0.05)


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What one visit makes of one element: whether it showed any of it, and how much is built in truth."""

    element: int
    visit: int
    errs: float
    shown: bool
    truth: float
    state: str
    lower: float
    upper: float
    best: float | None


def visits_of(number: int, whole: BimModel) -> Iterator[Said]:
    """Let one element rise and be seen over some visits, all by chance."""
    rng = np.random.default_rng((SEED, number))
    element = whole.elements[rng.integers(len(whole.elements))]
    design = replace(whole, elements=(element,), tasks=(), cost_lines=())
    errs, nats, measured = rng.choice(ERRS), rng.choice(NATS), bool(rng.random() < 0.5)
    history, level_m = EMPTY_HISTORY, 0.0
    for visit in range(int(rng.integers(2, 6))):
        level_m = min(element.height_m, level_m + float(rng.choice(RISES)))
        odds = shown_odds(element, level_m, nats, errs, rng) if rng.random() < SEES else None
        one, history = judged(design, odds, measured, history, DAY + timedelta(days=7 * visit))
        yield Said(
            element=number, visit=visit, errs=float(errs), shown=bool(one.stations),
            truth=share_under(element, level_m), state=one.state, lower=one.completion.lower,
            upper=one.completion.upper, best=one.completion.best,
        )  # fmt: skip


def share_under(element: BimElement, level_m: float) -> float:
    """Return the share of an element's cells that lies under a level."""
    cells = element_cells(element)
    rows = cells.shape[1]
    filled = np.clip(level_m / element.height_m * rows - np.arange(rows), 0.0, 1.0)
    return float(np.broadcast_to(filled, cells.shape)[cells.weight > 0.0].mean())


def shown_odds(element: BimElement, level_m: float, nats: float, errs: float, rng: np.random.Generator) -> np.ndarray:
    """Return the log-odds (N,) of an element's samples at a visit that shows windows of some of its sides."""
    samples = cell_samples(element, OPTIONS.spacing_m)
    height_m = samples.points_m[:, 2] - element.vertices_m[:, 2].min()
    seen = np.zeros(len(height_m), dtype=bool)
    for face in rng.choice(len(element.faces), size=int(rng.integers(1, len(element.faces) + 1)), replace=False):
        own = samples.face == face
        if own.any():
            across = samples.uv_m[:, 0] - samples.uv_m[own, 0].min()
            seen |= own & _within(across / max(across[own].max(), 1e-9), rng) & _within(height_m / height_m.max(), rng)
    is_built = (height_m < level_m) ^ (rng.random(len(height_m)) < errs)
    odds: np.ndarray = np.where(seen, np.where(is_built, nats, -nats), 0.0)
    return odds


def _within(at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Say which places (N,) of 0..1 lie in a window: often all of it, else a part."""
    low = float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.6)]))
    high = float(rng.choice([1.0, 1.0, rng.uniform(low + 0.2, 1.0)]))
    return np.asarray((at >= low) & (at <= high))


def judged(
    design: BimModel, odds: np.ndarray | None, measured: bool, history: VisitHistory, day: date
) -> tuple[ElementProgress, VisitHistory]:
    """Return what a visit makes of the one element of a design, and the history with it.

    `measured`: what is built was measured as a face.
    """
    (element,) = design.elements
    nothing = np.zeros(len(cell_samples(element, OPTIONS.spacing_m).face))
    built, opened = decided(nothing if odds is None else odds)
    no = np.zeros(len(built), dtype=bool)
    votes = Votes(
        built=built, open=opened, log_odds=no_surer_than_learned(nothing if odds is None else odds), contradicted=no,
        decided_by={"A1": built | opened} if odds is not None else {}, before=no, spoken=(), other_colour={},
    )  # fmt: skip
    earlier = [history.earlier(element.global_id, face, OPTIONS) for face in element.faces]
    states: list[SurfaceState] = decide_element(element, votes, {}, earlier, OPTIONS)
    if measured:
        states = [replace(one, outline_uv_m=one.built_uv_m) for one in states]
    found = summarise(states, NO_MATCH, design, history, day)
    return found.elements[0], remember(history, found)


def lines_of(rows: list[Said]) -> list[Line]:
    """Judge what is certain against the truth, and against the visit before."""
    pairs = [(a, b) for a, b in pairwise(rows) if a.element == b.element]
    empty = [(a, b) for a, b in pairs if not b.shown]
    seen = [one for one in rows if one.shown]
    off = np.array([abs(one.best - one.truth) for one in seen if one.best is not None] or [0.0])
    return [
        _few('"at least" over the truth', [r for r in rows if r.lower > r.truth + ROUNDED], len(rows)),
        _few('"possibly" under the truth', [r for r in rows if r.upper < r.truth - ROUNDED], len(rows)),
        _none("complete, and it isn't", [r for r in rows if r.state == "complete" and r.truth < 0.95], len(rows)),
        _none('"at least" moves without a photo', [a for a, b in empty if a.lower != b.lower], len(empty)),
        _none("complete without a photo", [a for a, b in empty if b.state == "complete" != a.state], len(empty)),
        told("best estimate off where a visit shows it: mean, 95 %",
             ", ".join(f"{100.0 * one:.1f}" for one in (np.mean(off), np.percentile(off, 95))) + " points", len(off)),
        told("not started, and more than a kicker stands where no photo looks",
             f"{sum(r.state == 'not started' and r.truth > 0.06 for r in seen)}", len(seen)),
        told('"at least" falls by over 3 points at a visit with photos',
             f"{sum(b.lower < a.lower - ROUNDED for a, b in pairs if b.shown)}", len(pairs) - len(empty)),
    ]  # fmt: skip


def _none(what: str, faults: Sequence[Said], n: int) -> Line:
    return line(what, f"{len(faults)}", "none", n, not faults)


def _few(what: str, faults: Sequence[Said], n: int) -> Line:
    return line(what, f"{len(faults)}", f"<= {MOST_UNTRUE:.1%}", n, len(faults) <= MOST_UNTRUE * n)


def main() -> int:
    """Let the elements rise and be seen, and print the table."""
    parser = options(__doc__ or "")
    args = parser.parse_args()
    design = read_design(SAMPLE / "design.ifc")
    rows: list[Said] = []
    for number in range(FEW if args.quick else MANY):
        rows += visits_of(number, design)
    lines = lines_of(rows)
    faults = {"elements": [asdict(one) for one in rows]}
    return report(
        "Elements seen in part, visit by visit", unjudged(lines, 1) if args.quick else lines, args, {}, faults
    )


if __name__ == "__main__":
    sys.exit(main())
