"""The solids around the elements: those alone that could touch one, since geometry is what reading costs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from asbuilt_bim.bim.exposure import touching
from asbuilt_bim.bim.model import BimElement, Obstacle
from asbuilt_bim.geometry.arrays import freeze, frozen
from asbuilt_bim.ifc.geometry.bodies import Body, read_bodies
from asbuilt_bim.ifc.read.federation import Member

_MAX_DEPTH = 16


def read_obstacles(member: Member, products: Sequence[Any], elements: Sequence[BimElement]) -> tuple[Obstacle, ...]:
    """Return the bodies of those products of a file that touch a lateral face of an element, whosever it is.

    Each is first drawn as it is before openings and clippings are taken off, which costs a tenth and can only be
    larger; of those that touch so, the ones that were cut are then drawn again as they are.
    """
    if not elements:
        return ()
    file, scale, place = member.file, member.units.length_scale, member.world_from_file
    rough = read_bodies(file, products, scale, world_from_file=place, uncut=True)
    drawn = [product for product in products if product.id() in rough]
    near = {drawn[i].id() for i in touching(elements, [_obstacle(product, rough[product.id()]) for product in drawn])}
    cut = {product.id() for product in products if _is_cut(product)}
    sure = {p.id() for p in products if p.id() in cut and (p.id() not in rough or _is_united(p))}
    exact = read_bodies(file, [p for p in products if p.id() in (near & cut) | sure], scale, world_from_file=place)
    bodies = {number: body for number, body in rough.items() if number in near - cut} | exact
    return tuple(_obstacle(product, bodies[product.id()]) for product in products if product.id() in bodies)


def _obstacle(product: Any, body: Body) -> Obstacle:
    return Obstacle(
        global_id=product.GlobalId,
        ifc_class=product.is_a(),
        vertices_m=frozen(body.mesh.vertices_m),
        triangles=freeze(body.mesh.triangles),
    )


def _is_cut(product: Any) -> bool:
    """Say whether openings or Boolean operations shape a product's body."""
    if getattr(product, "HasOpenings", None):
        return True
    return any(item.is_a("IfcBooleanResult") or item.is_a("IfcCsgSolid") for item in _items(product))


def _is_united(product: Any) -> bool:
    """Say whether a Boolean operation may have made a product's body larger than its first operand."""
    return any(
        item.is_a("IfcCsgSolid") or (item.is_a("IfcBooleanResult") and item.Operator == "UNION")
        for item in _items(product)
    )


def _items(product: Any) -> Iterator[Any]:
    """Yield what a product's body is made of: through mapped items, and the first operands of what is cut."""
    shape = product.Representation
    for representation in shape.Representations if shape is not None else ():
        for item in representation.Items or ():
            yield from _within(item, 0)


def _within(item: Any, depth: int) -> Iterator[Any]:
    yield item
    if depth >= _MAX_DEPTH:
        return
    if item.is_a("IfcBooleanResult"):
        yield from _within(item.FirstOperand, depth + 1)
    elif item.is_a("IfcMappedItem"):
        for inner in item.MappingSource.MappedRepresentation.Items or ():
            yield from _within(inner, depth + 1)
