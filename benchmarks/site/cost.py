"""What a run costs: seconds a station and in all, the share of each step, the memory of its largest process.

python benchmarks/site/cost.py --json figures.json    the sample
python benchmarks/site/cost.py --quick                two of its stations
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.sites import SAMPLE, run_site, small_sample
from benchmarks.table import Line, options, report, told


def peak_memory_mb() -> float | None:
    """Return the resident peak of the largest child process so far; None where the system doesn't tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return peak / (1024.0 if sys.platform != "darwin" else 1024.0**2)


def main() -> int:
    """Run the sample once in one process and print what it cost."""
    parser = options(__doc__ or "")
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        run = run_site(small_sample(Path(scratch)) if args.quick else SAMPLE, "sample", args.workers)
    stations = [station for result in run.results.values() for station in result["stations"]]
    steps: dict[str, list[float]] = defaultdict(list)
    for station in stations:
        for step, seconds in station["seconds"].items():
            steps[step].append(seconds)
    totals = [sum(station["seconds"].values()) for station in stations]
    whole = sum(totals)
    lines: list[Line] = [
        told(f"whole run, {args.workers} of {os.cpu_count()} processors", f"{run.seconds:.1f} s", 1),
        told("a station, median", f"{np.median(totals):.2f} s", len(totals)),
        told("a station, slowest", f"{max(totals):.2f} s", len(totals)),
        told("calibration, IFC, matching, outputs", f"{run.seconds - whole / args.workers:.1f} s", 1),
    ]
    memory = peak_memory_mb()
    if memory is not None:
        lines.append(told("largest process, resident", f"{memory:.0f} MB", 1))
    for step, seconds in sorted(steps.items(), key=lambda item: -sum(item[1])):
        lines.append(told(f"  {step}", f"{sum(seconds) / whole:.0%}", len(seconds)))
    return report("What a run costs", lines, args)


if __name__ == "__main__":
    sys.exit(main())
