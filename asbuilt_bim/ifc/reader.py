"""An IFC file becomes a `BimModel`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asbuilt_bim.bim.exposure import expose
from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.cost import read_cost_lines
from asbuilt_bim.ifc.elements import read_elements
from asbuilt_bim.ifc.facts import FileFacts, read_facts
from asbuilt_bim.ifc.schedule import read_tasks
from asbuilt_bim.ifc.source import file_digest, open_ifc
from asbuilt_bim.ifc.structure import read_storeys
from asbuilt_bim.ifc.units import read_units

_DAMAGE = (AssertionError, AttributeError, IndexError, KeyError, RuntimeError, TypeError, ValueError)
"""What ifcopenshell raises where an entity outside the elements lacks what the schema says it has."""


def read_design(path: Path, scope: str | None = None) -> BimModel:
    """Read the design from an IFC file (IFC2X3, IFC4, IFC4X3): walls and columns with their exposed faces.

    `scope` is an ifcopenshell selector that picks the elements to be monitored; the others still hide and touch them.
    One element that can't be used becomes a note, not an error.

    Raises:
        DesignError: the file is missing, no IFC, cut short, of another schema, without a wall or column that has a
            body, or two of them share a GlobalId.
    """
    file = open_ifc(path)
    with _damage_named(path):
        return _read(file, path, scope)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inspection:
    """What a file holds, and the design that is made of it: None where it can't be used, and why not."""

    facts: FileFacts
    design: BimModel | None
    refusal: str


def inspect_file(path: Path, scope: str | None = None) -> Inspection:
    """Read what a file holds even where it is no design.

    Raises:
        DesignError: it can't be opened, or is damaged.
    """
    file = open_ifc(path)
    with _damage_named(path):
        facts = read_facts(file)
        try:
            return Inspection(facts=facts, design=_read(file, path, scope), refusal="")
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


def _read(file: Any, path: Path, scope: str | None) -> BimModel:
    units = read_units(file)
    storeys = read_storeys(file, units)
    read = read_elements(file, scope, units, str(path))
    if not read.elements:
        raise DesignError(f"{path}: {_why_empty(read.notes, scope)}")
    ids = frozenset(element.global_id for element in read.elements)
    lines, cost_notes = read_cost_lines(file, ids, units)
    elements, exposure_notes = expose(read.elements, read.obstacles)
    notes = (*read.notes, *exposure_notes, *cost_notes)
    if homeless := sum(not element.storey for element in elements):
        why = "" if storeys else " (the file holds no IfcBuildingStorey)"
        notes += (f"{homeless} walls or columns belong to no storey{why}: they count in the whole only",)
    projects = file.by_type("IfcProject")
    return BimModel(
        file_name=path.name,
        file_digest=file_digest(path),
        schema=file.schema,
        project_name=(projects[0].LongName or projects[0].Name or "") if projects else "",
        storeys=storeys,
        elements=elements,
        obstacles=read.obstacles,
        tasks=read_tasks(file, ids),
        cost_lines=lines,
        notes=notes,
    )


def _why_empty(notes: tuple[str, ...], scope: str | None) -> str:
    if notes:
        return f"no wall or column has a body that can be used ({notes[0]}); export it with its geometry"
    if scope:
        return f"no wall or column lies in the scope {scope!r}; widen it"
    return "there is no IfcWall or IfcColumn; give the structural model"
