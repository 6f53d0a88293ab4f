"""All mistakes of a project file in one message, by line: also those that only what is right shows to be wrong."""

import re
from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import Any

from asbuilt_bim.project.file import ProjectFile
from asbuilt_bim.project.paths import PathChecker
from asbuilt_bim.storage.regular_file import file_alike
from asbuilt_bim.storage.strict_yaml import YamlDocument
from asbuilt_bim.storage.structure import Problem, Problems, structure

MAX_NAMED = 100
"""Rows that one message holds."""
_STAND_IN: dict[str, Any] = {
    "format": "asbuilt-bim/project",
    "version": 1,
    "name": "-",
    "ifc": [],
    "rig": {"file": "-"},
    "visits": [],
}
"""What stands for a key that a project can't be without, where it is wrong: nothing is said of it a second time."""
_RESTS_ON = {
    "markers": ("visits", "poses", "control_points", "history", "markers"),
    "rig.tags": ("visits",),
}
"""Keys whose rules ask for other keys: nothing is said of them where one of those is wrong."""
_FILES = [
    "ifc",
    "schedule",
    "costs",
    "observations",
    "people",
    "control_points",
    "poses.file",
    "markers.survey",
    "rig.file",
    "rig.file_right",
    "rig.file_pose",
    "rig.control_points.file",
    "valuation.last",
]
_ROUNDS = 4
_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
_COUNTED = re.compile(r"\b(visits|stations)\[(\d+)\]")
_PLACE = re.compile(r"\b(?:visits|ifc|history)\[\d+\][\w.\[\]]*")


def further_mistakes(
    value: object, found: Sequence[Problem], checker: PathChecker, resolve: Callable[[ProjectFile, PathChecker], object]
) -> list[Problem]:
    """Return the mistakes of the rest of a file whose structure is wrong in `found`: what is wrong is left out of it.

    `resolve` makes a project of what was written and notes what is wrong with it in the checker's problems.
    """
    if not isinstance(value, dict):
        return []
    removed: set[str] = set()
    wrong = [problem.path for problem in found]
    for _ in range(_ROUNDS):
        removed |= {_there(value, where, removed) for where in wrong}
        removed.discard("")
        kept: dict[str, list[int]] = {}
        rest = _without(value, "", removed, kept)
        lacking = {key for key in _STAND_IN if key not in rest}
        tried = Problems()
        written: ProjectFile | None = structure(
            {**{key: _STAND_IN[key] for key in lacking}, **rest}, ProjectFile, tried
        )
        if written is not None and not tried.found:
            resolve(written, checker)
            _name_missing(value, checker, kept)
            meant = {problem.meant for problem in (*found, *tried.found)} - {""}
            return _told(checker.problems.found, kept, removed | lacking | meant)
        wrong = [_original(problem.path, kept) for problem in tried.found]
    return []


def _there(value: object, where: str, removed: Container[str]) -> str:
    """Return a place of a file, or what holds it where it isn't there or was left out; "" for the whole file."""
    while where and (where in removed or not _found(value, where)[0]):
        cut = max(where.rfind("."), where.rfind("["))
        where = where[:cut] if cut > 0 else ""
    return where


def _found(value: Any, where: str) -> tuple[bool, Any]:
    """Return whether there is something at a place of a file, and what."""
    if isinstance(value, dict) and where in value:  # a key may hold a dot
        return True, value[where]
    for name, index in _STEP.findall(where):
        if index and isinstance(value, list) and int(index) < len(value):
            value = value[int(index)]
        elif name and isinstance(value, dict) and name in value:
            value = value[name]
        else:
            return False, None
    return True, value


def _without(value: Any, path: str, removed: set[str], kept: dict[str, list[int]]) -> Any:
    """Return a copy less what was removed; `kept` gets the numbers of a list's items that stay, by the list's place."""
    if isinstance(value, dict):
        places = {key: f"{path}.{key}".lstrip(".") for key in value}
        return {k: _without(value[k], at, removed, kept) for k, at in places.items() if at not in removed}
    if isinstance(value, list):
        kept[path] = [i for i in range(len(value)) if f"{path}[{i}]" not in removed]
        return [_without(value[i], f"{path}[{i}]", removed, kept) for i in kept[path]]
    return value


def _original(where: str, kept: dict[str, list[int]]) -> str:
    """Return a place in the file as it was written, from one in what is left of it."""
    done = ""
    for name, index in _STEP.findall(where):
        stay = kept.get(done, [])
        number = int(index) if index else 0
        done += f"[{stay[number] if number < len(stay) else number}]" if index else f"{'.' if done else ''}{name}"
    return done


def _name_missing(value: object, checker: PathChecker, kept: dict[str, list[int]]) -> None:
    """Name each file of the project file that isn't there, also those in what was left out."""
    for where in _FILES:
        there, text = _found(value, where)
        if where not in checker.files and there and isinstance(text, str) and text.strip():
            checker.file(text, where)
    wrong = {problem.path for problem in checker.problems.found}
    for where, file in checker.files.items():
        written, _ = _found(value, _original(where, kept))
        if written and where not in wrong and not file.exists():
            checker.problems.add(where, f"there is no {shown_path(file, checker.folder)}{file_alike(file)}")


def _told(found: Sequence[Problem], kept: dict[str, list[int]], removed: set[str]) -> list[Problem]:
    """Return what isn't a mere consequence of what was left out, by its places in the file as it was written."""
    told = []
    for problem in found:
        where = _original(problem.path, kept)
        follows = any(_within(where, one) or _within(one, where) for one in removed)
        rests = next((on for key, on in _RESTS_ON.items() if _within(where, key)), ())
        if where in _FILES:
            follows = any(where == one for one in removed)
        if not follows and not (where not in _FILES and any(_within(one, key) for one in removed for key in rests)):
            text = _PLACE.sub(lambda match: _original(match.group(), kept), problem.text)
            told.append(Problem(path=where, text=text))
    return told


def _within(where: str, outer: str) -> bool:
    return where == outer or where.startswith((f"{outer}.", f"{outer}["))


def shown_path(path: Path, folder: Path) -> str:
    """Return a path as people get it: relative to the project's folder with `/`, or its bare name."""
    try:
        return path.relative_to(folder).as_posix()
    except ValueError:
        return path.name


def message(path: Path, found: Sequence[Problem], document: YamlDocument) -> str:
    """Write all mistakes of a file, each with its line, in the order of the lines.

    A key that is missing and stands behind a # has the line where it does. Visits and stations are counted from 1, too.
    """
    count = "one mistake" if len(found) == 1 else f"{len(found)} mistakes"
    rows = []
    for problem in found:
        line, text = _line(problem.path, document.lines), problem.text
        hidden = document.behind_hash.get(problem.path)
        if hidden is not None and problem.path not in document.lines:
            line = hidden
            text = (
                f"{text}: take the # away there, and replace what is an example"
                if problem.missing
                else (f"stands behind a #: take it away there, and replace what is an example (it {text})")
            )
        rows.append((line, f"  line {line}: {problem.path or 'the file'}: {text}{_counted(problem.path)}"))
    ordered = [row for _, row in sorted(rows, key=lambda one: one[0])]
    return "\n".join(first_rows([f"{path}: {count}; nothing was run:", *ordered]))


def _counted(where: str) -> str:
    """Return `; that is visit 1, station 2` of a place that is counted from 0, "" of any other."""
    numbers = [(name.rstrip("s"), int(index) + 1) for name, index in _COUNTED.findall(where)]
    return f"; that is {', '.join(f'{name} {number}' for name, number in numbers)}" if numbers else ""


def first_rows(rows: list[str]) -> list[str]:
    """Return the rows of a message, the first ones where nobody would read them all."""
    return [*rows[:MAX_NAMED], f"  and {len(rows) - MAX_NAMED:,} more"] if len(rows) > MAX_NAMED else rows


def _line(where: str, lines: dict[str, int]) -> int:
    while where and where not in lines:  # a missing key has no line: its parent's
        cut = max(where.rfind("."), where.rfind("["))
        where = where[:cut] if cut > 0 else ""
    return lines.get(where, 1)
