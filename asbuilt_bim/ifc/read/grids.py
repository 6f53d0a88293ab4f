"""Placements at grid intersections, which the geometry kernel doesn't know, as local placements."""

from typing import Any

import ifcopenshell.util.element
import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray

_PARALLEL = 1e-6


def settle_grid_placements(file: Any) -> None:
    """Put a local placement in the place of each grid placement of an open file, which isn't written again.

    Axes that aren't straight, or don't meet, leave the placement as it is: its elements have no usable body then.
    """
    for placement in file.by_type("IfcGridPlacement"):
        grid = _grid_of(placement.PlacementLocation)
        found = _corner(placement.PlacementLocation)
        if grid is None or found is None:
            continue
        origin, along = found
        local = file.create_entity(
            "IfcLocalPlacement",
            PlacementRelTo=grid.ObjectPlacement,
            RelativePlacement=file.create_entity(
                "IfcAxis2Placement3D",
                Location=file.create_entity("IfcCartesianPoint", origin.tolist()),
                Axis=file.create_entity("IfcDirection", [0.0, 0.0, 1.0]),
                RefDirection=file.create_entity("IfcDirection", [*_turned(placement, origin, along).tolist(), 0.0]),
            ),
        )
        for user in file.get_inverse(placement):
            ifcopenshell.util.element.replace_attribute(user, placement, local)


def _turned(placement: Any, origin: FloatArray, along: FloatArray) -> FloatArray:
    """Return the plan direction (2,) of a placement's x axis: towards what it names, else along the first grid axis."""
    named = placement.PlacementRefDirection
    if named is None:
        return along
    if named.is_a("IfcDirection"):
        return np.array(named.DirectionRatios[:2], dtype=np.float64)
    other = _corner(named)
    towards = along if other is None else (other[0] - origin)[:2]
    return towards if np.linalg.norm(towards) > 0.0 else along


def _grid_of(crossing: Any) -> Any:
    axis = crossing.IntersectingAxes[0]
    return next((grid for part in ("PartOfU", "PartOfV", "PartOfW") for grid in getattr(axis, part) or ()), None)


def _corner(crossing: Any) -> tuple[FloatArray, FloatArray] | None:
    """Return where two straight axes meet (3,), offsets to their left and upwards, and the first one's direction (2,).

    None where one is curved, or they are parallel.
    """
    first, second = (line_of(axis) for axis in crossing.IntersectingAxes[:2])
    if first is None or second is None:
        return None
    offsets = [*crossing.OffsetDistances, 0.0]
    (p, d), (q, e) = first, second
    p = p + offsets[0] * np.array([-d[1], d[0]])
    q = q + offsets[1] * np.array([-e[1], e[0]])
    across = d[0] * e[1] - d[1] * e[0]
    if abs(across) < _PARALLEL:
        return None
    t = ((q - p)[0] * e[1] - (q - p)[1] * e[0]) / across
    return np.array([*(p + t * d), offsets[2]], dtype=np.float64), d


def line_of(axis: Any) -> tuple[FloatArray, FloatArray] | None:
    """Return a point (2,) and the unit direction (2,) of a straight grid axis."""
    curve = axis.AxisCurve
    if curve.is_a("IfcPolyline") and len(curve.Points) == 2:
        start, end = (np.array(point.Coordinates[:2], dtype=np.float64) for point in curve.Points)
        along = end - start
    elif curve.is_a("IfcLine"):
        start = np.array(curve.Pnt.Coordinates[:2], dtype=np.float64)
        along = np.array(curve.Dir.Orientation.DirectionRatios[:2], dtype=np.float64)
    else:
        return None
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return None
    return start, (along if axis.SameSense else -along) / length
