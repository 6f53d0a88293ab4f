"""A copy that a person has changed is theirs: it is kept beside the new one."""

from __future__ import annotations

import filecmp
from datetime import UTC, datetime
from pathlib import Path


def keep_edited(folder: Path, relative: Path) -> Path | None:
    """Move a file that stands where a copy goes, and that no run in the folder wrote as it is, out of the way.

    Returns where it is kept now; None where nothing stands there, or what a run wrote.

    Raises:
        OSError: it can't be read or moved; it is open in another program.
    """
    copy = folder / relative
    if not copy.is_file():
        return None
    newest_first = sorted((folder / "runs").iterdir(), reverse=True)
    written = (run / relative for run in newest_first if (run / relative).is_file())
    if any(filecmp.cmp(copy, one, shallow=False) for one in written):
        return None
    changed = datetime.fromtimestamp(copy.stat().st_mtime, UTC)
    name, count = f"{copy.stem}.edited-{changed:%Y%m%dT%H%M%SZ}", 1
    kept = copy.with_name(f"{name}{copy.suffix}")
    while kept.exists():
        count += 1
        kept = copy.with_name(f"{name}-{count}{copy.suffix}")
    copy.rename(kept)
    return kept
