"""Takes out what this program wrote, and puts back what it overwrote."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from asbuilt_bim.ifc.cost import AS_BUILT
from asbuilt_bim.ifc.marks import PROGRESS_SET, QUANTITY_SET
from asbuilt_bim.ifc.write_tasks import put_back


def strip(file: Any) -> int:
    """Remove our sets and our cost schedule from an open file, restore its task times; return how many sets there were.

    A set counts as ours by its name. What else the file holds is untouched.
    """
    relations = [
        relation
        for relation in file.by_type("IfcRelDefinesByProperties")
        if getattr(relation.RelatingPropertyDefinition, "Name", None) in (PROGRESS_SET, QUANTITY_SET)
    ]
    for relation in relations:
        for thing in relation.RelatedObjects:
            if thing.is_a("IfcTask") and relation.RelatingPropertyDefinition.Name == PROGRESS_SET:
                put_back(file, thing, _texts(relation.RelatingPropertyDefinition))
    sets = {relation.RelatingPropertyDefinition.id(): relation.RelatingPropertyDefinition for relation in relations}
    _remove(file, relations)
    for one in sets.values():
        inner = [*(getattr(one, "HasProperties", None) or ()), *(getattr(one, "Quantities", None) or ())]
        _remove(file, [one])
        _remove_unused(file, inner)
    _strip_costs(file)
    return len(sets)


def _texts(definition: Any) -> dict[str, str]:
    return {
        one.Name: str(one.NominalValue.wrappedValue)
        for one in definition.HasProperties or ()
        if one.is_a("IfcPropertySingleValue") and one.NominalValue is not None
    }


def _strip_costs(file: Any) -> None:
    for schedule in file.by_type("IfcCostSchedule"):
        if getattr(schedule, "ObjectType", None) != AS_BUILT:
            continue
        ties = list(schedule.Controls or ())
        items = [item for tie in ties for item in tie.RelatedObjects if item.is_a("IfcCostItem")]
        inner_ties = [tie for item in items for tie in item.Controls or ()]
        inner = [part for item in items for part in (*(item.CostQuantities or ()), *(item.CostValues or ()))]
        declared = [tie for tie in getattr(schedule, "HasContext", None) or () if len(tie.RelatedDefinitions) == 1]
        _remove(file, [*ties, *inner_ties, *declared, *items, schedule])
        _remove_unused(file, inner)


def _remove(file: Any, things: Iterable[Any]) -> None:
    for thing in {one.id(): one for one in things}.values():
        file.remove(thing)


def _remove_unused(file: Any, things: Iterable[Any]) -> None:
    for thing in {one.id(): one for one in things}.values():
        if file.get_total_inverses(thing) == 0:
            file.remove(thing)
