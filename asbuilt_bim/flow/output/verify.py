"""Holds an output folder, and the project's own files, against the digests that its result and certificates keep."""

import filecmp
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from asbuilt_bim.camera.photo.read import read_photo, side_by_side
from asbuilt_bim.errors import PhotoError, ResultError
from asbuilt_bim.flow.output.folder import RESULT, CurrentRun, copies_of, read_current
from asbuilt_bim.flow.output.kept import SIGNED_WORKBOOKS, WORKBOOK
from asbuilt_bim.flow.output.publish import no_run, places_digest
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.inputs import NO_INPUTS, Certificate
from asbuilt_bim.project.model import Project, Station
from asbuilt_bim.report.result.document import VISITS, read_result
from asbuilt_bim.storage.regular_file import file_digest, files_digest

Kind = Literal["result", "copy", "signed workbook", "signed run", "IFC", "survey", "photos"]
State = Literal["same", "other", "gone", "typed into", "unknown"]
"""`typed into`: a person wrote into the workbook, as they should. `unknown`: of before digests, or of a video."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verified:
    """What became of one thing since its digest was taken."""

    kind: Kind
    name: str
    state: State
    where: str = ""  # the file or folder that was looked at; of what is gone, what it would have to be


def verify_folder(folder: Path, project: Project | None = None) -> list[Verified]:
    """Look at a folder's current run, its certificates and IFC files; with its project at survey and photos, too.

    Raises:
        OutputError: the current result isn't as its run wrote it.
        ResultError: there is no run, or a file can't be read.
    """
    try:
        return _verified(folder, project)
    except OSError as problem:
        why = f"can't be read ({problem.strerror}); close it in other programs, and look at your rights"
        raise ResultError(f"{problem.filename or folder}: {why}") from problem


def _verified(folder: Path, project: Project | None) -> list[Verified]:
    if not folder.is_dir():
        raise ResultError(f"{folder}: no such folder; name the --out folder of a run")
    current = read_current(folder)
    if current is None:
        raise ResultError(no_run(folder))
    report = read_result(current.folder / RESULT)
    found = [
        Verified(kind="result", name=current.folder.name, state="same" if current.digest else "unknown"),
        *_copies(folder, current),
        *_certificates(folder, report, project),
        _ifc(folder, current, report),
    ]
    if project is not None:
        visits = [read_result(path) for path in sorted((current.folder / VISITS).glob("*.json"))]
        found += [_survey(project, report), *_photos(project, visits or [report])]
    return found


def _copies(folder: Path, current: CurrentRun) -> Iterator[Verified]:
    for relative in copies_of(current.folder):
        copy = folder / relative
        changed: State = "typed into" if relative.name == WORKBOOK else "other"
        same = copy.is_file() and filecmp.cmp(copy, current.folder / relative, shallow=False)
        state: State = "same" if same else changed if copy.is_file() else "gone"
        yield Verified(kind="copy", name=relative.as_posix(), state=state, where=str(copy))


def _certificates(folder: Path, report: ProgressReport, project: Project | None) -> Iterator[Verified]:
    """Look for each valuation's signed file by its digest, whatever its name, and for its run's result."""
    named = project.last_workbook if project is not None else None
    files = [*folder.glob(SIGNED_WORKBOOKS), *folder.glob(WORKBOOK), *([named] if named and named.is_file() else [])]
    there = {file_digest(file): file for file in files}
    for one in (report.valuation or NO_INPUTS).certificates:
        digest, name = one.digests.get("workbook", ""), f"valuation {one.number}"
        state: State = "unknown" if not digest else "same" if digest in there else "gone"
        where = there[digest].name if digest in there else f"SHA-256 {digest}" if digest else ""
        yield Verified(kind="signed workbook", name=name, state=state, where=where)
        yield _run_of(folder, one, name)


def _run_of(folder: Path, one: Certificate, name: str) -> Verified:
    digest = one.digests.get("result", "")
    if not digest:
        return Verified(kind="signed run", name=name, state="unknown")
    for result in sorted((folder / "runs").glob(f"*/{RESULT}")):
        if file_digest(result) == digest:
            return Verified(kind="signed run", name=name, state="same", where=result.parent.name)
    where = f"the run of {one.run}, whose {RESULT} has the SHA-256 {digest}"
    return Verified(kind="signed run", name=name, state="gone", where=where)


def _ifc(folder: Path, current: CurrentRun, report: ProgressReport) -> Verified:
    sources = [folder / path for path in current.ifc]
    then = report.provenance.ifc_digest if report.provenance else ""
    state: State = "unknown"
    if not all(source.is_file() for source in sources):
        state = "gone"
    elif then:
        state = "same" if files_digest(sources) == then else "other"
    return Verified(kind="IFC", name=", ".join(path.name for path in sources), state=state, where=str(sources[0]))


def _survey(project: Project, report: ProgressReport) -> Verified:
    files = [one for one in (project.survey, project.poses, project.control_points) if one is not None]
    state: State = "unknown"
    if not all(file.is_file() for file in files):
        state = "gone"
    elif report.provenance:
        state = "same" if places_digest(project) == report.provenance.survey_digest else "other"
    return Verified(kind="survey", name=", ".join(file.name for file in files) or "none", state=state)


def _photos(project: Project, reports: Sequence[ProgressReport]) -> Iterator[Verified]:
    """Look at the photos of each station that a report measured, where the project names them."""
    of_videos = {visit.date for visit in project.visits if visit.videos}  # their frames are in the cache alone
    here = {(visit.date, station.name): station for visit in project.visits for station in visit.stations}
    for report in reports:
        for record in report.stations:
            name = f"{report.visit_date.isoformat()} {record.name}"
            station = here.get((report.visit_date, record.name))
            state: State = "unknown" if report.visit_date in of_videos else "gone"
            if station is not None and station.left.is_file() and station.right.is_file():
                then = (record.left_digest, record.right_digest)
                state = "same" if _digests(station) == then else "other"
            where = str(station.left) if station is not None else record.left_photo
            yield Verified(kind="photos", name=name, state=state, where=where)


def _digests(station: Station) -> tuple[str, str]:
    """Return the digests of a station's photos as measuring takes them; of what is no photo any more, none."""
    try:
        left = read_photo(station.left)
        both = side_by_side(left) if station.side_by_side else (left, read_photo(station.right))
    except PhotoError:
        return "", ""
    return both[0].digest, both[1].digest
