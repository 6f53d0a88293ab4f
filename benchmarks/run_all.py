"""Every benchmark, one after the other or two at a time: which crash, and which of those expected to hold don't.

python benchmarks/run_all.py                      the smallest case of each, two at a time: some ten minutes
python benchmarks/run_all.py --slow --out FOLDER  each whole, for hours; its figures go to FOLDER
python benchmarks/run_all.py --brief              the same, but those that take long are only started
python benchmarks/run_all.py --only ifc           those whose path holds this text

What lacks data (ASBUILT_BIM_DATA) or a package is skipped, and named. Exit code 1 where one crashes, takes too long, or
falls short of limits that it is expected to keep.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # the root of the project
from benchmarks.sites import DATA, ONE_THREAD, ROOT

QUICK_S, SLOW_S = 600.0, 6 * 3600.0
RENDERER = ("asbuilt_synthetic", "embreex")
TOOLS = ("ifccsv", "ifc4d", "ifc5d", "ifcdiff")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One benchmark: its smallest and its whole case; those with --check are expected to hold."""

    script: str
    quick: str = "--quick"
    slow: str = "--check"
    data: str = ""  # what it needs of the data folder
    room: str = ""  # what it needs of the project
    packages: tuple[str, ...] = ()
    long: bool = False  # its smallest case takes over a quarter of a minute of a processor, and others run its code


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of a case: `code` is None where it was skipped, and `said` tells why, or what it printed."""

    name: str
    seconds: float
    code: int | None
    said: str


CASES = (
    Case(script="site/site.py", quick="--quick --check", packages=RENDERER, long=True),
    Case(script="faces/faces.py", packages=RENDERER, long=True),
    Case(script="networks/networks.py", slow="", packages=RENDERER, long=True),
    Case(script="site/light.py", packages=RENDERER, long=True),
    Case(script="site/subsets.py", packages=RENDERER, long=True),
    Case(script="site/over_visits.py", quick="--quick --check"),
    Case(script="visit/plan.py", quick="--quick --check", packages=RENDERER),
    Case(script="visit/check.py", quick="--quick --check", long=True),
    Case(script="site/page.py"),
    Case(script="hold/photos.py", quick="--quick --check"),
    Case(script="hold/faults.py", slow="--check --faultless 37 106 108 139 301 302", packages=RENDERER, long=True),
    Case(script="hold/inputs.py", quick="--quick --check"),
    Case(script="hold/kills.py", quick="--quick --check", long=True),
    Case(script="valuation/fill.py", quick="--quick --check"),
    Case(script="valuation/tables.py", quick="--check", packages=TOOLS),
    Case(script="hold/ifc_hostile.py", quick="--quick --check", long=True),
    Case(script="hold/alike.py", quick="--quick --check", slow="--check", long=True),
    Case(script="hold/cluster.py", quick="--quick --check", packages=("distributed",)),
    Case(script="site/speed.py", slow="", long=True),
    Case(script="site/cost.py", slow="", long=True),
    Case(script="hold/scale.py", slow="", packages=("asbuilt_synthetic",), long=True),
    Case(script="house/scrambled.py", quick="--quick --check", room="asbuilt_bim/report/wording", long=True),
    Case(script="target/target.py", long=True),
    Case(script="target/odds.py", long=True),
    Case(script="rigs/knocked.py", long=True),
    Case(script="rigs/boards.py", quick="--quick", slow="--check"),
    Case(script="rigs/zed.py", quick="--quick", slow="--check", data="stereo/zed_corridor"),
    Case(script="rigs/files.py", quick="--quick --check", data="rigs"),
    Case(script="register/place.py", quick="--quick", slow="", long=True),
    Case(script="register/real.py", quick="--quick", slow="--check", data="stereo", long=True),
    Case(script="register/by_design.py", quick="--quick", slow="", packages=RENDERER, long=True),
    Case(script="rigs/factory.py", quick="--check", data="stereo"),
    Case(script="faces/sigma.py", packages=RENDERER),
    Case(script="faces/ends.py", slow="", packages=RENDERER, long=True),
    Case(script="faces/fit_edges.py", slow="", packages=RENDERER, long=True),
    Case(script="faces/fit_sides.py", slow="", packages=RENDERER, long=True),
    Case(script="faces/fit_ends.py", slow="", packages=RENDERER, long=True),
    Case(script="site/fit_evidence.py", slow="", packages=RENDERER, long=True),
    Case(script="faces/faces.py --networks", packages=RENDERER, long=True),
    Case(script="networks/odds.py", slow="", packages=RENDERER, long=True),
    Case(script="ifc/files.py", quick="--quick --check", slow="--check --workers 2", data="ifc", long=True),
    Case(script="ifc/read.py", quick="--quick --check", data="ifc"),
    Case(script="ifc/speed.py", data="ifc/large", long=True),
    Case(script="ifc/tools.py", quick="--check", packages=TOOLS),
    Case(script="ifc/schedule.py", quick="--check", packages=("ifc4d",)),
    Case(script="real/photos.py", slow="", data="photos", long=True),
    Case(script="real/rigs.py", slow="", data="rigs", long=True),
    Case(script="real/depth.py", quick="--check", slow="", data="stereo"),
    Case(script="real/planes.py", slow="", data="stereo"),
    Case(script="real/repeats.py", slow="", data="stereo", long=True),
    Case(script="real/whole_runs.py", slow="", data="stereo"),
    Case(script="valuation/valuation.py", quick="--quick --check"),
    Case(script="house/structure.py", quick="--check"),
    Case(script="house/core_numbers.py", quick="", slow=""),
)


def lacking(case: Case) -> str:
    """Say what a case can't do without and isn't here; "" where it can run."""
    if case.data and not (DATA / case.data).exists():
        return f"no {case.data} in the data folder"
    if case.room and not (ROOT / case.room).is_dir():
        return f"no {case.room}"
    without = [name for name in case.packages if importlib.util.find_spec(name) is None]
    return f"not installed: {', '.join(without)}" if without else ""


def run(case: Case, slow: bool, brief: bool, out: Path | None) -> Outcome:
    """Run a case in a process of its own; where it is `brief`, a long one says no more than what it is for."""
    script, *words = [*case.script.split(), *(case.slow if slow else case.quick).split()]
    if lack := lacking(case):
        return Outcome(name=case.script, seconds=0.0, code=None, said=lack)
    if brief and case.long:
        words = ["--help"]
    elif out is not None and not script.endswith("core_numbers.py") and script != "networks/odds.py":
        words += ["--json", str(out / f"{case.script.replace('/', '_').replace('.py', '').replace(' --', '_')}.json")]
    command = [sys.executable, str(ROOT / "benchmarks" / script), *words]
    folders = [str(ROOT), str(ROOT / "synthetic"), str(ROOT / "training"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(folder for folder in folders if folder)}
    start = time.perf_counter()
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=environment, timeout=SLOW_S if slow else QUICK_S, check=False, text=True,
            encoding="utf-8", errors="replace", stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        code, said = done.returncode, done.stdout
    except subprocess.TimeoutExpired as stopped:
        code, said = 124, f"took more than {stopped.timeout:.0f} s"
    outcome = Outcome(name=" ".join([script, *words]), seconds=time.perf_counter() - start, code=code, said=said)
    print(f"{row(outcome)}", file=sys.stderr, flush=True)
    return outcome


def row(one: Outcome) -> str:
    """Write one row of the table."""
    verdict = f"skipped: {one.said}" if one.code is None else "ok" if one.code == 0 else "FAILED"
    code = "-" if one.code is None else str(one.code)
    return f"  {one.name:<44} {one.seconds:7.1f} s  rc {code:<4} {verdict}"


def main() -> int:
    """Run them and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--slow", action="store_true", help="the whole cases, one after the other")
    parser.add_argument("--brief", action="store_true", help="start those that take long, and no more")
    parser.add_argument("--only", default="", help="those whose path holds this text")
    parser.add_argument("--out", type=Path, help="folder for the figures of each")
    parser.add_argument("--jobs", type=int, default=0, help="how many at a time; 2, of slow ones 1")
    args = parser.parse_args()
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
    chosen = [case for case in CASES if args.only in case.script]
    start = time.perf_counter()
    with ThreadPoolExecutor(args.jobs or (1 if args.slow else 2)) as pool:
        outcomes = list(pool.map(lambda case: run(case, args.slow, args.brief, args.out), chosen))
    bad = [one for one in outcomes if one.code]
    for one in bad:
        print(f"\n--- {one.name}: the end of what it said\n" + "\n".join(one.said.splitlines()[-25:]))
    print("\nBenchmarks, " + ("whole" if args.slow else "the smallest case of each"))
    for one in outcomes:
        print(row(one))
    print(f"  in all {time.perf_counter() - start:.0f} s, {len(bad)} of {len(outcomes)} failed")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
