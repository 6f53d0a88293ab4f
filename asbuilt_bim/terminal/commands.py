"""What each command does, between the command line and the pipeline; returns the exit code."""

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import date, datetime
from pathlib import Path

from rich.text import Text

from asbuilt_bim.api import until_visit
from asbuilt_bim.camera.calibration.area_effect import area_effect
from asbuilt_bim.errors import DesignError, OutputError, ResultError
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.output.carried_on import last_workbook
from asbuilt_bim.flow.output.folder import Published, open_output, read_current
from asbuilt_bim.flow.output.places import CHANGES
from asbuilt_bim.flow.output.publish import (
    no_run,
    previous_result,
    publish_again,
    publish_run,
    with_what_is_known,
)
from asbuilt_bim.flow.pipeline import RunResult, run_project
from asbuilt_bim.flow.video_stations import with_video_stations
from asbuilt_bim.ifc.apart import inspect_file, strip_asbuilt
from asbuilt_bim.measure.step_timer import StepTimer
from asbuilt_bim.progress.globalid_remap import known_again
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.check import missing_photos
from asbuilt_bim.project.mistakes import first_rows
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.page.calibration import unfit_words
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.report.task_rows import late_words
from asbuilt_bim.report.wording.changes import changes
from asbuilt_bim.report.wording.of_page.alike import days_alike, notes_alike
from asbuilt_bim.report.writers import load_writers
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.scale.cluster import Scheduler
from asbuilt_bim.storage.atomic_write import place_problem
from asbuilt_bim.terminal.inspect_table import design_tables, fact_tables
from asbuilt_bim.terminal.open_cache import open_cache
from asbuilt_bim.terminal.screen import Screen
from asbuilt_bim.terminal.summary_table import (
    DesignFiles,
    calibration_lines,
    say_left_out_last,
    summary,
    time_line,
    warn_of_design,
    warn_of_faults,
    warn_of_visit,
)

INCOMPLETE = 1
"""The exit code where a station was left out and --strict is given, or where every one of the visit's was."""
MAX_CHANGES = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """The command line of `run`, as it was given."""

    project: Path
    out: Path
    workers: int | None = None
    until: date | None = None
    strict: bool = False
    refine_rig: bool = False
    allow_outside: bool = False
    scheduler: Scheduler | None = None
    no_cache: bool = False
    colour: bool = False
    whole_photos: bool = False
    quiet: bool = False
    keep_runs: int | None = None


def run_command(request: RunRequest, screen: Screen, when: datetime) -> int:
    """Run a project and publish its outputs.

    Raises:
        AsBuiltError: there is no result, with the reason.
    """
    project = until_visit(read_project(request.project, allow_outside=request.allow_outside), request.until)
    writers = load_writers(project.writers)
    if request.refine_rig:
        project = replace(project, rig=replace(project.rig, refine=True))
    if request.whole_photos:
        project = replace(project, pictures="whole")
    cache = Cache(folder=None) if request.no_cache else open_cache(screen)
    place = Workplace(workers=request.workers or 0, scheduler=request.scheduler, cache=cache)
    with open_output(request.out, project.sources) as out, ExitStack() as until_end:
        before = previous_result(out)
        last = last_workbook(out, before, project.last_workbook)  # one that can't be read is said before anything else
        _warn_of_missing(project, screen)
        with screen.steps() as progress:
            project = until_end.enter_context(with_video_stations(project, cache, progress))
            result = run_project(project, place, progress, before)
            result = with_what_is_known(result, project, before, last, when.date())
            before = known_again(before, result.design) if before is not None else None
            timer = StepTimer(time.perf_counter)
            published = publish_run(
                out, result, project, when, writers,
                progress=progress, colour=request.colour, keep_runs=request.keep_runs,
            )  # fmt: skip
            timer.done("write")
    cache.prune()
    incomplete = _warn(result, project, screen)
    if published.current:
        report = read_result(published.folder / "result.json")  # as written: it knows what it was made from
        _show(report, before, screen, request.out / CHANGES)
        if result.from_cache:
            count = sum(len(visit.stations) for visit in project.visits)
            screen.say(f"{result.from_cache} of {count} stations were measured before and taken from the cache.")
        screen.say(time_line({**result.seconds, **timer.seconds}))
    _say_where(request.out, published, screen)
    for visit, report in zip(project.visits, result.reports, strict=True):
        say_left_out_last(visit, report, screen)
    if result.reports[-1].nothing_seen:
        screen.error(_nothing_seen(result.reports[-1]))
        return INCOMPLETE
    if request.strict and incomplete:
        screen.error("stations were left out (see above), and --strict was given")
        return INCOMPLETE
    return 0


def _warn_of_missing(project: Project, screen: Screen) -> None:
    """Say before anything is measured which photos aren't there: a mistyped path is mended in less than a run."""
    if missing := missing_photos(project):
        what = "photos aren't there; their stations will be left out, unless you stop and correct the paths:"
        screen.warn("\n".join([what, *first_rows([f"  {line}" for line in missing])]))


def _warn(result: RunResult, project: Project, screen: Screen) -> bool:
    """Say what is wrong with visits, rig and design, the worst first; return whether a station was left out."""
    for report in result.reports:
        warn_of_faults(report, screen)
    if result.calibration is not None:
        for line in calibration_lines(result.calibration):
            screen.say(line)
        effect = area_effect(result.calibration.rig, result.calibration.by_source)
        if unfit := unfit_words(result.calibration, effect):
            screen.warn(unfit)
    files = DesignFiles(
        ifc=", ".join(path.name for path in project.ifc),
        costs=project.costs.name if project.costs else "",
        schedule=project.schedule.name if project.schedule else "",
    )
    warn_of_design(files, result.design.notes, screen)
    incomplete, warnings = False, []
    for visit, report in zip(project.visits, result.reports, strict=True):
        incomplete |= warn_of_visit(visit, report, screen)
        own = [note for note in report.notes if note not in result.design.notes]  # a rig that was refined, or knocked
        warnings += [(visit.date.isoformat(), one.line) for one in notes_alike(own)]
    for line in days_alike(warnings):
        screen.warn(line)
    return incomplete


def _nothing_seen(report: ProgressReport) -> str:
    """Say what a report is worth of whose visit not one station counts."""
    known = "nothing is known of any element"
    if not report.knows_nothing:
        known = "the report holds what was known before, no more"
    return f"visit {report.visit_date.isoformat()}: not one station could be used, so {known}"


def report_command(
    folder: Path,
    ifc: Sequence[Path],
    screen: Screen,
    when: datetime,
    *,
    colour: bool = False,
    whole_photos: bool = False,
) -> int:
    """Make the outputs of a folder's current run again.

    Raises:
        AsBuiltError: there is no run, or its result or IFC can't be used.
    """
    if not folder.is_dir():
        raise OutputError(f"{folder}: no such folder; name the --out folder of a run")
    if read_current(folder) is None:  # before the folder is taken: one without runs stays as it is
        raise ResultError(no_run(folder))
    with open_output(folder) as out, screen.steps() as progress:
        published = publish_again(out, ifc, when, progress=progress, colour=colour, whole_photos=whole_photos)
    _show(read_result(published.folder / "result.json"), None, screen, folder / CHANGES)
    _say_where(folder, published, screen)
    return 0


def inspect_command(path: Path, screen: Screen) -> int:
    """Show what is understood of an IFC file.

    Raises:
        DesignError: it can't be used.
    """
    with screen.waiting(f"Reading {path.name}"):
        found = inspect_file(path)
    for table in (*fact_tables(path.name, found.facts), *(design_tables(found.design) if found.design else ())):
        screen.say(table)
    if found.design is None:
        raise DesignError(found.refusal)
    return 0


def strip_command(source: Path, target: Path, screen: Screen, *, replace_it: bool = False) -> int:
    """Write a copy of an IFC file without anything of this program's.

    Raises:
        AsBuiltError: the file can't be read, or the copy can't be written.
    """
    if problem := place_problem(target, folder=False):
        raise OutputError(problem)
    if target.exists() and not replace_it and target.resolve() != source.resolve():
        raise OutputError(f"{target}: is there already; name another file, or pass --replace")
    count = strip_asbuilt(source, target)
    if count:
        screen.say(f"{target}: {count} sets of asbuilt-bim's and all that belongs to them were taken out.")
    else:
        screen.warn(f"{source}: carries nothing of asbuilt-bim's; {target} holds the same")
    return 0


def _show(report: ProgressReport, before: ProgressReport | None, screen: Screen, whole: Path) -> None:
    """Show the end of a run; `whole` is the file that holds all changes."""
    screen.say()
    screen.say(summary(report, screen.width))
    if plan := late_words(report):
        screen.say(Text(f"Against the schedule: {plan}"))  # a Text is wrapped at the terminal's width
    if before is None:
        return
    lines: Sequence[str] = changes(before, report)
    screen.say("Against the earlier run in this folder:" if lines else "Nothing has changed against the earlier run.")
    for line in lines[:MAX_CHANGES]:
        screen.say(f"  {line}")
    if len(lines) > MAX_CHANGES:
        screen.say(f"  ... and {len(lines) - MAX_CHANGES} more; all {len(lines)} stand in {whole}")


def _say_where(folder: Path, published: Published, screen: Screen) -> None:
    for warning in published.warnings:
        screen.warn(warning)
    kept = ""
    if published.runs_kept > 1:
        size = f"{published.bytes_kept / 1e6:.0f} MB; --keep-runs N takes away all but the newest N"
        kept = f" ({published.runs_kept} runs are kept in {folder / 'runs'}: {size})"
    screen.say(f"{'Report' if published.current else 'Earlier report'}: {folder / 'report.html'}{kept}")
