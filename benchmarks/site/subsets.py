"""Every choice of a visit's stations: does the leading number rise with fewer photos, and is what the page says true?

python benchmarks/site/subsets.py --check --json figures.json   the sample and two generated sites, half an hour
python benchmarks/site/subsets.py --quick                       three stations of the sample's first visit

Photos are measured once; only what is said of them is worked out again. A visit stands alone: earlier ones count whole.
The page says: at least (it leads), possibly, and the best estimate where at least half was seen. A rise is against the
same stations and one more, and against the whole visit.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.flow.design_source import design_of
from asbuilt_bim.flow.measure_visit import MeasuredVisit, Workplace, measure_visit
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.progress.history import EMPTY_HISTORY, VisitHistory, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.report.tables import station_of
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.scale.executor import one_thread
from benchmarks.sites import SAMPLE, benchmark_folder, generated_site
from benchmarks.table import Line, line, options, quantiles, report, told, unjudged

SEEDS = (20, 31)
MOST = 200
"""Choices of a visit's stations: all of seven, a draw of more."""
RISE, WORST = 0.01, 0.03
SLACK = 0.01
"""Bounds are of cells that are whole, the truth is of heights: a cell of a hundred may be cut."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the page says with these stations of a visit, beside the truth: a row (least, most, truth) a statement."""

    site: str
    day: str
    stations: tuple[str, ...]
    lower: float
    best: float | None
    groups: tuple[tuple[float, float, float], ...]  # the whole and its storeys
    elements: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """A visit with its measured stations, and what was known before it."""

    visit: Visit
    seen: MeasuredVisit
    history: VisitHistory


def chosen(names: tuple[str, ...], most: int = MOST) -> list[tuple[str, ...]]:
    """Return all choices of at least one station, the whole visit among them; of many a draw with all of them in it."""
    every = [one for size in range(1, len(names) + 1) for one in combinations(names, size)]
    if len(every) <= most:
        return every
    drawn = np.random.default_rng(0).choice(len(every) - 1, most - 1, replace=False)
    return [*(every[index] for index in sorted(drawn)), every[-1]]


def measured_visits(
    project: Project, design: BimModel, survey: tuple[SurveyedMarker, ...], stations: int
) -> Iterator[Measured]:
    """Measure each visit, or find it in the cache, and give it with the history of those before it."""
    folder = benchmark_folder() / "cache"
    place = Workplace(workers=1, cache=Cache(folder=folder))
    rig = rig_of(project, place.cache, _quiet).rig
    past: tuple[ProgressReport, ...] = ()
    shown: tuple[Any, ...] = ()
    for visit in project.visits:
        cut = Visit(date=visit.date, stations=visit.stations[:stations])
        seen = measure_visit(cut, project, rig, place, _quiet, survey, shown)
        history = reduce(remember, past, EMPTY_HISTORY)
        yield Measured(visit=cut, seen=seen, history=history)
        shown = seen.shown
        names = tuple(one.name for one in cut.stations)
        past = (*past, judged(Measured(visit=cut, seen=seen, history=history), names, project, design, survey))


def judged(
    one: Measured, names: tuple[str, ...], project: Project, design: BimModel, survey: tuple[SurveyedMarker, ...]
) -> ProgressReport:
    """Return the report of a visit that had these stations alone."""
    stations = [each for each in one.seen.measured if each.station in names]
    rejections = [each for each in one.seen.rejections if station_of(each) in ("", *names)]
    return monitor(stations, rejections, survey, design, one.history, one.visit.date, project.options)


def choices_of(site: Path, name: str, visits: int, stations: int) -> list[Choice]:
    """Return what is said with every choice of stations of each visit of a site."""
    project = read_project(site / "project.yaml")
    design = design_of(project, Cache(folder=benchmark_folder() / "cache"))
    survey = read_survey(project.survey, project.markers.size_m, project.markers.sigma_m)
    truth = json.loads((site / "truth.json").read_text(encoding="utf-8"))
    found: list[Choice] = []
    for number, one in enumerate(measured_visits(project, design, survey, stations)):
        if number >= visits:
            break
        for names in chosen(tuple(each.name for each in one.visit.stations)):
            found.append(_choice(name, names, judged(one, names, project, design, survey), truth["visits"][number]))
        print(f"{name} {one.visit.date}: {len(found)} choices so far", file=sys.stderr, flush=True)
    return found


def _choice(site: str, names: tuple[str, ...], said: ProgressReport, truth: dict[str, Any]) -> Choice:
    storeys = {one["name"]: one for one in truth["storeys"]}
    elements = {one["global_id"]: one["completion"] for one in truth["elements"]}
    built, exposed = (sum(one[key] for one in storeys.values()) for key in ("built_area_m2", "exposed_area_m2"))
    groups = [(said.whole.completion, built / exposed)]
    groups += [(one.completion, storeys[one.name]["completion_by_area"]) for one in said.storeys]
    each = [(one.completion, elements[one.global_id]) for one in said.elements]
    return Choice(
        site=site,
        day=said.visit_date.isoformat(),
        stations=names,
        lower=said.whole.completion.lower,
        best=said.whole.completion.best_shown,
        groups=tuple((done.lower, done.upper, true) for done, true in groups),
        elements=tuple((done.lower, done.upper, true) for done, true in each),
    )


def rises(found: list[Choice], what: str) -> list[float]:
    """Return by how much (0..1) fewer stations say more: against one station more, and against the whole visit."""
    by = {(one.site, one.day, frozenset(one.stations)): getattr(one, what) for one in found}
    whole: dict[tuple[str, str], frozenset[str]] = {}
    for site, day, names in by:
        whole[site, day] = max(whole.get((site, day), names), names, key=len)
    gaps = []
    for (site, day, names), value in by.items():
        more = {names | {extra} for extra in whole[site, day] - names} | ({whole[site, day]} - {names})
        with_more = [by[site, day, each] for each in more if (site, day, each) in by]
        gaps += [value - other for other in with_more if value is not None and other is not None]
    return gaps


def lines_of(found: list[Choice]) -> list[Line]:
    """Judge how often the leading number rises with fewer photos, and whether the truth lies within what is said."""
    lower, best = rises(found, "lower"), rises(found, "best")
    often = float(np.mean([gap > RISE for gap in lower])) if lower else 1.0
    worst = max(lower, default=1.0)
    lines = [
        line("at least: rises by over 1 point with fewer photos", f"{often:.1%}", "<= 2 %", len(lower), often <= 0.02),
        line("  the most that it rises", f"{worst * 100:.1f} points", "<= 3", len(lower), worst <= WORST),
        told("best estimate, where half was seen: rises by over 1 point", _share(best, RISE), len(best)),
        told("  the most that it rises", f"{max(best, default=0.0) * 100:.1f} points", len(best)),
    ]
    for what in ("groups", "elements"):
        rows = [row for one in found for row in getattr(one, what)]
        inside = float(np.mean([low - SLACK <= true <= high + SLACK for low, high, true in rows])) if rows else 0.0
        over = float(np.mean([low - SLACK > true for low, _, true in rows])) if rows else 1.0
        name = {"groups": "storeys and the whole", "elements": "elements"}[what]
        lines.append(
            line(f"{name}: truth within at least and possibly", f"{inside:.1%}", ">= 97 %", len(rows), inside >= 0.97)
        )
        lines.append(told("  truth under at least", f"{over:.1%}", len(rows)))
    return lines


def _share(gaps: list[float], over: float) -> str:
    return f"{np.mean([gap > over for gap in gaps]):.1%}" if gaps else "none"


def _quiet(step: str, done: int, total: int, what: str = "") -> None:
    del step, done, total, what


@one_thread()
def main() -> int:
    """Run all choices and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", default=list(SEEDS), help="generated sites beside the sample")
    args = parser.parse_args()
    seeds = [] if args.quick else args.seeds
    found = choices_of(SAMPLE, "sample", *((1, 3) if args.quick else (99, 99)))
    for seed in seeds:
        found += choices_of(generated_site(seed), f"seed {seed}", 99, 99)
    lines = lines_of(found)
    rows = [{"site": one.site, "day": one.day, "stations": one.stations, "lower": one.lower} for one in found]
    spread = {"spread": {"rises of at least": quantiles(rises(found, "lower"))}}
    return report(
        "Choices of stations", unjudged(lines) if args.quick else lines, args, dict(spread), {"choices": rows}
    )


if __name__ == "__main__":
    sys.exit(main())
