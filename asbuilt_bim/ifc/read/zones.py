"""Which zones elements lie in: spatial zones that refer to them, and zones of the spaces that hold them."""

from collections.abc import Iterable
from typing import Any

MOST_ZONES = 8
"""Of one element; a file may put it into thousands."""


def read_zones(file: Any) -> dict[str, tuple[str, ...]]:
    """Return GlobalId -> names of zones, each once, of the elements that lie in any; a zone without a name has none."""
    found: dict[str, dict[str, None]] = {}

    def put(things: Iterable[Any], zone: Any) -> None:
        for thing in things if zone.Name else ():
            names = found.setdefault(thing.GlobalId or "", {})
            if len(names) < MOST_ZONES:
                names[str(zone.Name)] = None

    inside: dict[int, list[Any]] = {}
    for kind in ("IfcRelContainedInSpatialStructure", "IfcRelReferencedInSpatialStructure"):
        for relation in file.by_type(kind):
            holder, held = relation.RelatingStructure, relation.RelatedElements or ()
            if holder is None:  # it was deleted from the file
                continue
            inside.setdefault(holder.id(), []).extend(held)
            if holder.is_a() == "IfcSpatialZone":  # IFC2X3 knows no such class
                put(held, holder)
    for zone in file.by_type("IfcZone"):
        for relation in zone.IsGroupedBy or ():
            for thing in relation.RelatedObjects or ():
                put([thing, *inside.get(thing.id(), ())], zone)
    return {key: tuple(names) for key, names in found.items()}
