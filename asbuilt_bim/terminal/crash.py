"""A log of an unexpected error, for the person who mends it: never on the user's screen."""

from __future__ import annotations

import platform
import sys
import tempfile
import traceback
from pathlib import Path

from asbuilt_bim.version import __version__
from asbuilt_bim.version_info import library_versions


def write_crash_log(problem: BaseException) -> Path | None:
    """Write the traceback into a temporary file and return its path; None where even that fails."""
    lines = [
        f"asbuilt-bim {__version__}, Python {platform.python_version()} on {platform.platform()}",
        f"libraries: {', '.join(f'{n} {v}' for n, v in library_versions().items())}",
        f"command: {' '.join(sys.argv)}",
        "",
        *traceback.format_exception(problem),
    ]
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="asbuilt-bim-", suffix=".log", delete=False, encoding="utf-8", errors="replace"
        ) as file:
            file.write("\n".join(lines))
        return Path(file.name)
    except OSError:
        return None
