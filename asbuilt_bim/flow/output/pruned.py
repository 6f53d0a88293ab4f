"""Runs that are old are taken away where that is asked for, whole, and never the current one."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Collection
from pathlib import Path

from asbuilt_bim.flow.output.places import RUN_NAME


def kept_runs(runs: Path, keep: int | None, in_use: Collection[Path]) -> list[Path]:
    """Return the runs that there are, the newest first, once all but the newest `keep` are gone; None keeps all.

    Those in use stay, however old. What isn't a run is left alone, and so is one that is open in another program.
    """
    there = sorted((run for run in runs.iterdir() if RUN_NAME.fullmatch(run.name)), key=_age, reverse=True)
    for run in there[keep:] if keep is not None else ():
        if run not in in_use:
            _remove(run)
    return [run for run in there if run.is_dir()]


def bytes_of(folder: Path) -> int:
    """Return how much the files below a folder hold; what goes meanwhile counts nothing."""
    total = 0
    for file in folder.rglob("*"):
        with contextlib.suppress(OSError):
            total += file.lstat().st_size if file.is_file() else 0
    return total


def _age(run: Path) -> tuple[str, int]:
    """Return what runs are ordered by: the moment, then the count of those of one moment."""
    parts = run.name.split("-")
    return parts[0], int(parts[2]) if len(parts) > 2 else 1


def _remove(run: Path) -> None:
    """Take a run away: renamed first, so that none is ever half there; what a kill leaves the next run clears away."""
    doomed = run.with_name(run.name + ".part")
    with contextlib.suppress(OSError):
        run.rename(doomed)
        shutil.rmtree(doomed, ignore_errors=True)
