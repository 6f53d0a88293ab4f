"""Rough places as a project file says them, as places of the design."""

import re
from collections.abc import Sequence

import numpy as np

from asbuilt_bim.bim.model import BimModel, GridLine
from asbuilt_bim.errors import ProjectError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.project.file import NearFile
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.register.by_design.rough import RoughPlace, RoughPlaces

COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
MOST_NAMED = 12
"""Names that one message holds."""


def check_near(project: Project, design: BimModel) -> None:
    """Look up every rough place of a project, before anything is measured.

    Raises:
        ProjectError: the design has no such storey or grid axis; every station's mistake is named.
    """
    faults: list[str] = []
    for visit in project.visits:
        for station in visit.stations:
            try:
                if station.near is not None:
                    _place(station.near, design)
            except ValueError as problem:
                faults.append(f"{visit.date} {station.name}: near: {problem}")
    if faults:
        more = f"; and {len(faults) - MOST_NAMED} more" if len(faults) > MOST_NAMED else ""
        raise ProjectError(f"{project.path.name}: {'; '.join(faults[:MOST_NAMED])}{more}")


def rough_places(visit: Visit, design: BimModel) -> RoughPlaces | None:
    """Return a visit's rough places, None where it has none."""
    places = {one.name: _place(one.near, design) for one in visit.stations if one.near is not None}
    return RoughPlaces(places=places, design=design) if places else None


def _place(near: NearFile, design: BimModel) -> RoughPlace:
    level_m: FloatArray | None = None
    if near.grid is not None:
        level_m = crossing(near.grid, design.grid_lines)
    elif near.x_m is not None and near.y_m is not None:
        level_m = frozen([near.x_m, near.y_m])
    return RoughPlace(
        storeys=() if near.storey is None else _storeys(near.storey, design),
        level_m=level_m,
        bearing_rad=_bearing(near, design),
        within_m=near.within_m,
        within_rad=float(np.radians(near.within_deg)),
    )


def _bearing(near: NearFile, design: BimModel) -> float | None:
    """Return a bearing clockwise from the world's y: where a word counts from north, by the file's own north."""
    if near.bearing_deg is not None:
        return float(np.radians(near.bearing_deg))
    if near.looking is None:
        return None
    x, y = design.north or (0.0, 1.0)
    return float(np.arctan2(x, y) + np.radians(45.0 * COMPASS.index(near.looking)))


def _storeys(name: str, design: BimModel) -> tuple[str, ...]:
    wanted = name.strip().casefold()
    found = tuple(s.global_id for s in design.storeys if name == s.global_id or s.name.strip().casefold() == wanted)
    if not found:
        raise ValueError(f"the design has no storey '{name[:60]}'; it has {_named([s.name for s in design.storeys])}")
    return found


def crossing(text: str, lines: Sequence[GridLine]) -> FloatArray:
    """Return where two named grid axes cross (2,).

    Raises:
        ValueError: there are no such axes, or they don't cross, or in several places.
    """
    if not lines:
        raise ValueError("the design has no grid; give storey, x_m and y_m")
    labels = {line.label.strip().casefold() for line in lines}
    pairs = [
        (text[: part.start()].strip().casefold(), text[part.end() :].strip().casefold())
        for part in re.finditer(r"[-/, ]", text.strip())
    ]
    pairs = [pair for pair in pairs if set(pair) <= labels]
    if not pairs:
        raise ValueError(
            f"grid '{text[:60]}' names no two axes of the design; it has {_named([x.label for x in lines])}"
        )
    found: list[FloatArray] = []
    for first, second in pairs:
        for one in (line for line in lines if line.label.strip().casefold() == first):
            for other in (line for line in lines if line.label.strip().casefold() == second):
                point = _meeting(one, other)
                if point is not None and not any(np.linalg.norm(point - known) < 0.01 for known in found):
                    found.append(point)
    if len(found) != 1:
        raise ValueError(f"grid '{text[:60]}': these axes cross in {len(found)} places; give x_m and y_m")
    return frozen(found[0])


def _meeting(one: GridLine, other: GridLine) -> FloatArray | None:
    start, way = np.array([one.x1_m, one.y1_m]), np.array([one.x2_m - one.x1_m, one.y2_m - one.y1_m])
    there, across = np.array([other.x1_m, other.y1_m]), np.array([other.x2_m - other.x1_m, other.y2_m - other.y1_m])
    turned = way[0] * across[1] - way[1] * across[0]
    if abs(turned) < 0.1 * np.linalg.norm(way) * np.linalg.norm(across):
        return None
    to = there - start
    point: FloatArray = start + way * ((to[0] * across[1] - to[1] * across[0]) / turned)
    return point


def _named(names: Sequence[str]) -> str:
    shown = ", ".join(name[:40] for name in names[:MOST_NAMED])
    return shown + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "") if names else "none"
