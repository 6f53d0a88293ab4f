"""Whether an output folder is whole: where it points, what that run holds, and the copies beside it."""

from __future__ import annotations

import hashlib
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

from asbuilt_bim.flow.output.places import COPIED, COPIED_FOLDERS


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """What a command leaves that nobody kills: its files, the digests that don't change, and how long it writes."""

    command: tuple[str, ...]
    names: frozenset[str]
    digests: dict[str, str]  # of the files that are the same in every run
    writing_s: float
    publishing_s: float  # from the run's own folder to the end
    whole_s: float  # from its start


def current(out: Path) -> Path:
    """Return the run that `current.json` names."""
    return out / str(json.loads((out / "current.json").read_text(encoding="utf-8"))["run"])


def digests_of(folder: Path) -> dict[str, str]:
    """Return name -> sha256 of every file below a folder."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def fault_of(run: Path, reference: Reference) -> str:
    """Return what is wrong with a run's folder, "" where it is whole."""
    found = digests_of(run)
    if missing := reference.names - found.keys():
        return f"{run.name} lacks {sorted(missing)[0]}"
    wrong = [name for name, digest in reference.digests.items() if found[name] != digest]
    return f"{run.name}/{wrong[0]} is not what it should be" if wrong else next(filter(None, _unsound(run)), "")


def _unsound(run: Path) -> list[str]:
    """Look into the files that hold the time at which they were made."""
    faults = []
    for path in run.rglob("*"):
        if path.suffix == ".xlsx" and (not zipfile.is_zipfile(path) or zipfile.ZipFile(path).testzip()):
            faults.append(f"{path.name} is damaged")
        if path.suffix == ".html" and not path.read_bytes().rstrip().endswith(b"</html>"):
            faults.append(f"{path.name} is cut short")
        if path.suffix == ".json":
            try:
                json.loads(path.read_bytes())
            except ValueError:
                faults.append(f"{path.name} is cut short")
    return faults


def broken_copies(out: Path, runs: list[Path]) -> list[str]:
    """Return the copies beside the runs that are of none of them, whole."""
    whole = [digests_of(run) for run in runs if run.is_dir()]
    copies = [p for n in COPIED_FOLDERS for p in (out / n).rglob("*") if p.is_file() and p.suffix != ".part"]
    copies += [path for path in (*(out / name for name in COPIED), *out.glob("*.asbuilt.ifc")) if path.is_file()]
    faults = []
    for path in copies:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if all(run.get(path.relative_to(out).as_posix()) != digest for run in whole):
            faults.append(f"{path.name} is of no run")
    return faults
