"""What is read from an IFC file, in three schemas and two units, near and far from the origin."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asbuilt_bim.bim.model import BimElement, BimModel
from asbuilt_bim.bim.schedule import TaskLink
from asbuilt_bim.codes import Reason
from asbuilt_bim.geometry.cylinder import CylinderFrame
from asbuilt_bim.geometry.polygon import bounds
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import SCHEMAS, ModelBuilder
from tests.notes import codes, the


def _named(design: BimModel, name: str) -> BimElement:
    return next(element for element in design.elements if element.name == name)


@pytest.mark.parametrize("schema", SCHEMAS)
@pytest.mark.parametrize("millimetres", [True, False])
def test_a_wall_with_an_opening_has_its_areas_in_square_metres(schema: str, millimetres: bool, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema, millimetres=millimetres, origin_m=(81234.5, 455678.25, 12.0), turn_deg=23.0)
    wall = builder.box("IfcWall", "W1", (2.0, 1.0, 0.0), (4.0, 0.25, 3.0), turn_deg=30.0)
    builder.opening(wall, (1.0, -0.5, 0.8), (1.2, 1.5, 1.4))
    design = read_design(builder.write(tmp_path / "wall.ifc"))
    element = _named(design, "W1")
    by_role = {role: sorted(f.area_m2 for f in element.faces if f.role == role) for role in ("side", "end", "reveal")}
    np.testing.assert_allclose(by_role["side"], [12.0 - 1.68] * 2, atol=1e-5)
    np.testing.assert_allclose(by_role["end"], [0.75] * 2, atol=1e-5)
    np.testing.assert_allclose(by_role["reveal"], [0.25 * 1.4] * 2, atol=1e-5)
    assert (element.length_m, element.thickness_m, element.height_m) == pytest.approx((4.0, 0.25, 3.0), abs=1e-6)
    assert element.volume_m3 == pytest.approx(4.0 * 0.25 * 3.0 - 1.2 * 0.25 * 1.4, abs=1e-6)
    assert element.is_concrete is True
    assert design.notes == ()
    assert design.schema == schema


def test_faces_stand_where_the_site_placement_puts_them_and_look_outwards(tmp_path: Path) -> None:
    builder = ModelBuilder(origin_m=(1000.0, 2000.0, 50.0), turn_deg=90.0)
    builder.box("IfcColumn", "C1", (3.0, 0.0, 0.0), (0.4, 0.6, 2.5), level=1)
    element = _named(read_design(builder.write(tmp_path / "c.ifc")), "C1")
    # site turned by 90 degrees: site x is world y, site y is world -x
    low, high = element.vertices_m.min(axis=0), element.vertices_m.max(axis=0)
    np.testing.assert_allclose(low, [999.4, 2003.0, 53.0], atol=1e-6)
    np.testing.assert_allclose(high, [1000.0, 2003.4, 55.5], atol=1e-6)
    centre = (low + high) / 2.0
    assert len(element.faces) == 4
    for face in element.faces:
        (rings,) = face.rings_uv_m
        corner = face.frame.from_uv(rings[0].mean(axis=0))
        assert (corner - centre) @ face.frame.normal > 0.19
        assert face.frame.v[2] == pytest.approx(1.0)


def test_storeys_come_from_below_in_world_metres_and_hold_their_elements(tmp_path: Path) -> None:
    builder = ModelBuilder(origin_m=(0.0, 0.0, 50.0))
    builder.box("IfcColumn", "up", (0.0, 0.0, 0.0), (0.4, 0.4, 2.5), level=1)
    builder.box("IfcColumn", "down", (0.0, 0.0, 0.0), (0.4, 0.4, 2.5), level=0)
    design = read_design(builder.write(tmp_path / "s.ifc"))
    assert [storey.elevation_m for storey in design.storeys] == pytest.approx([50.0, 53.0])
    assert _named(design, "up").storey == design.storeys[1].global_id


def test_a_round_column_is_one_mantle_with_its_whole_girth(tmp_path: Path) -> None:
    builder = ModelBuilder(origin_m=(5000.0, -3000.0, 0.0), turn_deg=17.0)
    builder.cylinder("R", (1.0, 2.0, 0.0), 0.25, 3.0)
    (face,) = _named(read_design(builder.write(tmp_path / "r.ifc")), "R").faces
    assert isinstance(face.frame, CylinderFrame)
    assert face.frame.radius_m == pytest.approx(0.25, abs=1e-5)
    assert bounds(face.rings_uv_m) == pytest.approx((-np.pi * 0.25, 0.0, np.pi * 0.25, 3.0), abs=1e-4)
    assert face.area_m2 == pytest.approx(2.0 * np.pi * 0.25 * 3.0, rel=1e-4)
    assert face.role == "side"


@pytest.mark.parametrize("with_axis", [False, True])
def test_a_wall_without_a_body_takes_the_geometry_of_its_parts(with_axis: bool, tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.bare("IfcWall", "layers")
    if with_axis:
        builder.axis_only(wall)
    layers = [
        builder.box("IfcBuildingElementPart", f"layer {i}", (0.0, 0.1 * i, 0.0), (2.0, 0.1, 2.5), level=None)
        for i in range(2)
    ]
    builder.parts(wall, layers)
    design = read_design(builder.write(tmp_path / "p.ifc"))
    (element,) = design.elements
    assert element.thickness_m == pytest.approx(0.2)
    # the joint between the layers is no surface that could be seen
    assert element.exposed_area_m2 == pytest.approx(2.0 * 2.0 * 2.5 + 4.0 * 0.1 * 2.5, abs=1e-3)
    assert not design.obstacles


def test_an_element_without_a_body_is_named_in_the_notes(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcColumn", "solid", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    for number in range(7):
        builder.bare("IfcColumn", f"ghost {number}")
    design = read_design(builder.write(tmp_path / "g.ifc"))
    assert [element.name for element in design.elements] == ["solid"]
    (note,) = design.notes
    assert note.code == Reason.NO_BODY and note.values["count"] == 7
    assert "ghost 0" in note_words(note) and note_words(note).endswith("and 2 more")


def test_a_wall_assigned_to_a_space_still_finds_its_storey(tmp_path: Path) -> None:
    builder = ModelBuilder()
    wall = builder.box("IfcWall", "in space", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0), level=None)
    space = builder.rooted("IfcSpace", Name="room", CompositionType="ELEMENT")
    builder.parts(builder.levels[1], [space])
    builder.rooted("IfcRelContainedInSpatialStructure", RelatedElements=[wall], RelatingStructure=space)
    design = read_design(builder.write(tmp_path / "space.ifc"))
    assert design.elements[0].storey == builder.levels[1].GlobalId


def test_a_column_in_an_assembly_and_a_wall_in_a_wall_find_the_storey_of_what_holds_them(tmp_path: Path) -> None:
    builder = ModelBuilder()
    assembly = builder.bare("IfcElementAssembly", "frame", level=1)
    builder.parts(assembly, [builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0), level=None)])
    builder.box("IfcWall", "W", (5.0, 0.0, 0.0), (2.0, 0.2, 3.0), level=0)
    design = read_design(builder.write(tmp_path / "nested.ifc"))
    assert _named(design, "C").storey == builder.levels[1].GlobalId
    assert _named(design, "W").storey == builder.levels[0].GlobalId
    assert design.notes == ()


def test_two_storeys_of_one_name_in_one_file_stay_two(tmp_path: Path) -> None:
    builder = ModelBuilder(storeys=2)
    for number, level in enumerate(builder.levels):
        level.Name = "Level"
        level.ObjectPlacement.RelativePlacement.Location.Coordinates = (0.0, 0.0, 0.0)
        builder.box("IfcColumn", f"C{number}", (5.0 * number, 0.0, 0.0), (0.4, 0.4, 3.0), level=number)
    design = read_design(builder.write(tmp_path / "twins.ifc"))
    assert [storey.name for storey in design.storeys] == ["Level", "Level"]
    assert len({element.storey for element in design.elements}) == 2


def test_a_file_without_a_storey_is_read_and_says_that_its_elements_count_in_the_whole_only(tmp_path: Path) -> None:
    builder = ModelBuilder(storeys=0)
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    design = read_design(builder.write(tmp_path / "flat.ifc"))
    assert (design.storeys, design.elements[0].storey) == ((), "")
    assert the(design.notes, Reason.NO_STOREY).values == {"count": 1, "storeys": 0}


def test_the_parts_of_a_bridge_stand_in_the_place_of_storeys(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC4X3", storeys=0)
    pier, deck = builder.bridge_part("Pier 1", 2.0), builder.bridge_part("Deck", 9.0)
    builder.box("IfcColumn", "shaft", (0.0, 0.0, 0.0), (1.2, 1.2, 6.0), level=0)
    builder.box("IfcWall", "parapet", (0.0, 0.0, 0.0), (8.0, 0.3, 1.1), level=1)
    design = read_design(builder.write(tmp_path / "bridge.ifc"))
    assert [(one.name, one.elevation_m) for one in design.storeys] == [("Pier 1", 2.0), ("Deck", 9.0)]
    assert _named(design, "shaft").storey == pier.GlobalId and _named(design, "parapet").storey == deck.GlobalId
    assert Reason.NO_STOREY not in codes(design.notes)


@pytest.mark.parametrize(
    ("material", "concrete"),
    [
        ("Stahlbeton C25/30", True),
        ("Béton armé", True),
        ("Hormigón H-25", True),
        ("Porenbeton", False),
        ("Concrete Masonry Units", False),
        ("Kalkzandsteen", False),
        ("Concreto armado", True),
        ("コンクリート", None),
        ("\u0431\u0435\u0442\u043e\u043d B25", None),
        ("Steinsteypa", None),
        ("Default Wall", None),
        (None, None),
    ],
)
def test_concrete_is_told_from_the_names_of_materials(
    material: str | None, concrete: bool | None, tmp_path: Path
) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0), material=material)
    assert read_design(builder.write(tmp_path / "m.ifc")).elements[0].is_concrete is concrete


@pytest.mark.parametrize("schema", SCHEMAS)
@pytest.mark.parametrize("by_process", [True, False])
def test_tasks_are_read_whichever_way_they_are_tied(schema: str, by_process: bool, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema)
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.task("pour", [column], by_process=by_process)
    (task,) = read_design(builder.write(tmp_path / "t.ifc")).tasks
    assert task.elements == (column.GlobalId,)
    assert task.identification == "pour"
    assert task.schedule_start is not None and task.schedule_start.isoformat() == "2026-02-01T00:00:00"


@pytest.mark.parametrize("schema", SCHEMAS)
def test_tasks_come_with_the_summaries_above_them_and_their_predecessors(schema: str, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema)
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    first, second = builder.task("rebar", [column]), builder.task("pour", [column])
    floor, whole = builder.task("Ground floor", [], time=False), builder.task("Shell", [], time=False)
    builder.rooted("IfcRelNests", RelatingObject=floor, RelatedObjects=[first, second])
    builder.rooted("IfcRelNests", RelatingObject=whole, RelatedObjects=[floor])
    two_days = 172800.0
    if schema != "IFC2X3":
        two_days = builder.make("IfcLagTime", LagValue=builder.make("IfcDuration", "P2D"), DurationType="WORKTIME")
    builder.rooted(
        "IfcRelSequence", RelatingProcess=first, RelatedProcess=second, TimeLag=two_days, SequenceType="START_START"
    )
    rebar, pour = read_design(builder.write(tmp_path / "t.ifc")).tasks
    assert rebar.outline == pour.outline == ("Shell", "Ground floor")
    assert pour.links == (TaskLink(predecessor=first.GlobalId, kind="SS", lag_h=48.0),)
    assert rebar.links == ()


def test_cost_lines_keep_their_own_unit_and_rate(tmp_path: Path) -> None:
    builder = ModelBuilder()
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.cost("concrete", [column], "IfcQuantityVolume", 0.48, 210.0)
    builder.cost("formwork", [column], "IfcQuantityArea", 4.8, 38.5)
    lines = read_design(builder.write(tmp_path / "k.ifc")).cost_lines
    assert [(line.unit, line.measure, line.planned_quantity, line.rate, line.currency) for line in lines] == [
        ("m3", "volume", pytest.approx(0.48), 210.0, "EUR"),
        ("m2", "area", pytest.approx(4.8), 38.5, "EUR"),
    ]


def test_a_scope_picks_elements_and_leaves_the_others_as_obstacles(tmp_path: Path) -> None:
    builder = ModelBuilder()
    builder.box("IfcWall", "W", (0.0, 0.0, 0.0), (2.0, 0.2, 3.0))
    builder.box("IfcColumn", "C", (2.0, 0.0, 0.0), (0.2, 0.2, 3.0))
    design = read_design(builder.write(tmp_path / "scope.ifc"), scope="IfcWall")
    assert [element.name for element in design.elements] == ["W"]
    assert [obstacle.ifc_class for obstacle in design.obstacles] == ["IfcColumn"]
    # the wall's end that touches the column can't be seen
    assert min(face.exposed_area_m2 for face in design.elements[0].faces) == 0.0


def test_face_ids_outlive_moving_the_site_and_renumbering(tmp_path: Path) -> None:
    ids = []
    for turn, extra in ((0.0, 0), (77.0, 3)):
        builder = ModelBuilder(turn_deg=turn, origin_m=(100.0 * turn, 0.0, 0.0))
        for i in range(extra):
            builder.box("IfcSlab", f"S{i}", (20.0, 20.0, 0.0), (1.0, 1.0, 0.2))
        wall = builder.box("IfcWall", "W", (1.0, 1.0, 0.0), (4.0, 0.125, 3.0))
        builder.opening(wall, (1.0, -0.5, 0.0), (1.0, 1.5, 2.1))
        wall.GlobalId = "0wall00000000000000000"
        design = read_design(builder.write(tmp_path / f"{extra}.ifc"))
        ids.append(sorted(face.face_id for face in design.elements[0].faces))
    assert ids[0] == ids[1]
    assert len(set(ids[0])) == len(ids[0])
    assert all(name.startswith("0wall00000000000000000-") for name in ids[0])


@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_column_at_a_grid_crossing_stands_there_turned_along_the_first_axis(schema: str, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema, origin_m=(100.0, 0.0, 10.0))

    def axis(tag: str, *ends: tuple[float, float]) -> Any:
        points = [builder.make("IfcCartesianPoint", tuple(1000.0 * v for v in end)) for end in ends]
        return builder.make(
            "IfcGridAxis", AxisTag=tag, AxisCurve=builder.make("IfcPolyline", Points=points), SameSense=True
        )

    a, one = axis("A", (3.0, -5.0), (3.0, 5.0)), axis("1", (0.0, 2.0), (9.0, 2.0))
    builder.rooted("IfcGrid", UAxes=[a], VAxes=[one], ObjectPlacement=builder.levels[0].ObjectPlacement)
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.6, 0.4, 2.5))
    crossing = builder.make(
        "IfcVirtualGridIntersection", IntersectingAxes=[a, one], OffsetDistances=(-500.0, 250.0, 100.0)
    )
    column.ObjectPlacement = builder.make("IfcGridPlacement", PlacementLocation=crossing)
    (element,) = read_design(builder.write(tmp_path / "grid.ifc")).elements
    # half a metre right of A (which runs along y), a quarter left of 1, a tenth up; its length along A
    low, high = element.vertices_m.min(axis=0), element.vertices_m.max(axis=0)
    np.testing.assert_allclose(low, [103.5 - 0.4, 2.25, 10.1], atol=1e-6)
    np.testing.assert_allclose(high, [103.5, 2.25 + 0.6, 12.6], atol=1e-6)


@pytest.mark.parametrize(
    ("start", "finish", "says"),
    [
        ("2026-99-99T08:00:00", "2026-02-14T00:00:00", "its start '2026-99-99T08:00:00' is no date"),
        ("2026-02-01T00:00:00", "soon", "its finish 'soon' is no date"),
        ("2026-02-14T00:00:00", "2026-02-01T00:00:00", "its finish 2026-02-01 is before its start 2026-02-14"),
    ],
)
def test_task_dates_that_cannot_be_are_left_out_and_said(start: str, finish: str, says: str, tmp_path: Path) -> None:
    builder = ModelBuilder()
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    bad, _ = (builder.task(name, [column]) for name in ("rebar", "pour"))
    bad.TaskTime.ScheduleStart, bad.TaskTime.ScheduleFinish = start, finish
    design = read_design(builder.write(tmp_path / "plan.ifc"))
    dates = {task.name: (task.schedule_start, task.schedule_finish) for task in design.tasks}
    assert dates == {"rebar": (None, None), "pour": (datetime(2026, 2, 1), datetime(2026, 2, 14, 17))}
    assert any(words.startswith(f"task rebar: {says}") for words in map(note_words, design.notes))


def test_an_ifc2x3_time_without_its_minute_and_second_is_one(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC2X3")
    builder.task("pour", [builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))])
    (control,) = builder.file.by_type("IfcScheduleTimeControl")
    clock = control.ScheduleStart.TimeComponent
    clock.HourComponent, clock.MinuteComponent, clock.SecondComponent = 7, None, None
    design = read_design(builder.write(tmp_path / "plan.ifc"))
    assert [task.schedule_start for task in design.tasks] == [datetime(2026, 2, 1, 7)]
    assert Reason.DATE_UNREADABLE not in codes(design.notes)


def test_tasks_of_a_baseline_beside_the_plan_are_said_to_count_like_it(tmp_path: Path) -> None:
    builder = ModelBuilder()
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    for name, kind in (("Plan", "PLANNED"), ("Tender", "BASELINE")):
        schedule = builder.rooted("IfcWorkSchedule", Name=name, PredefinedType=kind)
        summary = builder.task(f"all of {name}", [])
        builder.rooted("IfcRelNests", RelatingObject=summary, RelatedObjects=[builder.task(name, [column])])
        builder.rooted("IfcRelAssignsToControl", RelatedObjects=[summary], RelatingControl=schedule)
        design = read_design(builder.write(tmp_path / "m.ifc"))
        assert (Reason.WORK_SCHEDULES_SEVERAL in codes(design.notes)) is (name == "Tender")
    values = the(design.notes, Reason.WORK_SCHEDULES_SEVERAL).values
    assert values == {"count": 2, "schedules": ("Plan (PLANNED)", "Tender (BASELINE)")}


def test_a_task_with_other_dates_in_each_of_its_schedules_has_no_plan(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC2X3")
    column = builder.box("IfcColumn", "C", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    task = builder.task("pour", [column])
    (relation,) = builder.file.by_type("IfcRelAssignsTasks")
    (control,) = builder.file.by_type("IfcScheduleTimeControl")
    again = builder.rooted("IfcScheduleTimeControl", Name="again", ScheduleStart=control.ScheduleStart)
    builder.rooted(
        "IfcRelAssignsTasks", RelatedObjects=[task], RelatingControl=relation.RelatingControl, TimeForTask=again
    )
    same = read_design(builder.write(tmp_path / "m.ifc"))
    assert same.tasks[0].schedule_start == datetime(2026, 2, 1) and Reason.PLANS_DIFFER not in codes(same.notes)
    again.ScheduleStart = None
    other = read_design(builder.write(tmp_path / "m.ifc"))
    assert other.tasks[0].schedule_start is None
    assert the(other.notes, Reason.PLANS_DIFFER).values == {"task": "pour", "schedules": 2}
