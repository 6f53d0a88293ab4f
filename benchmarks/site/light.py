"""Whole runs on photos taken in worse light: what is wrong, what is lost, and whether the photo's fault is named.

python benchmarks/site/light.py --check --json figures.json     the sample and three sites, some twenty minutes
python benchmarks/site/light.py --quick                         the sample's first stations; nothing is judged
python benchmarks/site/light.py --seeds 20 31 37                the seeds that it was developed on

A run is one visit of a site, all its photos degraded alike. A station's coverage is the design surface that it decides,
as a share of what it decides with its clean photos.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.codes import PHOTO_FAULTS
from asbuilt_bim.flow.measure_visit import Workplace, measure_visit
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.match.adjust import adjust_with_design
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.surface import SurfaceState
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.register.placement import register
from asbuilt_bim.report.tables import station_of
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.scale.executor import one_thread
from benchmarks.site.degrade import CLEAN, DEGRADATIONS, Degradation
from benchmarks.sites import SAMPLE, benchmark_folder, generated_site
from benchmarks.table import Line, line, options, report, told, unjudged

DEVELOPING_SEEDS = (20, 31, 37)
LIGHT_SEEDS = (158, 159, 160)
"""Never looked at while the measures of a photo's quality were chosen."""
COLOUR = "of another colour"
"""A note on a face: of wet, dark or tinted concrete, and under coloured lamps, this is the cause."""
LOST = 0.10
VISIBLE = 0.5
SLACK = 0.01
"""Bounds are of cells that are whole, the truth is of heights: a cell of a hundred may be cut."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run: a visit of a site, its photos degraded."""

    site: Path
    name: str
    visit: int
    degradation: Degradation
    stations: int = 99


@dataclass(slots=True, kw_only=True)
class Element:
    """What a run said of an element, beside the truth."""

    name: str
    visible: float
    state: str
    true_state: str
    lower: float
    upper: float
    truth: float
    coverage: float
    stations: list[str]

    @property
    def wrong(self) -> bool:
        """Say whether its state is known, and another than the true one."""
        return self.state not in ("unknown", self.true_state)

    @property
    def outside(self) -> bool:
        """Say whether the truth lies outside its bounds."""
        return not self.lower - SLACK <= self.truth <= self.upper + SLACK


@dataclass(slots=True, kw_only=True)
class Outcome:
    """What came of a case: area decided, causes and all codes by station, and the elements."""

    name: str
    visit: int
    degradation: str
    decided_m2: dict[str, float]
    causes: dict[str, list[str]]
    codes: dict[str, list[str]]
    elements: list[Element] = field(default_factory=list)


def cases(sites: list[tuple[Path, str]], quick: bool, times: int, stations: int) -> list[Case]:
    """Return the runs: each degradation at so many of the sites in turn, at either visit."""
    if quick:
        site, name = sites[0]
        some = [one for one in DEGRADATIONS if one.name in ("exposure -4 EV", "exposure +3 EV", "defocus 4 px")]
        return [Case(site=site, name=name, visit=0, degradation=one, stations=2) for one in some]
    found = []
    for number, one in enumerate(DEGRADATIONS):
        for turn in range(times):
            site, name = sites[(number + 2 * turn) % len(sites)]
            visit = (number // len(sites) + turn) % 2
            found.append(Case(site=site, name=name, visit=visit, degradation=one, stations=stations))
    return found


@one_thread()
def run_case(case: Case) -> Outcome:
    """Degrade a visit's photos in a copy of the site, and run the program on it."""
    truth = json.loads((case.site / "truth.json").read_text(encoding="utf-8"))["visits"][case.visit]
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        found, surfaces = _run(_degraded(case, Path(scratch) / "site"))
    return _outcome(case, found, surfaces, truth)


def _run(project: Project) -> tuple[ProgressReport, Sequence[SurfaceState]]:
    """Do what a run does with its one visit, and keep what each station decides."""
    visit, chosen = project.visits[0], project.options
    place = Workplace(workers=1, cache=Cache(folder=benchmark_folder() / "light-cache"))
    rig = rig_of(project, place.cache, _silent).rig
    design = read_design(project.ifc, project.scope)
    survey = read_survey(project.survey, project.markers.size_m, project.markers.sigma_m)
    seen = measure_visit(visit, project, rig, place, _silent, survey)
    placement = register(seen.measured, survey, chosen.register)
    matched = adjust_with_design(match_faces(placement, design, chosen.match), design, chosen.match)
    surfaces = classify_surface(matched, design, EMPTY_HISTORY, chosen.progress)
    rejections = (*seen.rejections, *placement.rejections)
    return summarise(surfaces, matched, design, EMPTY_HISTORY, visit.date, rejections=rejections), surfaces


def _degraded(case: Case, folder: Path) -> Project:
    shutil.copytree(case.site, folder)
    whole = read_project(folder / "project.yaml")
    visit = whole.visits[case.visit]
    visit = replace(visit, stations=visit.stations[: case.stations])
    if case.degradation != CLEAN:
        for number, path in enumerate(path for station in visit.stations for path in (station.left, station.right)):
            photo = cv2.imread(str(path))
            path.write_bytes(case.degradation.encoded(photo, np.random.default_rng((case.visit, number))))
    return replace(whole, visits=(visit,))


def _silent(step: str, done: int, total: int, what: str = "") -> None:
    pass


def _outcome(case: Case, found: ProgressReport, surfaces: Sequence[SurfaceState], truth: dict[str, Any]) -> Outcome:
    codes: dict[str, list[str]] = {station["name"]: [] for station in truth["stations"][: case.stations]}
    for rejection in found.rejections:
        if station_of(rejection) in codes:
            codes[station_of(rejection)].append(rejection.code)
    decided = dict.fromkeys(codes, 0.0)
    for surface in surfaces:
        for station, area_m2 in surface.stations.items():
            decided[station] += area_m2
    true = {element["global_id"]: element for element in truth["elements"]}
    outcome = Outcome(
        name=case.name, visit=case.visit, degradation=case.degradation.name, decided_m2=decided, codes=codes,
        causes={name: [code for code in own if code in PHOTO_FAULTS] for name, own in codes.items()},
    )  # fmt: skip
    for note in (note for element in found.elements for note in element.notes):
        if note.code.value == COLOUR and note.subject.at_station in codes:
            outcome.causes[note.subject.at_station].append(note.code)
    for element in found.elements:
        known = true[element.global_id]
        outcome.elements.append(Element(
            name=element.name, visible=known["half_visible_share"], state=element.state, true_state=known["state"],
            lower=element.completion.lower, upper=element.completion.upper, truth=known["completion_by_cells"],
            coverage=element.completion.coverage, stations=list(element.stations),
        ))  # fmt: skip
    return outcome


def judged(outcomes: list[Outcome]) -> tuple[list[Line], list[str]]:
    """Judge the runs; and tell what is wrong, one by one."""
    clean = {(one.name, one.visit): one for one in outcomes if one.degradation == CLEAN.name}
    worse = [one for one in outcomes if one.degradation != CLEAN.name]
    faults, stations, named, silent, visits = [], 0, 0, [], 0
    wrong = defaultdict(int)
    for one in worse:
        known = {element.name: element for element in clean[one.name, one.visit].elements}
        for element in one.elements:
            visits += element.visible > 0.0
            if not (element.wrong or element.outside):
                continue
            with_cause = any(one.causes.get(station) for station in element.stations)
            before = known[element.name].wrong or known[element.name].outside
            wrong["wrong on the clean photos as well" if before else "named" if with_cause else "not named"] += 1
            faults.append(
                f"{one.name} visit {one.visit + 1}, {one.degradation}: {element.name} is {element.true_state} "
                f"{element.truth:.2f}, called {element.state} {element.lower:.2f}..{element.upper:.2f} by "
                f"{', '.join(element.stations)}{', clean too' if before else ', named' if with_cause else ''}"
            )
        for station, lost in losses(one, clean[one.name, one.visit]).items():
            if lost > LOST:
                stations += 1
                named += bool(one.causes[station])
                if not one.causes[station]:
                    codes = ", ".join(dict.fromkeys(one.codes[station])) or "not a word"
                    silent.append(f"{one.name} {station}, {one.degradation}: lost {lost:.0%}, says {codes}")
    unspoilt = [causes for one in clean.values() for causes in one.causes.values()]
    alarms = sum(map(bool, unspoilt))
    share, false = named / max(stations, 1), alarms / max(len(unspoilt), 1)
    counts = {what: wrong[what] for what in ("not named", "named", "wrong on the clean photos as well")}
    bad = counts["not named"]
    lines = [
        line("wrong state, or truth out of bounds, and no cause named", str(bad), "0", visits, bad == 0, 400),
        *(told(f"  {what}", str(counts[what]), visits) for what in list(counts)[1:]),
        line("stations that lost 10 points: cause named", f"{share:.1%}", ">= 95 %", stations, share >= 0.95),
        line("stations with clean photos: a cause named", f"{false:.1%}", "<= 2 %", len(unspoilt), false <= 0.02),
    ]
    return [*lines, *_by_degradation(worse, clean)], [*faults, *silent]


def losses(one: Outcome, clean: Outcome) -> dict[str, float]:
    """Return the share of what a station decides with clean photos that it no longer does."""
    return {name: 1.0 - one.decided_m2[name] / area_m2 for name, area_m2 in clean.decided_m2.items() if area_m2 > 0.0}


def _by_degradation(worse: list[Outcome], clean: dict[tuple[str, int], Outcome]) -> list[Line]:
    lines = []
    for name in dict.fromkeys(one.degradation for one in worse):
        own = [one for one in worse if one.degradation == name]
        lost = [value for one in own for value in losses(one, clean[one.name, one.visit]).values()]
        causes = [causes for one in own for causes in one.causes.values()]
        words = sorted({code.removeprefix("photo ") for codes in causes for code in codes})
        figure = f"{np.median(lost):.0%} lost, {sum(map(bool, causes))} of {len(causes)} named"
        lines.append(told(f"  {name}: {', '.join(words)}", figure, len(causes)))
    return lines


def main() -> int:
    """Run the cases and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", help=f"others than those reported, {LIGHT_SEEDS}")
    parser.add_argument("--only", default="", help="degradations whose name holds this text")
    parser.add_argument("--times", type=int, default=2, help="sites that each degradation is tried on")
    parser.add_argument("--stations", type=int, default=5, help="the first so many of each visit")
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    seeds = () if args.quick else LIGHT_SEEDS if args.seeds is None else tuple(args.seeds)
    sites = [(SAMPLE, "sample"), *((generated_site(seed), f"seed {seed}") for seed in seeds)]
    chosen = cases(sites, args.quick, args.times, args.stations)
    chosen = [one for one in chosen if args.only in one.degradation.name]
    chosen = [*dict.fromkeys(replace(case, degradation=CLEAN) for case in chosen), *chosen]
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        outcomes: list[Outcome] = []
        for done in pool.map(run_case, chosen):
            outcomes.append(done)
            print(f"{done.name} visit {done.visit + 1}, {done.degradation} ...", file=sys.stderr, flush=True)
    lines, told_one_by_one = judged(outcomes)
    print("\n".join(f"  {text}" for text in told_one_by_one))
    if args.quick:
        lines = unjudged(lines)
    rows: dict[str, object] = {"outcomes": [asdict(one) for one in outcomes]}
    return report("The main job in worse light", lines, args, {"said": told_one_by_one}, rows)


if __name__ == "__main__":
    sys.exit(main())
