"""Takes out what this program wrote, and puts back what it overwrote."""

from collections.abc import Iterable, Iterator
from typing import Any

from asbuilt_bim.ifc.names import HISTORY_SET, PROGRAM, PROGRESS_SET, own_roots
from asbuilt_bim.ifc.write.colours import put_colours_back
from asbuilt_bim.ifc.write.tasks import put_back

_PARTS = (
    "IfcProperty",
    "IfcPhysicalQuantity",
    "IfcAppliedValue",
    "IfcTimeSeries",
    "IfcIrregularTimeSeriesValue",
    "IfcDocumentReference",
    "IfcCalendarDate",
    "IfcDateAndTime",
    "IfcLocalTime",
)
"""What our rooted entities are made of, besides values. Units and owner histories are the design's."""


def strip(file: Any) -> int:
    """Remove what this program added to an open file, restore task times and colours; return how many sets there were.

    That is what bears one of our GlobalIds or names, and what only that refers to. All else is untouched.
    """
    put_colours_back(file)
    roots = own_roots(file)
    sets = [one for one in roots if one.is_a("IfcPropertySetDefinition")]
    for one in sets:
        if one.Name == PROGRESS_SET:
            for task in _tasks_of(one):
                put_back(task, one)
    _remove(file, [*_with_parts(file, [*roots, *_sources(file)])])
    for owner in file.by_type("IfcOwnerHistory"):
        if owner.OwningApplication is not None and owner.OwningApplication.ApplicationIdentifier == PROGRAM:
            _remove_unused(file, owner)
    file.recalculate_id_counter()  # what is written next gets the numbers that it had
    return len(sets)


def _sources(file: Any) -> list[Any]:
    """Return what names the source of our time series."""
    if file.schema == "IFC2X3":
        return []
    return [one for one in file.by_type("IfcExternalReferenceRelationship") if one.Name == HISTORY_SET]


def _tasks_of(definition: Any) -> Iterator[Any]:
    for relation in definition.file.get_inverse(definition):
        if relation.is_a("IfcRelDefinesByProperties"):
            yield from (thing for thing in relation.RelatedObjects if thing.is_a("IfcTask"))


def _with_parts(file: Any, roots: Iterable[Any]) -> Iterator[Any]:
    """Yield the roots and all parts of theirs that nothing else refers to."""
    found = {one.id(): one for one in roots}
    waiting = list(found.values())
    rooted = set(found)
    while waiting:
        for part in _direct_parts(waiting.pop()):
            if part.id() not in found:
                found[part.id()] = part
                waiting.append(part)
    kept = {
        number
        for number, one in found.items()
        if number not in rooted and any(user.id() not in found for user in file.get_inverse(one))
    }
    waiting = [found[number] for number in kept]
    while waiting:  # what something kept is made of is kept with it
        fresh = [part for part in _direct_parts(waiting.pop()) if part.id() not in kept]
        kept.update(part.id() for part in fresh)
        waiting += fresh
    yield from (one for number, one in found.items() if number not in kept)


def _direct_parts(one: Any) -> Iterator[Any]:
    for value in one:
        for part in value if isinstance(value, tuple) else (value,):
            if hasattr(part, "is_a") and part.id() and any(part.is_a(name) for name in _PARTS):
                yield part


def _remove(file: Any, things: Iterable[Any]) -> None:
    file.batch()
    for thing in things:
        file.remove(thing)
    file.unbatch()


def _remove_unused(file: Any, thing: Any) -> None:
    """Remove an entity that nothing refers to, and what it alone was made of."""
    if file.get_total_inverses(thing) == 0:
        parts = [part for part in thing if hasattr(part, "is_a") and part.id()]
        file.remove(thing)
        for part in parts:
            _remove_unused(file, part)
