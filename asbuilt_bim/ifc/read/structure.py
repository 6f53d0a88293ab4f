"""Where products belong: storeys, parts of a whole, materials, own quantities."""

import re
from collections.abc import Iterator
from typing import Any

import ifcopenshell.util.element
import ifcopenshell.util.placement
import numpy as np

from asbuilt_bim.bim.model import Storey
from asbuilt_bim.codes import Note, SubjectKind
from asbuilt_bim.ifc.identity import has_id, with_ids
from asbuilt_bim.ifc.units import Units

_MAX_DEPTH = 32  # a file may tie a knot in its tree
_CONCRETE = re.compile(
    r"concret[eo]|\bbet[oó]n|bet[aã]o\b|b[eé]ton|hormig[oó]n|calcestruzzo|betong|\bc\s?\d\d/\d\d\b|\bin[- ]?situ\b",
    re.IGNORECASE,
)
_BLOCKS = re.compile(
    r"(gas|poren|zell|cellen|cellular|aerated|autoclaved|foam)[- ]?(beton|concrete)|autoclaved|block|masonry|\bcmu\b|"
    r"betonstein|parpaing|bloque",
    re.IGNORECASE,
)
_OTHERS = re.compile(
    r"steel|stahl|st[aå]l\b|staal|acier|acero|acciaio|\bs\s?(235|275|355)|\bhe[abm]\s?\d|alumin|metal|\biron\b|"
    r"brick|ziegel|klinker|brique|ladrillo|mattone|baksteen|mauer|murstein|tegel|kalksand|kalkzand|masonry|metselwerk|"
    r"wood|timber|\bholz|holz\b|\bbois\b|madera|legno|\bhout|plywood|\bclt\b|sperrholz|\bosb\b|"
    r"gypsum|gips|pl[aâ]tre|yeso|cartongesso|plaster|putz|stucco|pleister|drywall|glas|verre|vidrio|vetro|"
    r"insul|d[aä]mm|isol|aislam|\beps\b|\bxps\b|wool|wolle|\bwol\b|\bair\b|cavity|luft|lucht|spouw|"
    r"stone\b|naturstein|granit|marmor|marble|pierre|piedra|tile|fliese|ceramic|keramik|plastic|kunststoff|\bpvc\b|"
    r"membrane|bitumen|earth|lehm|adobe|polystyr|polyureth|\bpur\b|\bpir\b",
    re.IGNORECASE,
)


def storeys_in(file: Any) -> list[Any]:
    """Return a file's storeys, and the parts of its bridges, roads and other facilities, which stand in their place."""
    parts = file.by_type("IfcFacilityPart") if file.schema == "IFC4X3" else ()
    return [*file.by_type("IfcBuildingStorey"), *parts]


def read_storeys(file: Any, units: Units) -> tuple[tuple[Storey, ...], tuple[Note, ...]]:
    """Return the storeys from below, and notes on those without a GlobalId of their own.

    The elevation is that of the placement, else of the attribute, in world metres.
    """
    storeys = []
    found, notes = with_ids(storeys_in(file), SubjectKind.STOREY, each_once=True)
    for storey in found:
        elevation = units.length(getattr(storey, "Elevation", None) or 0.0)
        if storey.ObjectPlacement is not None:
            placed = ifcopenshell.util.placement.get_local_placement(storey.ObjectPlacement)
            elevation = units.length(float(np.asarray(placed)[2, 3]))
        storeys.append(
            Storey(global_id=storey.GlobalId, name=storey.Name or storey.LongName or "(no name)", elevation_m=elevation)
        )
    return tuple(sorted(storeys, key=lambda storey: (storey.elevation_m, storey.name))), notes


def storey_of(product: Any) -> str:
    """Return the GlobalId of the storey that a product lies in, through spaces, wholes and openings.

    "" where it lies in none, or in one without a GlobalId of its own.
    """
    current = product
    for _ in range(_MAX_DEPTH):
        if current is None:
            return ""
        if is_storey(current):
            return str(current.GlobalId) if _counts(current) else ""
        current = holder_of(current)
    return ""


def is_storey(item: Any) -> bool:
    """Say whether an item is a storey, or a part of a facility, which stands in a storey's place."""
    return bool(item.is_a("IfcBuildingStorey") or item.is_a("IfcFacilityPart"))


def _counts(storey: Any) -> bool:
    """Say whether a storey is one of those that `read_storeys` returns: no other before it has its GlobalId."""
    if not has_id(storey):
        return False
    first = next(one for one in storeys_in(storey.file) if one.GlobalId == storey.GlobalId)
    return bool(first == storey)


def holder_of(item: Any) -> Any:
    """Return what holds an item: its spatial container, its whole, or the element that its opening is in."""
    for inverse, attribute in (
        ("ContainedInStructure", "RelatingStructure"),
        ("Decomposes", "RelatingObject"),
        ("Nests", "RelatingObject"),
        ("FillsVoids", "RelatingOpeningElement"),
        ("VoidsElements", "RelatingBuildingElement"),
        ("ReferencedInStructures", "RelatingStructure"),
    ):
        for relation in getattr(item, inverse, None) or ():
            holder = getattr(relation, attribute, None)
            if holder is not None:
                return holder
    return None


def parts_of(product: Any, depth: int = 0) -> Iterator[Any]:
    """Yield the parts of a whole, and theirs."""
    for relation in getattr(product, "IsDecomposedBy", None) or ():
        for part in relation.RelatedObjects:
            if depth < _MAX_DEPTH and part.is_a("IfcElement"):
                yield part
                yield from parts_of(part, depth + 1)


def type_name_of(product: Any) -> str:
    """Return the name of a product's type; without one what the product itself says of it."""
    made_as = ifcopenshell.util.element.get_type(product)
    return str((made_as.Name or "") if made_as is not None else product.ObjectType or "")


def is_concrete(product: Any) -> bool | None:
    """Say by its materials' names whether a product is cast concrete; None where they don't say.

    No is said only where every name is known to be something else: a word of a language that isn't known says nothing.
    """
    named = [name for name in material_names(product) if not name.startswith("<")]
    if any(_CONCRETE.search(name) and not _BLOCKS.search(name) for name in named):
        return True
    known = [_BLOCKS.search(name) or _OTHERS.search(name) for name in named]
    return False if known and all(known) else None


def material_names(product: Any) -> list[str]:
    """Return the names of a product's materials, own, by layers or by type; where it has none those of its parts."""
    names = [material.Name for material in _materials(product)]
    for part in parts_of(product) if not any(names) else ():
        names += [material.Name for material in _materials(part)]
    return [name.strip() for name in names if name and name.strip()]


def _materials(product: Any) -> list[Any]:
    found: list[Any] = list(ifcopenshell.util.element.get_materials(product))
    return [material for material in found if material is not None and material.is_a("IfcMaterial")]


def base_quantities(product: Any, units: Units) -> dict[str, float]:
    """Return the file's own base quantities of a product in SI, by name."""
    found: dict[str, float] = {}
    for relation in getattr(product, "IsDefinedBy", None) or ():
        if not relation.is_a("IfcRelDefinesByProperties"):
            continue
        sets: Any = relation.RelatingPropertyDefinition
        if not sets.is_a("IfcElementQuantity") or not (
            (sets.Name or "").startswith("Qto_") or (sets.Name or "") == "BaseQuantities"
        ):
            continue
        for quantity in sets.Quantities or ():
            if quantity.is_a("IfcPhysicalSimpleQuantity"):
                found[quantity.Name] = units.quantity(quantity)[1]
    return found
