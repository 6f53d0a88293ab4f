"""The page of a check on site: a verdict, a card a station with its picture, and what is still unseen."""

import base64
from dataclasses import dataclass

from asbuilt_bim.progress.visits.checked import CheckedAspect, CheckedStation, CheckedVisit
from asbuilt_bim.progress.visits.expected import VisitPlan
from asbuilt_bim.report.drawings.colours import ORDER
from asbuilt_bim.report.page.environment import environment
from asbuilt_bim.report.page.visit import places_of, unhelped, walk_parts
from asbuilt_bim.report.tables import NO_STOREY
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.check_words import (
    ASPECT_NAMES,
    aspect_reasons,
    aspect_words,
    grade_words,
    remedy_words,
    station_words,
    verdict_words,
)
from asbuilt_bim.report.wording.of_page.visit_words import still_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.words import Words

MADE_BY = b'<meta name="generator" content="asbuilt-bim check">'
"""What a page of this program's begins with: such a page may be replaced by the next one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckCard:
    """A station on the page: what was looked at (name, grade, words), the reasons, and its picture as a data URL.

    `counts` and `remedy` say whether it counts and what to do.
    """

    station: CheckedStation
    rows: tuple[tuple[str, str, str], ...]
    reasons: tuple[Words, ...]
    picture: str
    counts: str
    remedy: str


def check_html(visit: CheckedVisit, project_name: str, plan: VisitPlan | None = None) -> str:
    """Return the page: everything escaped, without scripts and without requests.

    `plan` is of the stations that would show what today's don't; None where nothing is said of that.
    """
    poses = {one.name: one.pose.world_from_left for one in visit.stations if one.pose is not None}
    return (
        environment()
        .get_template("check.html.j2")
        .render(
            still="" if plan is None else unseen_words(plan),
            parts=None if plan is None else walk_parts(plan, places_of(poses, plan)),
            no_storey=NO_STOREY,
            order=ORDER,
            visit=visit,
            project_name=project_name,
            verdict=verdict_words(visit),
            grade=_grade(visit),
            cards=[_card(station, visit) for station in visit.stations],
            faults=[words_of(fault) for fault in visit.faults],
            notes=[note_words(note) for note in visit.notes],
        )
    )


def check_page(visit: CheckedVisit, project_name: str, plan: VisitPlan | None = None) -> bytes:
    """Return the page as the file holds it."""
    return check_html(visit, project_name, plan).encode("utf-8", "replace")


def unseen_words(plan: VisitPlan) -> str:
    """Say what of the plan today's stations leave unseen, and what more of them would show."""
    visit = plan.visit
    return still_words(
        visit.asked_m2,
        visit.wanted.total_m2,
        len(plan.stations),
        visit.seen_m2,
        plan.unplaced,
        plan.placed_m2,
        unhelped(plan),
    )


def _grade(visit: CheckedVisit) -> str:
    if visit.again:
        return "not"
    return "doubtful" if visit.doubtful or visit.faults or visit.other_visits is not None else "ok"


def _card(station: CheckedStation, visit: CheckedVisit) -> CheckCard:
    rows = tuple((ASPECT_NAMES[one.aspect], one.grade, _words(one)) for one in station.aspects)
    data = base64.b64encode(station.picture).decode("ascii")
    picture = f"data:image/jpeg;base64,{data}" if data else ""
    return CheckCard(
        station=station, rows=rows, reasons=aspect_reasons(station), picture=picture,
        counts=station_words(station, visit), remedy=remedy_words(station),
    )  # fmt: skip


def _words(aspect: CheckedAspect) -> str:
    numbers = aspect_words(aspect)
    grade = grade_words(aspect)
    return f"{grade}: {numbers}" if numbers else grade
