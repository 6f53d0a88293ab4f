"""Every real IFC file: inspected, written with invented results, reopened, written again, stripped.

python benchmarks/ifc_files.py --json benchmarks/recorded/ifc_files.json

The files lie in ASBUILT_BIM_DATA/ifc (default: ../shared/data/ifc); each is handled in a process of its own.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from table import line, options, report, told

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).parents[2] / "shared" / "data")) / "ifc"
QUICK_BYTES = 150_000
TIMEOUT_S = 1800.0


@dataclass(kw_only=True)
class FileResult:
    """What became of one file; every list of complaints should be empty."""

    name: str
    bytes: int
    schema: str = ""
    refused: str = ""
    inspected: str = ""  # "yes", or why it was refused
    elements: int = 0
    added: int = 0
    write_s: float = 0.0
    inspect_s: float = 0.0
    peak_mb: float = 0.0
    changed: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    not_idempotent: list[str] = field(default_factory=list)
    not_stripped: list[str] = field(default_factory=list)
    crashed: str = ""


def examine(path: Path) -> FileResult:
    """Do with one file all that is asked, and say what went wrong."""
    import ifcopenshell
    from ifc_compare import changes, new_errors, same
    from ifc_invented import invented_reports

    from asbuilt_bim.errors import AsBuiltError
    from asbuilt_bim.ifc.source import open_ifc
    from asbuilt_bim.ifc.writer import strip_asbuilt, write_asbuilt

    result = FileResult(name=str(path.relative_to(DATA)), bytes=path.stat().st_size)
    try:
        source = open_ifc(path)
        *earlier, last = invented_reports(source)
        result.schema, result.elements = source.schema_identifier, len(last.elements)
        with tempfile.TemporaryDirectory() as place:
            first, second, bare = (Path(place) / name for name in ("first.ifc", "second.ifc", "bare.ifc"))
            start = time.perf_counter()
            write_asbuilt(path, last, first, earlier=earlier)
            result.write_s = time.perf_counter() - start
            result.peak_mb = peak_mb()
            written = ifcopenshell.open(str(first))
            result.changed, added = changes(source, written)
            result.added = len(added)
            result.errors = new_errors(source, written, added)
            write_asbuilt(first, last, second, earlier=earlier)
            result.not_idempotent = same(written, ifcopenshell.open(str(second)))
            strip_asbuilt(second, bare)
            result.not_stripped = same(source, ifcopenshell.open(str(bare)))
    except AsBuiltError as problem:
        result.refused = str(problem).replace(str(DATA), "")
    _inspect(path, result)
    return result


def _inspect(path: Path, result: FileResult) -> None:
    from asbuilt_bim.errors import AsBuiltError
    from asbuilt_bim.ifc.reader import read_design

    start = time.perf_counter()
    try:
        read_design(path)
        result.inspected = "yes"
    except AsBuiltError as problem:
        result.inspected = str(problem).replace(str(DATA), "")
    result.inspect_s = time.perf_counter() - start


def peak_mb() -> float:
    """Return this process's largest resident memory so far; 0 where the system doesn't tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0 if sys.platform != "darwin" else 1024.0**2)


def _guarded(path: Path) -> FileResult:
    try:
        return examine(path)
    except Exception as problem:
        return FileResult(
            name=str(path.relative_to(DATA)), bytes=path.stat().st_size, crashed=f"{type(problem).__name__}: {problem}"
        )


def run_all(paths: list[Path], workers: int) -> list[FileResult]:
    """Examine the files, each in a new process; a process that dies is a crash of its file."""
    from ifc_compare import rules_once

    rules_once()
    method = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    results = []
    with multiprocessing.get_context(method).Pool(workers, maxtasksperchild=1) as pool:
        waiting = [(path, pool.apply_async(_guarded, (path,))) for path in paths]
        for path, answer in waiting:
            try:
                results.append(answer.get(TIMEOUT_S))
            except multiprocessing.TimeoutError:
                results.append(FileResult(name=str(path.relative_to(DATA)), bytes=0, crashed="died or took too long"))
            _print_row(results[-1])
    return results


def _print_row(one: FileResult) -> None:
    bad = {
        "changed": one.changed,
        "errors": one.errors,
        "again": one.not_idempotent,
        "strip": one.not_stripped,
    }
    said = "; ".join(f"{what}: {len(found)}, e.g. {found[0][:300]}" for what, found in bad.items() if found)
    said = (
        (one.crashed and f"CRASHED {one.crashed}") or (one.refused and f"refused: {one.refused[:90]}") or said or "ok"
    )
    print(
        f"  {one.name[:60]:<60} {one.schema[:7]:<7} {one.bytes / 1e6:7.2f} MB {one.write_s:6.2f} s "
        f"{one.peak_mb:6.0f} MB {one.elements:5d} el {one.added:6d} added  {said or 'ok'}",
        flush=True,
    )


def main() -> int:
    """Examine the files and print the table."""
    parser = options(__doc__ or "")
    parser.add_argument("--only", default="", help="only files whose path holds this text")
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    paths = sorted(p for p in DATA.rglob("*") if p.suffix.lower() == ".ifc" and args.only in str(p))
    if args.quick:
        paths = [path for path in paths if path.stat().st_size < QUICK_BYTES]
    results = run_all(sorted(paths, key=lambda path: path.stat().st_size), args.workers)
    written = [one for one in results if not one.refused and not one.crashed]
    n = len(written)

    def clean(what: str, lists: list[list[str]]) -> None:
        good = sum(not found for found in lists)
        lines.append(line(what, f"{good} of {n}", "all", n, good == n))

    lines = [
        line("files handled without a crash", f"{sum(not r.crashed for r in results)} of {len(results)}", "all",
             len(results), not any(r.crashed for r in results)),
        told("  written", str(n), len(results)),
        told("  refused by name", str(sum(bool(r.refused) for r in results)), len(results)),
        told("  inspected", str(sum(r.inspected == "yes" for r in results)), len(results)),
    ]  # fmt: skip
    clean("originals unchanged but for the short list", [r.changed for r in written])
    clean("no new validation error, express rules too", [r.errors for r in written])
    clean("written twice is the same", [r.not_idempotent for r in written])
    clean("stripped is the source again", [r.not_stripped for r in written])
    return report("Real IFC files", lines, args, {"files": [asdict(one) for one in results]})


if __name__ == "__main__":
    sys.exit(main())
