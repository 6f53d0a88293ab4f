"""What each rule of judging buys: every one switched off alone, on measurements that are kept, against the truth.

python benchmarks/site/rules.py --seeds 20 31 100 101        the sample and these sites (for development)
python benchmarks/site/rules.py --quick                      the sample and three rules
python benchmarks/site/rules.py --shuttered 41 42            these sites with thick formwork round what is absent
python benchmarks/site/rules.py --only gaps edges            the rules whose name holds one of these words
python benchmarks/site/rules.py --together gaps hangs        these off all at once: one may do another's work

Right and wrong are elements of which half is visible; "in bounds" are all elements; the width is that of their bounds.
A rule that changes no state, loses no truth and narrows no bounds on many sites buys nothing. Most were made for one
case that few sites have, so three sites aren't many.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.cells import CellSamples
from asbuilt_bim.flow import pipeline
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.pipeline import run_project
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states import cell_states, decide, evidence, features, outlines, votes
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache
from benchmarks.site.site import EXPECTED_UNKNOWN, ROUNDED, VISIBLE
from benchmarks.sites import SAMPLE, benchmark_folder, generated_site
from benchmarks.table import Line, options, report, told

SEEN = 0.8
"""Of coverage, from which the best estimate is held against the truth."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rule:
    """A rule by the function that holds it, and what stands there in its place."""

    name: str
    module: Any
    function: str
    instead: Callable[..., Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """What is said of an element after a visit, and what is true."""

    key: str
    state: str
    true_state: str
    lower: float
    upper: float
    best: float | None
    true: float
    visible: bool
    unseen: bool


def none_of(*given: Any, **_: Any) -> Any:
    """Return that no sample is meant (N,)."""
    samples = next(one for one in given if isinstance(one, CellSamples))
    return np.zeros(len(samples.face), dtype=bool)


def _everywhere(rows: Any) -> Any:
    return np.ones_like(rows)


RULES = (
    Rule(name="patches before the design", module=features, function="_before", instead=none_of),
    Rule(
        name="outlines standing off", module=votes, function="stands_off", instead=lambda *_: False,
    ),
    Rule(name="bars by size and depth", module=outlines, function="looks_like_bars", instead=lambda *_: False),
    Rule(name="nothing is certain that nobody saw", module=cell_states, function="and_under", instead=_everywhere),
    Rule(name="whole held against what is built", module=decide, function="_past_outline", instead=lambda *_: 0.0),
    Rule(name="faces past their design", module=decide, function="past_design", instead=lambda *_: []),
    Rule(name="colour in place of a veto", module=votes, function="weigh_colour", instead=lambda *_: None),
    Rule(
        name="past bars in both photos", module=evidence, function="_on_both",
        instead=lambda view, points, pixels: np.ones(len(points), dtype=bool),
    ),
)  # fmt: skip


@contextmanager
def without(rule: Rule) -> Iterator[None]:
    """Switch a rule off for a while."""
    kept = getattr(rule.module, rule.function)
    setattr(rule.module, rule.function, rule.instead)
    try:
        yield
    finally:
        setattr(rule.module, rule.function, kept)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """A site's truth, and what `monitor` was asked of each visit, without the history."""

    name: str
    truth: Mapping[str, Any]
    asked: Sequence[tuple[Any, ...]]  # measured, rejections, survey, design, the visit's date, options, poses given


def measured_site(folder: Path, name: str, cache: Cache) -> Site:
    """Run a site once, with measurements that are kept between runs, and keep what is judged."""
    asked: list[tuple[Any, ...]] = []
    judge = pipeline.monitor

    def noting(measured: Any, rejections: Any, survey: Any, design: Any, history: Any, day: Any, of: Any, *_: Any,
               **more: Any) -> ProgressReport:  # fmt: skip
        placing = {key: value for key, value in more.items() if key != "share"}
        asked.append((measured, rejections, survey, design, day, of, placing))
        return judge(measured, rejections, survey, design, history, day, of, *_, **more)

    pipeline.monitor = noting
    try:
        run_project(read_project(folder / "project.yaml"), Workplace(workers=1, cache=cache), lambda *_, **__: None)
    finally:
        pipeline.monitor = judge
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return Site(name=name, truth=truth, asked=tuple(asked))


def fitting_options(text: str) -> argparse.ArgumentParser:
    """Return the options of a benchmark that fits on sites, with `text` as its help."""
    parser = options(text)
    parser.add_argument("--seeds", type=int, nargs="*", default=(), help="sites beside the sample")
    parser.add_argument("--write", action="store_true", help="write what was fitted into the package")
    return parser


def fitting_sites(args: argparse.Namespace) -> Iterator[tuple[int, Site]]:
    """Give the sample and the sites of the seeds, measured, with their seeds; of a quick run the first visit alone."""
    from asbuilt_synthetic.__main__ import SAMPLE_SEED  # fits alone need the generator

    cache = Cache(folder=benchmark_folder() / "cache")
    for seed in (SAMPLE_SEED, *args.seeds):
        folder, name = (SAMPLE, "sample") if seed == SAMPLE_SEED else (generated_site(seed), f"seed {seed}")
        site = measured_site(folder, name, cache)
        print(f"{name}: measured", file=sys.stderr, flush=True)
        yield seed, replace(site, asked=site.asked[: 1 if args.quick else None])


def elements(site: Site) -> list[Element]:
    """Judge a site's visits one after the other, and lay what is said of each element beside the truth."""
    history, by_day = EMPTY_HISTORY, {}
    for measured, rejections, survey, design, day, of, placing in site.asked:
        report = pipeline.monitor(measured, rejections, survey, design, history, day, of, **placing)
        history = remember(history, report)
        by_day[day.isoformat()] = {one.global_id: one for one in report.elements}
    return [
        _element(f"{site.name} {visit['date']}", by_day[visit["date"]][one["global_id"]], one)
        for visit in site.truth["visits"]
        for one in visit["elements"]
    ]


def _element(where: str, said: ElementProgress, true: Mapping[str, Any]) -> Element:
    of = said.completion
    best = of.best if of.coverage > SEEN else None
    return Element(
        key=f"{where} {said.name}", state=said.state, true_state=true["state"], lower=of.lower, upper=of.upper,
        best=best, true=true["completion"], visible=true["half_visible_share"] > VISIBLE,
        unseen=true["visible_share"] < EXPECTED_UNKNOWN,
    )  # fmt: skip


def figures(rows: Sequence[Element]) -> str:
    """Return right, wrong and unknown states, truths in bounds, the bounds' width and the best's error in one line."""
    seen = [row for row in rows if row.visible]
    right = sum(row.state == row.true_state for row in seen)
    wrong = sum(wrongly(row) for row in rows)
    inside = np.mean([within(row) for row in rows])
    width = np.mean([row.upper - row.lower for row in rows])
    errors = [abs(row.best - row.true) for row in rows if row.best is not None]
    zero = sum(row.unseen and row.state == "not started" for row in rows)
    return (
        f"right {right} of {len(seen)}, wrong {wrong}, unseen at 0: {zero}, in bounds {inside:.1%}, "
        f"width {100 * width:.2f}, best off {100 * np.mean(errors):.2f}"
    )


def wrongly(row: Element) -> bool:
    """Say whether a state is certain and wrong."""
    return row.state in ("complete", "not started", "displaced") and row.state != row.true_state


def within(row: Element) -> bool:
    """Say whether the truth lies within the bounds."""
    return row.lower - ROUNDED <= row.true <= row.upper + ROUNDED


def changed(name: str, base: Sequence[Element], rows: Sequence[Element]) -> list[Line]:
    """Tell what changes without some rules: states to the better and worse, truths lost and won, bounds."""
    pairs = list(zip(base, rows, strict=True))
    states = [(a, b) for a, b in pairs if a.state != b.state]
    better = sum(b.state == b.true_state for a, b in states)
    worse = sum(a.state == a.true_state for a, b in states)
    lost = sum(within(a) and not within(b) for a, b in pairs)
    won = sum(within(b) and not within(a) for a, b in pairs)
    bounds = sum((a.lower, a.upper) != (b.lower, b.upper) for a, b in pairs)
    told_of = f"states +{better} -{worse} of {len(states)}, truths +{won} -{lost}, bounds changed {bounds}"
    lines = [told(f"without: {name}", f"{told_of}; {figures(rows)}", len(rows))]
    return lines + [
        told(f"    {b.key}", f"{a.state} -> {b.state}, true {b.true_state}", 1) for a, b in states if wrongly(b)
    ]


def main() -> int:
    """Judge the sites with all rules, and without each."""
    parser = options(__doc__ or "")
    parser.add_argument("--seeds", type=int, nargs="*", default=(), help="sites beside the sample")
    parser.add_argument("--shuttered", type=int, nargs="*", default=(), help="sites with formwork of thick panels")
    parser.add_argument("--only", nargs="*", default=[""], help="the rules whose name holds one of these")
    parser.add_argument("--together", nargs="+", default=[], help="the rules so named, all at once")
    args = parser.parse_args()
    cache = Cache(folder=benchmark_folder() / "cache")
    folders = {"sample": SAMPLE} | {f"seed {seed}": generated_site(seed) for seed in args.seeds}
    folders |= {f"shuttered {seed}": generated_site(seed, shuttered=True) for seed in args.shuttered}
    sites = [measured_site(folder, name, cache) for name, folder in folders.items()]
    chosen = [rule for rule in RULES if any(word in rule.name for word in args.only)][: 3 if args.quick else None]

    def judged(rules: Sequence[Rule]) -> list[Element]:
        with ExitStack() as off:
            for rule in rules:
                off.enter_context(without(rule))
            return [row for site in sites for row in elements(site)]

    base = judged(())
    lines = [told("with every rule", figures(base), len(base))]
    print(lines[0].figure, file=sys.stderr, flush=True)
    asked = [(rule.name, [rule]) for rule in chosen]
    if args.together:
        together = [rule for rule in RULES if any(word in rule.name for word in args.together)]
        asked = [(" + ".join(rule.name for rule in together), together)]
    for name, rules in asked:
        of_rule = changed(name, base, judged(rules))
        lines += of_rule
        print(*(f"{line.what} | {line.figure}" for line in of_rule), sep="\n", file=sys.stderr, flush=True)
    return report("What each rule of judging buys", lines, args)


if __name__ == "__main__":
    sys.exit(main())
