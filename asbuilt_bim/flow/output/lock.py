"""One run at a time in an output folder: a lock of the operating system's, gone when its process is."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from asbuilt_bim.errors import OutputError

_HELD = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)


@contextlib.contextmanager
def run_lock(path: Path, folder: Path) -> Iterator[None]:
    """Hold `path` as a lock; `folder` is what the message names.

    A file system that knows no locks (some network folders) is used without.

    Raises:
        OutputError: another process holds it, or the file can't be made.
    """
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as problem:
        raise OutputError(f"{folder}: can't be written ({problem.strerror}); choose another --out") from problem
    try:
        _take(handle, folder)
        yield
    finally:
        os.close(handle)


def _take(handle: int, folder: Path) -> None:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as problem:
        if problem.errno in _HELD:
            raise OutputError(
                f"{folder}: another run is writing here; wait for it, or choose another --out"
            ) from problem
