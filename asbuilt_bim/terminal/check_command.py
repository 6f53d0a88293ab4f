"""`asbuilt-bim check`: today's photos on the notebook in the site container, before anybody leaves."""

from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from rich.table import Table
from rich.text import Text

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.errors import OutputError
from asbuilt_bim.flow.check_places import PlacedBy, near_of
from asbuilt_bim.flow.check_visit import check_stations, day_of
from asbuilt_bim.flow.design_source import place_on_map
from asbuilt_bim.flow.measure_visit import Workplace
from asbuilt_bim.flow.output.folder import output_error
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.flow.rough_places import check_near
from asbuilt_bim.flow.visit_plan import known_report, planned_design, remembered_tags, visit_plan
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.visits.checked import CheckedStation, CheckedVisit
from asbuilt_bim.progress.visits.expected import VisitPlan
from asbuilt_bim.progress.visits.tags import surveyed_tags, with_unread_tags
from asbuilt_bim.project.check import refuse_missing
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.project.networks import identities
from asbuilt_bim.project.photos import left_over, stations_of
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import check_places, known_places
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.report.page.check import MADE_BY, check_page, unseen_words
from asbuilt_bim.report.page.visit import walk_parts
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.check_words import (
    ASPECT_NAMES,
    GRADE_NAMES,
    aspect_reasons,
    aspect_words,
    grade_words,
    verdict_words,
)
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.values import plain
from asbuilt_bim.storage.atomic_write import place_problem, replace_bytes
from asbuilt_bim.terminal.open_cache import open_cache
from asbuilt_bim.terminal.screen import Screen

INCOMPLETE = 1
MOST_NAMED = 8
TABLE_WIDTH = 110
_HEAD = 2048  # bytes of a page that say who made it
_STYLES = {"ok": "green", "doubtful": "yellow", "not": "bold red", "unchecked": "dim"}


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckRequest:
    """The command line of `check`, as it was given."""

    photos: tuple[Path, ...]
    project: Path
    out: Path
    result: Path | None = None
    workers: int | None = None
    strict: bool = False
    allow_outside: bool = False


def check_command(request: CheckRequest, screen: Screen, today: date) -> int:
    """Check today's photos, say what to take again, and write the page.

    Raises:
        AsBuiltError: there is nothing to check, or nothing to check it with; or the page can't be written.
    """
    check_page_place(request.out, MADE_BY)
    project = read_project(request.project, allow_outside=request.allow_outside, visited=False)
    refuse_missing(project)
    identities(project.networks)  # opens them: what the run would refuse in the evening is refused here
    stations = near_of(stations_of(request.photos, project), project)
    if alone := left_over(request.photos, stations):
        some = ", ".join(alone[:MOST_NAMED]) + (
            f" and {len(alone) - MOST_NAMED} more" if len(alone) > MOST_NAMED else ""
        )
        why = "their names say no side, or nothing here reads them (convert HEIC and RAW to JPEG)"
        screen.warn(f"not checked, since {why}: {some}")
    cache = open_cache(screen)
    shown = Visit(date=day_of(stations, today), stations=stations)
    today_too = replace(project, visits=(*project.visits, shown))  # its photos say their size, tables name its stations
    places = known_places(today_too, lambda: place_on_map(project))
    design = planned_design(project, cache)
    check_places(places, design)
    check_near(today_too, design)
    known = known_report(project, design, places.survey, shown.date, request.result)
    with screen.steps() as progress:
        source = rig_of(today_too, cache, progress)
        workers = request.workers or 0
        by = PlacedBy(known=places, design=design, place=Workplace(workers=workers, cache=cache),
                      remembered=remembered_tags(known))  # fmt: skip
        visit = check_stations(stations, project, source.rig, by, shown.date, progress, workers)
        plan = _still_unseen(visit, project, design, source.rig, places.survey, known)
    visit = replace(visit, faults=(*source.warnings, *visit.faults))
    if plan is not None:
        visit = with_unread_tags(visit, source.rig, plan.visit.around, surveyed_tags(places.survey))
    _show(visit, screen)
    write_page(request.out, check_page(visit, project.name, plan))
    if plan is not None:
        screen.say(unseen_words(plan))
        parts = walk_parts(plan)
        for row in parts.rows:
            screen.say(f"  {row.number}. {row.storey}. {row.place} {row.look}")
        for name, words in parts.tags:
            screen.say(f"  {name}: {words}")
    screen.say(f"Page: {request.out}")
    if not visit.counting:
        return INCOMPLETE
    if request.strict and visit.again:
        screen.error("stations would be left out (see above), and --strict was given")
        return INCOMPLETE
    return 0


def _still_unseen(
    visit: CheckedVisit,
    project: Project,
    design: BimModel,
    rig: StereoRig,
    survey: tuple[SurveyedMarker, ...],
    known: ProgressReport,
) -> VisitPlan | None:
    """Return what today's stations leave unseen of what is due; None where not one of them counts."""
    poses = [one.pose.world_from_left for one in visit.stations if one.pose is not None]
    return visit_plan(project, design, rig, survey, visit.day, known, taken=poses) if poses else None


def check_page_place(path: Path, made_by: bytes) -> None:
    """Check that a page can be written: over an earlier page of the same command, never over anything else.

    Raises:
        OutputError: it can't.
    """
    if problem := place_problem(path, folder=False):
        raise OutputError(problem)
    if not path.exists():
        return
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as fault:
        raise output_error(path, fault, stands="nothing was written") from fault
    if made_by not in head:
        raise OutputError(f"{path}: is there already, and is no page of this command's; name another with --out")


def write_page(path: Path, data: bytes) -> None:
    """Write a page whole, or not at all.

    Raises:
        OutputError: it can't be written.
    """
    try:
        replace_bytes(path, data)
    except OSError as fault:
        raise output_error(path, fault, stands="no page was written") from fault


def _show(visit: CheckedVisit, screen: Screen) -> None:
    for fault in visit.faults:
        screen.warn(plain(str(words_of(fault))))
    for note in visit.notes:
        screen.warn(plain(note_words(note)))
    if screen.width >= TABLE_WIDTH:
        screen.say(_table(visit))
    else:
        for station in visit.stations:
            screen.say(f"{station.name}: {GRADE_NAMES[station.grade]}")
    for station in visit.stations:
        for reason in aspect_reasons(station):
            screen.warn(f"{plain(station.name)}: {plain(reason.at_station)}")
    (screen.warn if visit.again or visit.other_visits is not None else screen.say)(plain(verdict_words(visit)))


def _table(visit: CheckedVisit) -> Table:
    table = Table()
    table.add_column("Station", no_wrap=True)
    for name in ASPECT_NAMES.values():
        table.add_column(name)
    for station in visit.stations:
        table.add_row(*_cells(station))
    return table


def _cells(station: CheckedStation) -> list[Text]:
    cells = [Text(station.name, style=_STYLES[station.grade])]
    for aspect in station.aspects:
        words = aspect_words(aspect)
        text = words if aspect.grade == "ok" and words else grade_words(aspect)
        cells.append(Text(text, style=_STYLES[aspect.grade]))
    return cells
