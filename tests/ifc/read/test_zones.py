"""Zones: of elements, of spaces that hold them, and spatial zones that refer to them."""

from __future__ import annotations

from typing import Any

import ifcopenshell
import pytest

from asbuilt_bim.ifc.read import zones
from asbuilt_bim.ifc.read.zones import read_zones


def make(file: Any, kind: str, **values: Any) -> Any:
    return file.create_entity(kind, GlobalId=ifcopenshell.guid.new(), **values)


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4", "IFC4X3"])
def test_an_element_lies_in_the_zones_that_hold_it_or_its_space(schema: str) -> None:
    file = ifcopenshell.file(schema=schema)
    own, held, free = (make(file, "IfcWall", Name=name) for name in ("own", "held", "free"))
    space = make(file, "IfcSpace", Name="room")
    first, second = make(file, "IfcZone", Name="Pour 1"), make(file, "IfcZone", Name="Pour 2")
    nameless = make(file, "IfcZone")
    make(file, "IfcRelAssignsToGroup", RelatedObjects=[own, space], RelatingGroup=first)
    make(file, "IfcRelAssignsToGroup", RelatedObjects=[own], RelatingGroup=second)
    make(file, "IfcRelAssignsToGroup", RelatedObjects=[free], RelatingGroup=nameless)
    make(file, "IfcRelContainedInSpatialStructure", RelatedElements=[held], RelatingStructure=space)
    found = read_zones(file)
    assert found[own.GlobalId] == ("Pour 1", "Pour 2") and found[held.GlobalId] == ("Pour 1",)
    assert free.GlobalId not in found


def test_a_spatial_zone_holds_what_it_refers_to() -> None:
    file = ifcopenshell.file(schema="IFC4")
    wall, zone = make(file, "IfcWall"), make(file, "IfcSpatialZone", Name="Lot B")
    make(file, "IfcRelReferencedInSpatialStructure", RelatedElements=[wall], RelatingStructure=zone)
    assert read_zones(file) == {wall.GlobalId: ("Lot B",)}


def test_thousands_of_zones_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zones, "MOST_ZONES", 3)
    file = ifcopenshell.file(schema="IFC4")
    wall = make(file, "IfcWall")
    for number in range(9):
        group = make(file, "IfcZone", Name=f"zone {number}")
        make(file, "IfcRelAssignsToGroup", RelatedObjects=[wall], RelatingGroup=group)
    assert len(read_zones(file)[wall.GlobalId]) == 3
