"""Where outputs may go: never over what a project reads, never among the files of others."""

import re
from collections.abc import Iterable
from pathlib import Path

from asbuilt_bim.errors import OutputError

CURRENT = "current.json"
CHANGES = "changes.txt"
COPIED = (
    "result.json",
    "quantities.csv",
    "quantities.xlsx",
    "tasks.csv",
    "schedule.msp.xml",
    "schedule.p6.xml",
    "issues-2.1.bcf",
    "issues-3.0.bcf",
    CHANGES,
    "report-interactive.html",
    "report.html",
)
"""What people open: copied out of the current run, beside the IFC copy (`*.asbuilt.ifc`)."""
COPIED_FOLDERS = ("overlays", "extra")
RUN_NAME = re.compile(r"[0-9]{8}T[0-9]{6}Z-[0-9a-f]{8}(-[0-9]+)?")
"""A run's folder in `runs`."""
_PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
_OF_THE_SYSTEM = ("desktop.ini", "thumbs.db", "@eadir")
_NAMED = 3


def check_sources(path: Path, sources: Iterable[Path]) -> None:
    """Check that outputs in a folder touch nothing that the project reads.

    Raises:
        OutputError: they would, or a source is an output itself.
    """
    out = path.resolve()
    for source in sources:
        real = source.resolve()
        if real.parent == out and real.suffix.lower() in _PICTURES:
            raise OutputError(f"{path}: holds this project's photos; outputs go into a folder of their own (--out out)")
        written = real.parent == out and real.name in (CURRENT, *COPIED)
        if written or real.parent in [out / name for name in COPIED_FOLDERS]:
            raise OutputError(f"{source}: would be overwritten by an output of that name; choose another --out")
        if real.is_relative_to(out / "runs") or real.name.endswith(".asbuilt.ifc"):
            copy = "copy it to a place of its own" if real.suffix == ".json" else "name the original file"
            raise OutputError(f"{source}: is a result of an earlier run in this folder, and can't be a source; {copy}")


def check_strangers(path: Path) -> None:
    """Check that a folder without a run is empty or missing: outputs don't go among the files of others.

    Files that the system hides there don't count. A folder with runs is an output folder, even without its pointer.

    Raises:
        OutputError: it holds something else.
        OSError: it can't be listed.
    """
    if not path.is_dir() or (path / CURRENT).exists() or _holds_runs(path / "runs"):
        return
    names = sorted(one.name for one in path.iterdir() if not _hidden(one.name))
    if names == ["runs"] and all(_hidden(one.name) for one in (path / "runs").iterdir()):
        return  # a first run that came to nothing
    if names:
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        raise OutputError(
            f"{path}: holds {', '.join(names[:_NAMED])}{more}, and no run of this program's; outputs go into a folder "
            f"of their own, such as --out {path / 'out'}"
        )


def check_links(path: Path) -> None:
    """Check that no folder within an output folder is a link: what is written through it lands somewhere else.

    Raises:
        OutputError: one is; nothing was touched behind it.
    """
    folders = [path / "runs", *(path / name for name in COPIED_FOLDERS)]
    deeper = [one for folder in folders[1:] if not folder.is_symlink() for one in sorted(folder.rglob("*"))]
    for one in (*folders, *deeper):
        if one.is_symlink() and (one.is_dir() or one in folders):
            raise OutputError(
                f"{one}: is a link, and outputs are written through none; take the link away, or choose another --out"
            )


def _holds_runs(runs: Path) -> bool:
    """Say whether a folder holds a run, or what a killed one left."""
    return runs.is_dir() and any(RUN_NAME.fullmatch(one.name.removesuffix(".part")) for one in runs.iterdir())


def _hidden(name: str) -> bool:
    return name.startswith(".") or name.lower() in _OF_THE_SYSTEM
