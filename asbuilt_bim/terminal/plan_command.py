"""`asbuilt-bim plan`: the fewest stations that see what is due, before the visit."""

from dataclasses import dataclass
from datetime import date
from pathlib import Path

from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.flow.visit_plan import known_report, planned_design, visit_plan
from asbuilt_bim.project.check import refuse_missing
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import survey_of
from asbuilt_bim.register.survey import check_survey
from asbuilt_bim.report.page.visit import MADE_BY, plan_page, plan_promise, walk_parts
from asbuilt_bim.terminal.check_command import check_page_place, write_page
from asbuilt_bim.terminal.open_cache import open_cache
from asbuilt_bim.terminal.screen import Screen


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """The command line of `plan`, as it was given."""

    project: Path
    out: Path
    day: date | None = None
    stations: int | None = None
    result: Path | None = None
    allow_outside: bool = False


def plan_command(request: PlanRequest, screen: Screen, today: date) -> int:
    """Plan a visit, list its stations, and write the page.

    Raises:
        AsBuiltError: there is no plan, with the reason; or the page can't be written.
    """
    check_page_place(request.out, MADE_BY)
    project = read_project(request.project, allow_outside=request.allow_outside, visited=False)
    refuse_missing(project)
    cache = open_cache(screen)
    survey = survey_of(project)
    design = planned_design(project, cache)
    check_survey(survey, design)
    with screen.steps() as progress:
        rig = rig_of(project, cache, progress).rig
    day = request.day or today
    known = known_report(project, design, survey, day, request.result)
    plan = visit_plan(project, design, rig, survey, day, known, most=request.stations or 0)
    write_page(request.out, plan_page(plan, with_result=request.result is not None))
    parts = walk_parts(plan)
    for row in parts.rows:
        screen.say(f"{row.number}. {row.storey}. {row.place} {row.look} {row.sigma}; tags {row.tags}")
    for name, words in parts.tags:
        screen.say(f"{name}: {words}")
    for remark in parts.remarks:
        screen.say(remark)
    screen.say(plan_promise(plan))
    screen.say(f"Page: {request.out}")
    return 0
