"""Files that nobody here made: read or refused by name, and a copy with ours in it is no worse than its source."""

from __future__ import annotations

import os
from pathlib import Path

import ifcopenshell
import ifcopenshell.validate
import numpy as np
import pytest

from asbuilt_bim.bim.cells import cell_samples, element_cells
from asbuilt_bim.bim.mesh import turned_outwards
from asbuilt_bim.errors import DesignError
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.transform import inverse
from asbuilt_bim.ifc.geometry.bodies import read_bodies
from asbuilt_bim.ifc.geometry.faces import design_faces
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.units import read_units
from asbuilt_bim.ifc.write.copy import write_asbuilt
from tests.ifc.reports import report_on

DATA = Path(os.environ.get("ASBUILT_BIM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "ifc"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the shared IFC files are not here (ASBUILT_BIM_DATA)")

READ = {  # file: elements
    "bimserver/compare_by_guid_rev_2.ifc": 4,
    "bimserver/vectorworks_sjis.ifc": 16,
    "bimwhale/ManySimpleWalls.ifc": 3,
    "geometry/building_element_configuration_wall.ifc": 1,
    "geometry/construction_scheduling_task.ifc": 4,
    "ifc43/models/building-elements/wall-extrusion/wall-extruded-solid.ifc": 1,
    "ifc43/models/placements-and-gis-referencing/grid-placement/grid-placement.ifc": 25,
    "misc/Ifc4_SampleHouse.ifc": 5,
    "schependomlaan/YTONG-Kavel 01.ifc": 31,
    "units/Revit(2014,Wall(Edit_Profile('Top Arc')))--IFCExporter(2_9_0,CV_2_0).ifc": 1,
    "units/Revit(2014,Wall(Walls_Joins(Clean)))--IFCExporter(2_9_0,CV_2_0).ifc": 2,
}
REFUSED = {
    "bimserver/ADT-FZK-Haus-2005-2006.ifc": "IFC2X_FINAL",
    "bimserver/doubleguids.ifc": "couldn't be told apart",
    "bimserver/errorfile.ifc": "no IfcWall or IfcColumn",
    "geometry/IfcCShapeProfileDef.ifc": "no IfcWall or IfcColumn",
    "thatopen/KIT-Simple-Road-Test-Web-IFC4x3_RC2.ifc": "IFC4X3_RC2",
}


@pytest.mark.parametrize("name", READ)
def test_a_real_file_is_read_with_cells_and_samples(name: str) -> None:
    design = read_design(DATA / name)
    assert len(design.elements) == READ[name]
    for element in design.elements:
        cells, samples = element_cells(element), cell_samples(element)
        assert 0 < cells.count <= cells.weight.size
        assert samples.area_m2.sum() == pytest.approx(element.exposed_area_m2, rel=1e-6)
        assert all(face.exposed_area_m2 <= face.area_m2 + 1e-6 for face in element.faces)
        assert len({face.face_id for face in element.faces}) == len(element.faces)
        assert 0.05 < element.height_m < 100.0


@pytest.mark.parametrize("name", REFUSED)
def test_a_real_file_that_cannot_be_used_is_refused_by_name(name: str) -> None:
    with pytest.raises(DesignError, match=REFUSED[name]) as caught:
        read_design(DATA / name)
    assert name.rsplit("/", 1)[1] in str(caught.value)


def test_the_kernel_overlooks_a_unit_and_the_wall_is_still_three_metres_long() -> None:
    (wall,) = read_design(DATA / "geometry/building_element_configuration_wall.ifc").elements
    assert (wall.length_m, wall.thickness_m, wall.height_m) == pytest.approx((3.0, 0.3, 2.0))


def test_a_tessellated_column_in_inches_has_its_area_in_square_metres() -> None:
    folder = DATA / "ifc43/models/tessellated-shape/column-straight-rectangle-tessellation"
    (column,) = read_design(folder / "column-straight-rectangle-tessellation.ifc").elements
    assert column.exposed_area_m2 == pytest.approx(4 * 8 * 0.0254 * 120 * 0.0254, rel=1e-6)


def test_the_institutes_two_round_columns_are_cylinders_of_their_known_size() -> None:
    file = open_ifc(DATA / "bimserver/AC11-Institute-Var-2-IFC.ifc")
    bodies = read_bodies(file, file.by_type("IfcColumn"), read_units(file).length_scale)
    assert len(bodies) == 2
    for body in bodies.values():
        mesh = turned_outwards(body.mesh)
        (face,) = design_faces(mesh, "x", "column", np.eye(4), inverse(body.world_from_local))
        assert isinstance(face.frame, CylinderFrame)
        assert face.frame.radius_m == pytest.approx(0.10, abs=1e-3)
        assert face.area_m2 == pytest.approx(2.0 * np.pi * 0.10 * 2.70, rel=0.01)


@pytest.mark.parametrize("name", ["bimserver/compare_by_guid_rev_2.ifc", "geometry/construction_scheduling_task.ifc"])
def test_a_copy_of_a_real_file_has_all_its_entities_and_no_new_error(name: str, tmp_path: Path) -> None:
    design = read_design(DATA / name)
    report = report_on(design, {element.name: 0.5 for element in design.elements})
    target = tmp_path / "copy.ifc"
    write_asbuilt(DATA / name, report, target)
    before, after = ifcopenshell.open(str(DATA / name)), ifcopenshell.open(str(target))
    changed = {"IfcTask", "IfcTaskTime"}
    assert all(str(after.by_id(one.id())) == str(one) for one in before if one.is_a() not in changed)

    def complaints(path: Path) -> set[str]:
        logger = ifcopenshell.validate.json_logger()
        ifcopenshell.validate.validate(str(path), logger)
        return {f"{one.get('type')} {one.get('attribute')} {one.get('message')}" for one in logger.statements}

    assert complaints(target) <= complaints(DATA / name)
