"""The output folder: each run written whole into a folder of its own, then made current in one step.

A run that fails half-way (disk full, no right to write, the power cut) leaves the earlier one current, and nothing
of its own.
"""

import contextlib
import errno
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.output.kept import bytes_of, keep_edited, kept_runs
from asbuilt_bim.flow.output.places import (
    COPIED,
    COPIED_FOLDERS,
    CURRENT,
    RUN_NAME,
    check_links,
    check_sources,
    check_strangers,
)
from asbuilt_bim.storage.atomic_write import PART, flush, flush_tree, replace_bytes
from asbuilt_bim.storage.regular_file import file_digest
from asbuilt_bim.storage.strict_json import parse_json

RESULT = "result.json"
_HELD = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentRun:
    """What `current.json` says: the run's folder, and the IFC files (relative to the output folder) it is of."""

    folder: Path
    ifc: tuple[str, ...]
    digest: str = ""  # sha256 of its result; "" in folders of before there was one


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """A run that is `current` now, or else kept beside it; `warnings` name the copies that could not be replaced."""

    folder: Path
    runs_kept: int
    warnings: tuple[str, ...]
    current: bool = True
    bytes_kept: int = 0  # of all runs


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputFolder:
    """An output folder that this process holds; made by `open_output`."""

    path: Path

    def current(self) -> CurrentRun | None:
        """Return the current run, None where there is none yet."""
        return read_current(self.path)

    def publish(
        self,
        write: Callable[[Path], object],
        *,
        when: datetime,
        digest: str,
        ifc: Sequence[str],
        set_aside: bool = False,
        keep_runs: int | None = None,
        certified: Callable[[Path], bool] = lambda run: False,
    ) -> Published:
        """Have `write` fill a new run folder, then make it current; `set_aside`: keep it beside the current one.

        `keep_runs` takes away all but so many of the newest runs, never the current one, this one, or those of which
        `certified` says that a valuation rests on them.

        Raises:
            OutputError: something could not be written; the earlier run is still current and the new folder is gone.
        """
        before = self.current()
        final = self._new_name(when, digest)
        staging = final.with_name(final.name + ".part")
        try:
            staging.mkdir(parents=True)
            write(staging)
            flush_tree(staging)
            staging.rename(final)
            flush(final.parent)
            if not set_aside:
                replace_bytes(self.path / CURRENT, _pointer(final, when, ifc))
        except BaseException as problem:
            shutil.rmtree(staging, ignore_errors=True)
            if not self._points_at(final):
                shutil.rmtree(final, ignore_errors=True)
            if isinstance(problem, OSError):
                raise output_error(self.path, problem) from problem
            raise
        warnings = () if set_aside else tuple(self._copy(final, before))
        in_use = {final, before.folder} if set_aside and before else {final}
        if keep_runs is not None:
            in_use |= {run for run in (self.path / "runs").iterdir() if run.is_dir() and certified(run)}
        runs = kept_runs(self.path / "runs", keep_runs, in_use)
        size = sum(bytes_of(run) for run in runs)
        return Published(folder=final, runs_kept=len(runs), warnings=warnings, current=not set_aside, bytes_kept=size)

    def _points_at(self, run: Path) -> bool:
        try:
            current = self.current()
        except OutputError:
            return False
        return current is not None and current.folder == run

    def _new_name(self, when: datetime, digest: str) -> Path:
        name = f"{run_stamp(when)}-{digest[:8]}"
        runs = self.path / "runs"
        count, free = 1, runs / name
        while free.exists():
            count += 1
            free = runs / f"{name}-{count}"
        return free

    def _copy(self, run: Path, before: CurrentRun | None) -> Iterator[str]:
        """Bring the copies that people open up to date, one by one; say which could not be, and which were changed."""
        wanted = copies_of(run)
        gone = set(copies_of(before.folder)) - set(wanted) if before and before.folder.is_dir() else set()
        for relative in (*wanted, *sorted(gone)):
            yield from self._kept(relative)
        for relative in wanted:
            target = self.path / relative
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
                replace_bytes(target, (run / relative).read_bytes())
            except OSError as problem:
                yield f"{_not_copied(target, problem)}. The new one is {run / relative}"
        for relative in gone:
            with contextlib.suppress(OSError):
                (self.path / relative).unlink()

    def _kept(self, relative: Path) -> Iterator[str]:
        """Keep what a person made of a copy; what can't be moved can't be replaced, and a warning says so."""
        with contextlib.suppress(OSError):
            kept = keep_edited(self.path, relative)
            if kept is not None:
                yield f"{self.path / relative}: isn't what any run kept here wrote; it is kept as {kept.name}"


def run_stamp(when: datetime) -> str:
    """Return what the name of the folder of a run begins with that was made then."""
    return f"{when.astimezone(UTC):%Y%m%dT%H%M%SZ}"


@contextlib.contextmanager
def open_output(path: Path, sources: Iterable[Path] = ()) -> Iterator[OutputFolder]:
    """Make and hold an output folder, so that no other run writes into it meanwhile.

    Raises:
        OutputError: it can't be written, another run holds it, it would touch a source, or holds files of others.
    """
    path = path.absolute()
    check_sources(path, sources)
    try:
        check_strangers(path)
        check_links(path)
        (path / "runs").mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as problem:
        raise output_error(path, problem) from problem
    with run_lock(path / "runs" / ".lock", path):
        _clear_left_overs(path)
        try:
            with tempfile.TemporaryFile(dir=path):
                pass
        except OSError as problem:
            raise output_error(path, problem) from problem
        read_current(path)  # a damaged one is an error before anything is measured
        yield OutputFolder(path=path)


def _clear_left_overs(path: Path) -> None:
    """Take away what a killed run had begun: its folder, and copies that weren't whole yet."""
    for left_over in (path / "runs").glob("*.part"):
        if RUN_NAME.fullmatch(left_over.stem):
            shutil.rmtree(left_over, ignore_errors=True)
    halves = [*path.glob(f"{PART}*.part"), *(f for n in COPIED_FOLDERS for f in (path / n).rglob(f"{PART}*.part"))]
    for half in halves:
        with contextlib.suppress(OSError):
            half.unlink()


def read_current(path: Path) -> CurrentRun | None:
    """Return what `current.json` in an output folder points at, None where there is none.

    Raises:
        OutputError: the file is damaged or points out of the folder, or somebody changed the run's result since.
    """
    pointer = path / CURRENT
    try:
        plain = parse_json(pointer.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as problem:
        raise OutputError(f"{pointer}: can't be read ({problem}); delete it to start anew, the runs stay") from problem
    run = plain.get("run") if isinstance(plain, dict) else None
    known = isinstance(plain, dict) and plain.get("format") == "asbuilt-bim/current" and plain.get("version") == 1
    if not known or not isinstance(run, str) or not RUN_NAME.fullmatch(run.removeprefix("runs/")):
        raise OutputError(f"{pointer}: isn't a file of this program's; delete it to start anew, the runs stay")
    _check_result(path / run / RESULT, plain.get("result_sha256"), path)
    more = plain.get("more_ifc", [])
    models = (plain.get("ifc", ""), *(more if isinstance(more, list) else ()))
    digest = plain.get("result_sha256")
    return CurrentRun(
        folder=path / run,
        ifc=tuple(str(model) for model in models),
        digest=digest if isinstance(digest, str) else "",
    )


def _check_result(result: Path, digest: object, folder: Path) -> None:
    """Check that a result is as its run wrote it; `digest` is None in folders of before there was one.

    Raises:
        OutputError: it isn't: people are paid from it, so it counts for nothing.
    """
    if not isinstance(digest, str) or not result.is_file() or file_digest(result) == digest:
        return
    copy = folder / RESULT
    whole = copy.is_file() and file_digest(copy) == digest
    remedy = f"{copy} is as it was: copy it there" if whole else "put it back from a backup"
    raise OutputError(
        f"{result}: was changed since its run wrote it, so nothing is made from it; {remedy}. Or delete "
        f"{folder / CURRENT} to start anew, the runs stay"
    )


def output_error(
    path: Path,
    problem: BaseException,
    stands: str = "nothing of this run was kept and the earlier result stands",
) -> OutputError:
    """Return an OSError in words: what could not be written, why, what `stands`, what to do."""
    place = getattr(problem, "filename", None) or path
    code = getattr(problem, "errno", None)
    if code in (errno.ENOSPC, errno.EDQUOT):
        return OutputError(f"{path}: the disk is full; {stands}. Free some space, or choose another --out")
    if code in (errno.EACCES, errno.EPERM, errno.EROFS):
        return OutputError(f"{place}: no right to write here; choose another --out, or change the folder's rights")
    if code in (errno.ENOTDIR, errno.EEXIST):
        return OutputError(f"{place}: is in the way (a file where a folder is wanted); choose another --out")
    return OutputError(
        f"{place}: can't be written ({getattr(problem, 'strerror', None) or problem}); choose another --out"
    )


def _pointer(run: Path, when: datetime, ifc: Sequence[str]) -> bytes:
    """Return what `current.json` says of a run."""
    pointer = {
        "format": "asbuilt-bim/current",
        "version": 1,
        "run": f"runs/{run.name}",
        **({"result_sha256": file_digest(run / RESULT)} if (run / RESULT).is_file() else {}),
        "ifc": ifc[0],
        **({"more_ifc": list(ifc[1:])} if len(ifc) > 1 else {}),
        "written": when.astimezone(UTC).isoformat(timespec="seconds"),
    }
    return (json.dumps(pointer, indent=1) + "\n").encode()


def _not_copied(target: Path, problem: OSError) -> str:
    """Say why a copy isn't brought up to date, and what stands in its place."""
    there = os.path.lexists(target)
    if problem.errno in (errno.ENOSPC, errno.EDQUOT):
        why = "the disk is full"
    elif there:
        why = f"is open in another program or can't be replaced ({problem.strerror})"
    else:
        why = f"can't be written ({problem.strerror})"
    return f"{target}: {why}; {'it shows an earlier run' if there else 'it is not there'}"


def copies_of(run: Path) -> list[Path]:
    """Return what is copied from a run folder, relative to it."""
    models = [f.name for f in sorted(run.glob("*.asbuilt.ifc"))]
    deep = [f.relative_to(run) for name in COPIED_FOLDERS for f in sorted((run / name).rglob("*")) if f.is_file()]
    return [*deep, *(Path(name) for name in (*models, *COPIED) if (run / name).is_file())]  # the page last


@contextlib.contextmanager
def run_lock(path: Path, folder: Path) -> Iterator[None]:
    """Hold `path` as a lock; `folder` is what the message names.

    A file system that knows no locks (some network folders) is used without.

    Raises:
        OutputError: another process holds it, or the file can't be made.
    """
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as problem:
        raise OutputError(f"{folder}: can't be written ({problem.strerror}); choose another --out") from problem
    try:
        _take(handle, folder)
        yield
    finally:
        os.close(handle)


def _take(handle: int, folder: Path) -> None:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as problem:
        if problem.errno in _HELD:
            raise OutputError(
                f"{folder}: another run is writing here; wait for it, or choose another --out"
            ) from problem
