"""Reading what somebody names: a file within bounds, and no device or pipe, which may never end or never answer."""

import errno
import hashlib
import stat
from collections.abc import Sequence
from difflib import get_close_matches
from io import BufferedReader
from pathlib import Path

from asbuilt_bim.errors import AsBuiltError, OptionError

SPREADSHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How `.xlsx` and `.ods` begin, and `.xls`; archives and old documents begin so, too."""


def path_of(given: Path | str, argument: str) -> Path:
    """Return what a Python program gives as a path.

    Raises:
        OptionError: it is none; `argument` is what the program knows it by.
    """
    try:
        path = Path(given)
    except TypeError as problem:
        raise OptionError(f"{argument}: {given!r:.60} is no path; give a text, or a pathlib.Path") from problem
    if "\0" in str(path):
        raise OptionError(f"{argument}: {str(path)!r:.60} is no path: it holds a null byte; take that out")
    return path


def open_regular(path: Path) -> BufferedReader:
    """Open a file for reading bytes.

    Raises:
        OSError: it can't be opened, or is no regular file; `strerror` says which.
    """
    try:
        mode = path.stat().st_mode
    except ValueError as error:
        raise OSError(errno.EINVAL, f"no file can be named so: {error}", str(path)) from error
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder; name the file in it", str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is a device or a pipe, no file", str(path))
    return path.open("rb")


def read_bytes(path: Path, most: int, refusal: type[AsBuiltError], name: str = "") -> bytes:
    """Return the bytes of a file of at most `most`; `name` is what messages call it, else its path.

    Raises:
        AsBuiltError: of the sort `refusal`, where the file can't be read or is larger.
    """
    try:
        with open_regular(path) as file:
            data = file.read(most + 1)
    except FileNotFoundError as problem:
        raise refusal(f"{name or path}: there is no such file{file_alike(path)}; check the path") from problem
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        held = "close it in other programs, or give yourself the right to read it"
        advice = held if isinstance(problem, PermissionError) else "check the path"
        raise refusal(f"{name or path}: can't be read ({reason}); {advice}") from problem
    if len(data) > most:
        raise refusal(f"{name or path}: larger than {most / 1e6:g} MB, which no such file is; check the path")
    return data


def file_alike(missing: Path, *, folders: bool = False) -> str:
    """Say which file of its kind, or folder, lies where one is missing that is called nearly so; "" where none does.

    Windows hides endings: who saves `project.yaml` in Notepad has a `project.yaml.txt`, and doesn't see it.
    """
    try:
        if missing.with_name(f"{missing.name}.txt").is_file():
            return f" ({missing.name}.txt lies there, and Windows may hide its ending: take the .txt away)"
        beside = missing.parent.glob(f"*{missing.suffix}")
        there = {one.stem: one.name for one in beside if one.is_file() or (folders and one.is_dir())}
    except (OSError, ValueError):
        return ""
    alike = get_close_matches(missing.stem, there, n=1)
    return f" ({there[alike[0]]} lies there: is it that?)" if alike else ""


def as_text(data: bytes, refusal: type[AsBuiltError], name: str, encoding: str = "utf-8-sig") -> str:
    """Return bytes as text, without the mark that some programs put before it.

    Raises:
        AsBuiltError: of the sort `refusal`, where they are none.
    """
    if data.startswith(SPREADSHEETS):
        raise refusal(f"{name}: is a spreadsheet or an archive (.xlsx, .xls, .zip), no text; save it as CSV (UTF-8)")
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        advice = "save it as UTF-8: in Excel as CSV UTF-8, in Notepad with that encoding"
        raise refusal(f"{name}: line {line} is no UTF-8 text; {advice}") from problem


def file_digest(path: Path) -> str:
    """Return the sha256 of a file's bytes as hexadecimal text."""
    with open_regular(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def files_digest(paths: Sequence[Path]) -> str:
    """Return the digest of a design: its file's, or one over those of its files in their order."""
    digests = [file_digest(path) for path in paths]
    return digests[0] if len(digests) == 1 else hashlib.sha256("\n".join(digests).encode()).hexdigest()
