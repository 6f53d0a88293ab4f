"""Titles and texts of BCF topics."""

from collections.abc import Mapping
from datetime import date
from enum import StrEnum

from asbuilt_bim.codes import Note
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.report.wording.completion import in_words
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.values import day


class IssueKind(StrEnum):
    """What a topic is about, as it stands in the file."""

    DEVIATION = "Deviation"
    NOT_IN_MODEL = "Not in the model"
    LATE = "Late"
    CONTRADICTION = "Contradiction"
    SURVEY = "Doubtful survey"
    NEXT_VIEW = "Photograph next"


TITLES: Mapping[IssueKind, str] = {
    IssueKind.DEVIATION: "{name} differs from its design",
    IssueKind.NOT_IN_MODEL: "What {name} shows and the model doesn't hold",
    IssueKind.LATE: "{name} is late",
    IssueKind.CONTRADICTION: "{name}: photos contradict one another",
    IssueKind.SURVEY: "What is known to be wrong with the visit",
    IssueKind.NEXT_VIEW: "Photograph {name} next",
}
NO_LONGER = "No longer so at the visit of {day}."


def title_of(kind: IssueKind, name: str) -> str:
    """Return a topic's title; a name from a file is never read as a template."""
    return TITLES[kind].replace("{name}", name)


def notes_text(notes: tuple[Note, ...]) -> str:
    """Return notes as sentences."""
    return " ".join(f"{note_words(note)}." for note in notes)


def state_text(element: ElementProgress) -> str:
    """Return what is known of an element in a sentence."""
    return f"State: {element.shown_state}; {in_words(element.completion)}."


def late_text(task: str, due: date, late_days: int) -> str:
    """Return why an element is late."""
    return f"Due {day(due)} by the task '{task}', {late_days} day{'' if late_days == 1 else 's'} ago."


def unmatched_text(count: int, station: str, visit: date) -> str:
    """Return what the photo of a station shows that the model doesn't hold."""
    what = "1 measured surface belongs" if count == 1 else f"{count} measured surfaces belong"
    return (
        f"In photo {station} of {day(visit)} {what} to nothing in the design: formwork, props, or what the model lacks."
    )


def not_seen_since(visit: date) -> str:
    """Return that a topic stands as an earlier visit left it."""
    return f"Not looked at since {day(visit)}."


def again_text(visit: date) -> str:
    """Return why what a photo showed beside the model is closed: a newer photo has its own topic, or none."""
    return f"Photographed again at the visit of {day(visit)}."


def closed_text(visit: date) -> str:
    """Return why a topic of an earlier visit is closed."""
    return NO_LONGER.replace("{day}", day(visit))
