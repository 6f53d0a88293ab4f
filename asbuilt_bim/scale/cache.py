"""What was computed before: results on disk, found by a digest of all that they depend on.

A damaged entry, or one that another user may have written, is computed again, never trusted; the oldest entries go
when the folder grows too large.
"""

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from asbuilt_bim.scale.codec import from_bytes, to_bytes

T = TypeVar("T")
MAX_BYTES = 2_000_000_000
"""About two thousand stations; a disk of an office computer doesn't notice it."""


def default_folder() -> Path | None:
    """Return the user's cache folder, or what ASBUILT_BIM_CACHE names; None where that is `off`."""
    named = os.environ.get("ASBUILT_BIM_CACHE")
    if named:
        return None if named.lower() == "off" else Path(named)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "asbuilt-bim"


def digest_of(parts: Iterable[str | bytes]) -> str:
    """Return the SHA-256 of parts, each with its length, so that no two lists of parts share one."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "big"))
        digest.update(data)
    return digest.hexdigest()


def owner_only(about: os.stat_result) -> bool:
    """Say whether nobody but this user (or the system's) can have written a file: money follows from what it holds.

    Windows keeps a user's folder from others by itself.
    """
    if sys.platform == "win32":
        return True
    return about.st_uid in (os.getuid(), 0) and not about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cache:
    """A folder of results; `folder` None keeps nothing. Never raises: at worst nothing is found and nothing kept."""

    folder: Path | None
    max_bytes: int = MAX_BYTES

    def get(self, key: str, kind: type[T]) -> T | None:
        """Return the entry of a key, or None where there is none that can be read."""
        if self.folder is None:
            return None
        path = self._path(key)
        try:
            with path.open("rb") as file:
                if not owner_only(os.fstat(file.fileno())):
                    return None
                data = file.read()
        except OSError:
            return None
        try:
            if hashlib.sha256(data[32:]).digest() != data[:32]:
                raise ValueError("damaged")
            value = from_bytes(data[32:], kind)
        except Exception:  # whatever is wrong with it, the answer is to compute it again
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # used now: the last to go
        return value

    def put(self, key: str, value: object, kind: Any) -> None:
        """Keep an entry; a disk that is full or locked keeps nothing, and that is all."""
        if self.folder is None:
            return
        path = self._path(key)
        data = to_bytes(value, kind)
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(hashlib.sha256(data).digest() + data)
                Path(name).replace(path)
            except OSError:
                Path(name).unlink(missing_ok=True)
                raise

    def prune(self) -> None:
        """Remove the entries used longest ago until the folder is within its bound."""
        if self.folder is None:
            return
        with contextlib.suppress(OSError):
            entries = [(p.stat().st_mtime, p.stat().st_size, p) for p in self.folder.glob("*/*.entry")]
            total = sum(size for _, size, _ in entries)
            for _, size, path in sorted(entries, key=lambda entry: entry[0]):
                if total <= self.max_bytes:
                    return
                path.unlink(missing_ok=True)
                total -= size

    def _path(self, key: str) -> Path:
        assert self.folder is not None
        return self.folder / key[:2] / f"{key}.entry"
