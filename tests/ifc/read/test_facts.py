"""What `inspect` tells of a file: its place on the map, units, kinds, zones, and what it is refused for."""

from __future__ import annotations

import math
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from asbuilt_bim.ifc.read.design import inspect_file
from asbuilt_bim.terminal.inspect_table import design_tables, fact_tables
from tests.ifc.models import SCHEMAS, ModelBuilder


def _georeferenced(builder: ModelBuilder, scale: float | None = None, **attributes: Any) -> None:
    metre = builder.make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    crs = builder.make("IfcProjectedCRS", Name="EPSG:25832", MapUnit=metre)
    builder.make(
        "IfcMapConversion",
        SourceCRS=builder.context,
        TargetCRS=crs,
        Eastings=468000.5,
        Northings=5461000.25,
        OrthogonalHeight=111.0,
        Scale=scale,
        **attributes,
    )


def _text(path: Path) -> str:
    found = inspect_file(path)
    console = Console(width=300, record=True, file=StringIO())
    for table in (*fact_tables(path.name, found.facts), *(design_tables(found.design) if found.design else ())):
        console.print(table)
    return console.export_text()


@pytest.mark.parametrize("scale", [None, 0.001, 0.0009996, 1000.0])
def test_a_map_conversion_is_read_in_metres_with_its_turn_and_a_scale_that_can_be_one(
    scale: float | None, tmp_path: Path
) -> None:
    builder = ModelBuilder(millimetres=True)
    _georeferenced(builder, scale, XAxisAbscissa=math.cos(0.3), XAxisOrdinate=math.sin(0.3))
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    place = inspect_file(builder.write(tmp_path / "geo.ifc")).facts.georeference
    assert place is not None and place.crs == "EPSG:25832"
    assert place.scale == pytest.approx(0.9996 if scale == 0.0009996 else 1.0)
    on_map = place.map_from_world() @ [10.0, 0.0, 2.0, 1.0]
    expected = [468000.5 + 10.0 * math.cos(0.3), 5461000.25 + 10.0 * math.sin(0.3), 113.0, 1.0]
    np.testing.assert_allclose(on_map, expected)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_kinds_zones_tasks_and_costs_are_counted_in_every_schema(schema: str, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema)
    first = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    builder.box("IfcColumn", "C", (5.0, 0.0, 0.0), (0.3, 0.3, 3.0), level=None, material="Kalkzandsteen")
    builder.task("pour", [first])
    builder.task("tidy up", [])
    space = builder.rooted("IfcSpace", Name="room", CompositionType="ELEMENT")
    zone = builder.rooted("IfcZone", Name="Zone A")
    builder.rooted("IfcRelAssignsToGroup", RelatedObjects=[space], RelatingGroup=zone)
    if schema != "IFC2X3":
        builder.cost("concrete", [first], "IfcQuantityVolume", 1.2, 245.0)
    facts = inspect_file(builder.write(tmp_path / "kinds.ifc")).facts
    assert facts.schema == schema and facts.units == ("mm", "m2", "m3") and facts.currency == "EUR"
    assert {(kind.ifc_class, kind.concrete, kind.placed_in, count) for kind, count in facts.kinds} == {
        ("IfcWall", True, "storey", 1),
        ("IfcColumn", False, "nothing", 1),
    }
    assert facts.zones == (("Zone A", 1),)
    assert (facts.tasks, facts.tasks_assigned) == (2, 1)
    assert (facts.cost_items, facts.cost_has_values) == ((0, False) if schema == "IFC2X3" else (1, True))
    text = _text(tmp_path / "kinds.ifc")
    assert "1 of 2 with" in text and "Kalkzandsteen" in text
    assert ("no cost line is read, and nothing is priced" in text) == (schema == "IFC2X3")


def test_own_quantities_stand_beside_the_geometry_and_wrong_ones_are_counted(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    right = builder.make("IfcQuantityArea", Name="NetSideArea", AreaValue=12.0)
    wrong = builder.make("IfcQuantityVolume", Name="NetVolume", VolumeValue=3.2)
    qto = builder.rooted("IfcElementQuantity", Name="Qto_WallBaseQuantities", Quantities=[right, wrong])
    builder.rooted("IfcRelDefinesByProperties", RelatedObjects=[wall], RelatingPropertyDefinition=qto)
    rows = [" ".join(line.split()) for line in _text(builder.write(tmp_path / "q.ifc")).splitlines()]
    assert any("NetSideArea │ 1 │ 12.00 m² │ 12.00 m² │ 0" in row for row in rows)
    assert any("NetVolume │ 1 │ 3.20 m³ │ 2.40 m³ │ 1" in row for row in rows)


def test_a_file_that_is_refused_still_shows_what_it_holds(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.bare("IfcWall", "ghost")
    found = inspect_file(builder.write(tmp_path / "ghost.ifc"))
    assert found.design is None and "export it with its geometry" in found.refusal
    assert [(kind.ifc_class, count) for kind, count in found.facts.kinds] == [("IfcWall", 1)]


def test_a_name_cannot_steer_the_terminal(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0), material="\x1b[2J\x1b[31mConcrete [bold]")
    text = _text(builder.write(tmp_path / "esc.ifc"))
    assert "\x1b[2J" not in text and "Concrete [bold]" in text


def test_a_file_without_a_project_still_shows_what_it_holds(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    path = builder.write(tmp_path / "bare.ifc")
    path.write_text("\n".join(line for line in path.read_text().splitlines() if "IFCPROJECT(" not in line))
    facts = inspect_file(path).facts
    assert facts.units == ("m", "m2", "m3") and len(facts.kinds) == 1


def test_a_column_of_a_bridge_is_told_to_lie_in_a_part_of_a_facility(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC4X3", storeys=0)
    builder.bridge_part("Pier 1", 0.0)
    builder.box("IfcColumn", "shaft", (0.0, 0.0, 0.0), (1.2, 1.2, 6.0))
    ((kind, number),) = inspect_file(builder.write(tmp_path / "bridge.ifc")).facts.kinds
    assert (kind.placed_in, number) == ("part of a facility", 1)
