"""Damaged inputs of every sort: each is read or refused in words, never with a traceback, never for ever.

python benchmarks/hold/inputs.py --check --done FILE     12,000 by the readers, 1,500 by the command; hours, resumable
python benchmarks/hold/inputs.py --check --quick         150 by the readers, 6 by the command

A case is a seed: it says the sort of file, and what is done to its bytes (`readers.py`). A case is read in a process
with limits of memory and time. `--done` notes each case as a line of JSON and takes up where an earlier run ended.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from benchmarks.hold.children import LIMIT_S, Child
from benchmarks.hold.ifc_hostile import LIMIT_BYTES, OWN_FAULT, ask
from benchmarks.hold.readers import Sort, damaged, sorts
from benchmarks.sites import ONE_THREAD, ROOT, SAMPLE
from benchmarks.table import Line, line, options, report, told

CASES, COMMANDS, QUICK_CASES, QUICK_COMMANDS = 12_000, 1_500, 150, 6
FIRST_COMMAND = 10_000_000
"""Seeds of cases by the command begin here."""
FINE = ("read", "refused")


def by_readers(seeds: Iterable[int], done: dict[int, dict[str, Any]], keep: Path | None, workers: int) -> None:
    """Give the cases to the readers; `done` takes what comes of them."""
    left = [seed for seed in seeds if seed not in done]
    shares = [left[n::workers] for n in range(workers)]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda share: _asked(share, done, keep), shares))


def _asked(seeds: list[int], done: dict[int, dict[str, Any]], keep: Path | None) -> None:
    with Child() as child:
        for seed in seeds:
            found = child.ask(seed)
            if sorts()[seed % len(sorts())].name.startswith("IFC") and found["told"] not in FINE:
                found = by_command(seed)  # the geometry kernel died: the program reads it in a process apart
            _note(found, done, keep)


def _note(found: dict[str, Any], done: dict[int, dict[str, Any]], keep: Path | None) -> None:
    found.setdefault("sort", sorts()[int(found["seed"]) % len(sorts())].name)
    done[int(found["seed"])] = found
    if keep is not None:
        with keep.open("a", encoding="utf-8") as file:
            file.write(json.dumps(found) + "\n")


def by_command(seed: int) -> dict[str, Any]:
    """Give the case of a seed to the command itself, and say what came of it."""
    sort, did, data = damaged(seed)
    with tempfile.TemporaryDirectory(prefix="hold-") as place:
        words = _words(sort, data, Path(place))
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        own = {**os.environ, **ONE_THREAD, "PYTHONPATH": path, "ASBUILT_BIM_CACHE": str(Path(place) / "cache")}
        found = ask(words, cwd=place, env=own)
    answer = {"seed": seed, "sort": sort.name, "done": did, "seconds": round(found.seconds, 2)}
    if found.code not in (0, 1, 2) or "Traceback" in found.said or OWN_FAULT in found.said:
        return answer | {"told": f"died: exit code {found.code}: {found.said[-200:]}"}
    if found.seconds > LIMIT_S or found.memory_bytes > LIMIT_BYTES:
        return answer | {"told": f"hang: {found.seconds:.0f} s of processor time, {found.memory_bytes / 1e9:.1f} GB"}
    return answer | {"told": FINE[found.code > 0]}


def _words(sort: Sort, data: bytes, place: Path) -> list[str]:
    """Lay a case's files out and return the command line that reads them."""
    site = place / "site"
    site.mkdir()
    for name in ("design.ifc", "markers.csv", "project.yaml"):
        shutil.copyfile(SAMPLE / name, site / name)
    for name, beside in sort.beside.items():
        if not (site / name).exists():
            (site / name).parent.mkdir(parents=True, exist_ok=True)
            (site / name).write_bytes(beside)
    target = {"markers": "markers.csv", "IFC by byte": "design.ifc", "IFC by entity": "design.ifc"}.get(sort.name)
    (site / (target or sort.file)).write_bytes(data)
    if sort.name.startswith("IFC") or sort.name == "ifczip":
        return ["inspect", str(site / (target or sort.file))]
    if sort.name.startswith(("photo", "board")):
        other = SAMPLE / "visits/2026-03-02/G1_right.jpg"
        rig_file = _rig(site)
        return ["measure", str(site / sort.file), str(other), "--rig", str(rig_file), "--out", str(place / "out")]
    if sort.name.startswith("masks"):
        pair = [str(SAMPLE / f"visits/2026-03-02/G1_{side}.jpg") for side in ("left", "right")]
        given = ["--mask-class", "1=wall", "--mask-class", "2=column"] if sort.name.endswith("PNG") else []
        return [
            "measure",
            *pair,
            "--masks",
            str(site / sort.file),
            *given,
            "--rig",
            str(_rig(site)),
            "--out",
            str(place / "out"),
        ]
    text = (site / "project.yaml").read_text(encoding="utf-8", errors="surrogateescape")
    if sort.name.startswith("rig"):
        second = f", file_right: {next(iter(sort.beside))}" if sort.beside else ""
        text = _replaced(text, "rig:", f"rig: {{file: {sort.file}{second}}}")
    elif sort.name.startswith("schedule"):
        text += f"\nschedule: {sort.file}\n"
    elif sort.name == "result":
        text += f"\nhistory: [{sort.file}]\n"
    elif sort.name == "control points":
        text = _replaced(text, "rig:", f"rig: {{control_points: {{file: {sort.file}, photo_size_px: [1280, 960]}}}}")
    elif sort.name.startswith("network"):
        text += "\nnetworks: {segment: concrete.yaml}\n"
    if not sort.name.startswith(("rig", "control", "project")):
        text = _replaced(text, "rig:", f"rig: {{file: {_rig(site).name}}}")
    (site / "project.yaml").write_text(text, encoding="utf-8", errors="surrogateescape")
    return ["run", str(site / "project.yaml"), "--out", str(place / "out"), "--workers", "1"]


def _rig(site: Path) -> Path:
    one = next(sort for sort in sorts() if sort.name == "rig: rig")
    (site / "sound_rig.yaml").write_bytes(one.sample)
    return site / "sound_rig.yaml"


def _replaced(text: str, key: str, line_: str) -> str:
    """Put a line in the place of a key and what stands below it."""
    kept, skipping = [], False
    for row in text.splitlines():
        skipping = row.startswith(key) or (skipping and row[:1] in (" ", ""))
        if row.startswith(key):
            kept.append(line_)
        elif not skipping:
            kept.append(row)
    return "\n".join(kept) + "\n"


def lines_of(found: list[dict[str, Any]], commands: list[dict[str, Any]]) -> list[Line]:
    """Return the table: a line a sort of file, and those that are judged."""
    by_sort: dict[str, Counter[str]] = defaultdict(Counter)
    for one in found:
        by_sort[str(one["sort"])][str(one["told"]).partition(":")[0]] += 1
    lines = [
        told(name, ", ".join(f"{what} {count}" for what, count in sorted(tally.items())), tally.total())
        for name, tally in sorted(by_sort.items())
    ]
    for name, cases in (("by the readers", found), ("by the command", commands)):
        bad = [one for one in cases if one["told"] not in FINE]
        lines.append(line(f"{name}: crashed, died or hung", str(len(bad)), "none", len(cases), not bad, least_n=5))
    longest = max((float(one.get("seconds", 0.0)) for one in (*found, *commands)), default=0.0)
    lines.append(line("longest case", f"{longest:.1f} s", f"{LIMIT_S:.0f} s", len(found), longest < LIMIT_S))
    return lines


def main() -> int:
    """Run it."""
    parser = options(__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=0, help="by the readers")
    parser.add_argument("--commands", type=int, default=-1, help="by the command")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--done", type=Path, help="note each case here, and leave out those that stand here")
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    cases = args.cases or (QUICK_CASES if args.quick else CASES)
    count = args.commands if args.commands >= 0 else QUICK_COMMANDS if args.quick else COMMANDS
    seeds = range(args.first, args.first + cases)
    commands = range(FIRST_COMMAND + args.first, FIRST_COMMAND + args.first + count)
    done: dict[int, dict[str, Any]] = {}
    if args.done is not None and args.done.exists():
        rows = [json.loads(row) for row in args.done.read_text(encoding="utf-8").splitlines() if row.endswith("}")]
        done = {int(row["seed"]): row for row in rows}
    by_readers(seeds, done, args.done, args.workers)
    with ThreadPoolExecutor(args.workers) as pool:
        for found in pool.map(by_command, [seed for seed in commands if seed not in done]):
            _note(found, done, args.done)
    bad = [done[seed] for seed in (*seeds, *commands) if done[seed]["told"] not in FINE]
    for one in bad[:40]:
        print(f"  seed {one['seed']}, {one['sort']} ({one.get('done', '')}): {one['told']}")
    lines = lines_of([done[seed] for seed in seeds], [done[seed] for seed in commands])
    return report("Damaged inputs", lines, args, {"bad": bad})


if __name__ == "__main__":
    sys.exit(main())
