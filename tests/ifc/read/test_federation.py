"""Several files are one design: who owns what, where each lies, and into which file the result goes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import ifcopenshell
import ifcopenshell.util.element
import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import DesignError, ResultError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import write_asbuilt
from asbuilt_bim.ifc.write.federation import write_copies
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import ModelBuilder
from tests.ifc.reports import report_on
from tests.notes import codes, the
from tests.report.sample_report import sample_report


def _named(design: BimModel, name: str) -> BimElement:
    return next(element for element in design.elements if element.name == name)


def _on_map(builder: ModelBuilder, east_m: float, north_m: float, turn_deg: float, crs: str = "EPSG:25832") -> None:
    metre = builder.make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    builder.make(
        "IfcMapConversion",
        SourceCRS=builder.context,
        TargetCRS=builder.make("IfcProjectedCRS", Name=crs, MapUnit=metre),
        Eastings=east_m,
        Northings=north_m,
        OrthogonalHeight=0.0,
        XAxisAbscissa=math.cos(math.radians(turn_deg)),
        XAxisOrdinate=math.sin(math.radians(turn_deg)),
    )


def _pair(folder: Path) -> tuple[Path, Path]:
    """A structure in millimetres with a wall and a task, an architecture in metres with a column and a slab."""
    structure = ModelBuilder(schema="IFC2X3")
    wall = structure.box("IfcWall", "W", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    structure.task("pour", [wall])
    architecture = ModelBuilder(schema="IFC4", millimetres=False)
    architecture.box("IfcColumn", "C", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    architecture.box("IfcSlab", "S", (0.0, 0.2, 2.8), (4.0, 3.0, 0.2))
    column = architecture.file.by_type("IfcColumn")[0]
    architecture.cost("concrete", [column], "IfcQuantityVolume", 0.48, 245.0)
    return structure.write(folder / "structure.ifc"), architecture.write(folder / "architecture.ifc")


def test_two_files_of_other_schemas_and_units_are_one_design_that_touches_itself(tmp_path: Path) -> None:
    structure, architecture = _pair(tmp_path)
    design = read_design([structure, architecture])
    wall, column = _named(design, "W"), _named(design, "C")
    assert (wall.source, column.source) == (0, 1)
    assert (wall.length_m, column.height_m) == pytest.approx((4.0, 3.0))
    # the other file's slab abuts one side of the wall
    sides = sorted(face.exposed_area_m2 for face in wall.faces if face.role == "side")
    assert sides == pytest.approx([12.0 - 4.0 * 0.2, 12.0], abs=1e-4)
    assert [task.elements for task in design.tasks] == [(wall.global_id,)]
    assert [line.elements for line in design.cost_lines] == [(column.global_id,)]
    assert (design.file_name, design.schema) == ("structure.ifc, architecture.ifc", "IFC2X3, IFC4")
    assert codes(design.notes) == [Reason.NOT_IN_TASKS, Reason.NOT_IN_COST_LINES]
    assert note_words(design.notes[0]) == "walls and columns in no task: 1 of 2"


def test_a_task_and_a_cost_line_of_two_files_have_the_elements_of_both(tmp_path: Path) -> None:
    paths, made = [], []
    for number in (1, 2):
        builder = ModelBuilder(schema="IFC4")
        wall = builder.box("IfcWall", f"W{number}", (0.0, 5.0 * number, 0.0), (4.0, 0.2, 3.0))
        task = builder.task("pour", [wall])
        item = builder.cost("concrete", [wall], "IfcQuantityVolume", 4.8, 245.0)
        task.GlobalId, item.GlobalId = "1SharedTask00000000000", "1SharedCost00000000000"  # as a split export has them
        made.append(wall.GlobalId)
        paths.append(builder.write(tmp_path / f"part{number}.ifc"))
    design = read_design(paths)
    assert [task.elements for task in design.tasks] == [tuple(made)]
    assert [line.elements for line in design.cost_lines] == [tuple(made)]


def test_storeys_of_one_name_and_height_are_one(tmp_path: Path) -> None:
    design = read_design(_pair(tmp_path))
    assert [storey.name for storey in design.storeys] == ["Level 0", "Level 1"]
    assert {element.storey for element in design.elements} == {design.storeys[0].global_id}


def test_what_two_files_hold_counts_for_the_one_named_first_and_does_not_touch_itself(tmp_path: Path) -> None:
    structure, architecture = _pair(tmp_path)
    copy = ifcopenshell.open(str(structure))
    copy.by_type("IfcWall")[0].Name = "W again"
    copy.write(str(tmp_path / "copy.ifc"))
    design = read_design([structure, tmp_path / "copy.ifc", architecture])
    assert sorted(element.name for element in design.elements) == ["C", "W"]
    assert _named(design, "W").exposed_area_m2 > 20.0
    note = the(design.notes, Reason.IN_EARLIER_FILE)
    assert note.subject == about(SubjectKind.FILE, "copy.ifc") and note.values == {"count": 1}


def test_files_on_one_map_meet_in_the_first_ones_world(tmp_path: Path) -> None:
    first, second = ModelBuilder(), ModelBuilder(millimetres=False)
    _on_map(first, 468000.0, 5461000.0, 30.0)
    _on_map(second, 468010.0, 5461000.0, 120.0)
    first.box("IfcColumn", "A", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    second.box("IfcColumn", "B", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    design = read_design([first.write(tmp_path / "a.ifc"), second.write(tmp_path / "b.ifc")])
    low = _named(design, "B").vertices_m[:, :2].mean(axis=0)
    # ten metres east, seen in a frame turned by 30 degrees, and its own x axis along the first one's y
    turned = np.array([10.0 * math.cos(math.radians(-30.0)), 10.0 * math.sin(math.radians(-30.0))])
    np.testing.assert_allclose(low, turned + np.array([-0.2, 0.2]), atol=1e-6)
    assert design.notes == ()


@pytest.mark.parametrize("crs", ["EPSG:31467", ""])
def test_files_on_two_maps_are_taken_to_share_coordinates_and_say_so(crs: str, tmp_path: Path) -> None:
    first, second = ModelBuilder(), ModelBuilder()
    _on_map(first, 468000.0, 5461000.0, 0.0)
    if crs:
        _on_map(second, 500000.0, 5000000.0, 0.0, crs)
    first.box("IfcColumn", "A", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    second.box("IfcColumn", "B", (5.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    design = read_design([first.write(tmp_path / "a.ifc"), second.write(tmp_path / "b.ifc")])
    assert _named(design, "B").vertices_m[:, 0].min() == pytest.approx(5.0)
    assert the(design.notes, Reason.NOT_ON_ONE_MAP).subject == about(SubjectKind.FILE, "b.ifc")


def test_a_file_that_cannot_be_read_is_named_among_several(tmp_path: Path) -> None:
    structure, _ = _pair(tmp_path)
    (tmp_path / "torn.ifc").write_bytes(structure.read_bytes()[:2000])
    with pytest.raises(DesignError, match=r"torn\.ifc: .*cut short"):
        read_design([structure, tmp_path / "torn.ifc"])


def test_each_element_is_written_into_the_file_that_owns_it(tmp_path: Path) -> None:
    sources = _pair(tmp_path)
    spare = ModelBuilder()
    spare.box("IfcSlab", "only a slab", (0.0, 0.0, 5.0), (1.0, 1.0, 0.2))
    paths = [*sources, spare.write(tmp_path / "spare.ifc")]
    design = read_design(paths)
    report = report_on(design, {"W": 1.0, "C": 0.5})
    written = write_copies(paths, report, tmp_path / "out")
    assert [path.name for path in written] == ["structure.asbuilt.ifc", "architecture.asbuilt.ifc"]
    marked = [
        {p.Name for r in ifcopenshell.open(str(path)).by_type("IfcRelDefinesByProperties")
         if r.RelatingPropertyDefinition.Name == "AsBuilt_Progress" for p in r.RelatedObjects if p.is_a("IfcProduct")}
        for path in written
    ]  # fmt: skip
    assert "W" in marked[0] and "C" not in marked[0]
    assert "C" in marked[1] and "W" not in marked[1]
    with pytest.raises(ResultError, match="are in none of these files"):
        write_copies(paths[1:], report, tmp_path / "less")


def test_a_storey_of_several_files_says_whose_numbers_it_has_and_one_of_a_single_file_does_not(tmp_path: Path) -> None:
    sources = _pair(tmp_path)
    for paths in (sources, sources[:1]):
        design = read_design(paths)
        made_from = sample_report().provenance
        assert made_from is not None
        report = report_on(design, {element.name: 1.0 for element in design.elements})
        report = replace(report, provenance=replace(made_from, ifc_name=design.file_name))
        told = set()
        for path in write_copies(paths, report, tmp_path / "out"):
            file = ifcopenshell.open(str(path))
            for storey in file.by_type("IfcBuildingStorey"):
                told.add(ifcopenshell.util.element.get_psets(storey).get("AsBuilt_Progress", {}).get("Files"))
        assert told - {None} == ({design.file_name} if len(paths) > 1 else set())


def test_a_single_file_says_no_files_whatever_name_it_has_meanwhile(tmp_path: Path) -> None:
    source = _pair(tmp_path)[0]
    design = read_design(source)
    made_from = sample_report().provenance
    assert made_from is not None
    report = replace(report_on(design, {"W": 1.0}), provenance=replace(made_from, ifc_name="Haus A, Bau 2.ifc"))
    write_asbuilt(source, report, tmp_path / "out.ifc")
    assert "'Files'" not in (tmp_path / "out.ifc").read_text(encoding="utf-8")


def test_two_files_of_one_name_in_two_folders_get_copies_of_two_names(tmp_path: Path) -> None:
    structure, architecture = _pair(tmp_path)
    paths = []
    for folder, path in (("a", structure), ("b", architecture)):
        (tmp_path / folder).mkdir()
        paths.append(path.rename(tmp_path / folder / "model.ifc"))
    written = write_copies(paths, report_on(read_design(paths), {"W": 1.0, "C": 1.0}), tmp_path / "out")
    assert [path.name for path in written] == ["model.asbuilt.ifc", "model-2.asbuilt.ifc"]
