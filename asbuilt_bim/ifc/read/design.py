"""One IFC file, or several that describe one building, become a `BimModel`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from asbuilt_bim.bim.exposure import expose, touching
from asbuilt_bim.bim.model import BimElement, BimModel, CostLine, Obstacle, Task
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.errors import DesignError
from asbuilt_bim.geometry.arrays import freeze, frozen
from asbuilt_bim.ifc.geometry.bodies import Body, read_bodies
from asbuilt_bim.ifc.read.cost import read_cost_lines
from asbuilt_bim.ifc.read.elements import ReadElements, read_elements
from asbuilt_bim.ifc.read.facts import FileFacts, read_facts
from asbuilt_bim.ifc.read.federation import Member, member, same_storeys
from asbuilt_bim.ifc.read.orientation import read_grid_lines, read_north
from asbuilt_bim.ifc.read.schedule import read_tasks
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.read.zones import read_zones
from asbuilt_bim.storage.regular_file import files_digest

_DAMAGE = (AssertionError, AttributeError, IndexError, KeyError, RuntimeError, TypeError, ValueError)
"""What ifcopenshell raises where an entity outside the elements lacks what the schema says it has."""
_MAX_DEPTH = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inspection:
    """What a file holds, and the design that is made of it: None where it can't be used, and why not."""

    facts: FileFacts
    design: BimModel | None
    refusal: str


Planned = TypeVar("Planned", Task, CostLine)


def read_design(path: Path | str | Sequence[Path | str], scope: str | None = None) -> BimModel:
    """Read the design from an IFC file (IFC2X3, IFC4, IFC4X3): walls and columns with their exposed faces.

    Several files are one design in the world of the first. What two of them hold counts for the one named first.
    Solids of one touch elements of another. `scope` is an ifcopenshell selector that picks the elements to be
    monitored; the others still touch them. One element that can't be used becomes a note, not an error.

    Raises:
        DesignError: a file is missing, no IFC, cut short or of another schema. Or two walls or columns of it share a
            GlobalId, or no wall or column has a body.
    """
    paths = [Path(one) for one in ([path] if isinstance(path, Path | str) else path or ())]
    if not paths:
        raise DesignError("no IFC file is named; name at least one")
    return _design([(one, open_ifc(one)) for one in paths], scope)


def inspect_file(path: Path, scope: str | None = None) -> Inspection:
    """Read what a file holds even where it is no design.

    Raises:
        DesignError: it can't be opened, or is damaged.
    """
    file = open_ifc(path)
    with _damage_named(path):
        facts = read_facts(file)
    try:
        return Inspection(facts=facts, design=_design([(path, file)], scope), refusal="")
    except DesignError as error:
        return Inspection(facts=facts, design=None, refusal=str(error))


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Turn what a damaged file makes ifcopenshell raise into a refusal that names the file."""
    try:
        yield
    except _DAMAGE as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise DesignError(f"{path}: the file is damaged ({reason}); export it again") from error


def _design(files: Sequence[tuple[Path, Any]], scope: str | None) -> BimModel:
    members: list[Member] = []
    found: list[ReadElements] = []
    for number, (path, file) in enumerate(files):
        with _damage_named(path):
            members.append(member(path, file, members[0] if members else None))
            taken = frozenset(e.global_id for read in found for e in read.elements)
            found.append(read_elements(members[-1], number, scope, taken))
    elements = tuple(chain.from_iterable(read.elements for read in found))
    where = ", ".join(str(path) for path, _ in files)
    if not elements:
        raise DesignError(f"{where}: {_why_empty([note for read in found for note in read.notes], scope)}")
    obstacles: list[Obstacle] = []
    for one, read in zip(members, found, strict=True):
        with _damage_named(one.path):
            obstacles += read_obstacles(one, read.others, elements)
    exposed, exposure_notes = expose(elements, tuple(obstacles))
    storeys, elements = same_storeys(members, exposed)
    design = BimModel(
        file_name=", ".join(path.name for path, _ in files),
        file_digest=files_digest([path for path, _ in files]),
        schema=", ".join(dict.fromkeys(file.schema for _, file in files)),
        project_name=next((one.project_name for one in members if one.project_name), ""),
        storeys=storeys,
        elements=elements,
        obstacles=tuple(obstacles),
        tasks=(),
        cost_lines=(),
        notes=(
            *chain.from_iterable((*one.notes, *read.notes) for one, read in zip(members, found, strict=True)),
            *exposure_notes,
        ),
    )
    with _damage_named(files[0][0]):
        design = _with_zones(members, design)
        design = replace(design, north=read_north(members), grid_lines=read_grid_lines(members))
    return _with_plan(members, design)


def _with_zones(members: Sequence[Member], design: BimModel) -> BimModel:
    """Return a design whose elements know the zones that any of its files puts them in."""
    zones: dict[str, tuple[str, ...]] = {}
    for one in members:
        for key, names in read_zones(one.file).items():
            zones[key] = tuple(dict.fromkeys((*zones.get(key, ()), *names)))
    if not zones:
        return design
    placed = (replace(e, zones=zones[e.global_id]) if e.global_id in zones else e for e in design.elements)
    return replace(design, elements=tuple(placed))


def _with_plan(members: Sequence[Member], design: BimModel) -> BimModel:
    """Return a design with its tasks and cost lines, each of the file that is named first, with every file's ties."""
    ids = frozenset(element.global_id for element in design.elements)
    tasks: dict[str, Task] = {}
    lines: dict[str, CostLine] = {}
    notes = list(design.notes)
    for one in members:
        with _damage_named(one.path):
            planned, task_notes = read_tasks(one.file, ids)
            for task in planned:
                tasks[task.global_id] = _with_assignments(tasks.get(task.global_id, task), task)
            read, cost_notes = read_cost_lines(one.file, ids, one.units)
            for line in read:
                lines[line.global_id] = _with_assignments(lines.get(line.global_id, line), line)
            notes += (*task_notes, *cost_notes)
    if homeless := sum(not element.storey for element in design.elements):
        values: Values = {"count": homeless, "storeys": len(design.storeys)}
        notes.append(noted(Reason.NO_STOREY, about(SubjectKind.DESIGN), **values))
    for code, things in ((Reason.NOT_IN_TASKS, tasks.values()), (Reason.NOT_IN_COST_LINES, lines.values())):
        if without := len(ids.difference(*(thing.elements for thing in things))) if things else 0:
            values = {"count": without, "of": len(ids)}
            notes.append(noted(code, about(SubjectKind.DESIGN), **values))
    return replace(design, tasks=tuple(tasks.values()), cost_lines=tuple(lines.values()), notes=tuple(notes))


def _with_assignments(first: Planned, again: Planned) -> Planned:
    """Return a task or cost line of several files with the elements that all of them tie it to."""
    if first is again:
        return first
    elements = tuple(dict.fromkeys((*first.elements, *again.elements)))
    return replace(first, elements=elements, others=first.others + again.others)


def _why_empty(notes: Sequence[Note], scope: str | None) -> str:
    if notes:
        first = notes[0]
        values = ", ".join(str(value) for value in first.values.values() if value != "")
        return f"no wall or column has a body that can be used ({first.code}: {values}); export it with its geometry"
    if scope:
        return f"no wall or column lies in the scope {scope!r}; widen it"
    return "there is no IfcWall or IfcColumn; give the structural model"


def read_obstacles(member: Member, products: Sequence[Any], elements: Sequence[BimElement]) -> tuple[Obstacle, ...]:
    """Return the bodies of those products of a file that touch a lateral face of an element, whosever it is.

    Each is first drawn without its openings and clippings: that costs a tenth, and can only be larger. Of those that
    touch, the ones with openings or clippings are then drawn again as they are.
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
