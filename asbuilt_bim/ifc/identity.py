"""GlobalIds: what everything that counts is known by, in the result and in the copy of the file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

MAX_NAMED = 5
_GLOBAL_ID = re.compile(r"[0-9A-Za-z_$]{22}")


def id_fault(thing: Any) -> str:
    """Return why a thing's GlobalId is none, "" where it is one.

    22 signs of IFC's alphabet are asked for, whatever the first is: several programs write ids of more than 128 bits.
    """
    found = thing.GlobalId
    if isinstance(found, str) and _GLOBAL_ID.fullmatch(found):
        return ""
    shown = f"{found[:30]!r} ({len(found)} characters)" if found else "empty"
    return f"its GlobalId is {shown}, not 22 letters, digits, _ or $"


def with_ids(things: Iterable[Any], *, each_once: bool = False) -> tuple[list[Any], tuple[str, ...]]:
    """Return the things that have GlobalIds, and notes that name the rest.

    `each_once` leaves out what has the GlobalId of one before it, too.
    """
    kept: list[Any] = []
    bad: list[str] = []
    first: dict[str, str] = {}
    for thing in things:
        name = f"{thing.is_a()} {thing.Name or '(no name)'}"
        fault = id_fault(thing)
        if not fault and each_once and thing.GlobalId in first:
            fault = f"it has the GlobalId {thing.GlobalId} of {first[thing.GlobalId]}"
        if fault:
            bad.append(f"{name}: {fault}")
        else:
            first[thing.GlobalId] = name
            kept.append(thing)
    if not bad:
        return kept, ()
    more = f" and {len(bad) - MAX_NAMED} more" if len(bad) > MAX_NAMED else ""
    said = f"left out: {'; '.join(bad[:MAX_NAMED])}{more}; have the program that wrote the file give new GlobalIds"
    return kept, (said,)
