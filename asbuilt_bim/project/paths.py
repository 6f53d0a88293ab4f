"""Paths and names out of a project file: kept inside its folder, and safe to make files of."""

import contextlib
import os
import re
import sys
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath

from asbuilt_bim.storage.structure import Problems

_RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in "123456789")}
_FORBIDDEN = re.compile(r'[\\/:*?"<>|\x00-\x1f\x7f]')
_TYPED_QUOTES = tuple("„“”«»")
MAX_NAME = 64
"""A station's name becomes part of file names; longer ones meet Windows' 260 characters."""
MAX_PATH, MAX_PART = 4000, 255
"""Bytes that the systems allow in a path and in one name of it."""
MOST_SHOWN = 3
"""Names that a message shows of what is there instead."""
MAX_PAIRS = 500
"""Of board photos, all held in memory; nobody takes a hundred, and a folder with a site's photos holds thousands."""


def safe_name(name: str) -> str:
    """Return why a name can't be part of a file name, on any system, or "" where it can."""
    if len(name) > MAX_NAME:
        return f"is longer than {MAX_NAME} characters"
    if bad := _FORBIDDEN.search(name):
        return f"'{name}' holds {bad.group()!r}, which file names can't; use letters, digits, - and _"
    if name != name.strip() or name.startswith(".") or name.endswith("."):
        return f"'{name}' starts or ends with a space or a dot, which file names can't"
    kinds = {unicodedata.category(c) for c in name}
    if "Cs" in kinds:
        return unnameable()
    if kinds & {"Cc", "Cf", "Co", "Cn"}:
        return "holds a character that can't be seen"
    if name.split(".")[0].upper() in _RESERVED:
        return f"'{name}' is a name that Windows keeps for itself"
    return ""


def unnameable() -> str:
    """Say why a name is none here: with an umlaut, where the system's names are in an encoding that lacks it."""
    encoding = sys.getfilesystemencoding()
    if encoding == "utf-8":
        return "holds a character that can't be seen"
    return f"holds a letter that file names can't in this locale ({encoding}); set PYTHONUTF8=1 or LC_ALL=C.UTF-8"


def composed(name: str) -> str:
    """Return a name with its umlauts as one character each: a Mac's file names may hold them as letter and mark."""
    return unicodedata.normalize("NFC", name)


def stars_of(pattern: str, name: str) -> tuple[str, ...]:
    """Return what in a file's name stands for each `*` of a pattern's own file name; () where it doesn't fit."""
    parts = re.split(r"[\\/]", composed(pattern))[-1].split("*")
    fitting = re.fullmatch("(.*)".join(re.escape(part) for part in parts), composed(name), re.IGNORECASE)
    return fitting.groups() if fitting else ()


def _as_stored(folder: Path, text: str) -> Path:
    """Return the path of a text in a folder; where none is there, one whose names differ in how umlauts are stored."""
    path = folder / text
    if text.isascii() or path.exists():
        return path
    there = folder
    with contextlib.suppress(OSError):
        for part in Path(text).parts:
            beside = [] if (there / part).exists() or not there.is_dir() else [one.name for one in there.iterdir()]
            there /= next((name for name in beside if composed(name) == composed(part)), part)
        return there
    return path


def _lack(folder: Path, names: Sequence[str]) -> str:
    """Say why no file of a folder fits a pattern: it isn't there, it is empty, or its files have other names."""
    if not folder.is_dir():
        beside = sorted(one.name for one in folder.parent.iterdir() if one.is_dir()) if folder.parent.is_dir() else []
        there = f"; beside it: {_some(beside)}" if beside else ""
        return f"there is no folder {folder}{there}"
    return f"no file fits it in {folder}" + (f", which holds {_some(names)}" if names else ", which is empty")


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:MOST_SHOWN]) + (f" and {len(names) - MOST_SHOWN} more" if len(names) > MOST_SHOWN else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class PathChecker:
    """Makes absolute paths of the file's texts; what leaves `folder` is a problem unless `allow_outside`."""

    folder: Path
    allow_outside: bool
    problems: Problems
    files: dict[str, Path] = field(default_factory=dict)  # where -> path of all that `file` was asked for

    def file(self, text: str, where: str) -> Path:
        """Return the absolute path of `text`, whether or not the file is there, and note it in `files`."""
        path = self.files[where] = self.photo(text, where)
        return path

    def photo(self, text: str, where: str) -> Path:
        """Return the absolute path of a station's photo: a missing one costs its station alone, so it isn't noted."""
        path = self._join(text, where)
        self._inside(path, where, text)
        return path

    def pairs(self, left: str, right: str, where: str) -> tuple[tuple[Path, Path], ...]:
        """Return the files of two patterns, paired by what stands for their `*`; each must have its partner."""
        lefts, rights = self.matches(left, f"{where}.left"), self.matches(right, f"{where}.right")
        if lefts and rights:
            self._name_alone(lefts, rights, f"{where}.left", "right")
            self._name_alone(rights, lefts, f"{where}.right", "left")
        keys = sorted(lefts.keys() & rights.keys())
        if len(keys) > MAX_PAIRS:
            self.problems.add(
                where, f"{len(keys):,} pairs, limit {MAX_PAIRS}; twenty are plenty: name a folder with the boards alone"
            )
        return tuple((lefts[key], rights[key]) for key in keys[:MAX_PAIRS])

    def several(self, pattern: str, where: str) -> tuple[Path, ...]:
        """Return the files of one pattern: photos that hold both eyes side by side."""
        found = self.matches(pattern, where)
        if len(found) > MAX_PAIRS:
            self.problems.add(
                where,
                f"{len(found):,} photos, limit {MAX_PAIRS}; twenty are plenty: name a folder with the boards alone",
            )
        return tuple(found[key] for key in sorted(found)[:MAX_PAIRS])

    def _name_alone(self, ones: dict[str, Path], others: dict[str, Path], where: str, side: str) -> None:
        alone = [ones[key].name for key in sorted(ones.keys() - others.keys())]
        if alone:
            names = ", ".join(alone[:5]) + (f" and {len(alone) - 5} more" if len(alone) > 5 else "")
            self.problems.add(
                where, f"{names}: no {side} photo of that name ({len(ones)} here, {len(others)} {side}); add or remove"
            )

    def matches(self, pattern: str, where: str, *, may_be_none: bool = False) -> dict[str, Path]:
        """Return the files that a pattern fits, by what stands for its `*`; capitals don't tell them apart."""
        if not self._possible(pattern, where):
            return {}
        plain = pattern.replace("\\", "/")
        fixed = PurePosixPath(*[p for p in PurePosixPath(plain).parts[:-1] if "*" not in p])
        if not self._inside(self._join(str(fixed), where), where, pattern):
            return {}
        name = PurePosixPath(plain).name
        base = self._join(str(PurePosixPath(plain).parent), where)
        if "*" in str(base) or "**" in name:
            self.problems.add(where, f"'{pattern}': only the file's name may hold a *")
            return {}
        hidden = name.startswith(".")  # a card out of a Mac holds a hidden file beside each photo
        files = sorted(file for file in base.iterdir() if hidden or file.name[0] != ".") if base.is_dir() else []
        found: dict[str, Path] = {}
        for file in files:
            if not (stars := stars_of(name, file.name)) or not file.is_file():
                continue
            first = found.setdefault("\0".join(stars).casefold(), file)
            if first != file:
                twins = f"{first.name} and {file.name} differ in capitals alone"
                self.problems.add(where, f"{twins}, or in how umlauts are stored; keep one of them")
        if not found and not may_be_none:
            literal = "".join(sign for sign in "?[]{}" if sign in name)
            hint = f"; of patterns only * is known here, {' '.join(literal)} stand for themselves" if literal else ""
            self.problems.add(where, f"'{pattern}': {_lack(base, [file.name for file in files])}{hint}")
        return {stars: file for stars, file in found.items() if self._inside(file, where, file.name)}

    def _join(self, text: str, where: str) -> Path:
        return _as_stored(self.folder, text.replace("\\", "/")) if self._possible(text, where) else self.folder

    def _possible(self, text: str, where: str) -> bool:
        """Say whether a text can be a path on this system at all."""
        wrong = ""
        if text[:1] in _TYPED_QUOTES:
            wrong = f"'{text}': {text[0]} is no quotation mark here, but a part of the name; write \", or none"
        try:
            lengths = [len(os.fsencode(part)) for part in (text, *re.split(r"[\\/]", text))]
        except UnicodeEncodeError:
            wrong = f"'{text}' {unnameable()}"
        else:
            if "\0" in text:
                wrong = "holds a character that no path can"
            elif text and min(text) < " ":  # "C:\new\tower.ifc" in double quotes holds a line break and a tab
                wrong = f"{text!r:.80} holds a line break, a tab or the like; in quotation marks write / for \\"
            elif lengths[0] > MAX_PATH or max(lengths[1:]) > MAX_PART:
                wrong = f"is too long for a path: limit {MAX_PATH} characters, and {MAX_PART} between two slashes"
        if wrong:
            self.problems.add(where, wrong)
        return not wrong

    def _inside(self, path: Path, where: str, text: str) -> bool:
        if self.allow_outside:
            return True
        absolute = PureWindowsPath(text).drive or text.startswith(("/", "\\"))
        parts = text.replace("\\", "/").split("/")
        try:
            real = path.resolve()
            outside = not real.is_relative_to(self.folder.resolve())
        except (OSError, RuntimeError) as problem:
            self.problems.add(where, f"'{text}' can't be followed: {problem}")
            return False
        if absolute or ".." in parts or outside:
            link = "" if absolute or ".." in parts else " by a link"
            what = f"'{text}' leads out of the project folder{link}"
            self.problems.add(where, f"{what}; move the file into it, or pass --allow-outside")
            return False
        return True
