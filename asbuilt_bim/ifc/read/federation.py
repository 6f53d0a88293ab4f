"""Files that describe one building together: each in the world of the first; equal storeys are one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from asbuilt_bim.bim.model import BimElement, Storey
from asbuilt_bim.codes import Note, Reason, SubjectKind, Values, about, noted
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import inverse
from asbuilt_bim.ifc.read.georeference import Georeference, read_georeference
from asbuilt_bim.ifc.read.grids import settle_grid_placements
from asbuilt_bim.ifc.read.structure import read_storeys
from asbuilt_bim.ifc.units import Units, read_units

SAME_HEIGHT_M = 0.01
"""Storeys of one name in two files that lie no further apart are one: programs round elevations to millimetres."""
_NOTHING_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Member:
    """One open file of a design; `world_from_file` (4, 4) takes its own world metres to those of the first."""

    path: Path
    file: Any
    units: Units
    project_name: str
    georeference: Georeference | None
    world_from_file: FloatArray
    storeys: tuple[Storey, ...]
    notes: tuple[Note, ...]


def member(path: Path, file: Any, first: Member | None) -> Member:
    """Return an open file as a member of the design whose world is that of `first`, None where it is the first."""
    settle_grid_placements(file)
    units = read_units(file)
    georeference = read_georeference(file, units)
    place, notes = _place(path, georeference, first)
    rise = float(place[2, 3])
    projects = file.by_type("IfcProject")
    storeys, strangers = read_storeys(file, units)
    return Member(
        path=path,
        file=file,
        units=units,
        project_name=(projects[0].LongName or projects[0].Name or "") if projects else "",
        georeference=georeference,
        world_from_file=place,
        storeys=tuple(replace(s, elevation_m=s.elevation_m + rise) for s in storeys),
        notes=(*notes, *strangers),
    )


def _place(path: Path, own: Georeference | None, first: Member | None) -> tuple[FloatArray, tuple[Note, ...]]:
    """Return where a file's world lies in the first one's: by their maps, else they are taken to be the same."""
    if first is None:
        return np.eye(4), ()
    other = first.georeference
    if own is not None and other is not None and own.crs == other.crs:
        place = inverse(other.map_from_world()) @ own.map_from_world()
        return (np.eye(4) if np.abs(place - np.eye(4)).max() < _NOTHING_M else place), ()
    if own is None and other is None:
        return np.eye(4), ()
    maps = [georeference.crs if georeference else "" for georeference in (own, other)]
    values: Values = {"map": maps[0], "other_file": first.path.name, "other_map": maps[1]}
    return np.eye(4), (noted(Reason.NOT_ON_ONE_MAP, about(SubjectKind.FILE, path.name), **values),)


def same_storeys(
    members: Sequence[Member], elements: tuple[BimElement, ...]
) -> tuple[tuple[Storey, ...], tuple[BimElement, ...]]:
    """Return the storeys from below, and the elements, those of a storey that an earlier file has too moved to that."""
    kept: list[Storey] = []
    owner: dict[str, int] = {}
    moved: dict[str, str] = {}
    for number, one in enumerate(members):
        for storey in one.storeys:
            twin = next((k for k in kept if owner[k.global_id] < number and _same(k, storey)), None)
            if twin is None:
                kept.append(storey)
                owner[storey.global_id] = number
            elif twin.global_id != storey.global_id:
                moved[storey.global_id] = twin.global_id
    settled = tuple(replace(e, storey=moved[e.storey]) if e.storey in moved else e for e in elements)
    return tuple(sorted(kept, key=lambda storey: (storey.elevation_m, storey.name))), settled


def _same(a: Storey, b: Storey) -> bool:
    named = a.name.strip().casefold() == b.name.strip().casefold()
    return a.global_id == b.global_id or (named and abs(a.elevation_m - b.elevation_m) < SAME_HEIGHT_M)
