"""What both pages show of a result, worked out once."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from asbuilt_bim.codes import Reason, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.completion.planned import due_but_unknown
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.report.cost_rows import cost_groups
from asbuilt_bim.report.drawings.colours import ORDER, TARGET_COLOUR
from asbuilt_bim.report.drawings.earned_curve import earned_curves
from asbuilt_bim.report.drawings.gantt import gantt_of
from asbuilt_bim.report.page.cards import ElementCard, element_cards
from asbuilt_bim.report.page.matrix import matrix_of, money_due
from asbuilt_bim.report.page.photos import photos_before, station_cards
from asbuilt_bim.report.page.plan import MOST_VIEWS, storey_plans
from asbuilt_bim.report.page.rows import next_rows, since_rows
from asbuilt_bim.report.page.trend import trend_of
from asbuilt_bim.report.tables import (
    NO_STOREY,
    OF_FACES,
    faults_before,
    group_rows,
    lost_before,
    lost_stations,
    photographed_areas,
    station_of,
    still_in_doubt,
    storey_names,
)
from asbuilt_bim.report.task_rows import late_rows, late_words, plan_words, task_rows, unclear_rows
from asbuilt_bim.report.wording.of_page.alike import doubts_alike, notes_alike, rejections_alike
from asbuilt_bim.report.wording.of_page.fault_words import before_words
from asbuilt_bim.report.wording.reasons import words_of

Context = dict[str, Any]


def page_context(
    report: ProgressReport,
    pictures: Mapping[str, bytes],
    earlier: Sequence[ProgressReport],
    pictures_before: Mapping[str, bytes],
) -> Context:
    """Return what the templates show; `earlier` are the reports of the visits before, in the order of days.

    Raises:
        OutputError: a picture can't be decoded.
    """
    before = earlier[-1] if earlier else None
    stations = station_cards(report, pictures)
    now = [card.photo for card in stations if card.photo is not None]
    then = photos_before(before, pictures_before, whole=report.pictures == "whole")
    steps, plans = next_rows(report), storey_plans(report)
    names = storey_names(report)
    cards = element_cards(report, now, earlier, then)
    step_of = {row.element.global_id: row for row in steps[:MOST_VIEWS]}
    asked = step_of.keys() | {one.element.global_id for one in due_but_unknown(report)}
    unseen = {card.element.global_id for card in cards if card.is_unseen} - asked
    return {
        "report": report,
        "interactive": False,
        "storeys": group_rows(report),
        "elements": _by_storey(names, cards, unseen),
        "unseen": unseen,
        "storey_names": names,
        "no_storey": NO_STOREY,
        "plans": plans,
        "plan_number": {plan.storey: number for number, plan in enumerate(plans)},
        "cards": cards,
        "photos": [*now, *then],
        "photo_sizes": {photo.key: (photo.width, photo.height) for photo in (*now, *then)},
        "photographed": photographed_areas(report),
        "trend": trend_of(report, earlier),
        "earned": earned_curves(report, earlier),
        "stations": stations,
        "station_number": {card.row.name: number for number, card in enumerate(stations)},
        "before": before,
        "since": since_rows(before, report) if before else (),
        "next_rows": steps,
        "step_of": step_of,
        "comes_up": {row.element.global_id for row in steps[MOST_VIEWS:]},
        "most_shown": MOST_VIEWS,
        "in_tolerance": Counter(e.tolerance.verdict for e in report.elements if e.tolerance is not None),
        "out_of_tolerance": [e for e in report.elements if e.tolerance and e.tolerance.verdict == "out"],
        "order": ORDER,
        "target_colour": TARGET_COLOUR,
        **_to_look_at(report, earlier),
        **_planned(report),
    }


def with_panels(context: Context, templates: Environment) -> Context:
    """Return the context with each plan, element and station as markup, drawn once for both pages."""
    panels: Any = templates.get_template("panels.html.j2").make_module(context)
    drawn: dict[str, list[Markup]] = {
        "plan_html": [panels.plan_of(plan) for plan in context["plans"]],
        "card_html": [panels.card_of(card) for card in context["cards"]],
        "station_html": [panels.station_of(card) for card in context["stations"]],
    }
    return {**context, **drawn}


def _to_look_at(report: ProgressReport, earlier: Sequence[ProgressReport]) -> Context:
    """Return what is wrong or in doubt, and what counts for nothing: of earlier visits, too."""
    lost = lost_before(earlier)
    exposed = [one for one in report.faces if one.role != "reveal" and one.exposed_area_m2 > 0.0]  # what is judged
    undecided = set(report.unobserved)
    told = {day.isoformat() for day, _ in lost}  # with their reasons: no note needs to say it once more
    notes = [n for n in report.notes if not (n.code is Reason.STATIONS_NOT_USED and n.subject.name in told)]
    return {
        "lost": [*((None, row) for row in lost_stations(report)), *lost],
        "faults_before": before_words(faults_before(earlier, report)),
        "exposed": len(exposed),
        "undecided": sum(one.face_id in undecided for one in exposed),
        "unmatched": [words_of(rejection) for rejection in report.unmatched],
        "faults": [words_of(fault) for fault in report.faults],
        "look_at": (
            *doubts_alike(still_in_doubt(report, earlier)),
            *rejections_alike(_others(report)),
            *notes_alike(notes),
        ),
    }


def _planned(report: ProgressReport) -> Context:
    """Return tasks, late elements and money."""
    late, tasks = late_rows(report), task_rows(report)
    return {
        "tasks": tasks,
        "gantt": gantt_of(report, tasks),
        "late": late,
        "plan_words": plan_words(report),
        "late_words": late_words(report),
        "due_unknown": unclear_rows(report),
        "due": {**{row.global_id: "due" for row in unclear_rows(report)}, **{row.global_id: "late" for row in late}},
        "cost_groups": cost_groups(report),
        "money_due": money_due(report),
        "matrix": matrix_of(report, frozenset(row.global_id for row in late)),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreyRows:
    """A storey's elements as the page lists them: a row each, or by their tasks where nobody has seen them."""

    name: str
    shown: tuple[ElementProgress, ...]
    unseen: tuple[tuple[str, tuple[ElementProgress, ...]], ...]

    @property
    def unseen_count(self) -> int:
        """Return how many nobody has seen."""
        return sum(len(elements) for _, elements in self.unseen)


def _by_storey(names: dict[str, str], cards: Sequence[ElementCard], apart: Collection[str]) -> list[StoreyRows]:
    """Return the elements by storey from below, within it by class and name; those `apart` have their names alone."""
    groups: dict[str, list[ElementCard]] = {key: [] for key in names}
    for card in sorted(cards, key=lambda card: (card.element.ifc_class, card.element.name, card.element.global_id)):
        groups.setdefault(card.element.storey, []).append(card)
    found = []
    for key, own in groups.items():
        unseen: dict[str, list[ElementProgress]] = {}
        for card in own:
            if card.element.global_id in apart:
                unseen.setdefault(", ".join(card.tasks), []).append(card.element)
        shown = tuple(card.element for card in own if card.element.global_id not in apart)
        by_task = tuple((tasks, tuple(elements)) for tasks, elements in unseen.items())
        found.append(StoreyRows(name=names.get(key, NO_STOREY), shown=shown, unseen=by_task))
    return [rows for rows in found if rows.shown or rows.unseen]


def _others(report: ProgressReport) -> list[Rejection]:
    """Return what was left out besides stations and faults; faces and other discs stand with their stations."""
    lost = {row.name for row in lost_stations(report)}
    kept = [r for r in report.rejections if r.subject.kind not in {*OF_FACES, SubjectKind.DISC}]
    return [r for r in kept if r not in report.faults and station_of(r) not in lost]
