"""IFC files of others, read and written in a process of its own: the same functions, within limits.

A file can lead the geometry kernel into a crash or into work without end. Then the file is refused, by name.
"""

import stat
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from asbuilt_bim.bim.covers import Cover, CoveredRows
from asbuilt_bim.bim.model import BimModel, Obstacle
from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.read import covers, design, floors
from asbuilt_bim.ifc.read.archive import MAX_BYTES
from asbuilt_bim.ifc.read.design import Inspection
from asbuilt_bim.ifc.write import copy, federation
from asbuilt_bim.ifc.write.entities import Words, bare
from asbuilt_bim.progress.report import ProgressReport, ShownState
from asbuilt_bim.scale.apart import LIMITS_VARIABLE, Ended, Limits, run_apart
from asbuilt_bim.storage.regular_file import path_of

Result = TypeVar("Result")

_BASE_S, _S_PER_MB = 20.0, 100.0
"""Ten times what the slowest of some 200 files of others takes on a slow processor."""
_BASE_BYTES, _BYTES_PER_BYTE = 1.5e9, 60.0


def read_design(path: Path | str | Sequence[Path | str], scope: str | None = None) -> BimModel:
    """Read the design from an IFC file or several, as `ifc.read.design.read_design` does, in a process of its own.

    Raises:
        DesignError: as there; or the file crashed its reader, or took too long or too much memory.
    """
    named = [path] if isinstance(path, str) or not isinstance(path, Sequence) else path
    paths = [path_of(one, "path") for one in named]
    return _apart(paths, design.read_design, paths, scope)


def inspect_file(path: Path) -> Inspection:
    """Read what a file holds even where it is no design, in a process of its own.

    Raises:
        DesignError: it can't be opened, is damaged, crashed its reader, or took too long or too much memory.
    """
    return _apart([path], design.inspect_file, path)


def read_floors(paths: Sequence[Path | str]) -> tuple[Obstacle, ...]:
    """Return the slabs of the design's files, as `ifc.read.floors.read_floors` does, in a process of its own.

    Raises:
        DesignError: as there; or a file crashed its reader, or took too long or too much memory.
    """
    named = [Path(one) for one in paths]
    return _apart(named, floors.read_floors, tuple(named))


def read_covers(paths: Sequence[Path], rows: Sequence[Cover], measured: frozenset[str]) -> CoveredRows:
    """Return what the rows of a costs table pay for, as `ifc.read.covers.read_covers` does, in a process of its own.

    Raises:
        DesignError: as there; or a file or a selector crashed its reader, or took too long or too much memory.
    """
    return _apart(paths, covers.read_covers, tuple(paths), tuple(rows), measured)


def write_copies(
    sources: Sequence[Path],
    report: ProgressReport,
    folder: Path,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
    words: Words = bare,
) -> tuple[Path, ...]:
    """Write the result into copies of the design's files, as `ifc.write.federation.write_copies` does.

    Raises:
        AsBuiltError: as there; or a source crashed its reader, or took too long or too much memory.
    """
    return _apart(sources, _write_copies, tuple(sources), report, folder, tuple(earlier), colours, words)


def write_asbuilt(
    source: Path | str,
    report: ProgressReport,
    target: Path | str,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
    words: Words = bare,
) -> None:
    """Write a copy of `source` that carries the report, as `ifc.write.copy.write_asbuilt` does.

    Raises:
        AsBuiltError: as there; or the source crashed its reader, or took too long or too much memory.
    """
    _apart([Path(source)], _write_asbuilt, source, report, target, tuple(earlier), colours, words)


def strip_asbuilt(source: Path | str, target: Path | str) -> int:
    """Write a copy of `source` without what this program added; return how many sets went.

    Raises:
        AsBuiltError: the source can't be read, or the copy can't be written.
    """
    return _apart([path_of(source, "source")], copy.strip_asbuilt, source, path_of(target, "target"))


def _write_copies(sources: Sequence[Path], report: ProgressReport, folder: Path, *more: Any) -> tuple[Path, ...]:
    earlier, colours, words = more
    return federation.write_copies(sources, report, folder, earlier=earlier, colours=colours, words=words)


def _write_asbuilt(source: Path | str, report: ProgressReport, target: Path | str, *more: Any) -> None:
    earlier, colours, words = more
    copy.write_asbuilt(source, report, target, earlier=earlier, colours=colours, words=words)


def _apart(paths: Sequence[Path], work: Callable[..., Result], *arguments: Any) -> Result:
    """Do work on IFC files apart, within limits that grow with them.

    Raises:
        DesignError: the process crashed, took too long or too much memory.
    """
    done = run_apart(work, *arguments, limits=limits_of(paths).raised())
    if not isinstance(done, Ended):
        return done
    where = ", ".join(map(str, paths))
    if done.why == "died":
        raise DesignError(
            f"{where}: it crashed the IFC library ({done.detail}), so the file is damaged; export it again, or leave "
            "out what was changed last"
        )
    raise DesignError(
        f"{where}: working on it took {done.detail}, far more than files of its size do; export it again with simpler "
        f"geometry. If the file is sound, set {LIMITS_VARIABLE}=4 for four times the time and memory"
    )


def limits_of(paths: Sequence[Path]) -> Limits:
    """Return what work on files may take: honest ones of that size take a tenth of it."""
    size = sum(map(_size, paths))
    return Limits(seconds=_BASE_S + _S_PER_MB * size / 1e6, memory_bytes=_BASE_BYTES + _BYTES_PER_BYTE * size)


def _size(path: Path) -> int:
    """Return the bytes of a model, of an archive those that it says it unpacks to; 0 where there is none."""
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            return 0
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                return min(MAX_BYTES, sum(member.file_size for member in archive.infolist()))
        return about.st_size
    except (OSError, zipfile.BadZipFile):
        return 0
