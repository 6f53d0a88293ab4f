"""Every real IFC file: inspected, written with invented results, reopened, compared, written again, stripped.

python benchmarks/ifc/files.py --json benchmarks/recorded/ifc_files.json

The files lie in ASBUILT_BIM_DATA/ifc (default: ../shared/data/ifc); each is handled in a process of its own.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.ifc.compare import rules_once
from benchmarks.ifc.rounds import COMPLAINTS, FileResult, examine
from benchmarks.sites import DATA, absent
from benchmarks.table import Line, line, options, quantiles, report, told

FILES = DATA / "ifc"
QUICK_BYTES = 60_000
TIMEOUT_S = 1800.0


def main() -> int:
    """Examine the files and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--only", default="", help="only files whose path holds this text")
    parser.add_argument("--less-than", type=int, default=None, metavar="BYTES", help="only files smaller than this")
    parser.add_argument("--no-inspect", action="store_true", help="leave the reading of the geometry out")
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    if absent(FILES):
        return 0
    most = QUICK_BYTES if args.quick else args.less_than
    found = [p for p in FILES.rglob("*") if p.suffix.lower() == ".ifc" and args.only in str(p)]
    paths = sorted((p for p in found if most is None or p.stat().st_size < most), key=lambda p: p.stat().st_size)
    results = run_all(paths, args.workers, not args.no_inspect)
    written = [one for one in results if not one.refused and not one.crashed]
    sound = sum(not one.crashed for one in results)
    lines = [
        line("files without a crash", f"{sound} of {len(results)}", "all", len(results), sound == len(results)),
        told("  written", str(len(written)), len(results)),
        told("  refused by name", str(sum(bool(one.refused) for one in results)), len(results)),
        told("  inspected", str(sum(one.inspected == "yes" for one in results)), len(results)),
    ]
    lines += [item for name in ("plain", "planned") for item in _judged(name, written)]
    return report("Real IFC files", lines, args, summary(results), {"files": [asdict(one) for one in results]})


def summary(results: list[FileResult]) -> dict[str, object]:
    """Return what is recorded of the files: their schemas, what was refused and why, what is wrong, what it costs."""
    return {
        "schemas": dict(Counter(one.schema for one in results)),
        "refused": dict(Counter(_reason(one.refused) for one in results if one.refused)),
        "not_inspected": dict(Counter(_reason(one.inspected) for one in results if one.inspected != "yes")),
        "wrong": {one.name: one.crashed or one.complaint for one in results if one.crashed or one.complaint},
        "spread": {
            "bytes": quantiles(one.bytes for one in results),
            "write_s": quantiles(one.plain.write_s for one in results if not one.refused),
            "inspect_s": quantiles(one.inspect_s for one in results),
            "peak_mb": quantiles(one.peak_mb for one in results),
        },
    }


def _reason(refusal: str) -> str:
    """Leave the file's name out of a refusal, and what else differs from file to file."""
    return refusal.partition(": ")[2].partition(" (Ifc")[0]


def run_all(paths: list[Path], workers: int, inspect: bool) -> list[FileResult]:
    """Examine the files, each in a new process; a process that dies is a crash of its file."""
    rules_once()
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    results = []
    with multiprocessing.get_context(method).Pool(workers, maxtasksperchild=1) as pool:
        waiting = [(path, pool.apply_async(_guarded, (path, inspect))) for path in paths]
        for path, answer in waiting:
            try:
                results.append(answer.get(TIMEOUT_S))
            except multiprocessing.TimeoutError:
                results.append(FileResult(name=_name(path), bytes=0, crashed="died or took too long"))
            _print_row(results[-1])
    return results


def _guarded(path: Path, inspect: bool) -> FileResult:
    try:
        return examine(path, _name(path), inspect)
    except Exception as problem:
        return FileResult(name=_name(path), bytes=path.stat().st_size, crashed=f"{type(problem).__name__}: {problem}")


def _name(path: Path) -> str:
    return path.relative_to(FILES).as_posix()


def _print_row(one: FileResult) -> None:
    answer = one.complaint or "ok"
    if one.refused or one.crashed:
        answer = f"CRASHED {one.crashed}" if one.crashed else f"refused: {one.refused[:90]}"
    print(
        f"  {one.name[-60:]:<60} {one.schema[:7]:<7} {one.bytes / 1e6:7.2f} MB {one.plain.write_s:6.2f} s "
        f"{one.peak_mb:6.0f} MB {one.elements:5d} el {one.plain.added:6d} added  {answer}",
        flush=True,
    )


def _judged(name: str, written: list[FileResult]) -> list[Line]:
    """Judge one of the two rounds over all files."""
    title = {"plain": "", "planned": "with a plan and colours: "}[name]
    rounds = [getattr(one, name) for one in written if name == "plain" or one.elements]
    lines = []
    for key, what in COMPLAINTS.items():
        good = sum(not getattr(one, key) for one in rounds)
        lines.append(line(f"{title}{what}", f"{good} of {len(rounds)}", "all", len(rounds), good == len(rounds)))
    return [*lines, told(f"{title}entities added", str(sum(one.added for one in rounds)), len(rounds))]


if __name__ == "__main__":
    sys.exit(main())
