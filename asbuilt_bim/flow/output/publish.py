"""What a run folder holds: written by `run` from what was measured, by `report` from `result.json` alone."""

import contextlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.codes import REVISIONS, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import AsBuiltError, ResultError
from asbuilt_bim.flow.measure_visit import Progress
from asbuilt_bim.flow.output.carried_on import check_currency, inputs_of, last_workbook, with_last
from asbuilt_bim.flow.output.certified_on import (
    certified_runs,
    file_changes,
    photo_changes,
    photos_of,
    signed_otherwise,
)
from asbuilt_bim.flow.output.folder import OutputFolder, Published
from asbuilt_bim.flow.output.places import CHANGES
from asbuilt_bim.flow.pipeline import RunResult
from asbuilt_bim.ifc.apart import write_copies
from asbuilt_bim.progress.globalid_remap import inputs_again, known_again, remapped_ids, with_new_ids
from asbuilt_bim.progress.report import ProgressReport, Provenance
from asbuilt_bim.progress.revision import remap_notes, revision_notes
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.project.check import to_come
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.networks import identities
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from asbuilt_bim.report.outputs import read_pictures, write_outputs, write_overlays
from asbuilt_bim.report.result.document import CARRIED, VISITS, read_before, read_result, write_result
from asbuilt_bim.report.wording.changes import write_changes
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.workbook.read import LastWorkbook
from asbuilt_bim.report.writers import run_writers, writers_of
from asbuilt_bim.scale.cache import digest_of
from asbuilt_bim.scale.codec import plain_digest
from asbuilt_bim.scale.fingerprint import library_versions, program_digest
from asbuilt_bim.storage.plugins import Plugin
from asbuilt_bim.storage.regular_file import file_digest, files_digest
from asbuilt_bim.version import __version__

INPUTS = "inputs"
"""In a run's folder: the project file and its tables, as they were."""


def publish_run(
    out: OutputFolder,
    result: RunResult,
    project: Project,
    when: datetime,
    writers: Sequence[Plugin] = (),
    *,
    progress: Progress = lambda *_: None,
    colour: bool = False,
    keep_runs: int | None = None,
) -> Published:
    """Write a run's files into a run folder of its own and make it current; `writers` are other packages'.

    `colour` paints the elements of the IFC copy by state. `keep_runs` keeps only so many of the newest runs, unless
    no station of the visit could be used. A run without a usable station in any visit doesn't replace an earlier one.

    Raises:
        OutputError: something can't be written; the earlier run stays current.
    """
    made_from = provenance(result, project, when)
    reports = [replace(report, provenance=made_from) for report in result.reports]
    warnings: list[str] = []
    earlier = previous_result(out)
    before = known_again(earlier, result.design) if earlier is not None else None

    def write(folder: Path) -> None:
        _write_pictures(folder, result.pictures)
        write_rig(result.rig, folder / "rig.yaml")
        _keep_inputs(project, folder / INPUTS)
        for name, visits in ((VISITS, reports), (CARRIED, _without_pictures(result.past))):
            (folder / name).mkdir()
            for report in visits:
                write_result(report, folder / name / f"{report.visit_date.isoformat()}.json")
        write_result(reports[-1], folder / "result.json")
        last = _write_views(folder, project.ifc, colour, progress)
        if before is not None:
            write_changes(before, last, folder / CHANGES)
        warnings.extend(run_writers(writers, last, folder))

    published = out.publish(
        write,
        when=when,
        digest=_digest(made_from, reports),
        ifc=[_from(out.path, path) for path in project.ifc],
        set_aside=earlier is not None and not earlier.knows_nothing and reports[-1].knows_nothing,
        keep_runs=None if reports[-1].nothing_seen else keep_runs,
        certified=certified_runs(reports[-1]),
    )
    if earlier is not None and not published.current:
        warnings.append(
            f"{out.path / 'report.html'} and the files beside it stay those of the earlier run, visit of "
            f"{earlier.visit_date.isoformat()}: this run saw nothing. What it has to say is in {published.folder}"
        )
    return replace(published, warnings=(*warnings, *published.warnings))


def publish_again(
    out: OutputFolder,
    ifc: Sequence[Path],
    when: datetime,
    *,
    progress: Progress = lambda *_: None,
    colour: bool = False,
    whole_photos: bool = False,
) -> Published:
    """Make every output of the current run again, from its `result.json`, its pictures and the IFC files alone.

    `ifc` names all of them, in their order, where they have been moved; nothing where they are in their place.
    `whole_photos` shows photos whole this time, whatever the run did; `result.json` stays as the run wrote it.

    Raises:
        ResultError: there is no run yet, its result is damaged, or the IFC is not the one that it was made from.
        OutputError: something can't be written; the earlier run stays current.
    """
    current = out.current()
    if current is None:
        raise ResultError(no_run(out.path))
    report = read_result(current.folder / "result.json")
    sources = tuple(ifc) or tuple(out.path / path for path in current.ifc)
    _check_ifc(sources, report)
    last = last_workbook(out, report)
    if last is not None:
        report = with_last(report, last)
    writers, missing = writers_of(current.folder)
    warnings = list(missing)

    def write(folder: Path) -> None:
        for name in ("pictures", VISITS, CARRIED, INPUTS):
            _copy_folder(current.folder / name, folder / name)
        for name in ("result.json", "rig.yaml", CHANGES):
            if (current.folder / name).is_file():
                shutil.copyfile(current.folder / name, folder / name)
        if last is not None:
            write_result(report, folder / "result.json")
        _write_views(folder, sources, colour, progress, whole_photos=whole_photos)
        warnings.extend(run_writers(writers, report, folder))

    digest = _digest(report.provenance, [report]) if report.provenance else "0" * 8
    published = out.publish(write, when=when, digest=digest, ifc=[_from(out.path, path) for path in sources])
    return replace(published, warnings=(*warnings, *published.warnings))


def no_run(folder: Path) -> str:
    """Say that a folder holds no run, and how to make one."""
    return f"{folder}: holds no run; make one with: asbuilt-bim run PROJECT.yaml --out {folder}"


def previous_result(out: OutputFolder) -> ProgressReport | None:
    """Return the current run's report, to say what has changed; None where there is none that can be read."""
    try:
        current = out.current()
        return read_result(current.folder / "result.json") if current else None
    except AsBuiltError:  # a damaged earlier result takes nothing from the new one
        return None


def with_what_is_known(
    result: RunResult, project: Project, before: ProgressReport | None, last: LastWorkbook | None, today: date
) -> RunResult:
    """Return a run's result with all that the folder's earlier run, persons and the calendar say of it.

    Raises:
        CostError: what was certified before is of another currency than the costs now.
    """
    compared = with_other_program(with_visits_gone(with_revision(result, before), before), before)
    return with_days_to_come(with_persons(compared, project, before, last, _digests(result, project)), today)


def with_days_to_come(result: RunResult, today: date) -> RunResult:
    """Return a run's result with a note where a visit's day is yet to come."""
    reports = (replace(one, notes=(*to_come(one.visit_date, today), *one.notes)) for one in result.reports)
    return replace(result, reports=tuple(reports))


def with_revision(result: RunResult, before: ProgressReport | None) -> RunResult:
    """Return a run's result with notes on what its design differs in from the earlier run's in the same folder.

    Where the design is the earlier run's, the notes that that one carried stay: they tell of the last revision.
    """
    last = result.reports[-1]
    if before is None or before.provenance is None or any(note.code in REVISIONS for note in last.notes):
        return result
    if before.provenance.ifc_digest == result.design.file_digest:
        notes = tuple(note for note in before.notes if note.code in REVISIONS)
    else:
        ids = remapped_ids(before, result.design)
        known = with_new_ids(before, ids)
        notes = (*remap_notes(known, ids), *revision_notes(known, last))
    return replace(result, reports=(*result.reports[:-1], replace(last, notes=(*last.notes, *notes))))


def with_visits_gone(result: RunResult, before: ProgressReport | None) -> RunResult:
    """Return a run's result with a note on visits that the earlier run counted and this one doesn't."""
    last = result.reports[-1]
    if before is None:
        return result
    counted = {*before.earlier_visits, before.visit_date} - {*last.earlier_visits, last.visit_date}
    gone = tuple(day.isoformat() for day in sorted(counted))
    note = noted(Reason.VISITS_GONE, about(SubjectKind.VISIT, last.visit_date.isoformat()), visits=gone)
    reports = (*result.reports[:-1], replace(last, notes=(note, *last.notes)))
    return replace(result, reports=reports) if gone else result


def with_other_program(result: RunResult, before: ProgressReport | None) -> RunResult:
    """Return a run's result with a note where another program made the earlier run, or else the last under history."""
    earlier = before if before is not None else next(reversed(result.past), None)
    made_from = earlier.provenance if earlier is not None else None
    if made_from is None or made_from.program_digest == program_digest():
        return result
    last = result.reports[-1]
    subject = about(SubjectKind.VISIT, last.visit_date.isoformat())
    program = ", ".join(filter(None, (made_from.program_version, made_from.program_digest[:8])))
    note = noted(Reason.OTHER_PROGRAM, subject, program=program)
    return replace(result, reports=(*result.reports[:-1], replace(last, notes=(note, *last.notes))))


def with_persons(
    result: RunResult,
    project: Project,
    before: ProgressReport | None,
    last: LastWorkbook | None,
    digests: Mapping[str, str],
) -> RunResult:
    """Return a run's result with what persons bring to its last visit's valuation; `before` is the current run's.

    `digests` are of the files that the run is made from.

    Raises:
        CostError: what was certified before is of another currency than the costs now.
    """
    inputs, notes = inputs_of(project.valuation, last, before, result.past)
    if before is not None:
        inputs = inputs_again(inputs, before, result.reports[-1], remapped_ids(before, result.design))
    check_currency(result.reports[-1].cost_lines, inputs, (project.costs,) if project.costs else project.ifc)
    inputs = replace(inputs, photos=photos_of(result.reports))
    changed = (*photo_changes(inputs), *file_changes(inputs, digests), *signed_otherwise(last, before))
    last_report = with_valuation(result.reports[-1], inputs, (*notes, *changed))
    return replace(result, reports=(*result.reports[:-1], last_report))


def provenance(result: RunResult, project: Project, when: datetime) -> Provenance:
    """Return what a run's numbers were made from."""
    digests = _digests(result, project)
    return Provenance(
        program_version=__version__,
        created=when.astimezone(UTC).isoformat(timespec="seconds"),
        project_name=project.name,
        ifc_name=result.design.file_name,
        ifc_digest=digests["ifc"],
        rig_digest=digests["rig"],
        survey_digest=digests["survey"],
        options_digest=digests["options"],
        networks=identities(project.networks),
        libraries=library_versions(),
        program_digest=program_digest(),
    )


def _digests(result: RunResult, project: Project) -> dict[str, str]:
    """Return the digests of what a run is made from beside its photos."""
    markers = replace(project.markers, survey=None)  # it has a digest of its own
    accepted = [one for one in (project.accept_moved, project.accepted_shift) if one]
    options = (project.options, project.target, markers, project.scope, *accepted)
    return {
        "ifc": result.design.file_digest,
        "rig": plain_digest(result.rig, StereoRig),
        "survey": places_digest(project),
        "options": digest_of([repr(options)]),
    }


def places_digest(project: Project) -> str:
    """Return the digest of what the project knows of places: of its survey alone, where there is nothing else."""
    files = [file for file in (project.survey, project.poses, project.control_points) if file is not None]
    return file_digest(files[0]) if len(files) == 1 else digest_of([file_digest(file) for file in files])


def _write_views(
    folder: Path, ifc: Sequence[Path], colour: bool, progress: Progress, *, whole_photos: bool = False
) -> ProgressReport:
    """Write what is made from a run folder's results, as they stand there: `run` and `report` write the same."""
    progress("write", 0, 1)
    report = read_result(folder / "result.json")
    if whole_photos:
        report = replace(report, pictures="whole")
    earlier = read_before(folder, report.visit_date)
    write_outputs(report, folder, folder, earlier=earlier)
    for one in earlier:
        write_overlays(one, read_pictures(one, folder), folder / "overlays", whole=report.pictures == "whole")
    colours = STATE_COLOURS if colour else None
    write_copies(ifc, report, folder, earlier=earlier, colours=colours, words=note_words)
    progress("write", 1, 1)
    return report


def _without_pictures(past: Sequence[ProgressReport]) -> list[ProgressReport]:
    """Return results of other runs as this run's folder can hold them: their pictures stay where they are."""
    return [replace(one, stations=tuple(replace(s, picture="") for s in one.stations)) for one in past]


def _write_pictures(folder: Path, pictures: dict[str, bytes]) -> None:
    for name, data in pictures.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def _keep_inputs(project: Project, folder: Path) -> None:
    """Keep the project file and its tables as they are now: who asks a year later what was set finds it there."""
    tables = (
        *(project.survey, project.poses, project.control_points),
        *(project.costs, project.schedule, project.observations, project.people),
    )
    folder.mkdir()
    for file in (project.path, *(table for table in tables if table is not None)):
        beside = sum(one.name.endswith(file.name) for one in folder.iterdir())
        with contextlib.suppress(FileNotFoundError, PermissionError):  # gone meanwhile: no reason to lose a run
            shutil.copyfile(file, folder / (f"{beside + 1} {file.name}" if beside else file.name))


def _copy_folder(source: Path, target: Path) -> None:
    """Copy a folder's files where there is one; `shutil.copytree` would raise a list of all that failed."""
    for file in sorted(source.rglob("*")):
        if file.is_file():
            copy = target / file.relative_to(source)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)


def _check_ifc(paths: Sequence[Path], report: ProgressReport) -> None:
    for path in paths:
        if path.is_dir():
            raise ResultError(f"{path}: is a folder; name the IFC file in it with --ifc")
        if not path.is_file():
            raise ResultError(f"{path}: the IFC file of this result isn't there; name it with --ifc")
    if report.provenance and files_digest(paths) != report.provenance.ifc_digest:
        raise ResultError(
            f"{', '.join(map(str, paths))}: has changed since this result was made from it; run the project again, "
            "or name the file as it was with --ifc (each of them, in their order)"
        )


def _digest(made_from: Provenance | None, reports: Sequence[ProgressReport]) -> str:
    photos = [d for report in reports for s in report.stations for d in (s.left_digest, s.right_digest)]
    inputs = (
        [made_from.ifc_digest, made_from.rig_digest, made_from.survey_digest, made_from.options_digest]
        if made_from
        else []
    )
    return digest_of([*inputs, *photos])


def _from(folder: Path, path: Path) -> str:
    """Return `path` relative to the output folder, as it is when both are moved together."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()
