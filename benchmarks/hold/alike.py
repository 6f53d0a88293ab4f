"""The same photos give the same `result.json`, but for times: run again, with more workers, with more threads.

python benchmarks/hold/alike.py --check            six stations of the sample, five runs without a cache
python benchmarks/hold/alike.py --check --quick    two stations, three runs

`OMP_NUM_THREADS` stands for another machine's core count: numerical libraries take it for one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.hold.cluster import without_times
from benchmarks.hold.run_checks import current
from benchmarks.sites import ONE_THREAD, small_sample
from benchmarks.table import line, options, report

RUNS = {"again": (1, 1), "2 workers": (2, 1), "4 threads": (1, 4), "2 workers, 4 threads": (2, 4)}
"""Workers and threads of each run that is held against the first one, which has one of each."""
QUICK = "2 workers", "4 threads"


def made(site: Path, out: Path, workers: int, threads: int) -> Any:
    """Return the result of a run of its own, without what tells the time."""
    command = [sys.executable, "-m", "asbuilt_bim", "run", str(site / "project.yaml"), "--out", str(out)]
    done = subprocess.run(
        [*command, "--workers", str(workers), "--no-cache"], check=False, capture_output=True, text=True,
        env={**os.environ, **dict.fromkeys(ONE_THREAD, str(threads))},
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"the run ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return without_times(json.loads((current(out) / "result.json").read_text(encoding="utf-8")))


def unlike(one: Any, other: Any, where: str = "result") -> Iterator[str]:
    """Yield where two documents aren't equal, to the last digit."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in one.keys() | other.keys():
            yield from unlike(one.get(key), other.get(key), f"{where}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from unlike(a, b, f"{where}[{number}]")
    elif one != other:
        yield f"{where}: {str(one)[:60]} and {str(other)[:60]}"


def main() -> int:
    """Run, compare and print the table."""
    args = options(__doc__ or "").parse_args()
    lines, shown = [], []
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-alike-") as folder:
        site = small_sample(Path(folder), 2 if args.quick else 6)
        first = made(site, Path(folder) / "first", 1, 1)
        for name, (workers, threads) in RUNS.items():
            if args.quick and name not in QUICK:
                continue
            found = sorted(unlike(first, made(site, Path(folder) / name.replace(" ", "-"), workers, threads)))
            shown += [f"{name}: {one}" for one in found[:5]]
            what = f"{name}: values of result.json that differ from a run with one worker and one thread"
            lines.append(line(what, str(len(found)), "0", 1, not found, 1))
    for one in shown:
        print(f"  {one}")
    return report("The same numbers in every run", lines, args)


if __name__ == "__main__":
    sys.exit(main())
