"""What a cost line pays for beside walls and columns is never certified, and nothing is paid twice unsaid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.report.wording.notes import note_words
from tests.ifc.models import ModelBuilder
from tests.notes import codes, the

VOLUME = "IfcQuantityVolume"


@pytest.fixture
def builder() -> ModelBuilder:
    return ModelBuilder()


def column(builder: ModelBuilder, at_m: float = 0.0) -> Any:
    return builder.box("IfcColumn", f"C{at_m:g}", (at_m, 0.0, 0.0), (0.4, 0.4, 3.0))


def design(builder: ModelBuilder, tmp_path: Path, scope: str | None = None) -> BimModel:
    return read_design(builder.write(tmp_path / "cost.ifc"), scope=scope)


def test_a_slab_on_a_line_is_counted_as_not_measured_and_said(builder: ModelBuilder, tmp_path: Path) -> None:
    slab = builder.box("IfcSlab", "S", (5.0, 5.0, 0.0), (4.0, 4.0, 0.3))
    builder.cost("concrete", [column(builder), slab], VOLUME, 5.28, 210.0)
    found = design(builder, tmp_path)
    (line,) = found.cost_lines
    assert (len(line.elements), line.others, line.unit_scale) == (1, 1, 1.0)
    assert the(found.notes, Reason.COST_PART_UNMEASURED).values == {"item": "concrete", "others": 1, "of": 2}


def test_walls_out_of_scope_stay_on_the_line_as_not_measured(builder: ModelBuilder, tmp_path: Path) -> None:
    wall = builder.box("IfcWall", "W", (2.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    builder.cost("concrete", [column(builder), wall], VOLUME, 2.88, 210.0)
    (line,) = design(builder, tmp_path, scope="IfcColumn").cost_lines
    assert (len(line.elements), line.others) == (1, 1)


def test_types_stand_for_their_occurrences_and_openings_for_nothing(builder: ModelBuilder, tmp_path: Path) -> None:
    first, second = column(builder), column(builder, 3.0)
    wall = builder.box("IfcWall", "W", (0.0, 5.0, 0.0), (4.0, 0.2, 3.0))
    hole = builder.opening(wall, (1.0, 0.0, 1.0), (1.0, 0.2, 1.0))
    kind = builder.rooted("IfcColumnType", Name="K", PredefinedType="COLUMN")
    builder.rooted("IfcRelDefinesByType", RelatedObjects=[first, second], RelatingType=kind)
    builder.cost("columns", [kind, first, hole], VOLUME, 0.96, 210.0)
    (line,) = design(builder, tmp_path).cost_lines
    assert set(line.elements) == {first.GlobalId, second.GlobalId} and line.others == 0


def test_a_line_whose_parts_are_lines_is_left_out_and_said(builder: ModelBuilder, tmp_path: Path) -> None:
    made = column(builder)
    whole, part = (builder.cost(name, [made], VOLUME, 0.48, 210.0) for name in ("all concrete", "columns"))
    builder.rooted("IfcRelNests", RelatingObject=whole, RelatedObjects=[part])
    found = design(builder, tmp_path)
    assert [line.name for line in found.cost_lines] == ["columns"]
    assert the(found.notes, Reason.COST_NESTED).values == {"item": "all concrete"}


def test_a_tender_beside_a_budget_is_a_schedule_of_its_own(builder: ModelBuilder, tmp_path: Path) -> None:
    made = column(builder)
    builder.cost("concrete", [made], VOLUME, 0.48, 210.0)
    tender = builder.rooted("IfcCostSchedule", Name="tender", PredefinedType="TENDER")
    item = builder.cost("concrete again", [made], VOLUME, 0.48, 190.0)
    relation = next(r for r in item.HasAssignments if r.RelatingControl == builder.budget)
    relation.RelatingControl = tender
    found = design(builder, tmp_path)
    assert [line.schedule for line in found.cost_lines] == ["budget", "tender"]
    assert the(found.notes, Reason.COST_SCHEDULES_SEVERAL).values == {"count": 2}
    assert Reason.COST_PAID_TWICE not in codes(found.notes)


def test_two_lines_of_one_schedule_on_the_same_elements_are_named(builder: ModelBuilder, tmp_path: Path) -> None:
    made = column(builder)
    for name, quantity in (("concrete", VOLUME), ("concrete again", VOLUME), ("formwork", "IfcQuantityArea")):
        builder.cost(name, [made], quantity, 0.48, 210.0)
    words = note_words(the(design(builder, tmp_path).notes, Reason.COST_PAID_TWICE))
    assert words == "cost items concrete and concrete again: both pay for the same elements by volume; both count"


def test_an_item_that_takes_money_off_is_named_since_its_certain_value_counts_what_was_not_seen(
    builder: ModelBuilder, tmp_path: Path
) -> None:
    made = column(builder)
    builder.cost("concrete", [made], VOLUME, 0.48, 210.0)
    builder.cost("deduction", [made], "IfcQuantityCount", 2.0, -15.0)
    note = the(design(builder, tmp_path).notes, Reason.COST_TAKES_OFF)
    assert (note.values["item"], note.values["amount"]) == ("deduction", 30.0)


def test_items_that_pay_for_no_wall_or_column_are_told_by_number(builder: ModelBuilder, tmp_path: Path) -> None:
    slab = builder.box("IfcSlab", "S", (5.0, 5.0, 0.0), (4.0, 4.0, 0.3))
    builder.cost("concrete", [column(builder)], VOLUME, 0.48, 210.0)
    builder.cost("slab", [slab], VOLUME, 4.8, 210.0)
    assert the(design(builder, tmp_path).notes, Reason.COST_OF_OTHER_WORK).values == {"count": 1}


def test_a_task_that_makes_a_slab_too_knows_of_it(builder: ModelBuilder, tmp_path: Path) -> None:
    slab = builder.box("IfcSlab", "S", (5.0, 5.0, 0.0), (4.0, 4.0, 0.3))
    made = column(builder)
    builder.task("pour", [made, slab])
    (task,) = design(builder, tmp_path).tasks
    assert task.elements == (made.GlobalId,) and task.others == 1


def test_rates_that_hold_one_after_the_other_are_not_added_up(builder: ModelBuilder, tmp_path: Path) -> None:
    made = column(builder)
    builder.cost("sound", [made], VOLUME, 0.48, 210.0)
    item = builder.cost("risen", [made], VOLUME, 0.48, 210.0)
    until, since = (
        item.CostValues[0],
        builder.make("IfcCostValue", AppliedValue=builder.make("IfcMonetaryMeasure", 225.0)),
    )
    until.FixedUntilDate, since.ApplicableDate = "2026-02-28", "2026-03-01"
    item.CostValues = [until, since]
    found = design(builder, tmp_path)
    assert [line.name for line in found.cost_lines] == ["sound"]  # 435 a cubic metre is nobody's rate
    assert the(found.notes, Reason.COST_RATES_SEVERAL).values == {"item": "risen"}
    item.CostValues = [until]
    assert [line.rate for line in design(builder, tmp_path).cost_lines] == [210.0, 210.0]


@pytest.mark.parametrize(
    ("quantity", "rate", "says"),
    [
        (0.48, 1e308, "its rate 1e+308 is no number up to 1e+15"),
        (1e300, 210.0, "its quantity 1e+300 is no number up to 1e+15"),
        (0.48, -2e15, "its rate -2e+15 is no number up to 1e+15"),
    ],
)
def test_a_cost_beyond_all_numbers_is_left_out_and_its_item_named(
    builder: ModelBuilder, tmp_path: Path, quantity: float, rate: float, says: str
) -> None:
    made = column(builder)
    builder.cost("sound", [made], VOLUME, 0.48, 210.0)
    builder.cost("typo", [made], VOLUME, quantity, rate)
    found = design(builder, tmp_path)
    assert [line.name for line in found.cost_lines] == ["sound"]
    assert any(words.startswith(f"cost item typo left out: {says}") for words in map(note_words, found.notes))


@pytest.mark.parametrize("factor", [0.0, 1e300])
def test_a_cost_in_a_unit_that_cannot_be_is_left_out(builder: ModelBuilder, tmp_path: Path, factor: float) -> None:
    item = builder.cost("typo", [column(builder)], VOLUME, 0.48, 210.0)
    metre = next(unit for unit in builder.file.by_type("IfcSIUnit") if unit.Name == "CUBIC_METRE")
    item.CostQuantities[0].Unit = converted(builder, "bucket", factor, metre)
    found = design(builder, tmp_path)
    assert found.cost_lines == () and Reason.COST_UNIT_IMPOSSIBLE in codes(found.notes)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("CUBIC FOOT", "ft3"), ("cubic foot", "ft3"), ("CUBIC YARD", "yd3"), ("US SURVEY FOOT 3", "US SURVEY FOOT 3")],
)
def test_a_converted_unit_has_its_sign_however_an_exporter_writes_it_or_else_its_name(
    builder: ModelBuilder, tmp_path: Path, name: str, unit: str
) -> None:
    item = builder.cost("concrete", [column(builder)], VOLUME, 0.48, 210.0)
    metre = next(unit for unit in builder.file.by_type("IfcSIUnit") if unit.Name == "CUBIC_METRE")
    item.CostQuantities[0].Unit = converted(builder, name, 0.5, metre)
    assert [line.unit for line in design(builder, tmp_path).cost_lines] == [unit]


def converted(builder: ModelBuilder, name: str, factor: float, metre: Any) -> Any:
    return builder.make(
        "IfcConversionBasedUnit",
        Dimensions=builder.make("IfcDimensionalExponents", 3, 0, 0, 0, 0, 0, 0),
        UnitType="VOLUMEUNIT",
        Name=name,
        ConversionFactor=builder.make("IfcMeasureWithUnit", builder.make("IfcReal", factor), metre),
    )


def test_a_number_of_ifc4x3_without_a_unit_is_a_count_and_one_of_kilograms_is_none(tmp_path: Path) -> None:
    builder = ModelBuilder(schema="IFC4X3")
    made = column(builder)
    builder.cost("half built in", [made], "IfcQuantityNumber", 2.5, 120.0)
    heavy = builder.cost("steel", [made], "IfcQuantityNumber", 80.0, 2.0)
    heavy.CostQuantities[0].Unit = builder.make("IfcSIUnit", UnitType="MASSUNIT", Prefix="KILO", Name="GRAM")
    found = design(builder, tmp_path)
    (line,) = found.cost_lines
    assert (line.name, line.measure, line.unit, line.planned_quantity) == ("half built in", "count", "pcs", 2.5)
    assert the(found.notes, Reason.COST_MIXED_QUANTITIES).values == {"item": "steel"}
