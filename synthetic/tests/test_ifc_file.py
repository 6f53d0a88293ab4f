from datetime import date

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.unit
import ifcopenshell.validate
import numpy as np
import pytest

from asbuilt_synthetic.ifc_file import write_ifc
from asbuilt_synthetic.layout import design
from asbuilt_synthetic.meshes import transform
from asbuilt_synthetic.solids import poured, volume_m3


@pytest.fixture(scope="module", params=[1, 4])
def written(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("ifc") / "design.ifc"
    building = design(request.param)
    write_ifc(building, path)
    return building, ifcopenshell.open(str(path)), path


def test_the_file_is_valid_ifc4_with_no_remark(written):
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(written[1], log)
    assert log.statements == []


def test_geometry_in_world_metres_agrees_with_the_meshes_to_a_tenth_of_a_millimetre(written):
    building, file, _ = written
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    for e in building.elements:
        shape = ifcopenshell.geom.create_shape(settings, file.by_guid(e.global_id))
        theirs = np.array(shape.geometry.verts).reshape(-1, 3)
        ours = transform(building.world_from_local, poured(e, e.height_m, 0, 0).vertices_m)
        if e.shape == "round":  # tessellated differently: both on the same circle
            axis = transform(building.world_from_local, e.local_from_element[None, :3, 3])[0, :2]
            for v in (ours, theirs):
                r = np.linalg.norm(v[:, :2] - axis, axis=1)
                assert np.abs(r[r > 0.01] - e.length_m / 2).max() < 1e-4
            assert np.allclose(
                [ours[:, 2].min(), ours[:, 2].max()], [theirs[:, 2].min(), theirs[:, 2].max()], atol=1e-4
            )
        else:
            gap = np.linalg.norm(ours[:, None] - theirs[None], axis=2)
            assert gap.min(0).max() < 1e-4
            assert np.abs(ours.min(0) - theirs.min(0)).max() < 1e-4 and np.abs(ours.max(0) - theirs.max(0)).max() < 1e-4


def test_the_site_lies_far_off_and_turned_and_lengths_are_millimetres(written):
    building, file, _ = written
    assert ifcopenshell.util.unit.calculate_unit_scale(file) == pytest.approx(0.001)
    m = building.world_from_local
    assert np.linalg.norm(m[:2, 3]) > 400 and 17 <= np.rad2deg(np.arctan2(m[1, 0], m[0, 0])) <= 40


def test_every_wall_and_column_is_the_product_of_one_dated_task(written):
    building, file, _ = written
    of_element = {}
    for rel in file.by_type("IfcRelAssignsToProduct"):
        of_element.setdefault(rel.RelatingProduct.GlobalId, []).extend(rel.RelatedObjects)
    for e in building.vertical:
        (task,) = of_element[e.global_id]
        start, finish = (str(t)[:10] for t in (task.TaskTime.ScheduleStart, task.TaskTime.ScheduleFinish))
        assert date.fromisoformat(start) < date.fromisoformat(finish)


def test_cost_items_carry_a_rate_and_the_planned_quantity_of_their_elements(written):
    building, file, _ = written
    item = next(i for i in file.by_type("IfcCostItem") if i.Identification == "1.1")
    planned = sum(q.VolumeValue for q in item.CostQuantities)
    assert planned == pytest.approx(sum(volume_m3(e) for e in building.vertical if e.storey == 0), abs=0.01)
    assert item.CostValues[0].AppliedValue.wrappedValue == 245.0
    controlled = [
        p for r in file.by_type("IfcRelAssignsToControl") if r.RelatingControl == item for p in r.RelatedObjects
    ]
    assert {p.GlobalId for p in controlled} == {e.global_id for e in building.vertical if e.storey == 0}


def test_the_same_seed_writes_the_same_bytes(written, tmp_path):
    building, _, path = written
    write_ifc(building, tmp_path / "design.ifc")
    assert (tmp_path / "design.ifc").read_bytes() == path.read_bytes()
