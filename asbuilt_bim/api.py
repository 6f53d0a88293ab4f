"""The Python face of the whole flow: what `asbuilt-bim run` and `report` do, in a script or a notebook."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from functools import partial
from multiprocessing import current_process
from pathlib import Path

from asbuilt_bim.errors import OptionError, OutputError, ProjectError
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.output.carried_on import last_workbook
from asbuilt_bim.flow.output.folder import open_output
from asbuilt_bim.flow.output.publish import previous_result, publish_again, publish_run, with_what_is_known
from asbuilt_bim.flow.pipeline import run_project
from asbuilt_bim.flow.video_stations import with_video_stations
from asbuilt_bim.ifc import apart
from asbuilt_bim.progress.report import ProgressReport, ShownState
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.drawings.colours import with_default_colours
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.writers import load_writers
from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.storage.regular_file import path_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """A run that was published: its reports in the order of the visits, and where its files lie."""

    reports: tuple[ProgressReport, ...]
    folder: Path  # the run's own folder; the output folder holds copies of what people open
    warnings: tuple[str, ...]  # what puts every number of a visit in doubt, and what could not be written

    @property
    def result(self) -> ProgressReport:
        """Return THE result: the last visit's, with what the earlier ones had decided."""
        return self.reports[-1]


def run(
    project: Path | str,
    out: Path | str,
    *,
    until: date | None = None,
    workers: int = 1,
    allow_outside: bool = False,
    cache: bool = True,
    progress: Callable[[str, int, int, str], None] | None = None,
) -> Run:
    """Measure a project's stations and publish the outputs in the folder `out`, as `asbuilt-bim run` does.

    `workers` 0 is one process per processor; with more than one, a script needs `if __name__ == "__main__":`, because
    its processes are spawned. `until` gives the state as of that visit. Stations that were left out are in each
    report's `rejections`. `progress(step, done, total, what)` is called as the work goes on, with the name of the step,
    how many of how many things are done, and the last one's name. Look at `warnings`: a visit of which not one station
    could be used still gives a result, as the visits before left it.

    Raises:
        AsBuiltError: there is no result; its text says why and what to do. An earlier result stands.
    """
    if not isinstance(workers, int) or workers < 0:
        raise OptionError(f"workers: {workers!r} is no number of processes; give 1, 2 ..., or 0 for one per processor")
    if workers != 1 and current_process().daemon:
        raise OptionError(
            f"workers: {workers} wants processes, and a daemon (a worker of multiprocessing.Pool) may start none; "
            "give 1, or call from a worker of concurrent.futures.ProcessPoolExecutor"
        )
    if isinstance(until, datetime) or not isinstance(until, date | None):
        raise OptionError(f"until: {until!r} is no day; give a datetime.date, such as date(2026, 3, 2)")
    project, out = path_of(project, "project"), path_of(out, "out")
    checked = until_visit(read_project(project, allow_outside=allow_outside), until)
    writers = load_writers(checked.writers)
    store = Cache(folder=default_folder() if cache else None)
    place = Workplace(workers=workers, cache=store)
    tell = _silent if progress is None else partial(_told, progress)
    with open_output(out, checked.sources) as output:
        before = previous_result(output)
        last = last_workbook(output, before, checked.last_workbook)
        with with_video_stations(checked, store, tell) as visited:
            when = datetime.now(UTC)
            found = run_project(visited, place, tell, before)
            found = with_what_is_known(found, visited, before, last, when.date())
            published = publish_run(output, found, visited, when, writers, progress=tell)
    store.prune()
    return Run(reports=found.reports, folder=published.folder, warnings=(*_doubts(found.reports), *published.warnings))


def remake(folder: Path | str, ifc: Path | str | Sequence[Path | str] | None = None) -> Run:
    """Make every output of a folder's current run again from its result and the IFC, as `asbuilt-bim report` does.

    `ifc` names the IFC file, or all of them in their order, where they have been moved since.

    Raises:
        AsBuiltError: there is no run, or its result or its IFC can't be used.
    """
    folder = path_of(folder, "folder")
    if not folder.is_dir():
        raise OutputError(f"{folder}: no such folder; name the output folder of a run")
    with open_output(folder) as output:
        named = [ifc] if isinstance(ifc, str | Path) else ifc or ()
        published = publish_again(output, [path_of(path, "ifc") for path in named], datetime.now(UTC))
    visits = sorted((published.folder / "visits").glob("*.json"))
    reports = [read_result(path) for path in visits] or [read_result(published.folder / "result.json")]
    return Run(reports=tuple(reports), folder=published.folder, warnings=(*_doubts(reports), *published.warnings))


def _doubts(reports: Sequence[ProgressReport]) -> Iterator[str]:
    """Say of each visit what is known to be wrong with all of it, and whether not one station of it counts."""
    for report in reports:
        day = report.visit_date.isoformat()
        yield from (f"visit {day}: known to be wrong: {words_of(fault)}" for fault in report.faults)
        if report.nothing_seen:
            yield f"visit {day}: not one station could be used; nothing in its report was seen on that day"


def until_visit(project: Project, last: date | None) -> Project:
    """Return a project with its visits up to one day, all of them where that is None.

    Raises:
        ProjectError: no visit is of that day.
    """
    if last is None:
        return project
    visits = tuple(visit for visit in project.visits if visit.date <= last)
    if not visits or visits[-1].date != last:
        there = ", ".join(visit.date.isoformat() for visit in project.visits)
        raise ProjectError(f"{project.path}: has no visit of {last.isoformat()}; it has {there}")
    return replace(project, visits=visits)


def _told(progress: Callable[[str, int, int, str], None], step: str, done: int, total: int, what: str = "") -> None:
    """Tell a host, who is promised all four, also where there is nothing to name."""
    progress(step, done, total, what)


def _silent(step: str, done: int, total: int, what: str = "") -> None:
    """Tell nobody."""


def write_asbuilt(
    source: Path | str,
    report: ProgressReport,
    target: Path | str,
    *,
    earlier: Sequence[ProgressReport] = (),
    colours: Mapping[ShownState, str] | None = None,
) -> None:
    """Write a copy of the IFC file `source` to `target` that carries the report, and the visits before it as a history.

    `colours` (state -> "#rrggbb") paints the elements by state; states that it lacks take the report's colours, and
    `{}` takes them all. Writing twice gives the same file.

    Raises:
        AsBuiltError: the source can't be read, the report is of another design, a colour can't be read, or the copy
            can't be written.
    """
    source, target = path_of(source, "source"), path_of(target, "target")
    painted = None if colours is None else with_default_colours(colours)
    apart.write_asbuilt(source, report, target, earlier=earlier, colours=painted, words=note_words)
