"""The IFC copy: ours is there, everything else is as it was, and writing again changes nothing."""

from __future__ import annotations

import errno
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import ifcopenshell.validate
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import strip_asbuilt, write_asbuilt
from asbuilt_bim.progress.completion.planned import verdict
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import SCHEMAS, ModelBuilder
from tests.ifc.reports import report_on

BEST: dict[str, float | None] = {"full": 1.0, "half": 0.5, "none": 0.0, "hidden": None}


def _model(schema: str, folder: Path, millimetres: bool = True) -> Path:
    builder = ModelBuilder(schema=schema, millimetres=millimetres)
    made = {name: builder.box("IfcColumn", name, (2.0 * i, 0.0, 0.0), (0.4, 0.4, 3.0)) for i, name in enumerate(BEST)}
    for name, column in made.items():
        builder.task(f"pour {name}", [column])
    builder.task("pour some", [made["half"], made["hidden"]])
    if schema != "IFC2X3":
        builder.cost("concrete", [made["full"], made["half"]], "IfcQuantityVolume", 0.96, 210.0)
    return builder.write(folder / f"{schema}.ifc")


def _written(schema: str, folder: Path) -> tuple[Path, Path]:
    source = _model(schema, folder)
    target = folder / "out" / f"{schema}.asbuilt.ifc"
    write_asbuilt(source, report_on(read_design(source), BEST), target)
    return source, target


def _psets(file: Any, ifc_class: str, name: str) -> dict[str, dict[str, Any]]:
    (thing,) = [one for one in file.by_type(ifc_class) if one.Name == name]
    return dict(ifcopenshell.util.element.get_psets(thing))


def _without_ids(file: Any) -> list[str]:
    """Every entity as text with references followed, so that line numbers don't count."""

    def text(value: Any, depth: int = 0) -> str:
        if isinstance(value, ifcopenshell.entity_instance):
            inner = ",".join(text(value[i], depth + 1) for i in range(len(value))) if depth < 6 else ""
            return f"{value.is_a()}({inner})"
        if isinstance(value, tuple):
            return "(" + ",".join(text(one, depth) for one in value) + ")"
        return repr(value)

    return sorted(text(entity) for entity in file)


def _complaints(path: Path) -> set[str]:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(path), logger)
    return {f"{one.get('type')} {one.get('attribute')} {one.get('message')}" for one in logger.statements}


@pytest.mark.parametrize("schema", SCHEMAS)
def test_every_element_carries_one_set_of_properties_and_one_of_quantities(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    half = _psets(file, "IfcColumn", "half")
    assert half["AsBuilt_Progress"]["State"] == "part"
    assert half["AsBuilt_Progress"]["CompletionBest"] == pytest.approx(0.5)
    assert half["AsBuilt_Progress"]["DeviationFromDesign"] == pytest.approx(12.0)  # millimetres in this file
    assert half["AsBuilt_Progress"]["VisitDate"] == "2026-03-02"
    assert half["AsBuilt_Quantities"]["AsBuiltArea"] == pytest.approx(1.25)  # square metres in this file
    assert "AsBuiltArea" not in _psets(file, "IfcColumn", "none")["AsBuilt_Quantities"]
    hidden = _psets(file, "IfcColumn", "hidden")["AsBuilt_Progress"]
    assert hidden["State"] == "unknown" and "CompletionBest" not in hidden
    assert (hidden["CompletionLower"], hidden["CompletionUpper"]) == (0.0, 1.0)
    assert hidden["Reason"] == "not seen"  # the code: nobody gave words
    assert half["AsBuilt_Progress"]["TiltMmPerM"] == pytest.approx(10.0, abs=0.01)
    assert "AsBuiltArea" not in _psets(file, "IfcColumn", "hidden")["AsBuilt_Quantities"]


@pytest.mark.parametrize("schema", SCHEMAS)
def test_an_element_that_nobody_has_seen_has_no_day_of_a_visit(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    assert "VisitDate" not in _psets(file, "IfcColumn", "hidden")["AsBuilt_Progress"]


def test_with_words_an_element_says_its_bounds_and_why_it_is_unknown(tmp_path: Path) -> None:
    source = _written("IFC4", tmp_path)[0]
    write_asbuilt(source, report_on(read_design(source), BEST), tmp_path / "words.ifc", words=note_words)
    file = ifcopenshell.open(str(tmp_path / "words.ifc"))
    assert _psets(file, "IfcColumn", "half")["AsBuilt_Progress"]["Summary"] == "at least 45 %, possibly 55 %"
    hidden = _psets(file, "IfcColumn", "hidden")["AsBuilt_Progress"]
    assert hidden["Summary"] == "nothing certain, possibly all"
    assert hidden["Reason"].startswith("Nothing of it was seen")


@pytest.mark.parametrize("schema", SCHEMAS)
def test_an_element_names_its_zones_and_one_in_none_has_no_such_property(schema: str, tmp_path: Path) -> None:
    builder = ModelBuilder(schema=schema)
    for number, name in enumerate(("in", "out")):
        builder.box("IfcColumn", name, (2.0 * number, 0, 0), (0.4, 0.4, 3.0))
    source = builder.write(tmp_path / "m.ifc")
    report = report_on(read_design(source), {"in": 1.0, "out": 1.0})
    inside = {"in": ("Pour 1", "Lot B")}
    report = replace(report, elements=tuple(replace(e, zones=inside.get(e.name, ())) for e in report.elements))
    write_asbuilt(source, report, tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    found = {
        one.Name: ifcopenshell.util.element.get_psets(one)["AsBuilt_Progress"].get("Zones")
        for one in file.by_type("IfcColumn")
    }
    assert found == {"in": "Pour 1; Lot B", "out": None}


def test_what_is_complete_as_far_as_seen_says_so(tmp_path: Path) -> None:
    source = _written("IFC4", tmp_path)[0]
    report = report_on(read_design(source), BEST)
    elements = [replace(one, as_far_as_seen=one.state == "complete") for one in report.elements]
    write_asbuilt(source, replace(report, elements=tuple(elements)), tmp_path / "far.ifc")
    file = ifcopenshell.open(str(tmp_path / "far.ifc"))
    assert _psets(file, "IfcColumn", "full")["AsBuilt_Progress"]["State"] == "complete as far as seen"


@pytest.mark.parametrize("schema", SCHEMAS)
def test_values_have_the_right_measures(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    kinds = {p.Name: p.NominalValue.is_a() for p in file.by_type("IfcPropertySingleValue")}
    assert kinds["CompletionBest"] == "IfcNormalisedRatioMeasure"
    assert kinds["DeviationSigma"] == "IfcLengthMeasure"
    assert kinds["VisitDate"] == ("IfcLabel" if schema == "IFC2X3" else "IfcDate")
    assert all(quantities.MethodOfMeasurement for quantities in file.by_type("IfcElementQuantity"))


@pytest.mark.parametrize("schema", SCHEMAS)
def test_every_original_entity_is_still_there_and_nothing_new_is_invalid(schema: str, tmp_path: Path) -> None:
    source, target = _written(schema, tmp_path)
    before, after = ifcopenshell.open(str(source)), ifcopenshell.open(str(target))
    tasks = {"IfcTask", "IfcTaskTime", "IfcScheduleTimeControl", "IfcRelAssignsTasks"}
    for entity in before:
        same = after.by_id(entity.id())
        assert same.is_a() == entity.is_a()
        if entity.is_a() not in tasks:
            assert str(same) == str(entity)
        if hasattr(entity, "GlobalId"):
            assert same.GlobalId == entity.GlobalId
    assert _complaints(target) <= _complaints(source)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_writing_on_a_file_that_has_ours_gives_the_same_file(schema: str, tmp_path: Path) -> None:
    source, first = _written(schema, tmp_path)
    report = report_on(read_design(source), BEST)
    second = tmp_path / "second.ifc"
    write_asbuilt(first, report, second)
    assert _without_ids(ifcopenshell.open(str(second))) == _without_ids(ifcopenshell.open(str(first)))


@pytest.mark.parametrize("schema", SCHEMAS)
def test_strip_gives_the_design_back(schema: str, tmp_path: Path) -> None:
    source, target = _written(schema, tmp_path)
    bare = tmp_path / "bare.ifc"
    assert strip_asbuilt(target, bare) > 0
    assert _without_ids(ifcopenshell.open(str(bare))) == _without_ids(ifcopenshell.open(str(source)))


@pytest.mark.parametrize("schema", SCHEMAS)
def test_strip_gives_the_design_back_from_a_copy_of_before_there_were_codes(schema: str, tmp_path: Path) -> None:
    source, target = _written(schema, tmp_path)
    old = ifcopenshell.open(str(target))
    texts = {
        Reason.BASIS_COMPLETE: "Completion is 1: seen complete; at least 90.0 % is certain",
        Reason.BASIS_LOWER: "Completion is the lower bound: the best estimate is 50.0 %",
        Reason.BASIS_UNKNOWN: "too little was seen to say: the task's own time is as it was",
    }
    basis = [one for one in old.by_type("IfcPropertySingleValue") if one.Name == "Basis"]
    assert {one[1] for one in basis} >= set(texts)
    for one in basis:
        if one[1] in texts:
            one.NominalValue = old.create_entity("IfcText", texts[Reason(one[1])])
        one[1] = None
    old.write(str(target))
    strip_asbuilt(target, tmp_path / "bare.ifc")
    bare = ifcopenshell.open(str(tmp_path / "bare.ifc"))
    assert _without_ids(bare) == _without_ids(ifcopenshell.open(str(source)))


@pytest.mark.parametrize("schema", ["IFC4", "IFC4X3"])
def test_measured_zero_unknown_and_part_measured_are_three_things(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    times = {task.Name: task.TaskTime for task in file.by_type("IfcTask")}
    assert times["pour full"].Completion == 1.0  # finished, as in every other schedule
    assert times["pour full"].ActualFinish is not None
    said = _psets(file, "IfcTask", "pour full")["AsBuilt_Progress"]
    assert said["Basis"] == Reason.BASIS_COMPLETE  # no words were given
    assert said["CompletionLower"] == pytest.approx(0.9)
    assert times["pour full"].ActualFinish == "2026-03-02T17:00:00"
    assert times["pour full"].ScheduleStart == "2026-02-01T00:00:00"
    assert times["pour none"].Completion is None and times["pour none"].DataOrigin == "MEASURED"
    assert _psets(file, "IfcTask", "pour none")["AsBuilt_Progress"]["CompletionBest"] == 0.0
    assert times["pour hidden"].DataOrigin is None and times["pour hidden"].StatusTime is None
    hidden = _psets(file, "IfcTask", "pour hidden")["AsBuilt_Progress"]
    assert hidden["State"] == "unknown" and "CompletionBest" not in hidden
    assert times["pour some"].Completion == pytest.approx(0.45)  # the lower bound: one element was not seen
    assert _psets(file, "IfcTask", "pour some")["AsBuilt_Progress"]["Basis"] == Reason.BASIS_LOWER
    assert times["pour some"].ActualFinish is None


def test_a_task_that_makes_a_slab_too_holds_its_lower_bound_as_all_other_schedules_do(tmp_path: Path) -> None:
    source = _model("IFC4", tmp_path)
    report = report_on(read_design(source), BEST)
    half = next(task for task in report.tasks if task.progress.name == "pour half")
    done = replace(half.progress.completion, best=None, lower=0.2, upper=0.8)
    mixed = replace(half, others=1, progress=replace(half.progress, completion=done))
    write_asbuilt(source, replace(report, tasks=(mixed,)), tmp_path / "w.ifc", words=note_words)
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    (time,) = [task.TaskTime for task in file.by_type("IfcTask") if task.Name == "pour half"]
    assert time.Completion == verdict(mixed).share == 0.2
    assert (time.DataOrigin, time.ActualStart) == ("MEASURED", "2026-03-02T08:00:00")
    basis = _psets(file, "IfcTask", "pour half")["AsBuilt_Progress"]["Basis"]
    assert basis == "Completion is the lower bound: 1 more not measured here"


@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_finish_that_a_schedule_file_gives_stands_with_its_file_beside_the_days_late(
    schema: str, tmp_path: Path
) -> None:
    source = _model(schema, tmp_path)
    report = report_on(read_design(source), BEST)
    half = next(task for task in report.tasks if task.progress.name == "pour half")
    filed = replace(half, schedule_finish=datetime(2026, 2, 27, 17), finish_from="plan.csv", late=True)
    others = tuple(task for task in report.tasks if task is not half)
    write_asbuilt(source, replace(report, tasks=(filed, *others)), tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    said = _psets(file, "IfcTask", "pour half")["AsBuilt_Progress"]
    assert (said["PlannedFinish"], said["PlannedFinishFrom"]) == ("2026-02-27", "plan.csv")
    assert said["DaysLate"] == 3  # to the visit of 2 March; the IFC's own finish is another
    assert not _psets(file, "IfcTask", "pour full")["AsBuilt_Progress"].keys() & {"PlannedFinish", "PlannedFinishFrom"}
    assert _complaints(tmp_path / "w.ifc") <= _complaints(source)


def test_ifc2x3_tasks_carry_their_completion_in_the_time_control(tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written("IFC2X3", tmp_path)[1]))
    controls = {control.Name: control for control in file.by_type("IfcScheduleTimeControl")}
    assert controls["pour half"].Completion == pytest.approx(0.45)
    assert controls["pour half"].StatusTime.DateComponent.YearComponent == 2026
    assert controls["pour none"].Completion is None
    assert controls["pour hidden"].StatusTime is None


@pytest.mark.parametrize("schema", ["IFC4", "IFC4X3"])
def test_as_built_quantities_stand_in_a_cost_schedule_of_their_own(schema: str, tmp_path: Path) -> None:
    file = ifcopenshell.open(str(_written(schema, tmp_path)[1]))
    planned, ours = sorted(file.by_type("IfcCostItem"), key=lambda item: item.ObjectType or "")
    assert planned.CostQuantities[0].VolumeValue == pytest.approx(0.96)
    assert len(planned.CostQuantities) == 1
    assert ours.CostQuantities[0].VolumeValue == pytest.approx(0.384)
    (schedule,) = [one for one in file.by_type("IfcCostSchedule") if one.PredefinedType == "USERDEFINED"]
    assert schedule.ObjectType == "ASBUILT"
    # read as a design again, the plan is still the plan
    source = tmp_path / f"{schema}.ifc"
    again = read_design(tmp_path / "out" / f"{schema}.asbuilt.ifc")
    assert [line.planned_quantity for line in again.cost_lines] == [
        line.planned_quantity for line in read_design(source).cost_lines
    ]


def test_a_part_of_a_bridge_carries_its_completion_as_a_storey_does(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC4X3", storeys=0)
    builder.bridge_part("Pier 1", 0.0)
    builder.box("IfcColumn", "full", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    path = builder.write(tmp_path / "bridge.ifc")
    write_asbuilt(path, report_on(read_design(path), BEST), tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    said = _psets(file, "IfcBridgePart", "Pier 1")
    assert said["AsBuilt_Progress"]["ElementsComplete"] == 1 and "DesignExposedArea" in said["AsBuilt_Quantities"]
    assert _complaints(tmp_path / "w.ifc") <= _complaints(path)


def test_a_tender_beside_a_budget_is_not_added_to_it_in_the_copy(tmp_path: Path) -> None:
    builder = ModelBuilder()
    column = builder.box("IfcColumn", "full", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.cost("concrete", [column], "IfcQuantityVolume", 0.48, 210.0)
    builder.budget = builder.rooted("IfcCostSchedule", Name="tender", PredefinedType="TENDER")
    builder.cost("concrete", [column], "IfcQuantityVolume", 0.48, 190.0)
    path = builder.write(tmp_path / "m.ifc")
    write_asbuilt(path, report_on(read_design(path), BEST), tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    ours = [one for one in file.by_type("IfcCostSchedule") if one.ObjectType == "ASBUILT"]
    rates = {
        one.Name: [item.CostValues[0].AppliedValue.wrappedValue for item in one.Controls[0].RelatedObjects]
        for one in ours
    }
    assert rates == {"As-built quantities: budget": [210.0], "As-built quantities: tender": [190.0]}
    strip_asbuilt(tmp_path / "w.ifc", tmp_path / "b.ifc")
    assert _without_ids(ifcopenshell.open(str(tmp_path / "b.ifc"))) == _without_ids(ifcopenshell.open(str(path)))


@pytest.mark.parametrize("schema", SCHEMAS)
def test_what_the_schedule_said_before_is_kept_and_put_back(schema: str, tmp_path: Path) -> None:
    path = _model(schema, tmp_path)
    file = ifcopenshell.open(str(path))
    times = file.by_type("IfcScheduleTimeControl" if schema == "IFC2X3" else "IfcTaskTime")[0]
    times.Completion = 0.25
    times.StatusTime = times.ScheduleStart
    file.write(str(path))
    written, bare = tmp_path / "w.ifc", tmp_path / "b.ifc"
    write_asbuilt(path, report_on(read_design(path), BEST), written)
    said = _psets(ifcopenshell.open(str(written)), "IfcTask", "pour full")["AsBuilt_Progress"]
    assert said["OriginalCompletion"] == "0.25"
    if schema == "IFC2X3":  # there a moment is an entity: it is kept by reference
        kept = [p for p in ifcopenshell.open(str(written)).by_type("IfcPropertyReferenceValue") if "Status" in p.Name]
        assert [one.PropertyReference.is_a() for one in kept] == ["IfcDateAndTime"]
    else:
        assert said["OriginalStatusTime"] == "2026-02-01T00:00:00"
    strip_asbuilt(written, bare)
    assert _without_ids(ifcopenshell.open(str(bare))) == _without_ids(ifcopenshell.open(str(path)))


def test_a_task_without_a_time_gets_one_and_loses_it_again(tmp_path: Path) -> None:
    builder = ModelBuilder()
    column = builder.box("IfcColumn", "full", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    builder.task("pour", [column], time=False)
    path = builder.write(tmp_path / "m.ifc")
    write_asbuilt(path, report_on(read_design(path), BEST), tmp_path / "w.ifc")
    assert ifcopenshell.open(str(tmp_path / "w.ifc")).by_type("IfcTask")[0].TaskTime.Completion == 1.0
    strip_asbuilt(tmp_path / "w.ifc", tmp_path / "b.ifc")
    assert _without_ids(ifcopenshell.open(str(tmp_path / "b.ifc"))) == _without_ids(ifcopenshell.open(str(path)))


@pytest.mark.parametrize(("rate", "whole", "way"), [(120.0, 2, "down"), (-120.0, 3, "up")])
@pytest.mark.parametrize("schema", ["IFC4", "IFC4X3"])
def test_pieces_are_counted_whole_where_the_schema_wants_it_upwards_only_where_they_take_money_off(
    schema: str, rate: float, whole: int, way: str, tmp_path: Path
) -> None:
    builder = ModelBuilder(schema=schema)
    columns = [builder.box("IfcColumn", f"{i}", (2.0 * i, 0.0, 0.0), (0.4, 0.4, 3.0)) for i in range(7)]
    builder.cost("columns", columns, "IfcQuantityCount", 7, rate)
    source, target = builder.write(tmp_path / "m.ifc"), tmp_path / "w.ifc"
    write_asbuilt(source, report_on(read_design(source), {}), target, words=note_words)
    written = ifcopenshell.open(str(target))
    ours = next(one for one in written.by_type("IfcCostItem") if one.ObjectType == "ASBUILT")
    assert ours.CostQuantities[0].CountValue == (whole if schema == "IFC4X3" else pytest.approx(2.8))
    (basis,) = [
        value.NominalValue.wrappedValue
        for relation in ours.IsDefinedBy
        for value in relation.RelatingPropertyDefinition.HasProperties
        if value.Name == "Basis"
    ]
    assert (f"(2.8, rounded {way} to whole pieces)" in basis) is (schema == "IFC4X3")
    assert _complaints(target) <= _complaints(source)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_areas_follow_the_files_area_unit_and_not_its_length_unit_squared(schema: str, tmp_path: Path) -> None:
    path = _model(schema, tmp_path)
    file = ifcopenshell.open(str(path))
    (unit,) = [one for one in file.by_type("IfcSIUnit") if one.UnitType == "AREAUNIT"]
    unit.Prefix = "CENTI"
    file.write(str(path))
    write_asbuilt(path, report_on(read_design(path), BEST), tmp_path / "w.ifc")
    written = ifcopenshell.open(str(tmp_path / "w.ifc"))
    (area,) = [q for q in _quantities(written, "half") if q.Name == "AsBuiltArea"]
    assert area.is_a("IfcQuantityArea") and area.AreaValue == pytest.approx(12500.0)  # 1.25 m2 in cm2


def _quantities(file: Any, name: str) -> tuple[Any, ...]:
    (column,) = [one for one in file.by_type("IfcColumn") if one.Name == name]
    sets = [one.RelatingPropertyDefinition for one in column.IsDefinedBy]
    (ours,) = [one for one in sets if one.Name == "AsBuilt_Quantities"]
    return tuple(ours.Quantities)


@pytest.mark.parametrize("schema", SCHEMAS)
def test_the_designs_own_quantities_stay_beside_ours(schema: str, tmp_path: Path) -> None:
    path = _model(schema, tmp_path)
    file = ifcopenshell.open(str(path))
    (column,) = [one for one in file.by_type("IfcColumn") if one.Name == "half"]
    owner = file.by_type("IfcOwnerHistory")[0]
    length = file.create_entity("IfcQuantityLength", Name="Length", LengthValue=3000.0)
    made = file.create_entity(
        "IfcElementQuantity", ifcopenshell.guid.new(), owner, Name="Qto_ColumnBaseQuantities", Quantities=[length]
    )
    rel = file.create_entity("IfcRelDefinesByProperties", ifcopenshell.guid.new(), owner)
    rel.RelatedObjects, rel.RelatingPropertyDefinition = [column], made
    file.write(str(path))
    write_asbuilt(path, report_on(read_design(path), BEST), tmp_path / "w.ifc")
    sets = _psets(ifcopenshell.open(str(tmp_path / "w.ifc")), "IfcColumn", "half")
    assert sets["Qto_ColumnBaseQuantities"]["Length"] == 3000.0
    assert {"AsBuiltArea", "AsBuiltAreaSigma", "DesignExposedArea"} <= sets["AsBuilt_Quantities"].keys()


@pytest.mark.parametrize("schema", SCHEMAS)
def test_a_completion_above_one_is_never_written(schema: str, tmp_path: Path) -> None:
    source = _model(schema, tmp_path)
    report = report_on(read_design(source), {"full": 1.2})  # IfcPositiveRatioMeasure would let it pass
    write_asbuilt(source, report, tmp_path / "w.ifc")
    file = ifcopenshell.open(str(tmp_path / "w.ifc"))
    times = file.by_type("IfcScheduleTimeControl" if schema == "IFC2X3" else "IfcTaskTime")
    assert max(time.Completion or 0.0 for time in times) == 1.0
    assert _psets(file, "IfcColumn", "full")["AsBuilt_Progress"]["CompletionBest"] == 1.0


def test_a_result_of_another_design_is_refused(tmp_path: Path) -> None:
    source = _model("IFC4", tmp_path)
    other = ModelBuilder()
    other.box("IfcColumn", "other", (0.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    report = report_on(read_design(other.write(tmp_path / "other.ifc")), {"other": 1.0})
    with pytest.raises(ResultError, match="belongs to another design"):
        write_asbuilt(source, report, tmp_path / "out.ifc")


def test_the_source_is_never_overwritten(tmp_path: Path) -> None:
    source = _model("IFC4", tmp_path)
    report = report_on(read_design(source), BEST)
    with pytest.raises(OutputError, match="would overwrite the design itself"):
        write_asbuilt(source, report, tmp_path / "." / source.name)


def test_a_full_disk_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = _model("IFC4", tmp_path)
    report = report_on(read_design(source), BEST)
    folder = tmp_path / "out"
    target = folder / "model.asbuilt.ifc"
    write_asbuilt(source, report, target)
    before = target.read_bytes()

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_asbuilt(source, report, target)
    assert target.read_bytes() == before
    assert [path.name for path in folder.iterdir()] == ["model.asbuilt.ifc"]


def test_a_full_disk_is_said_as_such_and_the_librarys_own_half_file_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = _model("IFC4", tmp_path)
    folder = tmp_path / "out"

    def fails(self: Any, path: str, *_: Any, **__: Any) -> None:
        Path(f"{path}.33469269.tmp").write_text("ISO-10303-21;")
        raise RuntimeError("An unknown error occurred")

    monkeypatch.setattr(ifcopenshell.file, "write", fails)
    with pytest.raises(OutputError, match="An unknown error"):
        strip_asbuilt(source, folder / "plain.ifc")
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=4096))
    with pytest.raises(OutputError, match=r"plain\.ifc: .*the disk is full"):
        strip_asbuilt(source, folder / "plain.ifc")
    assert list(folder.iterdir()) == []


def test_what_the_system_says_of_a_folder_stands_before_a_guess_at_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(Path, "touch", refused)
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=0))  # as a read-only image has
    with pytest.raises(OutputError, match="Read-only file system"):
        strip_asbuilt(_model("IFC4", tmp_path), tmp_path / "plain.ifc")


def test_a_copy_that_was_cut_short_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = _model("IFC4", tmp_path)
    report = report_on(read_design(source), BEST)

    def half(self: Any, path: str, *_: Any, **__: Any) -> None:
        Path(path).write_text("ISO-10303-21;\nDATA;\n#1=IFCPRO")

    monkeypatch.setattr(ifcopenshell.file, "write", half)
    with pytest.raises(OutputError, match="cut short"):
        write_asbuilt(source, report, tmp_path / "model.asbuilt.ifc")
    assert not (tmp_path / "model.asbuilt.ifc").exists()


def test_a_folder_that_is_a_file_is_named(tmp_path: Path) -> None:
    source = _model("IFC4", tmp_path)
    report = report_on(read_design(source), BEST)
    (tmp_path / "out").write_text("a file")
    with pytest.raises(OutputError, match="check the folder's rights"):
        write_asbuilt(source, report, tmp_path / "out" / "model.ifc")


def test_a_thing_whose_globalid_is_no_text_is_left_in_peace_by_strip(tmp_path: Path) -> None:
    _, target = _written("IFC4", tmp_path)
    text = target.read_text(encoding="utf-8")
    retyped = text.replace("IFCCARTESIANPOINT((", "IFCRELAGGREGATES((", 1)
    assert retyped != text
    target.write_text(retyped, encoding="utf-8")
    assert strip_asbuilt(target, tmp_path / "bare.ifc") > 0
    assert "IFCRELAGGREGATES((" in (tmp_path / "bare.ifc").read_text(encoding="utf-8")
