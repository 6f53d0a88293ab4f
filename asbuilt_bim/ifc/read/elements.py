"""Walls and columns of a file as plain elements, and the solids around them."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import ifcopenshell.util.placement
import ifcopenshell.util.selector
import numpy as np

from asbuilt_bim.bim.mesh import merged, pieces, signed_volume, turned_outwards
from asbuilt_bim.bim.model import BimElement, ElementClass
from asbuilt_bim.bim.shape import axes
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.errors import DesignError
from asbuilt_bim.geometry.arrays import FloatArray, freeze, frozen
from asbuilt_bim.geometry.transform import inverse
from asbuilt_bim.ifc.geometry.bodies import Body, read_bodies
from asbuilt_bim.ifc.geometry.faces import design_faces
from asbuilt_bim.ifc.identity import with_ids
from asbuilt_bim.ifc.read.federation import Member
from asbuilt_bim.ifc.read.structure import base_quantities, is_concrete, parts_of, storey_of, type_name_of
from asbuilt_bim.ifc.units import Units

_OBSTACLES = (
    "IfcSlab", "IfcBeam", "IfcFooting", "IfcPile", "IfcRoof", "IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight",
    "IfcMember", "IfcBuildingElementProxy", "IfcBuildingElementPart",
)  # fmt: skip

_NO_BODY = frozenset({"Axis", "FootPrint", "Box", "Annotation", "Profile", "Plan", "Reference", "CoG", "Clearance"})
_NAMED = 5
MAX_SIZE_M = 1000.0
"""A longer wall is a wrong unit; its cells and samples would fill the memory."""
_UNITS_M = (1e-6, 1e4)
"""From a micrometre to beyond a mile: what programs offer as a unit of length."""
_SAMPLE = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReadElements:
    """What was read: elements, the products that may touch elements, and what couldn't be used."""

    elements: tuple[BimElement, ...]
    others: tuple[Any, ...]
    notes: tuple[Note, ...]


def read_elements(member: Member, number: int, scope: str | None, taken: frozenset[str] = frozenset()) -> ReadElements:
    """Read the walls and columns of a file (those that `scope`, an ifcopenshell selector, picks) that have GlobalIds.

    `number` is the file's place in the design. What an earlier file has (`taken`, GlobalIds) counts there.

    Raises:
        DesignError: the scope can't be read, two elements share a GlobalId, or the unit of length can't be meant.
    """
    file, where = member.file, str(member.path)
    everything = walls_and_columns(file)
    candidates = [product for product in everything if product.GlobalId not in taken]
    chosen = _in_scope(file, candidates, scope, where)
    chosen, strangers = with_ids(chosen, SubjectKind.ELEMENT)
    _check_ids(chosen, where)
    parts = [part for product in chosen if not _has_body(product) for part in parts_of(product)]
    check_unit(file, [*chosen, *parts], member.units.length_scale, where)
    bodies = read_bodies(file, [*chosen, *parts], member.units.length_scale, world_from_file=member.world_from_file)
    elements: list[BimElement] = []
    notes: list[Note] = []
    bodiless: list[str] = []
    for product in chosen:
        body = _body_of(product, bodies, member)
        if body is None:
            bodiless.append(_label(product))
        else:
            element = _read_or_note(product, body, member.units, number)
            if isinstance(element, Note):
                notes.append(element)
            else:
                elements.append(element)
    if twice := len(everything) - len(candidates):
        subject = about(SubjectKind.FILE, member.path.name)
        notes.append(noted(Reason.IN_EARLIER_FILE, subject, count=twice))
    return ReadElements(
        elements=tuple(elements),
        others=_others(file, everything, {product.id() for product in chosen}, taken),
        notes=(*strangers, *_bodiless_note(bodiless), *notes),
    )


def _others(file: Any, candidates: list[Any], picked: set[int], taken: frozenset[str]) -> tuple[Any, ...]:
    """Return what else may touch elements: walls and columns not picked, or their parts, slabs, beams ..."""
    own_parts = {part.id() for product in candidates for part in parts_of(product)}
    around = [product for name in _OBSTACLES for product in _by_type(file, name) if product.id() not in own_parts]
    for product in candidates:
        if product.id() not in picked and product.GlobalId not in taken:
            around += [product] if _has_body(product) else parts_of(product)
    return tuple({product.id(): product for product in around}.values())


def _bodiless_note(labels: list[str]) -> tuple[Note, ...]:
    if not labels:
        return ()
    return (noted(Reason.NO_BODY, about(SubjectKind.DESIGN), elements=tuple(labels[:_NAMED]), count=len(labels)),)


def _read_or_note(product: Any, body: Body, units: Units, number: int) -> BimElement | Note:
    try:
        return _element(product, body, units, number)
    except Exception as error:  # whatever is wrong with one element must not cost the others: the note carries it
        return _note(Reason.ELEMENT_UNUSABLE, product, {"error": f"{type(error).__name__}: {error}"})


def _note(code: Reason, product: Any, values: Values) -> Note:
    named = {"ifc_class": product.is_a(), "element": product.Name or ""}
    return noted(code, about(SubjectKind.ELEMENT, product.GlobalId), **named, **values)


def _by_type(file: Any, name: str) -> list[Any]:
    """Return the products of a class, none where the schema doesn't know it."""
    try:
        return list(file.by_type(name))
    except RuntimeError:
        return []


def walls_and_columns(file: Any) -> list[Any]:
    """Return the walls and columns that are no parts of another wall or column."""
    both = [*file.by_type("IfcWall"), *file.by_type("IfcColumn")]
    inner = {part.id() for product in both for part in parts_of(product)}
    return [product for product in both if product.id() not in inner]


def _in_scope(file: Any, candidates: list[Any], scope: str | None, where: str) -> list[Any]:
    if not scope:
        return candidates
    try:
        picked = {product.id() for product in ifcopenshell.util.selector.filter_elements(file, scope)}
    except Exception as error:  # the selector's parser raises its own kinds
        text = " ".join(str(error).split())[:160]
        raise DesignError(
            f'{where}: the scope {scope!r} can\'t be read ({text}); write it like `IfcWall, location="Level 1"`'
        ) from error
    return [product for product in candidates if product.id() in picked]


def _check_ids(products: list[Any], where: str) -> None:
    twice = [name for name, count in Counter(product.GlobalId for product in products).items() if count > 1]
    if twice:
        labels = "; ".join(_label(product) for product in products if product.GlobalId in set(twice[:3]))
        raise DesignError(
            f"{where}: {len(twice)} GlobalIds are used by more than one wall or column ({labels}): what was measured "
            "couldn't be told apart; have the authoring program give new ones"
        )


def _has_body(product: Any) -> bool:
    """Say whether a product has a representation that could be a solid: an axis or an outline in plan is none."""
    shape = product.Representation
    return shape is not None and any(
        representation.RepresentationIdentifier not in _NO_BODY for representation in shape.Representations
    )


def _body_of(product: Any, bodies: dict[int, Body], member: Member) -> Body | None:
    """Return a product's own body, else that of its parts together."""
    if product.id() in bodies:
        return bodies[product.id()]
    inner = [bodies[part.id()] for part in parts_of(product) if part.id() in bodies]
    if not inner:
        return None
    world_from_local = inner[0].world_from_local
    if product.ObjectPlacement is not None:
        placed = ifcopenshell.util.placement.get_local_placement(product.ObjectPlacement)
        world_from_local = np.array(placed, dtype=np.float64)
        world_from_local[:3, 3] *= member.units.length_scale
        world_from_local = member.world_from_file @ world_from_local
    return Body(mesh=merged(tuple(body.mesh for body in inner)), world_from_local=world_from_local)


def _element(product: Any, body: Body, units: Units, number: int) -> BimElement | Note:
    kind: ElementClass = "column" if product.is_a("IfcColumn") else "wall"
    mesh = merged(tuple(turned_outwards(piece) for piece in pieces(body.mesh)))
    preferred: FloatArray | None = body.world_from_local[:2, 0] if kind == "wall" else None
    axis_from_world, extents = axes(mesh, preferred)
    if extents.max() > MAX_SIZE_M:
        sizes = {"length_m": float(extents.max()), "limit_m": MAX_SIZE_M}
        return _note(Reason.ELEMENT_TOO_LONG, product, sizes)
    faces = design_faces(mesh, product.GlobalId, kind, axis_from_world, inverse(_rigid(body.world_from_local)))
    if not faces:
        return _note(Reason.NO_UPRIGHT_FACE, product, {})
    return BimElement(
        global_id=product.GlobalId,
        ifc_class=product.is_a(),
        kind=kind,
        name=product.Name or "",
        tag=product.Tag or "",
        storey=storey_of(product),
        is_concrete=is_concrete(product),
        vertices_m=frozen(mesh.vertices_m),
        triangles=freeze(mesh.triangles),
        axis_from_world=frozen(axis_from_world),
        length_m=float(extents[0]),
        thickness_m=float(extents[1]),
        height_m=float(extents[2]),
        volume_m3=abs(signed_volume(mesh)),
        faces=faces,
        qto=base_quantities(product, units),
        source=number,
        type_name=type_name_of(product),
    )


def _rigid(placement: FloatArray) -> FloatArray:
    """Return a placement without what scaling or shearing a file may have put into it."""
    u, _, v = np.linalg.svd(placement[:3, :3])
    clean = placement.copy()
    clean[:3, :3] = u @ v
    return clean


def _label(product: Any) -> str:
    return f"{product.is_a()} {product.Name or '(no name)'} ({product.GlobalId})"


def check_unit(file: Any, products: Sequence[Any], length_scale: float, where: str) -> None:
    """Refuse a file whose walls and columns are mostly longer than any is, by a few of them drawn uncut.

    Raises:
        DesignError: the unit of length is none, or most of the few are longer than `MAX_SIZE_M`.
    """
    if not _UNITS_M[0] <= length_scale <= _UNITS_M[1]:
        raise DesignError(
            f"{where}: its unit of length is {length_scale:g} m (limits {_UNITS_M[0]:g} and {_UNITS_M[1]:g} m); "
            "export it in millimetres or metres"
        )
    few = products[:: max(1, len(products) // _SAMPLE)]
    bodies = read_bodies(file, few, length_scale, uncut=True)
    sizes = sorted(float(np.diff(body.mesh.bounds_m, axis=0).max()) for body in bodies.values())
    if sizes and (half := sizes[(len(sizes) - 1) // 2]) > MAX_SIZE_M:
        raise DesignError(
            f"{where}: its walls and columns are mostly {half:.0f} m long or more (limit {MAX_SIZE_M:.0f} m). "
            f"Its unit of length is {length_scale:g} m; export it in the unit that it is drawn in"
        )
