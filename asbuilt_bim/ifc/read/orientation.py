"""What turns a plan the right way up for people: north, and the straight axes of the grids."""

import math
from collections.abc import Sequence
from typing import Any

import ifcopenshell.util.placement
import numpy as np

from asbuilt_bim.bim.model import GridLine
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.ifc.read.federation import Member
from asbuilt_bim.ifc.read.grids import line_of

MOST_LINES = 400
"""A plan with more axes shows nothing; a file may hold millions."""
_LABEL = 12


def read_north(members: Sequence[Member]) -> tuple[float, float] | None:
    """Return where north points in the world's x and y (unit), None where no file says it.

    TrueNorth of the first file's model context; else the map's north, which differs from it by a degree or two.
    """
    for context in members[0].file.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        direction = getattr(context, "TrueNorth", None)
        if direction is None or len(direction.DirectionRatios) < 2:
            continue
        x, y = (float(ratio) for ratio in direction.DirectionRatios[:2])
        length = math.hypot(x, y)
        if length > 0.0 and math.isfinite(length):
            return x / length, y / length
    map_ = members[0].georeference
    return None if map_ is None else (math.sin(map_.turn_rad), math.cos(map_.turn_rad))


def read_grid_lines(members: Sequence[Member]) -> tuple[GridLine, ...]:
    """Return the straight axes of all grids with two ends, in world metres, each once; the first `MOST_LINES`."""
    found: dict[GridLine, None] = {}
    for one in members:
        for grid in one.file.by_type("IfcGrid"):
            place = _world_from_grid(one, grid)
            for axis in (*(grid.UAxes or ()), *(grid.VAxes or ()), *(getattr(grid, "WAxes", None) or ())):
                line = _grid_line(axis, place, one.units.length_scale)
                if line is not None:
                    found[line] = None
                if len(found) >= MOST_LINES:
                    return tuple(found)
    return tuple(found)


def _world_from_grid(one: Member, grid: Any) -> FloatArray:
    """Return the transform (4, 4) from a grid's own frame in metres to the world."""
    local = np.eye(4)
    if grid.ObjectPlacement is not None:
        local = np.asarray(ifcopenshell.util.placement.get_local_placement(grid.ObjectPlacement), dtype=np.float64)
        local[:3, 3] *= one.units.length_scale
    placed: FloatArray = one.world_from_file @ local
    return placed


def _grid_line(axis: Any, world_from_grid: FloatArray, metre: float) -> GridLine | None:
    """Return an axis with both ends, None where it isn't a straight piece or its numbers are none."""
    curve = axis.AxisCurve
    if line_of(axis) is None or not curve.is_a("IfcPolyline"):  # an endless line has no ends to draw
        return None
    ends = np.array([[*point.Coordinates[:2], 0.0] for point in curve.Points], dtype=np.float64) * metre
    (x1, y1, _), (x2, y2, _) = ends @ world_from_grid[:3, :3].T + world_from_grid[:3, 3]
    if not np.isfinite([x1, y1, x2, y2]).all():
        return None
    return GridLine(
        label=str(axis.AxisTag or "")[:_LABEL],
        x1_m=round(float(x1), 4),
        y1_m=round(float(y1), 4),
        x2_m=round(float(x2), 4),
        y2_m=round(float(y2), 4),
    )
