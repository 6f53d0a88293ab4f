"""What tests ask of notes: their codes, and the one of a code."""

from __future__ import annotations

from collections.abc import Iterable

from asbuilt_bim.codes import Note, Reason, SubjectKind, about


def codes(notes: Iterable[Note]) -> list[Reason]:
    """Return the codes of notes, in their order."""
    return [note.code for note in notes]


def the(notes: Iterable[Note], code: Reason) -> Note:
    """Return the one note of a code."""
    (found,) = [note for note in notes if note.code == code]
    return found


def unstated(text: str) -> Note:
    """Return a note as it is read from a file without codes."""
    return Note(code=Reason.UNSTATED, subject=about(SubjectKind.UNSTATED), values={"text": text})
