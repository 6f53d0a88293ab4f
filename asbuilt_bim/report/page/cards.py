"""An element's card: its photos cut to it with its outline, now and at the visit before, its tasks and why."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from asbuilt_bim.codes import WHY_STATE
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport, ShownState
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.cost_rows import worths
from asbuilt_bim.report.page.cuts import Cut, Photo, cuts_by_element
from asbuilt_bim.report.page.elevation import ElementDrawing, element_drawings
from asbuilt_bim.report.tables import NO_STOREY, storey_names
from asbuilt_bim.report.task_rows import LateRow, late_rows
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.card_words import sides_words, unmeasured_words, why_words, worth_words


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """What was known of an element after a visit."""

    day: date
    state: ShownState
    completion: Completion


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementCard:
    """All that the page shows of one element besides its row."""

    element: ElementProgress
    storey: str
    drawing: ElementDrawing | None
    now: tuple[Cut, ...]
    then: tuple[Cut, ...]
    tasks: tuple[str, ...]
    late: tuple[LateRow, ...]
    past: tuple[Past, ...]  # by visit, this one last; none where there is one visit alone
    money: tuple[str, ...]
    why: str
    sides: str
    unmeasured: str
    notes: tuple[str, ...]

    @property
    def is_unseen(self) -> bool:
        """Say whether no visit has shown anything of it."""
        element = self.element
        known = element.last_seen or element.doubts or element.shown_state != "unknown"
        return not (known or self.now or self.then or self.late)


def element_cards(
    report: ProgressReport, photos: Sequence[Photo], earlier: Sequence[ProgressReport], photos_before: Sequence[Photo]
) -> tuple[ElementCard, ...]:
    """Return a card an element, in the order of the table: every name on the page leads to one."""
    storeys = storey_names(report)
    drawings = {drawing.element.global_id: drawing for drawing in element_drawings(report)}
    now = cuts_by_element(report, photos)
    then = cuts_by_element(earlier[-1], photos_before) if earlier else {}
    tasks, late, past, money = tasks_by_element(report), _late(report), _past(report, earlier), _money(report)
    order = {key: index for index, key in enumerate(storeys)}
    elements = sorted(
        report.elements, key=lambda e: (order.get(e.storey, len(order)), e.ifc_class, e.name, e.global_id)
    )
    cards = []
    for element in elements:
        key = element.global_id
        why = next((note for note in element.notes if note.code in WHY_STATE), None)
        others = tuple(note_words(note) for note in element.notes if note is not why)
        cards.append(
            ElementCard(
                element=element,
                storey=storeys.get(element.storey, NO_STOREY),
                drawing=drawings.get(key),
                now=tuple(now.get(key, ())),
                then=tuple(then.get(key, ())[:1]),
                tasks=tuple(tasks.get(key, ())),
                late=tuple(late.get(key, ())),
                past=tuple(past.get(key, ())),
                money=tuple(money.get(key, ())),
                why=note_words(why) if why else why_words(element),
                sides=sides_words(element),
                unmeasured=unmeasured_words(element),
                notes=others,
            )
        )
    return tuple(cards)


def tasks_by_element(report: ProgressReport) -> dict[str, list[str]]:
    """Return the names of each element's tasks, by GlobalId."""
    found: dict[str, list[str]] = {}
    for task in report.tasks:
        for key in task.progress.elements:
            found.setdefault(key, []).append(task.progress.name or task.identification or task.progress.key)
    return found


def _late(report: ProgressReport) -> dict[str, list[LateRow]]:
    """Return the rows of late elements, by GlobalId."""
    found: dict[str, list[LateRow]] = {}
    for row in late_rows(report):
        found.setdefault(row.global_id, []).append(row)
    return found


def _past(report: ProgressReport, earlier: Sequence[ProgressReport]) -> dict[str, list[Past]]:
    """Return what each visit knew of each element, by GlobalId."""
    found: dict[str, list[Past]] = {}
    for one in (*sorted(earlier, key=lambda each: each.visit_date), report) if earlier else ():
        for element in one.elements:
            known = Past(day=one.visit_date, state=element.shown_state, completion=element.completion)
            found.setdefault(element.global_id, []).append(known)
    return found


def _money(report: ProgressReport) -> dict[str, list[str]]:
    """Return what each element is worth in the cost lines, and what of it counts, by GlobalId: as the valuation does.

    The amounts are those of the sheet Cost by element: they add up to the bill's.
    """
    found: dict[str, list[str]] = {}
    for line in (line for bill in bills(report) for line in bill.lines):
        for row, worth, (_, amount) in zip(line.rows, worths(line), line.amounts(), strict=True):
            if row.element is not None:
                found.setdefault(row.global_id, []).append(worth_words(line, row, worth, amount))
    return found
