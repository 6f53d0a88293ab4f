"""Surface colours by state, so that any viewer shows progress; they can be taken off again.

An item bears one style at most. Where the design has styled it, the design's IfcStyledItem is set aside: detached,
numbered in its name, and kept in a styled representation of a material of ours (the place that the schema has for
styled items without an item). Taking the colours off puts it back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from asbuilt_bim.ifc.marker import Marker
from asbuilt_bim.ifc.structure import parts_of
from asbuilt_bim.progress.report import ElementProgress, State

_OURS = "AsBuilt_Colour"
_ASIDE = "AsBuilt_Aside"
"""Name of a styled item that was set aside: this, a number, a blank, and its own name in quotes if it had one."""
_MAX_DEPTH = 8


class Painter:
    """Colours the bodies of elements in one file."""

    def __init__(self, marker: Marker, colours: Mapping[State, str]) -> None:
        self._make = marker.file.create_entity
        self._file = marker.file
        self._colours = colours
        self._styles: dict[str, Any] = {}
        self._aside: list[Any] = []
        self._count = 0

    def paint(self, element: Any, progress: ElementProgress) -> bool:
        """Colour an element's body by its state; say whether all of it could be.

        A body that several elements share has one colour for all of them, and stays as it is.
        """
        items = list(_body_items(element))
        could = [self._paint_item(item, progress.state) for item in items]
        return bool(could) and all(could)

    def finish(self) -> None:
        """Keep the styles that were set aside where the schema wants styled items without an item."""
        contexts = self._file.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
        if not self._aside or not contexts:
            return
        kept = self._make(
            "IfcStyledRepresentation",
            ContextOfItems=contexts[0],
            RepresentationIdentifier=_ASIDE,
            RepresentationType="Style",
            Items=self._aside,
        )
        material = self._make("IfcMaterial", Name=_ASIDE)
        self._make("IfcMaterialDefinitionRepresentation", Representations=[kept], RepresentedMaterial=material)

    def _paint_item(self, item: Any, state: State) -> bool:
        if not _own_body(item):
            return False
        number = self._count
        self._count += 1
        for styled in item.StyledByItem or ():
            own = "" if styled.Name is None else f" '{styled.Name}'"
            styled.Item, styled.Name = None, f"{_ASIDE} {number}{own}"
            self._aside.append(styled)
        self._make("IfcStyledItem", Item=item, Styles=[self._style(state)], Name=f"{_OURS} {number}")
        return True

    def _style(self, state: State) -> Any:
        if state not in self._styles:
            colour = self._colours[state]
            red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
            shade = self._make(
                "IfcSurfaceStyleShading", SurfaceColour=self._make("IfcColourRgb", _OURS, red, green, blue)
            )
            style = self._make("IfcSurfaceStyle", Name=f"{_OURS} {state}", Side="BOTH", Styles=[shade])
            if self._file.schema == "IFC2X3":
                style = self._make("IfcPresentationStyleAssignment", [style])
            self._styles[state] = style
        return self._styles[state]


def put_colours_back(file: Any) -> None:
    """Take our colours off an open file and give every item the style it had."""
    painted = [one for one in file.by_type("IfcStyledItem") if (one.Name or "").startswith(_OURS)]
    if not painted:
        return
    items = {one.Name.removeprefix(_OURS).strip(): one.Item for one in painted}
    for styled in [one for one in file.by_type("IfcStyledItem") if (one.Name or "").startswith(f"{_ASIDE} ")]:
        number, _, own = styled.Name.removeprefix(f"{_ASIDE} ").partition(" ")
        styled.Item, styled.Name = items.get(number), own[1:-1] if own else None
    materials = [one for one in file.by_type("IfcMaterial") if one.Name == _ASIDE]
    kept = [rep for one in materials for rep in one.HasRepresentation or ()]
    styled = [rep for one in kept for rep in one.Representations]
    styles = {style.id(): style for one in painted for style in one.Styles}
    for thing in (*kept, *styled, *materials, *painted):
        file.remove(thing)
    for style in styles.values():
        _remove_with_parts(file, style)


def _remove_with_parts(file: Any, thing: Any) -> None:
    if file.get_total_inverses(thing):
        return
    parts = [p for value in thing for p in (value if isinstance(value, tuple) else (value,)) if hasattr(p, "is_a")]
    file.remove(thing)
    for part in parts:
        _remove_with_parts(file, part)


def _body_items(element: Any) -> Iterator[Any]:
    """Yield the items of an element's body, or of its parts' where it has none of its own."""
    for product in (element, *parts_of(element)):
        shape = getattr(product, "Representation", None)
        for representation in getattr(shape, "Representations", None) or ():
            if representation.RepresentationIdentifier in ("Body", "Facetation"):
                yield from representation.Items


def _own_body(item: Any) -> bool:
    """Say whether an item's colour shows, and shows on one element alone."""
    users = [user for user in item.file.get_inverse(item) if user.is_a("IfcRepresentation")]
    if len(users) != 1 or users[0].RepresentationMap:
        return False
    products = [one for shape in users[0].OfProductRepresentation for one in getattr(shape, "ShapeOfProduct", ())]
    return len(products) == 1 and not _styled_inside(item)


def _styled_inside(item: Any, depth: int = 0) -> bool:
    """Say whether a mapped item's source has styles of its own, which would hide that of the mapped item."""
    if not item.is_a("IfcMappedItem") or depth > _MAX_DEPTH:
        return False
    inner = item.MappingSource.MappedRepresentation.Items
    return any(one.StyledByItem or _styled_inside(one, depth + 1) for one in inner)
