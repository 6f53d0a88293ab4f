"""Files that are whole whenever the power goes: written beside their place, flushed, then moved into it."""

import errno
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from asbuilt_bim.errors import OutputError

PART = ".asbuilt-"
"""What a file's name begins with until it is whole; it ends in `.part`."""


def place_problem(path: Path, *, folder: bool = True) -> str:
    """Return why no file can be put where the user wants it, "" where one can; `folder`: its folder must be there."""
    if path.exists() and not path.is_file():
        return f"{path}: is {'a folder' if path.is_dir() else 'no ordinary file'}; name a file"
    if folder and not path.parent.is_dir():
        return f"{path}: there is no folder {path.parent}; make it, or name another place"
    problem = write_problem(path.parent)
    return f"{path}: can't be written ({problem.strerror}); name another place" if problem is not None else ""


def write_problem(folder: Path) -> OSError | None:
    """Return what keeps a folder, or the nearest one above it that is there, from taking a file; None where nothing."""
    there = next((one for one in (folder.absolute(), *folder.absolute().parents) if one.is_dir()), folder)
    try:
        with tempfile.TemporaryFile(dir=there):
            return None
    except OSError as problem:
        return problem


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Name the file, and what to do, where what is done within fails to write it.

    Raises:
        OutputError: the file can't be written.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"{path}: can't be written: {error.strerror or error}; close it elsewhere, free space or name another place"
        ) from error


def replace_bytes(path: Path, data: bytes) -> None:
    """Put bytes in a file's place, whole and on the disk, or leave it as it was.

    Raises:
        OSError: they can't be written, or the file is held by another program.
    """
    replace_all({path: data})


def replace_all(files: Mapping[Path, bytes], like: Path | None = None) -> None:
    """Put bytes in the places of several files: all are whole on the disk before the first is moved into its place.

    The files get the rights of the file `like`, else those that the user's umask leaves.

    Raises:
        OSError: they can't be written, a place is no file's, or a file is held by another program.
    """
    for path in files:
        if path.exists() and not path.is_file():
            code = errno.EISDIR if path.is_dir() else errno.EINVAL
            raise OSError(code, os.strerror(code) if path.is_dir() else "is no ordinary file", str(path))
    parts: dict[Path, Path] = {}
    try:
        for path, data in files.items():
            part = path.with_name(f"{PART}{secrets.token_hex(8)}.part")
            with part.open("xb") as file:
                parts[path] = part
                if like is not None:
                    part.chmod(stat.S_IMODE(like.stat().st_mode))
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
        for path, part in parts.items():
            part.replace(path)
    except BaseException:
        for part in parts.values():
            part.unlink(missing_ok=True)
        raise


def flush_tree(folder: Path) -> None:
    """Have the system put a folder with all that is in it on the disk now."""
    for path in sorted(folder.rglob("*"), reverse=True):
        flush(path)
    flush(folder)


def flush(path: Path) -> None:
    """Have the system put a file or a folder on the disk now; Windows has no such thing for folders."""
    if path.is_dir() and os.name == "nt":
        return
    flags = os.O_RDONLY if path.is_dir() or os.name != "nt" else os.O_RDWR
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    except OSError as problem:  # some network folders refuse it for folders
        if problem.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)
