"""North and the grids' axes, as the plan of a site has them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ifcopenshell
import pytest

from asbuilt_bim.ifc.read import orientation
from asbuilt_bim.ifc.read.federation import member
from asbuilt_bim.ifc.read.orientation import read_grid_lines, read_north


def design(north: tuple[float, float] | None = None, axes: int = 2, millimetres: bool = True) -> Any:
    """A file in millimetres with a grid whose origin stands 10 m along x, turned a quarter to the left."""
    file = ifcopenshell.file(schema="IFC4")
    make = file.create_entity
    prefix = {"Prefix": "MILLI"} if millimetres else {}
    units = make("IfcUnitAssignment", Units=[make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE", **prefix)])
    origin = make("IfcAxis2Placement3D", Location=make("IfcCartesianPoint", [0.0, 0.0, 0.0]))
    towards = make("IfcDirection", list(north)) if north else None
    context = make("IfcGeometricRepresentationContext", ContextType="Model", CoordinateSpaceDimension=3,
                   Precision=1e-5, WorldCoordinateSystem=origin, TrueNorth=towards)  # fmt: skip
    make(
        "IfcProject", GlobalId=ifcopenshell.guid.new(), Name="P", UnitsInContext=units, RepresentationContexts=[context]
    )
    scale = 1000.0 if millimetres else 1.0
    up, along = make("IfcDirection", [0.0, 0.0, 1.0]), make("IfcDirection", [0.0, 1.0, 0.0])
    at = make("IfcCartesianPoint", [10.0 * scale, 0.0, 0.0])
    place = make("IfcAxis2Placement3D", Location=at, Axis=up, RefDirection=along)
    lines = []
    for number in range(axes):
        ends = [[0.0, 3.0 * number * scale], [5.0 * scale, 3.0 * number * scale]]
        curve = make("IfcPolyline", Points=[make("IfcCartesianPoint", end) for end in ends])
        lines.append(make("IfcGridAxis", AxisTag="AB<b>" if number else "1", AxisCurve=curve, SameSense=True))
    circle = make("IfcCircle", Position=make("IfcAxis2Placement2D", make("IfcCartesianPoint", [0.0, 0.0])), Radius=5.0)
    round_one = make("IfcGridAxis", AxisTag="R", AxisCurve=circle, SameSense=True)
    make("IfcGrid", GlobalId=ifcopenshell.guid.new(), UAxes=lines, VAxes=[round_one],
         ObjectPlacement=make("IfcLocalPlacement", RelativePlacement=place))  # fmt: skip
    return file


@pytest.mark.parametrize("millimetres", [True, False])
def test_axes_stand_in_world_metres_where_the_grid_stands(millimetres: bool) -> None:
    lines = read_grid_lines([member(Path("a.ifc"), design(millimetres=millimetres), None)])
    assert [line.label for line in lines] == ["1", "AB<b>"]  # a round axis has no ends
    first, second = lines
    assert (first.x1_m, first.y1_m, first.x2_m, first.y2_m) == pytest.approx((10.0, 0.0, 10.0, 5.0))
    assert (second.x1_m, second.y1_m) == pytest.approx((7.0, 0.0))


def test_north_is_of_length_one_and_none_where_no_file_says_it() -> None:
    assert read_north([member(Path("a.ifc"), design(), None)]) is None
    x, y = read_north([member(Path("a.ifc"), design(north=(-3.0, 4.0)), None)]) or (0.0, 0.0)
    assert (x, y) == pytest.approx((-0.6, 0.8)) and math.hypot(x, y) == pytest.approx(1.0)
    assert read_north([member(Path("a.ifc"), design(north=(0.0, 0.0)), None)]) is None


def test_a_file_with_millions_of_axes_fills_no_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orientation, "MOST_LINES", 5)
    assert len(read_grid_lines([member(Path("a.ifc"), design(axes=9), None)])) == 5
