"""Surface colours by state, so that any viewer shows progress; they can be taken off again.

An item bears one style at most. Where the design has styled it, the design's IfcStyledItem is set aside: detached and
numbered in its name. It is kept in a styled representation of a material that this program makes: there the schema
lets styled items be without an item. Taking the colours off puts it back. A style inside a mapped source would hide
that of the element. So it is moved out to all who use the source, each in its own colour or the one it had.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from asbuilt_bim.ifc.read.structure import parts_of
from asbuilt_bim.ifc.write.entities import Marker
from asbuilt_bim.progress.report import ElementProgress, ShownState

_STYLE = "AsBuilt_Colour"
_ASIDE = "AsBuilt_Aside"
"""Name of a styled item that was set aside: this, a number, a blank, and its own name in quotes if it had one."""


class Painter:
    """Colours the bodies of elements in one file; `colours` has one for each state, `#rrggbb`."""

    def __init__(self, marker: Marker, colours: Mapping[ShownState, str]) -> None:
        self._make = marker.file.create_entity
        self._file = marker.file
        self._colours = colours
        self._styles: dict[str, Any] = {}
        self._aside: list[Any] = []
        self._shown: dict[int, bool] = {}
        self._count = 0

    def paint(self, element: Any, progress: ElementProgress) -> bool:
        """Colour an element's body by its state; say whether all of it could be.

        A body that several elements share has one colour for all of them, and stays as it is.
        """
        items = list(_body_items(element))
        could = [self._paint_item(item, progress.shown_state) for item in items]
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

    def _paint_item(self, item: Any, state: ShownState) -> bool:
        if not _alone(item) or not self._shows(item):
            return False
        mine = [styled for styled in item.StyledByItem or () if str(styled.Name).startswith(_STYLE)]
        if mine:  # it bears its source's style, moved out
            mine[0].Styles = [self._style(state)]
            return True
        self._put_aside(item)
        self._wear(item, [self._style(state)])
        return True

    def _shows(self, item: Any) -> bool:
        """Say whether an item's own style would show; the styles in a mapped source are moved out where they can be."""
        if not item.is_a("IfcMappedItem"):
            return True
        source = item.MappingSource
        if source.id() not in self._shown:
            self._shown[source.id()] = self._move_out(source)
        return self._shown[source.id()]

    def _move_out(self, source: Any) -> bool:
        """Give a mapped source's one style to all who use it, and set it aside inside: what it hides can then show."""
        inner, users = source.MappedRepresentation.Items, source.MapUsage
        if any(one.is_a("IfcMappedItem") for one in inner):
            return False
        styles = {tuple(style.id() for style in styled.Styles) for one in inner for styled in one.StyledByItem or ()}
        if not styles:
            return True
        every = all(one.StyledByItem for one in inner)
        if not every or len(styles) > 1 or any(user.StyledByItem for user in users) or not _only_mapped(source):
            return False
        worn = inner[0].StyledByItem[0].Styles
        for one in inner:
            self._put_aside(one)
            self._make("IfcPresentationLayerAssignment", Name=f"{_ASIDE} {self._count}", AssignedItems=[one])
            self._count += 1
        for user in users:
            self._wear(user, worn)
        return True

    def _wear(self, item: Any, styles: Sequence[Any]) -> None:
        self._make("IfcStyledItem", Item=item, Styles=styles, Name=f"{_STYLE} {self._count}")
        self._count += 1

    def _put_aside(self, item: Any) -> None:
        """Detach what styles an item, under the number that our next style or layer bears."""
        for styled in item.StyledByItem or ():
            own = "" if styled.Name is None else f" '{styled.Name}'"
            styled.Item, styled.Name = None, f"{_ASIDE} {self._count}{own}"
            self._aside.append(styled)

    def _style(self, state: ShownState) -> Any:
        if state not in self._styles:
            colour = self._colours[state]
            red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
            shade = self._make(
                "IfcSurfaceStyleShading", SurfaceColour=self._make("IfcColourRgb", _STYLE, red, green, blue)
            )
            style = self._make("IfcSurfaceStyle", Name=f"{_STYLE} {state}", Side="BOTH", Styles=[shade])
            if self._file.schema == "IFC2X3":
                style = self._make("IfcPresentationStyleAssignment", [style])
            self._styles[state] = style
        return self._styles[state]


def put_colours_back(file: Any) -> None:
    """Take our colours off an open file and give every item the style it had."""
    painted = [one for one in file.by_type("IfcStyledItem") if str(one.Name).startswith(f"{_STYLE} ")]
    if not painted:
        return
    layers = [one for one in file.by_type("IfcPresentationLayerAssignment") if str(one.Name).startswith(f"{_ASIDE} ")]
    items = {one.Name.removeprefix(f"{_ASIDE} "): one.AssignedItems[0] for one in layers}
    items |= {one.Name.removeprefix(f"{_STYLE} "): one.Item for one in painted}
    for styled in [one for one in file.by_type("IfcStyledItem") if str(one.Name).startswith(f"{_ASIDE} ")]:
        number, _, own = styled.Name.removeprefix(f"{_ASIDE} ").partition(" ")
        styled.Item, styled.Name = items.get(number), own[1:-1] if own else None
    materials = [one for one in file.by_type("IfcMaterial") if one.Name == _ASIDE]
    kept = [rep for one in materials for rep in one.HasRepresentation or ()]
    styled = [rep for one in kept for rep in one.Representations]
    styles = {style.id(): style for one in painted for style in one.Styles}
    for thing in (*kept, *styled, *materials, *layers, *painted):
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


def _alone(item: Any) -> bool:
    """Say whether an item is the body of one element alone."""
    file = item.file
    users = [user for user in file.get_inverse(item) if user.is_a("IfcRepresentation")]
    if len(users) != 1 or any(source.MapUsage for source in users[0].RepresentationMap):
        return False
    return len(_products_of(users[0])) == 1


def _only_mapped(source: Any) -> bool:
    """Say whether a mapped source is nothing's body by itself."""
    representation = source.MappedRepresentation
    return len(representation.RepresentationMap) == 1 and not _products_of(representation)


def _products_of(representation: Any) -> list[Any]:
    file = representation.file
    shapes = [one for one in file.get_inverse(representation) if one.is_a("IfcProductRepresentation")]
    return [one for shape in shapes for one in file.get_inverse(shape) if one.is_a("IfcProduct")]
