"""What leads back to itself is refused by name before any geometry is drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.errors import DesignError
from asbuilt_bim.ifc.read.circles import MAX_DEPTH
from asbuilt_bim.ifc.read.design import read_design
from tests.ifc.models import ModelBuilder

Tie = Callable[[ModelBuilder, Any], None]


def solid_of(product: Any) -> Any:
    return product.Representation.Representations[0].Items[0]


def cut(builder: ModelBuilder, first: Any, second: Any) -> Any:
    return builder.make("IfcBooleanResult", Operator="UNION", FirstOperand=first, SecondOperand=second)


def placement_on_itself(builder: ModelBuilder, wall: Any) -> None:
    wall.ObjectPlacement.PlacementRelTo = wall.ObjectPlacement


def storey_on_its_wall(builder: ModelBuilder, wall: Any) -> None:
    builder.levels[0].ObjectPlacement.PlacementRelTo = wall.ObjectPlacement


def boolean_in_itself(builder: ModelBuilder, wall: Any) -> None:
    result = cut(builder, solid_of(wall), solid_of(wall))
    result.FirstOperand = result
    wall.Representation.Representations[0].Items = [result]


def two_units_of_each_other(builder: ModelBuilder, wall: Any) -> None:
    dimensions = builder.make("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
    units = [
        builder.make("IfcConversionBasedUnit", Dimensions=dimensions, UnitType="LENGTHUNIT", Name=name) for name in "ab"
    ]
    for unit, other in zip(units, reversed(units), strict=True):
        value = builder.make("IfcRatioMeasure", 2.0)
        unit.ConversionFactor = builder.make("IfcMeasureWithUnit", ValueComponent=value, UnitComponent=other)
    assignment = builder.project.UnitsInContext
    assignment.Units = [units[0], *assignment.Units[1:]]


def map_of_itself(builder: ModelBuilder, wall: Any) -> None:
    body = wall.Representation.Representations[0]
    origin = builder.make("IfcAxis2Placement3D", Location=builder.make("IfcCartesianPoint", (0.0, 0.0, 0.0)))
    source = builder.make("IfcRepresentationMap", MappingOrigin=origin, MappedRepresentation=body)
    target = builder.make(
        "IfcCartesianTransformationOperator3D", LocalOrigin=builder.make("IfcCartesianPoint", (0.0, 0.0, 0.0))
    )
    body.Items = [builder.make("IfcMappedItem", MappingSource=source, MappingTarget=target)]


def wall_that_is_its_own_part(builder: ModelBuilder, wall: Any) -> None:
    builder.parts(wall, [wall, wall])


@pytest.mark.parametrize(
    ("tie", "what"),
    [
        (placement_on_itself, "placements lead back to themselves"),
        (storey_on_its_wall, "placements lead back to themselves"),
        (boolean_in_itself, "solids lead back to themselves"),
        (map_of_itself, "solids lead back to themselves"),
        (two_units_of_each_other, "units lead back to themselves"),
        (wall_that_is_its_own_part, "parts lead back to themselves"),
    ],
)
def test_what_leads_back_to_itself_is_refused_by_name(tie: Tie, what: str, tmp_path: Path) -> None:
    builder = ModelBuilder()
    tie(builder, builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0)))
    with pytest.raises(DesignError, match=rf"tied\.ifc: its {what} \(#\d+ Ifc.*export it again"):
        read_design(builder.write(tmp_path / "tied.ifc"))


def test_a_tree_of_cuts_that_doubles_at_every_level_is_refused_before_it_is_drawn(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    tree = solid_of(wall)
    for _ in range(24):
        tree = cut(builder, tree, tree)
    wall.Representation.Representations[0].Items = [tree]
    with pytest.raises(DesignError, match="stands for over 100,000 cuts and copies; export it with simpler geometry"):
        read_design(builder.write(tmp_path / "tree.ifc"))


@pytest.mark.parametrize("deeper", [-5, 0])
def test_a_nest_of_cuts_is_refused_where_it_is_too_deep_to_follow(deeper: int, tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    placement = wall.ObjectPlacement
    for _ in range(MAX_DEPTH + deeper):
        placement = builder.make(
            "IfcLocalPlacement", PlacementRelTo=placement, RelativePlacement=placement.RelativePlacement
        )
    wall.ObjectPlacement = placement
    path = builder.write(tmp_path / "nest.ifc")
    if deeper < 0:
        assert len(read_design(path).elements) == 1
    else:
        with pytest.raises(DesignError, match=f"placements are nested over {MAX_DEPTH} deep"):
            read_design(path)


def test_an_element_that_is_cut_by_a_column_is_refused_by_name(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    builder.opening(wall, (0.5, 0.0, 0.5), (1.0, 0.2, 1.0))
    path = builder.write(tmp_path / "retyped.ifc")
    text = path.read_text(encoding="utf-8")
    entity = next(line for line in text.splitlines() if "=IFCOPENINGELEMENT(" in line)
    path.write_text(text.replace(entity, entity.replace("IFCOPENINGELEMENT", "IFCCOLUMN")), encoding="utf-8")
    with pytest.raises(DesignError, match=r"IfcRelVoidsElement cuts an element by #\d+ IfcColumn, which is no opening"):
        read_design(path)


def test_products_that_share_one_drawing_lead_to_no_circle(tmp_path: Path) -> None:
    builder = ModelBuilder()
    first = builder.mirrored("IfcColumn", "A", (0.4, 0.4, 3.0))
    second = builder.bare("IfcColumn", "B")
    second.Representation = first.Representation
    assert len(read_design(builder.write(tmp_path / "shared.ifc")).elements) == 2
