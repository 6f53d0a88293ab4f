"""A log of an unexpected error, for the person who mends it: never on the user's screen."""

import contextlib
import os
import platform
import re
import stat
import sys
import tempfile
import traceback
from pathlib import Path

from asbuilt_bim.scale.fingerprint import library_versions
from asbuilt_bim.version import __version__

_PREFIX = "asbuilt-bim-crash-"
KEPT = 10
_PASSWORD = re.compile(r"//[^/@\s]+@")  # of an address: tls://name:password@10.0.0.5


def write_crash_log(problem: BaseException) -> Path | None:
    """Write the traceback into a temporary file and return its path; None where even that fails.

    The user's last `KEPT` logs are kept, so that a program that fails often fills no disk.
    """
    lines = [
        f"asbuilt-bim {__version__}, Python {platform.python_version()} on {platform.platform()}",
        f"libraries: {', '.join(f'{n} {v}' for n, v in library_versions().items())}",
        f"command: {' '.join(sys.argv)}",
        "",
        *traceback.format_exception(problem),
    ]
    text = _PASSWORD.sub("//...@", "\n".join(lines))
    try:
        _forget_old()
        with tempfile.NamedTemporaryFile(
            "w", prefix=_PREFIX, suffix=".log", delete=False, encoding="utf-8", errors="replace"
        ) as file:
            file.write(text)
        return Path(file.name)
    except OSError:
        return None


def _forget_old() -> None:
    """Remove the oldest of this user's logs, so many that with the next one there are `KEPT`."""
    own = os.getuid() if hasattr(os, "getuid") else None
    logs = []
    for path in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*.log"):
        with contextlib.suppress(OSError):  # another process may be removing it too
            about = path.lstat()
            if stat.S_ISREG(about.st_mode) and own in (None, about.st_uid):
                logs.append((about.st_mtime_ns, path))
    for _, path in sorted(logs, reverse=True)[KEPT - 1 :]:
        with contextlib.suppress(OSError):
            path.unlink()
