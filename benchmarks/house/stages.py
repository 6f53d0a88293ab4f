"""Runs one checkout's program and writes what each stage gave: `stages.py CHECKOUT OUT.json PROJECT...`.

Functions are found by their names, wherever the checkout keeps them, so that old and new layouts compare.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
from flatten import Flat, file_table, flatten

STAGES = {
    "measured": "measure_visit",
    "registered": "register",
    "matched": "match_faces",
    "adjusted": "adjust_with_design",
    "surfaces": "classify_surface",
    "report": "summarise",
}
PAIRS = (("2026-03-02", "G1"), ("2026-03-16", "U4"))
"""Two pairs of the shipped sample that are measured without a design."""


def home_of(checkout: Path, function: str) -> str:
    """Return the dotted name of the module that defines a function."""
    for path in sorted((checkout / "asbuilt_bim").rglob("*.py")):
        if re.search(rf"^def {function}\(", path.read_text(encoding="utf-8"), re.MULTILINE):
            return ".".join(path.relative_to(checkout).with_suffix("").parts)
    raise SystemExit(f"{checkout}: no module defines {function}")


def recorder(table: dict[str, Flat], site: str, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function, which now also notes what it gave, call by call."""
    calls = 0

    def noted(*words: Any, **named: Any) -> Any:
        nonlocal calls
        answer = function(*words, **named)
        table[f"{site}/{stage}/{calls}"] = dict(flatten(answer))
        calls += 1
        return answer

    return noted


def run_sites(checkout: Path, sites: list[Path], scratch: Path) -> dict[str, Flat]:
    """Run every site in this process, and return each stage's and each output's table."""
    flow = importlib.import_module(home_of(checkout, "monitor"))
    command = importlib.import_module("asbuilt_bim.cli")
    table: dict[str, Flat] = {}
    own = {name: getattr(flow, name) for name in STAGES.values()}
    for site in sites:
        name = site.parent.name
        print(f"  {checkout.name}: {name}", file=sys.stderr, flush=True)
        for stage, function in STAGES.items():
            setattr(flow, function, recorder(table, name, stage, own[function]))
        out = scratch / name
        code = call(command, ["run", str(site), "--out", str(out), "--no-cache", "--quiet"])
        table[f"{name}/exit"] = {"code": code}
        table |= outputs(f"{name}/outputs", out)
    return table


def run_others(checkout: Path, sample: Path, scratch: Path) -> dict[str, Flat]:
    """Calibrate, measure two pairs, make the report again and strip the copy, on the shipped sample."""
    command = importlib.import_module("asbuilt_bim.cli")
    table: dict[str, Flat] = {}
    rig, folder = scratch / "rig.yaml", sample.parent
    call(command, ["calibrate", str(sample), "--out", str(rig)])
    yaml = importlib.import_module("yaml")
    table["calibrate"] = dict(flatten(yaml.safe_load(rig.read_text(encoding="utf-8"))))
    for day, name in PAIRS:
        photos = [str(folder / "visits" / day / f"{name}_{side}.jpg") for side in ("left", "right")]
        out = scratch / f"pair-{name}"
        call(command, ["measure", *photos, "--rig", str(rig), "--target-diameter", "0.30", "--out", str(out)])
        table |= outputs(f"measure/{name}", out)
    results = scratch / "site"
    call(command, ["report", str(results)])
    table |= outputs("report again", results)
    plain = scratch / "plain.ifc"
    call(command, ["strip", str(results / "design.asbuilt.ifc"), "--out", str(plain)])
    table["strip"] = file_table(plain)
    return table


def outputs(name: str, out: Path) -> dict[str, Flat]:
    """Return a table for each file of an output folder; earlier runs and pictures are left out."""
    files = (path for path in sorted(out.rglob("*")) if path.is_file() and "runs" not in path.relative_to(out).parts)
    return {
        f"{name}/{path.relative_to(out).as_posix()}": file_table(path)
        for path in files
        if path.suffix != ".lock" and path.name != "current.json"
    }


def call(command: Any, words: list[str]) -> int:
    """Call the command line in this process; return its exit code."""
    old, sys.argv = sys.argv, ["asbuilt-bim", *words]
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return int(command.main() or 0)
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = old


def dump(checkout: Path, out: Path, projects: list[Path]) -> None:
    """Run a checkout in a process of its own, so that its code and nobody else's is imported."""
    command = [sys.executable, __file__, str(checkout), str(out), *map(str, projects)]
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-cache-") as cache:
        environment = {**os.environ, "PYTHONPATH": str(checkout), "ASBUILT_BIM_CACHE": cache}
        done = subprocess.run(command, env=environment, check=False, cwd=tempfile.gettempdir())
    if done.returncode != 0:
        raise SystemExit(f"{checkout}: the run failed; the lines above say why")


if __name__ == "__main__":
    root, target, first, *others = map(Path, sys.argv[1:])
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-same-") as scratch:
        found = run_sites(root, [first, *others], Path(scratch))
        found |= run_others(root, first, Path(scratch))
    target.write_text(json.dumps(found), encoding="utf-8")
