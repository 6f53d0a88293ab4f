"""Rejections of results that were written before there were codes: their texts as they are, and whom they are about."""

import re
from collections.abc import Mapping

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.report.wording.words import Table, Values, Words

TEXTS = ("what", "reason", "value", "limit", "remedy")
_PARTS = {
    "marker": SubjectKind.MARKER,
    "target's diameter": SubjectKind.TARGET,
    "target": SubjectKind.TARGET,
    "red disc at": SubjectKind.DISC,
    "control point": SubjectKind.CONTROL_POINT,
    "photo": SubjectKind.PHOTO,
    "left": SubjectKind.PHOTO,
    "right": SubjectKind.PHOTO,
    "wall": SubjectKind.INSTANCE,
    "column": SubjectKind.INSTANCE,
}
_PART_OF_STATION = re.compile(rf", ({'|'.join(_PARTS)})\b ?")


def unstated_rejection(texts: Mapping[str, object]) -> Rejection:
    """Return a rejection that has no code, or one that this version doesn't know, from its English texts."""
    values = {key: str(texts.get(key, "")) for key in TEXTS}
    return Rejection(code=Reason.UNSTATED, subject=subject_of(values["what"]), values=values)


def subject_of(what: str) -> Subject:
    """Return what an old rejection is about, by its name: `station A3, marker 17`, `face A3/2 (wall, ...)`."""
    kind, _, rest = what.partition(" ")
    if what == "survey":
        return Subject(kind=SubjectKind.SURVEY)
    if kind == "face" and "/" in rest:
        name = rest.split(" (")[0]
        return Subject(kind=SubjectKind.FACE, name=name, station=name.rpartition("/")[0])
    if kind != "station" or not rest:
        return Subject(kind=SubjectKind.UNSTATED, name=what)
    part = _PART_OF_STATION.search(rest)
    if part is None:
        return Subject(kind=SubjectKind.STATION, name=rest)
    return Subject(kind=_PARTS[part[1]], name=rest[part.end() :], station=rest[: part.start()])


def _as_written(values: Values) -> Words:
    texts = {key: str(values.get(key, "")) for key in TEXTS}
    about = subject_of(texts["what"])
    part = texts["what"].removeprefix(f"station {about.at_station}").lstrip(", ") if about.at_station else texts["what"]
    return Words(part=part, **texts)


UNSTATED: Table = {Reason.UNSTATED: _as_written}
