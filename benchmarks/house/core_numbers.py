"""Lines and set numbers of the measuring core, written down so that neither rises unseen.

python benchmarks/house/core_numbers.py                       this working tree, beside the list
python benchmarks/house/core_numbers.py REVISION ...          these revisions
python benchmarks/house/core_numbers.py --write               write what stands now into the list
python benchmarks/house/core_numbers.py --write --script F    the same where it rose: F fits the new numbers

A number counts wherever it stands (constants, class fields, defaults, in the middle of code) but for -2 to 2 whole and
0.5: moving one hides nothing. The list is core_numbers.json; tests/benchmarks/test_core_numbers.py holds it.
"""

from __future__ import annotations

import argparse
import ast
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_suffix(".json")
PACKAGE = "asbuilt_bim"
CORE = ("geometry", "vision", "measure", "register", "match", "progress")
LEFT_OUT = "networks"
PLAIN = (0, 1, 2, 0.5)
JUDGED = ("lines", "numbers")


@dataclass(slots=True, kw_only=True)
class Count:
    """What one folder of the core holds."""

    files: int = 0
    lines: int = 0
    numbers: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Risen:
    """A rise that was asked for: by how many lines or numbers, and the script that fits them."""

    folder: str
    what: str
    by: int
    script: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Listed:
    """What is written down: the folders as they were, and what has risen since, with its reason."""

    folders: dict[str, Count] = field(default_factory=dict)
    risen: tuple[Risen, ...] = ()

    def allowed(self, folder: str, what: str) -> int:
        """Return how many lines or numbers a folder may have."""
        reasons = sum(one.by for one in self.risen if (one.folder, one.what) == (folder, what))
        return int(getattr(self.folders.get(folder, Count()), what)) + reasons


def numbers_in(text: str) -> int:
    """Count the set numbers of a Python text."""
    found = [node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant)]
    numbers = [value for value in found if isinstance(value, int | float) and not isinstance(value, bool)]
    return sum(abs(number) not in PLAIN for number in numbers)


def counted(files: Iterable[tuple[str, str]]) -> dict[str, Count]:
    """Count the core among files, each a path under the project ("asbuilt_bim/vision/bars.py") and its text."""
    found = {folder: Count() for folder in CORE}
    for path, text in files:
        parts = path.split("/")
        if len(parts) < 3 or parts[0] != PACKAGE or parts[1] not in CORE or LEFT_OUT in parts:
            continue
        row = found[parts[1]]
        row.files, row.lines, row.numbers = row.files + 1, row.lines + text.count("\n"), row.numbers + numbers_in(text)
    return found


def in_working_tree(root: Path = ROOT) -> Iterator[tuple[str, str]]:
    """Give the package's files as they lie on disk."""
    for path in sorted((root / PACKAGE).rglob("*.py")):
        yield path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")


def in_revision(revision: str, root: Path = ROOT) -> Iterator[tuple[str, str]]:
    """Give the package's files of a revision."""
    for name in _git(root, "ls-tree", "-r", "--name-only", revision, PACKAGE).splitlines():
        if name.endswith(".py"):
            yield name, _git(root, "show", f"{revision}:{name}")


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, encoding="utf-8", check=True)
    return done.stdout


def read_list(path: Path = LIST) -> Listed:
    """Read what is written down; nothing, where there is no list yet."""
    if not path.exists():
        return Listed()
    held = json.loads(path.read_text(encoding="utf-8"))
    folders = {folder: Count(**row) for folder, row in held["folders"].items()}
    return Listed(folders=folders, risen=tuple(Risen(**one) for one in held["risen"]))


def write_list(listed: Listed, path: Path = LIST) -> None:
    """Write the list down."""
    held = {
        "folders": {k: asdict(v) for k, v in listed.folders.items()},
        "risen": [asdict(one) for one in listed.risen],
    }
    path.write_text(json.dumps(held, indent=1) + "\n", encoding="utf-8")


def rises(now: dict[str, Count], listed: Listed) -> list[tuple[str, str, int]]:
    """Return where the core holds more than the list allows: folder, what, by how much."""
    over = [
        (folder, what, int(getattr(row, what)) - listed.allowed(folder, what))
        for folder, row in now.items()
        for what in JUDGED
    ]
    return [one for one in over if one[2] > 0]


def renewed(now: dict[str, Count], listed: Listed, script: str) -> Listed:
    """Return the list as it stands now; a rise is added with its script, and without one it is refused.

    A folder may rise by what others fell: code that moves within the core needs no script.
    """
    risen = list(listed.risen)
    for what in JUDGED:
        change = sum(int(getattr(now[one], what)) - listed.allowed(one, what) for one in now)
        if listed.folders and change > 0:
            if not script:
                raise SystemExit(f"the core's {what} rose by {change}: name the script that fits them, by --script")
            folder, _, _ = max((one for one in rises(now, listed) if one[1] == what), key=lambda one: one[2])
            risen.append(Risen(folder=folder, what=what, by=change, script=script))
    reasons = Listed(risen=tuple(risen))
    folders = {
        folder: Count(files=row.files, **{what: getattr(row, what) - reasons.allowed(folder, what) for what in JUDGED})
        for folder, row in now.items()
    }
    return Listed(folders=folders, risen=tuple(risen))


def told(name: str, rows: dict[str, Count]) -> str:
    """Write one line on a state of the core."""
    files, lines, numbers = (sum(getattr(row, what) for row in rows.values()) for what in ("files", *JUDGED))
    each = ", ".join(f"{folder} {row.lines}/{row.numbers}" for folder, row in rows.items())
    return f"{name}: {lines} lines in {files} files, {numbers} set numbers ({each})"


def main() -> int:
    """Count, print, and write where that was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("revisions", nargs="*", help="revisions to count instead of the working tree")
    parser.add_argument("--write", action="store_true", help="write what stands now into the list")
    parser.add_argument("--script", default="", help="the script that fits the new numbers, as a path in the project")
    args = parser.parse_args()
    for revision in args.revisions:
        print(told(revision[:12], counted(in_revision(revision))))
    if args.revisions:
        return 0
    now, listed = counted(in_working_tree()), read_list()
    if args.script and not (ROOT / args.script).is_file():
        raise SystemExit(f"{args.script} is no file of the project")
    if args.write:
        listed = renewed(now, listed, args.script)
        write_list(listed)
    print(told("now", now))
    print(told("list", listed.folders))
    for folder, what, by in rises(now, listed):
        print(f"  {folder}: {by} {what} more than the list allows")
    return 1 if rises(now, listed) else 0


if __name__ == "__main__":
    sys.exit(main())
