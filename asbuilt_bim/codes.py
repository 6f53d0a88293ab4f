"""What the program has to say, as codes: a reason, what it is about, and the values. Sentences are made at the edge.

Nothing reads prose: code asks for a `Reason`, people read what `report/wording` makes of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

Value = str | int | float | bool | tuple[str, ...] | tuple[int, ...] | tuple[float, ...]
"""What a sentence may be filled with: numbers in SI with their unit in the key's name, names, lists of names."""


class SubjectKind(StrEnum):
    """What kind of thing is spoken of."""

    UNSTATED = "unstated"  # read from a file that was written before there were codes
    VISIT = "visit"
    STATION = "station"
    PHOTO = "photo"
    MARKER = "marker"
    FACE = "face"
    ELEMENT = "element"
    STOREY = "storey"
    TASK = "task"
    COST_LINE = "cost line"
    SURVEY = "survey"
    RIG = "rig"
    DESIGN = "design"
    SCHEDULE = "schedule"
    FILE = "file"


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a rejection or a note is about: its kind, its name or id, and the station where it was seen."""

    kind: SubjectKind
    name: str = ""  # of a station its name, of a face "A3/2", of an element its GlobalId
    station: str = ""  # "" where it is about no station, or is the station itself


class Reason(StrEnum):
    """Why something was left out, or what has to be told. A value never changes its meaning; new ones are added."""

    UNSTATED = "unstated"  # read from a file that was written before there were codes

    # Rejections.

    # Notes.


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """Something that a person has to know: the code, what it is about, and the values that its sentence needs."""

    code: Reason
    subject: Subject
    values: Mapping[str, Value] = field(default_factory=dict)
