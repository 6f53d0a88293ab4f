"""The solids around the elements: those alone that could touch one, since geometry is what reading costs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from asbuilt_bim.bim.model import BimElement, Obstacle
from asbuilt_bim.geometry.arrays import BoolArray, FloatArray, freeze, frozen
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.ifc.bodies import Body, read_bodies
from asbuilt_bim.ifc.federation import Member

REACH_M = 0.05
"""A solid whose box stays further away than this touches nothing: five times what exposure calls near."""
_LEANS = 1e-6
_OVERLAP_M = 1e-6
_MAX_DEPTH = 16


def read_obstacles(member: Member, products: Sequence[Any], elements: Sequence[BimElement]) -> tuple[Obstacle, ...]:
    """Return the bodies of those products of a file that may touch a lateral face of an element, whosever it is.

    Each is first drawn as it is before openings and clippings are taken off, which costs a tenth and can only be
    larger; those that are near and were cut are then drawn again as they are.
    """
    if not elements:
        return ()
    boxes = np.array([_room(element) for element in elements])
    file, scale, place = member.file, member.units.length_scale, member.world_from_file
    rough = read_bodies(file, products, scale, world_from_file=place, uncut=True)
    cut = {product.id() for product in products if _is_cut(product)}
    grown = {product.id() for product in products if product.id() in cut and _is_united(product)}
    near = {
        product.id()
        for product in products
        if product.id() in grown
        or (product.id() not in rough and product.id() in cut)
        or (product.id() in rough and _meets(rough[product.id()], boxes))
    }
    exact = read_bodies(file, [p for p in products if p.id() in near & cut], scale, world_from_file=place)
    bodies = {number: body for number, body in rough.items() if number in near - cut} | {
        number: body for number, body in exact.items() if _meets(body, boxes)
    }
    return tuple(_obstacle(product, bodies[product.id()]) for product in products if product.id() in bodies)


def _obstacle(product: Any, body: Body) -> Obstacle:
    return Obstacle(
        global_id=product.GlobalId,
        ifc_class=product.is_a(),
        vertices_m=frozen(body.mesh.vertices_m),
        triangles=freeze(body.mesh.triangles),
    )


def _room(element: BimElement) -> FloatArray:
    """Return the box (2, 3) in which a solid may touch an element's lateral faces.

    What lies on top of it or below it, as most slabs and beams do, touches no upright face.
    """
    low, high = element.vertices_m.min(axis=0) - REACH_M, element.vertices_m.max(axis=0) + REACH_M
    frames = (face.frame for face in element.faces)
    if all(abs(f.normal[2] if isinstance(f, PlaneFrame) else np.hypot(*f.axis[:2])) < _LEANS for f in frames):
        low[2] += REACH_M + _OVERLAP_M
        high[2] -= REACH_M + _OVERLAP_M
    return np.stack([low, high])


def _meets(body: Body, boxes_m: FloatArray) -> bool:
    low, high = body.mesh.vertices_m.min(axis=0), body.mesh.vertices_m.max(axis=0)
    meets: BoolArray = (boxes_m[:, 0] <= high).all(axis=1) & (boxes_m[:, 1] >= low).all(axis=1)
    return bool(meets.any())


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
