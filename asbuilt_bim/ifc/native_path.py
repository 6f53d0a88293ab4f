"""Paths for ifcopenshell, which reads every name as UTF-8 whatever the system's names are in."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory


@contextmanager
def native_path(path: Path) -> Iterator[Path]:
    """Give a file's or folder's path as ifcopenshell finds it: itself, or a link to it, for as long as it lasts.

    A link is wanted where the locale isn't UTF-8 and the name isn't ASCII.
    """
    if _is_utf8(path):
        yield path
        return
    with TemporaryDirectory() as folder:
        link = Path(folder) / "link"
        link.symlink_to(path.absolute())
        yield link


def _is_utf8(path: Path) -> bool:
    try:
        return str(path.absolute()).encode() == os.fsencode(path.absolute())
    except UnicodeEncodeError:  # bytes that the locale's encoding lacks
        return False
