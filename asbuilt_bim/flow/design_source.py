"""The design of a project: read from its IFC files once, then from the cache for as long as they stay as they are.

Its cost lines are the IFC's, or those of a costs table.
"""

from dataclasses import replace

from asbuilt_bim.bim.covers import Cover, Covered, CoveredRows
from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.bim.twins import once_each
from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.ifc.apart import inspect_file, read_covers, read_design
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.tables.costs import read_costs, with_costs
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.fingerprint import library_versions, reading_code_digest
from asbuilt_bim.storage.regular_file import files_digest


def design_of(project: Project, cache: Cache) -> BimModel:
    """Return what the project's IFC files hold of its scope.

    Raises:
        DesignError: a file can't be used; see `read_design`. What can't be used is never kept.
    """
    key = _key(project) if cache.folder is not None else ""
    found = cache.get(key, BimModel) if key else None
    if found is not None:
        return found
    design = once_each(read_design(project.ifc, project.scope))
    if key and _key(project) == key:  # else a file was written anew in between
        cache.put(key, design, BimModel)
    return design


def with_costs_table(design: BimModel, project: Project, cache: Cache) -> BimModel:
    """Return the design with the lines of the project's costs table, where it has one.

    Raises:
        CostError: the table can't be used.
        DesignError: a file or a selector crashed its reader, or took too long.
    """
    if project.costs is None:
        return design
    table = read_costs(project.costs)
    first = {note.subject.name: str(note.values["first"]) for note in design.notes if note.code is Reason.ELEMENT_TWICE}
    measured = frozenset({*(element.global_id for element in design.elements), *first})
    covers = tuple(_as_named_today(cover, design) for cover in table.covers)
    covered = _covered(project, covers, measured, cache)
    rows = [replace(row, elements=_each_once(row, first)) for row in covered.rows]
    return with_costs(design, table, replace(covered, rows=tuple(rows)))


def _as_named_today(cover: Cover, design: BimModel) -> Cover:
    return replace(cover, global_ids=tuple(dict.fromkeys(map(design.today, cover.global_ids))))


def _each_once(row: Covered, first: dict[str, str]) -> tuple[str, ...]:
    """Return a row's elements, of two in one place the first."""
    return tuple(dict.fromkeys(first.get(key, key) for key in row.elements))


def _covered(project: Project, covers: tuple[Cover, ...], measured: frozenset[str], cache: Cache) -> CoveredRows:
    design = _key(project) if cache.folder is not None else ""
    key = digest_of(["covers", design, *map(repr, covers), *sorted(measured)]) if design else ""
    found = cache.get(key, CoveredRows) if key else None
    if found is None:
        found = read_covers(project.ifc, covers, measured)
        if key:
            cache.put(key, found, CoveredRows)
    return found


def place_on_map(project: Project) -> tuple[FloatArray, float]:
    """Return the move (4, 4) from the first IFC file's world to its map, and the map's scale.

    Raises:
        DesignError: the file can't be opened.
        SurveyError: it has no map conversion.
    """
    found = inspect_file(project.ifc[0]).facts.georeference
    if found is None:
        raise SurveyError(
            f"poses.coordinates: map, and {project.relative(project.ifc[0])} has no IfcMapConversion; give the poses "
            "in the IFC's own coordinates, with coordinates: ifc"
        )
    return found.map_from_world(), found.scale


def _key(project: Project) -> str:
    """Return a digest of all that the design depends on, "" where a file can't be read: `read_design` says why."""
    try:
        digest = files_digest(project.ifc)
    except OSError:
        return ""
    libraries = [f"{name} {version}" for name, version in sorted(library_versions().items())]
    names = [path.name for path in project.ifc]
    return digest_of(["design", digest, project.scope or "", reading_code_digest(), *libraries, *names])
