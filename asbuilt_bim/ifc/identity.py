"""GlobalIds: what everything that counts is known by, in the result and in the copy of the file."""

import re
from collections.abc import Iterable
from typing import Any

from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted

MAX_NAMED = 5
MOST_SHOWN = 30
"""Characters of a bad GlobalId that a note keeps: a damaged file may hold any number."""
_GLOBAL_ID = re.compile(r"[0-9A-Za-z_$]{22}")


def has_id(thing: Any) -> bool:
    """Say whether a thing's GlobalId is one.

    22 signs of IFC's alphabet are asked for, whatever the first is: several programs write ids of more than 128 bits.
    """
    return isinstance(thing.GlobalId, str) and _GLOBAL_ID.fullmatch(thing.GlobalId) is not None


def with_ids(
    things: Iterable[Any], kind: SubjectKind, *, each_once: bool = False
) -> tuple[list[Any], tuple[Note, ...]]:
    """Return the things of a kind that have GlobalIds, and notes on the rest.

    `each_once` leaves out what has the GlobalId of one before it, too.
    """
    kept: list[Any] = []
    bad: list[Note] = []
    first: dict[str, str] = {}
    for thing in things:
        named = {"ifc_class": thing.is_a(), "thing": thing.Name or ""}
        if not has_id(thing):
            written = thing.GlobalId or ""
            values: Values = {**named, "global_id": written[:MOST_SHOWN], "characters": len(written)}
            bad.append(noted(Reason.GLOBAL_ID_INVALID, about(kind), **values))
        elif each_once and thing.GlobalId in first:
            values = {**named, "other": first[thing.GlobalId]}
            bad.append(noted(Reason.GLOBAL_ID_TWICE, about(kind, thing.GlobalId), **values))
        else:
            first[thing.GlobalId] = f"{thing.is_a()} {thing.Name or ''}".strip()
            kept.append(thing)
    left = len(bad) - MAX_NAMED
    more = noted(Reason.GLOBAL_IDS_MORE, about(kind), count=left)
    return kept, (*bad[:MAX_NAMED], *((more,) if left > 0 else ()))
