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
from collections.abc import Iterable, Iterator, Mapping
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

    def allowed(self, what: str) -> int:
        """Return how many lines or numbers the core may have."""
        return total(self.folders, what) + sum(one.by for one in self.risen if one.what == what)


def total(folders: Mapping[str, Count], what: str) -> int:
    """Add the files, lines or numbers of all folders up."""
    return sum(int(getattr(row, what)) for row in folders.values())


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


def rises(now: Mapping[str, Count], listed: Listed) -> dict[str, int]:
    """Return by how many lines or numbers the core is over what the list allows; code may move within the core."""
    over = {what: total(now, what) - listed.allowed(what) for what in JUDGED}
    return {what: by for what, by in over.items() if by > 0}


def renewed(now: Mapping[str, Count], listed: Listed, script: str) -> Listed:
    """Return the list as the core stands now; a rise is refused without a script that fits it, and kept with it.

    The list's folders are what stands without the rises. Where the core fell they fall.
    """
    risen = listed.risen
    for what, by in rises(now, listed).items() if listed.folders else ():
        if not script:
            raise SystemExit(f"the core's {what} rose by {by}: name the script that fits them, by --script")
        most = max(now, key=lambda folder: int(getattr(now[folder], what)) - _listed(listed, folder, what))
        risen += (Risen(folder=most, what=what, by=by, script=script),)
    folders = {
        folder: Count(files=row.files, **{what: getattr(row, what) - _by(risen, folder, what) for what in JUDGED})
        for folder, row in now.items()
    }
    return Listed(folders=folders, risen=risen)


def _listed(listed: Listed, folder: str, what: str) -> int:
    return int(getattr(listed.folders.get(folder, Count()), what)) + _by(listed.risen, folder, what)


def _by(risen: tuple[Risen, ...], folder: str, what: str) -> int:
    return sum(one.by for one in risen if (one.folder, one.what) == (folder, what))


def told(name: str, rows: dict[str, Count]) -> str:
    """Write one line on a state of the core."""
    files, lines, numbers = (total(rows, what) for what in ("files", *JUDGED))
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
    for what, by in rises(now, listed).items():
        print(f"  {by} {what} more than the list allows")
    return 1 if rises(now, listed) else 0


if __name__ == "__main__":
    sys.exit(main())
