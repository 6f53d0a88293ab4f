"""What is kept in an output folder: copies that a person has changed, and the newest runs."""

import contextlib
import filecmp
import shutil
from collections.abc import Collection
from datetime import UTC, datetime
from pathlib import Path

from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.flow.output.places import RUN_NAME
from asbuilt_bim.report.workbook.layout import VALUATION
from asbuilt_bim.storage.xlsx_file import read_xlsx

WORKBOOK = "quantities.xlsx"
SIGNED_WORKBOOKS = "quantities.signed-*.xlsx"
"""What is kept of those that were signed."""


def keep_edited(folder: Path, relative: Path) -> Path | None:
    """Move a file that stands where a copy goes, and that no run in the folder wrote as it is, out of the way.

    Its new name says that it was edited, or of a workbook that it is signed. Returns where it is kept now; None where
    nothing stands there, or what a run wrote.

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
    name, count = f"{copy.stem}.{'signed' if _is_signed(copy) else 'edited'}-{changed:%Y%m%dT%H%M%SZ}", 1
    kept = copy.with_name(f"{name}{copy.suffix}")
    while kept.exists():
        count += 1
        kept = copy.with_name(f"{name}-{count}{copy.suffix}")
    copy.rename(kept)
    return kept


def _is_signed(copy: Path) -> bool:
    """Say whether a copy is a workbook with a name beside "Certified by": a certificate."""
    try:
        return copy.name == WORKBOOK and bool(read_xlsx(copy, WorkbookError, (VALUATION,)).at("signed_by"))
    except WorkbookError:
        return False


def kept_runs(runs: Path, keep: int | None, in_use: Collection[Path]) -> list[Path]:
    """Return the runs that there are, the newest first, once all but the newest `keep` are gone; None keeps all.

    Those in use stay, however old. What isn't a run is left alone, and so is one that is open in another program.
    """
    there = sorted((run for run in runs.iterdir() if RUN_NAME.fullmatch(run.name)), key=age_of, reverse=True)
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


def age_of(run: Path) -> tuple[str, int]:
    """Return what runs are ordered by: the moment, then the count of those of one moment."""
    parts = run.name.split("-")
    return parts[0], int(parts[2]) if len(parts) > 2 else 1


def _remove(run: Path) -> None:
    """Take a run away: renamed first, so that none is ever half there; what a kill leaves the next run clears away."""
    doomed = run.with_name(run.name + ".part")
    with contextlib.suppress(OSError):
        run.rename(doomed)
        shutil.rmtree(doomed, ignore_errors=True)
