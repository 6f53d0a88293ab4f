"""A copy that a person has changed is theirs: it is kept beside the new one."""

from __future__ import annotations

import filecmp
from datetime import UTC, datetime
from pathlib import Path


def keep_edited(copy: Path, runs: Path) -> Path | None:
    """Move a file that stands where a copy goes, and that no run under `runs` wrote as it is, out of the way.

    Returns where it is kept now; None where nothing stands there, or what a run wrote.

    Raises:
        OSError: it can't be read or moved; it is open in another program.
    """
    if not copy.is_file():
        return None
    if any(filecmp.cmp(copy, written, shallow=False) for written in runs.glob(f"*/{copy.name}")):
        return None
    changed = datetime.fromtimestamp(copy.stat().st_mtime, UTC)
    name, count = f"{copy.stem}.edited-{changed:%Y%m%dT%H%M%SZ}", 1
    kept = copy.with_name(f"{name}{copy.suffix}")
    while kept.exists():
        count += 1
        kept = copy.with_name(f"{name}-{count}{copy.suffix}")
    copy.rename(kept)
    return kept
