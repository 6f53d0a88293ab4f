"""No code reads prose: the sample gives the same numbers and states with all its wording scrambled.

python benchmarks/house/scrambled.py --check     the whole sample, twice
python benchmarks/house/scrambled.py --quick     one of its stations

All wording lies in asbuilt_bim.report.wording. A process of its own replaces that package's texts and what its
functions return by texts with other letters, before anything else is imported. Then it runs the program.
"""

from __future__ import annotations

import functools
import importlib
import json
import os
import pkgutil
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project
from benchmarks.sites import ONE_THREAD, ROOT, SAMPLE, small_sample
from benchmarks.table import line, options, report

WORDING = "asbuilt_bim.report.wording"
CHILD = "--run-scrambled"
TURN = 3  # letters; not 13: what is scrambled twice must not come back
KEPT = re.compile(r"\{[^{}]*\}|%(?:\(\w+\))?[-+ #0-9.]*[a-zA-Z%]|<[^<>]*>")
"""Fields, formats and tags: without them a text could not be filled in."""
PROSE = {"doubts", "limit", "notes", "reason", "remedy", "text", "value", "what"}
"""Keys of a result whose texts are prose; only how many there are is compared."""
CHANGING = {"created", "seconds"}


def scrambled(value: Any) -> Any:
    """Turn the letters of a text, of the values of a table, of what a function returns; leave all else."""
    if isinstance(value, str):
        parts, kept = KEPT.split(value), [*KEPT.findall(value), ""]
        return type(value)("".join(_turned(part) + keep for part, keep in zip(parts, kept, strict=True)))
    if isinstance(value, dict):
        return {key: scrambled(inner) for key, inner in value.items()}
    if type(value) in (list, tuple):
        return type(value)(scrambled(inner) for inner in value)
    if callable(value) and not isinstance(value, type):
        return _scrambling(value)
    return value


def _turned(text: str) -> str:
    def letter(one: str) -> str:
        first = ord("a") if "a" <= one <= "z" else ord("A") if "A" <= one <= "Z" else None
        return one if first is None else chr(first + (ord(one) - first + TURN) % 26)

    return "".join(letter(one) for one in text)


def _scrambling(function: Any) -> Any:
    @functools.wraps(function)
    def scrambles(*args: Any, **named: Any) -> Any:
        return scrambled(function(*args, **named))

    return scrambles


def scramble_wording() -> int:
    """Replace every public text and function of the wording package; return how many there were."""
    room = importlib.import_module(WORDING)
    names = [f"{WORDING}.{found.name}" for found in pkgutil.iter_modules(room.__path__)]
    replaced = 0
    for module in [room, *(importlib.import_module(name) for name in names)]:
        for name, value in list(vars(module).items()):
            own = isinstance(value, str | dict | list | tuple) or getattr(value, "__module__", "") == module.__name__
            if name.startswith("_") or not own or isinstance(value, type):
                continue
            setattr(module, name, scrambled(value))
            replaced += 1
    return replaced


def child(words: list[str]) -> None:
    """Scramble all wording in this process, then run the program."""
    if not scramble_wording():
        raise SystemExit(f"{WORDING} holds no public text: nothing was scrambled, so nothing is shown")
    from asbuilt_bim.cli import main as program

    sys.argv = ["asbuilt-bim", *words]
    program()


def results(site: Path, out: Path, *, scramble: bool) -> dict[str, Any]:
    """Run the program on a site, in one process; return every result document by its name."""
    words = ["run", str(site / "project.yaml"), "--out", str(out), "--no-cache", "--workers", "1", "--quiet"]
    start = [__file__, CHILD] if scramble else ["-m", "asbuilt_bim"]
    done = subprocess.run(
        [sys.executable, *start, *words],
        cwd=ROOT,
        env=os.environ | ONE_THREAD,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise SystemExit(f"{'scrambled' if scramble else 'as it is'}: ended with {done.returncode}:\n{done.stderr}")
    folder = out / str(json.loads((out / "current.json").read_text(encoding="utf-8"))["run"])
    return {
        path.relative_to(folder).as_posix(): json.loads(path.read_text(encoding="utf-8"))
        for path in sorted([folder / "result.json", *folder.glob("visits/*.json")])
    }


def leaves(value: Any, where: str = "", prose: bool = False) -> Iterator[tuple[str, Any]]:
    """Give every number, state and name of a result by its place; of prose, that there is one."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in CHANGING:
                yield from leaves(inner, f"{where}/{key}", key in PROSE)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from leaves(inner, f"{where}/{number}", prose)
    else:
        yield where, "(prose)" if prose and isinstance(value, str) else value


def main() -> int:
    """Run twice, compare, print the table."""
    if CHILD in sys.argv[1:2]:
        child(sys.argv[2:])
        return 0
    args = options(__doc__ or "").parse_args()
    if not (ROOT / WORDING.replace(".", "/")).is_dir():
        print(f"there is no folder {WORDING} in this checkout: its wording can't be scrambled")
        return 1
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        site = small_sample(Path(scratch), 1) if args.quick else SAMPLE
        plain = dict(leaves(results(site, Path(scratch) / "plain", scramble=False)))
        other = dict(leaves(results(site, Path(scratch) / "scrambled", scramble=True)))
    apart = sorted(where for where in plain.keys() | other.keys() if plain.get(where, "-") != other.get(where, "-"))
    for where in apart[:20]:
        print(f"  {where}: {plain.get(where, 'absent')!r}, scrambled {other.get(where, 'absent')!r}")
    judged = line("numbers and states that differ", str(len(apart)), "0", len(plain), not apart)
    return report("No code reads prose", [judged], args)


if __name__ == "__main__":
    sys.exit(main())
