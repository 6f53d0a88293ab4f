"""What a file says about itself beside its geometry: units, place on the map, zones, classes, schedule, costs."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

from asbuilt_bim.ifc.read.cost import planned_items
from asbuilt_bim.ifc.read.elements import walls_and_columns
from asbuilt_bim.ifc.read.georeference import Georeference, read_georeference
from asbuilt_bim.ifc.read.schedule import read_tasks
from asbuilt_bim.ifc.read.structure import holder_of, is_concrete, material_names, type_name_of
from asbuilt_bim.ifc.units import read_units, unit_symbol

_PLACES = {
    "IfcBuildingStorey": "storey",
    "IfcFacilityPart": "part of a facility",
    "IfcSpace": "space",
    "IfcBuilding": "building",
    "IfcFacility": "facility",
    "IfcSite": "site",
}
_MATERIALS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """Walls or columns of one class, type and material, and what holds them: a storey, an element, nothing ..."""

    ifc_class: str
    type_name: str
    materials: str
    concrete: bool | None
    placed_in: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FileFacts:
    """What is in a file, whether or not it can be used."""

    schema: str
    exporter: str
    units: tuple[str, ...]  # of length, area and volume, as the file has them
    currency: str
    georeference: Georeference | None
    kinds: tuple[tuple[Kind, int], ...]  # with how many there are, the most first
    zones: tuple[tuple[str, int], ...]  # name, spaces in it
    tasks: int
    tasks_assigned: int  # to walls or columns
    cost_schedules: int
    cost_items: int
    cost_has_values: bool  # False: IFC2X3, whose items hold neither quantities nor rates


def read_facts(file: Any) -> FileFacts:
    """Read what an open file says about itself."""
    units = read_units(file)
    products = walls_and_columns(file)
    ids = frozenset(product.GlobalId for product in products)
    kinds = Counter(_kind(product) for product in products)
    return FileFacts(
        schema=file.schema,
        exporter=_exporter(file),
        units=(unit_symbol(file, "length"), unit_symbol(file, "area"), unit_symbol(file, "volume")),
        currency=units.currency,
        georeference=read_georeference(file, units),
        kinds=tuple(kinds.most_common()),
        zones=tuple((zone.Name or "(no name)", _members(zone)) for zone in file.by_type("IfcZone")),
        tasks=len(file.by_type("IfcTask")),
        tasks_assigned=len(read_tasks(file, ids)[0]),
        cost_schedules=len(file.by_type("IfcCostSchedule")),
        cost_items=sum(1 for _ in planned_items(file)) if file.schema != "IFC2X3" else len(file.by_type("IfcCostItem")),
        cost_has_values=file.schema != "IFC2X3",
    )


def _kind(product: Any) -> Kind:
    names = list(dict.fromkeys(material_names(product)))
    holder = holder_of(product)
    places = (place for ifc_class, place in _PLACES.items() if holder is not None and holder.is_a(ifc_class))
    place = "nothing" if holder is None else next(places, "another element")
    return Kind(
        ifc_class=product.is_a(),
        type_name=type_name_of(product),
        materials=", ".join(names[:_MATERIALS]) + (" ..." if len(names) > _MATERIALS else ""),
        concrete=is_concrete(product),
        placed_in=place,
    )


def _members(zone: Any) -> int:
    return sum(len(relation.RelatedObjects) for relation in zone.IsGroupedBy or ())


def _exporter(file: Any) -> str:
    """Return the program that wrote the file: from its application entity, else from the header."""
    for application in file.by_type("IfcApplication"):
        return " ".join(filter(None, (application.ApplicationFullName, application.Version)))
    return str(file.header.file_name.originating_system or "")
