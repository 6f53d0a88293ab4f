"""Faults of meaning, and what they make of a run: named, refused or harmless, and what stands wrong without a word.

python benchmarks/hold/faults.py --check --json figures.json   every fault on the sample and two sites: an hour
python benchmarks/hold/faults.py --faultless 20 31 37          sites without a fault beside the sample: none is named
python benchmarks/hold/faults.py --quick                       six faults on the sample, whose measurements are kept

A state is wrong where it says complete or not started and the truth says otherwise; a truth is outside where the bounds
of an element or a storey don't hold it. Both count where the faultless run is right. They are silent where the visit's
report says nothing that the faultless one doesn't, neither of itself nor of that element.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.pipeline import run_project
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.tables import OF_FACES
from asbuilt_bim.scale.cache import Cache
from benchmarks.hold.edits import FAULTS, Fault
from benchmarks.sites import SAMPLE, benchmark_folder, generated_site
from benchmarks.table import Line, line, options, report, told, unjudged

SITES = (20, 31)
ROUNDED = 0.0005
"""What the truth's shares are rounded by."""
NO_REASON = Reason.STATIONS_NOT_USED, Reason.NOT_IN_TASKS, Reason.NOT_IN_COST_LINES
"""Words that say what follows from a fault, and not which one it is."""
Wrong = dict[str, str]
"""What is wrong of one visit, by element or storey: in words."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ran:
    """A run's reports by visit, or why there is none."""

    reports: Mapping[str, ProgressReport]
    refusal: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What one fault did to one site."""

    fault: str
    site: str
    verdict: str  # named, refused, harmless, or SILENT
    codes: tuple[str, ...]  # what is said that the faultless run doesn't say
    wrong: int  # states
    outside: int  # truths
    silent: tuple[str, ...]  # of both, those without a word


def run(site: Path, cache: Cache) -> Ran:
    """Run a site with measurements kept from before."""
    try:
        found = run_project(read_project(site / "project.yaml"), Workplace(cache=cache), lambda *_, **__: None)
    except AsBuiltError as problem:
        return Ran(reports={}, refusal=type(problem).__name__)
    return Ran(reports={one.visit_date.isoformat(): one for one in found.reports})


def faulty(site: Path, other: Path, fault: Fault, cache: Cache) -> Ran:
    """Run a copy of a site with a fault in it."""
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        copy = Path(scratch) / "site"
        shutil.copytree(site, copy)
        fault.edit(copy, other)
        return run(copy, cache)


def said(one: ProgressReport) -> set[str]:
    """Return what is said of a visit, its rig, its survey, its stations and the design: all but single faces."""
    told = [*(r for r in one.rejections if r.subject.kind not in (*OF_FACES, SubjectKind.DISC)), *one.notes]
    return {f"{each.code} {each.subject.kind} {each.subject.name}" for each in told if each.code not in NO_REASON}


def said_of(one: ProgressReport) -> dict[str, set[str]]:
    """Return the codes of the notes on each element."""
    return {element.global_id: {str(note.code) for note in element.notes} for element in one.elements}


def beside(one: ProgressReport) -> set[str]:
    """Return which elements are said to stand beside their design."""
    return {f"displaced: {element.name}" for element in one.elements if element.state == "displaced"}


def wrong_states(one: ProgressReport, truth: Mapping[str, Any]) -> Wrong:
    """Return the elements whose state contradicts the truth; one that the truth doesn't have isn't built either."""
    true = {element["global_id"]: element["state"] for element in truth["elements"]}
    return {
        element.global_id: f"{element.name} {element.state}, {true.get(element.global_id, 'twin')}"
        for element in one.elements
        if element.state in ("complete", "not started") and element.state != true.get(element.global_id, "twin")
    }


def outside(one: ProgressReport, truth: Mapping[str, Any]) -> Wrong:
    """Return the elements and storeys whose true completion isn't between the bounds."""
    true = {element["global_id"]: element["completion"] for element in truth["elements"]}
    storeys = {storey["name"]: storey["completion_by_area"] for storey in truth["storeys"]}
    bounds = [(e.global_id, e.name, e.completion, true.get(e.global_id)) for e in one.elements]
    bounds += [(s.name, s.name, s.completion, storeys.get(s.name)) for s in one.storeys]
    return {
        key: f"{name} {share:.3f} not in {of.lower:.3f}..{of.upper:.3f}"
        for key, name, of, share in bounds
        if share is not None and not of.lower - ROUNDED <= share <= of.upper + ROUNDED
    }


def judged(fault: Fault, site: str, ran: Ran, sound: Ran, truth: Mapping[str, Any]) -> Row:
    """Hold a run with a fault against the one without, and against the truth."""
    if ran.refusal:
        return Row(fault=fault.name, site=site, verdict="refused", codes=(ran.refusal,), wrong=0, outside=0, silent=())
    codes: set[str] = set()
    silent: list[str] = []
    counts = [0, 0]
    for visit in truth["visits"]:
        day = visit["date"]
        own, base = ran.reports[day], sound.reports[day]
        news = said(own) - said(base)
        codes |= {
            str(each.code) for each in (*own.rejections, *own.notes) if any(n.startswith(each.code) for n in news)
        }
        codes |= beside(own) - beside(base)
        of_base, of_own = said_of(base), said_of(own)
        for kind, find in enumerate((wrong_states, outside)):
            found, known = find(own, visit), find(base, visit)
            new = {key: text for key, text in found.items() if key not in known}
            counts[kind] += len(new)
            if not news:
                silent += [f"{day} {t}" for k, t in new.items() if not of_own.get(k, set()) - of_base.get(k, set())]
    nothing_counts = all(one.nothing_seen for one in ran.reports.values())
    verdict = "SILENT" if silent else "refused" if nothing_counts else "named" if codes or any(counts) else "harmless"
    return Row(
        fault=fault.name, site=site, verdict=verdict, codes=tuple(sorted(codes)), wrong=counts[0], outside=counts[1],
        silent=tuple(silent),
    )  # fmt: skip


def faults_of(site: Path, name: str, other: Path, faults: Iterable[Fault], cache: Cache) -> tuple[list[Row], Ran]:
    """Run a site without a fault, and with each."""
    truth = json.loads((site / "truth.json").read_text(encoding="utf-8"))
    sound = run(site, cache)
    rows = []
    for fault in faults:
        rows.append(judged(fault, name, faulty(site, other, fault, cache), sound, truth))
        one = rows[-1]
        shown = f"{one.fault:<44} {one.site:<8} {one.verdict:<9} wrong {one.wrong:>2}  outside {one.outside:>2}"
        print(f"  {shown}  {', '.join(one.codes)[:110]}", file=sys.stderr, flush=True)
    return rows, sound


def lines_of(rows: Sequence[Row]) -> list[Line]:
    """Judge the faults: none leaves anything wrong without a word."""
    silent = [f"{row.fault}, {row.site}: {text}" for row in rows for text in row.silent]
    lines = [
        line("states wrong or truths outside, without a word", str(len(silent)), "0", len(rows), not silent),
        told("wrong states in all, beside a word or not", str(sum(row.wrong for row in rows)), len(rows)),
        told("truths outside in all", str(sum(row.outside for row in rows)), len(rows)),
    ]
    for verdict in ("named", "refused", "harmless", "SILENT"):
        lines.append(told(f"faults {verdict}", str(sum(row.verdict == verdict for row in rows)), len(rows)))
    return [*lines, *(told(f"  {text}", "", 1) for text in silent)]


def faultless_lines(sound: Mapping[str, Ran]) -> list[Line]:
    """Judge the runs without a fault: none is named."""
    visits = [(name, one) for name, ran in sound.items() for one in ran.reports.values()]
    named = [f"{name} {one.visit_date}: {fault.code}" for name, one in visits for fault in one.faults]
    named += [f"{name} {one.visit_date}: {text}" for name, one in visits for text in sorted(beside(one))]
    lost = [f"{name}: {ran.refusal}" for name, ran in sound.items() if ran.refusal]
    lost += [f"{name} {one.visit_date}: no station placed" for name, one in visits if one.nothing_seen]
    first = line("visits without a fault where one is named", str(len(named)), "0", len(visits), not named + lost, 2)
    return [first, *(told(f"  {text}", "", 1) for text in (*named, *lost))]


def _arguments() -> argparse.Namespace:
    parser = options((__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="*", default=SITES, help="the sites beside the sample")
    parser.add_argument("--faultless", type=int, nargs="*", default=(), help="more sites, run without a fault only")
    parser.add_argument("--only", default="", help="the faults whose name holds this text")
    parser.add_argument("--kept", action="store_true", help="only the faults whose stations needn't be measured anew")
    parser.add_argument("--no-sample", action="store_true", help="leave the shipped sample out")
    return parser.parse_args()


def main() -> int:
    """Run the faults and print the table."""
    args = _arguments()
    cache = Cache(folder=benchmark_folder() / "faults-cache")
    faults = [one for one in FAULTS if args.only in one.name and not (args.kept and one.anew)]
    if args.quick:
        faults = [one for one in faults if one.quick]
    others = {seed: generated_site(seed) for seed in (() if args.quick else args.seeds)}
    sites = ({} if args.no_sample else {"sample": SAMPLE}) | {f"seed {seed}": site for seed, site in others.items()}
    rows: list[Row] = []
    sound: dict[str, Ran] = {}
    for name, site in sites.items():
        other = next((one for one in (*others.values(), SAMPLE) if one != site), SAMPLE)
        found, sound[name] = faults_of(site, name, other, faults, cache)
        rows += found
    for seed in args.faultless:
        sound[f"seed {seed}"] = run(generated_site(seed), cache)
    lines = [*lines_of(rows), *faultless_lines(sound)]
    if args.quick:
        lines = unjudged(lines, 25)
    table = {f"{row.fault} | {row.site}": asdict(row) for row in rows}
    return report("Faults of meaning", lines, args, {"faults": table})


if __name__ == "__main__":
    sys.exit(main())
