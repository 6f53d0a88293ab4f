"""Notes in `result.json`: the English text under the key of old, and beside it the codes that it was made from."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, get_type_hints

from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, Value, about
from asbuilt_bim.report.wording.notes import note_words

CODES = {"notes": "note_codes", "doubts": "doubt_codes"}
"""Field of notes -> the key of their codes; the field's own key holds their texts, in the same order."""


def note_fields(cls: type[Any]) -> tuple[str, ...]:
    """Return the fields of a dataclass that hold notes."""
    named = {field.name for field in fields(cls)} & CODES.keys()
    hints = get_type_hints(cls) if named else {}
    return tuple(name for name in CODES if name in named and hints[name] == tuple[Note, ...])


def with_words(plain: dict[str, Any], value: Any, noted: tuple[str, ...]) -> dict[str, Any]:
    """Return plain values with the notes' texts in their place, and the notes as codes beside them."""
    for name in noted:
        plain[CODES[name]] = [_note_to_plain(note) for note in getattr(value, name)]
        plain[name] = [note_words(note) for note in getattr(value, name)]
    return plain


def with_codes(plain: Any, noted: tuple[str, ...]) -> Any:
    """Return plain values with the notes' codes in the texts' place; a text without a code stays a text.

    Old results have no codes, and newer ones may have some that this program doesn't know.
    """
    if not isinstance(plain, dict):
        return plain
    changed = dict(plain)
    for name in noted:
        texts, codes = plain.get(name), plain.get(CODES[name])
        if isinstance(texts, list) and isinstance(codes, list) and len(codes) == len(texts):
            changed[name] = [code if _is_known(code) else text for text, code in zip(texts, codes, strict=True)]
    return changed


def note_from_plain(plain: Any) -> Note:
    """Build a note of its codes, or of a text alone.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(plain, str):
        return Note(code=Reason.UNSTATED, subject=about(SubjectKind.UNSTATED), values={"text": plain})
    if not isinstance(plain, Mapping) or not isinstance(plain.get("values"), Mapping):
        raise ValueError("a note is a text, or has a code, a subject and values")
    subject = plain.get("subject") or {}
    return Note(
        code=Reason(plain["code"]),
        subject=Subject(
            kind=SubjectKind(subject.get("kind", "")),
            name=str(subject.get("name", "")),
            station=str(subject.get("station", "")),
        ),
        values={str(key): _value(value) for key, value in plain["values"].items()},
    )


def _note_to_plain(note: Note) -> dict[str, Any]:
    subject = note.subject
    return {
        "code": str(note.code),
        "subject": {"kind": str(subject.kind), "name": subject.name, "station": subject.station},
        "values": {key: list(value) if isinstance(value, tuple) else value for key, value in note.values.items()},
    }


def _is_known(plain: Any) -> bool:
    try:
        note_words(note_from_plain(plain))
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return False
    return True


def _value(value: Any) -> Value:
    plain: Value = tuple(value) if isinstance(value, list) else value
    return plain
