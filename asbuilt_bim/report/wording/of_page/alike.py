"""Warnings that say the same of several things, as one line with a count and the list of what it concerns."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from asbuilt_bim.codes import Note, Reason
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import ElementProgress
from asbuilt_bim.report.wording.design_notes import ELEMENT
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.surface_notes import photos_disagree, torn_heights
from asbuilt_bim.report.wording.template import filled
from asbuilt_bim.report.wording.values import plain

MOST_NAMED = 6
"""So many things stand in a line by name; a page lists them all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Alike:
    """A warning and all that it concerns; one that concerns a single thing is a whole sentence by itself."""

    words: str
    concerns: tuple[str, ...] = ()
    elements: tuple[ElementProgress, ...] = ()  # that a page leads to, with their pictures

    @property
    def line(self) -> str:
        """Return it as one line, with the count and the first things by name."""
        if len(self.concerns) < 2:
            return self.words
        named, more = "; ".join(self.concerns[:MOST_NAMED]), len(self.concerns) - MOST_NAMED
        return f"{len(self.concerns)} times: {self.words}: {named}{f'; and {more} more' if more > 0 else ''}"


def rejections_alike(rejections: Iterable[Rejection]) -> tuple[Alike, ...]:
    """Return rejections by what they say besides what they are about and their value."""
    found: dict[tuple[str, str, str], list[tuple[str, str]]] = {}
    for one in rejections:
        words = words_of(one)
        about = f"{words.what} ({words.value})" if words.value else words.what
        found.setdefault((words.reason, words.limit, words.remedy), []).append((about, str(words)))
    return tuple(_together(_said(*key), kept) for key, kept in found.items())


def notes_alike(notes: Iterable[Note]) -> tuple[Alike, ...]:
    """Return notes by what they say besides the element that they begin with."""
    found: dict[str, list[tuple[str, str]]] = {}
    for note in notes:
        text, about = note_words(note), ""
        if {"ifc_class", "element"} <= note.values.keys():
            prefix = filled(ELEMENT, note)
            about = prefix if text.startswith(prefix) else ""
        found.setdefault(text.removeprefix(about).lstrip(": "), []).append((about, text))
    return tuple(_together(said, kept) for said, kept in found.items())


def doubts_alike(elements: Sequence[ElementProgress]) -> tuple[Alike, ...]:
    """Return what to look at before elements are paid for: photos that disagree, then doubts, by what they say."""
    torn = [(plain(e.name) or e.global_id, e) for e in elements if e.cells_conflict > 0]
    found: dict[str, list[tuple[str, str]]] = {}
    whom: dict[str, dict[str, ElementProgress]] = {}
    for name, element in torn:
        whom.setdefault(PHOTOS_DISAGREE, {})[element.global_id] = element
        where = next((torn_heights(note.values) for note in element.notes if note.code is Reason.PHOTOS_DISAGREE), "")
        which = ", ".join(element.stations)
        told = "; ".join(part for part in (which, where) if part)
        about = f"{name} ({told})" if told else name
        whole = photos_disagree(element.kind, element.name, element.stations, where)
        found.setdefault(PHOTOS_DISAGREE, []).append((about, whole))
    for element in elements:
        for note in element.doubts:
            text, name = note_words(note), plain(element.name) or element.global_id
            found.setdefault(text, []).append((name, f"{name}: {text}"))
            whom.setdefault(text, {})[element.global_id] = element
    return tuple(replace(_together(said, kept), elements=tuple(whom[said].values())) for said, kept in found.items())


def days_alike(warnings: Iterable[tuple[str, str]]) -> tuple[str, ...]:
    """Return lines of (day, text), a text that several visits have as one line with their days."""
    found: dict[str, list[str]] = {}
    for day, text in warnings:
        found.setdefault(text, []).append(day)
    return tuple(
        f"visit{'s' if len(days) > 1 else ''} {', '.join(dict.fromkeys(days))}: {text}" for text, days in found.items()
    )


PHOTOS_DISAGREE = "photos disagree about part of it, built or not, so it counts as not seen: look at the pictures"


def _said(reason: str, limit: str, remedy: str) -> str:
    text = f"{reason} (limit {limit})" if limit else reason
    return f"{text}; {remedy}" if remedy else text


def _together(said: str, kept: Sequence[tuple[str, str]]) -> Alike:
    """Return one thing as its own sentence, several as the sentence that they share; the same thing counts once."""
    distinct = dict(kept)
    if len(distinct) == 1:
        return Alike(words=next(iter(distinct.values())))
    return Alike(words=said, concerns=tuple(distinct))
