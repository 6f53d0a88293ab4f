"""What a visit's elements say together that none says alone: of another storey or day, or of several days."""

from collections.abc import Sequence
from datetime import date

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.progress.report import ElementProgress, ProgressReport
from asbuilt_bim.progress.states.undone import FEWEST_GONE as FEWEST

NAMED = 3
"""Elements that a sentence names; the cards say the rest."""


def visit_doubts(report: ProgressReport) -> tuple[Note, ...]:
    """Return what makes one ask whether the visit's storey and day are right; nothing where few elements say so.

    Storeys are often alike: no photo tells one from the other. But what no task has begun yet rarely stands.
    """
    early = _built_early(report)
    shown = [one for one in report.elements if one.stations]  # of others an earlier visit's photos disagree
    apart = [one for one in shown if any(note.code is Reason.PHOTOS_DISAGREE for note in one.notes)]
    subject, notes = about(SubjectKind.VISIT, report.visit_date.isoformat()), list[Note]()
    if len(early) >= FEWEST:
        first = min(begin for _, begin in early)
        names = _named([element for element, _ in early])
        begin = first.isoformat()
        notes.append(noted(Reason.BUILT_EARLY, subject, elements=names, count=len(early), begin=begin))
    if len(apart) >= FEWEST:
        notes.append(noted(Reason.PHOTOS_OF_SEVERAL_DAYS, subject, elements=_named(apart), count=len(apart)))
    return tuple(notes)


def _built_early(report: ProgressReport) -> list[tuple[ElementProgress, date]]:
    """Return the elements that stand at least in part though all tasks that make them begin after the visit."""
    begins: dict[str, list[date]] = {}
    for task in report.tasks:
        if task.schedule_start is not None:
            for key in task.progress.elements:
                begins.setdefault(key, []).append(task.schedule_start.date())
    return [
        (element, min(begins[element.global_id]))
        for element in report.elements
        if element.completion.lower > 0.0
        and element.global_id in begins
        and min(begins[element.global_id]) > report.visit_date
    ]


def _named(elements: Sequence[ElementProgress]) -> tuple[str, ...]:
    return tuple(element.name or element.global_id for element in elements[:NAMED])
