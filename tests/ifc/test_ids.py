"""The IDS in schemas/ passes on what the writer writes, and each of its rules fails on a copy damaged against it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import ifcopenshell
import pytest

from asbuilt_bim.ifc.names import MARKS, QUANTITIES
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.write.copy import write_asbuilt
from tests.ifc.models import SCHEMAS, ModelBuilder
from tests.ifc.reports import report_on

ids = pytest.importorskip("ifctester.ids", reason="ifctester isn't installed (extra: dev)")
PATH = Path(__file__).parents[2] / "schemas" / "asbuilt-bim.ids"
BEST: dict[str, float | None] = {"full": 1.0, "half": 0.5, "none": 0.0, "hidden": None}
Damage = Callable[[Any], None]


def _properties(file: Any, name: str, state: str | None = None) -> list[Any]:
    """Our properties of a name, in sets that say this state."""
    found = []
    for one in file.by_type("IfcPropertySet"):
        inside = {each.Name: each for each in one.HasProperties}
        said = inside["State"].NominalValue.wrappedValue if "State" in inside else None
        if name in inside and (state is None or said == state):
            found.append(inside[name])
    return found


def _owner(file: Any, one: Any) -> Any:
    (owner,) = [user for user in file.get_inverse(one) if user.is_a("IfcPropertySet")]
    return owner


def _set(name: str, ifc_class: str, value: Any, state: str | None = None) -> Damage:
    def damage(file: Any) -> None:
        _properties(file, name, state)[0].NominalValue = file.create_entity(ifc_class, value)

    return damage


def _drop(name: str, state: str | None = None, beside: str | None = None) -> Damage:
    """Take a property out of a set, one that also has the property `beside`."""

    def damage(file: Any) -> None:
        for one in _properties(file, name, state):
            owner = _owner(file, one)
            names = [each.Name for each in owner.HasProperties]
            if beside is None or beside in names:
                owner.HasProperties = [each for each in owner.HasProperties if each != one]
                return
        raise AssertionError(f"nothing to damage: {name}")

    return damage


def _add_best(file: Any) -> None:
    owner = _owner(file, _properties(file, "State", "unknown")[0])
    value = file.create_entity("IfcNormalisedRatioMeasure", 0.0)
    best = file.create_entity("IfcPropertySingleValue", "CompletionBest", None, value)
    owner.HasProperties = [*owner.HasProperties, best]


def _drop_quantity(name: str, beside: str | None = None) -> Damage:
    def damage(file: Any) -> None:
        for one in file.by_type("IfcElementQuantity"):
            if beside is None or beside in [each.Name for each in one.Quantities]:
                one.Quantities = [each for each in one.Quantities if each.Name != name]
                return

    return damage


def _attribute(ifc_class: str, name: str, value: str) -> Damage:
    def damage(file: Any) -> None:
        (one, *_) = [one for one in file.by_type(ifc_class) if one.ObjectType == "ASBUILT"]
        setattr(one, name, value)

    return damage


def _drop_cost_basis(file: Any) -> None:
    (item,) = [one for one in file.by_type("IfcCostItem") if one.ObjectType == "ASBUILT"]
    (relation,) = item.IsDefinedBy
    owner = relation.RelatingPropertyDefinition
    owner.HasProperties = [each for each in owner.HasProperties if each.Name != "Basis"]


DAMAGES: dict[str, Damage] = {
    "AB01": _set("State", "IfcLabel", "nearly"),
    "AB02": _set("CompletionUpper", "IfcNormalisedRatioMeasure", 1.2),
    "AB03": _drop("CompletionBest", "not started"),
    "AB04": _add_best,
    "AB05": _set("VisitDate", "IfcText", "2 March"),
    "AB06": _drop("Reason", "unknown"),
    "AB07": _drop("ProgramVersion"),
    "AB08": _drop_quantity("DesignExposedArea"),
    "AB09": _drop_quantity("AsBuiltAreaSigma", beside="AsBuiltArea"),
    "AB10": _drop("DeviationSigma"),
    "AB11": _drop("ElementsUnknown"),
    "AB12": _drop("Basis", beside="State"),
    "AB13": _drop_cost_basis,
    "AB14": _attribute("IfcCostSchedule", "PredefinedType", "BUDGET"),
    "AB15": _attribute("IfcPerformanceHistory", "LifeCyclePhase", "OPERATION"),
    "AB16": _drop("Summary"),
}


@pytest.fixture(scope="module", params=SCHEMAS)
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ids")
    builder = ModelBuilder(schema=request.param)
    made = {name: builder.box("IfcColumn", name, (2.0 * i, 0, 0), (0.4, 0.4, 3.0)) for i, name in enumerate(BEST)}
    builder.task("pour", [made["full"], made["half"]])
    builder.task("later", [made["hidden"]])
    if request.param != "IFC2X3":
        builder.cost("concrete", [made["full"]], "IfcQuantityVolume", 0.96, 210.0)
    source = builder.write(folder / "m.ifc")
    report = report_on(read_design(source), BEST)
    tasks = tuple(replace(task, finish_from="plan.csv") for task in report.tasks)
    write_asbuilt(source, replace(report, tasks=tasks), folder / "w.ifc")
    return folder / "w.ifc"


def _failed(file: Any) -> set[str]:
    rules = ids.open(str(PATH), validate=True)
    rules.validate(file, should_filter_version=True)
    assert any(rule.applicable_entities for rule in rules.specifications)
    return {rule.name for rule in rules.specifications if rule.status is False}


def _rules() -> dict[str, tuple[str, str]]:
    found = re.findall(r'<specification identifier="(\w+)" name="([^"]+)" ifcVersion="([^"]+)"', PATH.read_text())
    return {key: (name, versions) for key, name, versions in found}


def test_a_known_state_without_its_day_fails(written: Path) -> None:
    file = ifcopenshell.open(str(written))
    _drop("VisitDate", "part")(file)
    assert _failed(file) == {"A state that is known says the day of its visit"}


def test_what_is_written_passes(written: Path) -> None:
    assert _failed(ifcopenshell.open(str(written))) == set()


def test_the_testers_own_command_passes_it_in_every_schema(written: Path) -> None:
    # the command holds every specification against every file, whatever its schema
    command = [sys.executable, "-m", "ifctester", str(PATH), str(written), "-r", "Json", "-o", str(written) + ".json"]
    subprocess.run(command, check=True, capture_output=True)
    told = json.loads(Path(f"{written}.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in told["specifications"] if not one["status"]] == []
    assert told["status"] is True


def test_an_element_of_which_too_little_was_seen_may_still_have_an_estimate(written: Path) -> None:
    file = ifcopenshell.open(str(written))
    owner = _owner(file, _properties(file, "State", "part")[0])
    reason = file.create_entity("IfcPropertySingleValue", "Reason", None, file.create_entity("IfcText", "its top"))
    owner.HasProperties = [*owner.HasProperties, reason]
    _set("State", "IfcLabel", "unknown", state="part")(file)  # a quarter seen, all of that built: best 1, state unknown
    assert _failed(file) == set()


@pytest.mark.parametrize("key", DAMAGES)
def test_each_rule_fails_on_a_copy_damaged_against_it(key: str, written: Path) -> None:
    name, versions = _rules()[key]
    file = ifcopenshell.open(str(written))
    if file.schema_identifier not in versions.split():
        return
    DAMAGES[key](file)
    assert name in _failed(file)


def test_the_rules_are_all_tried_and_name_what_the_writer_writes() -> None:
    assert _rules().keys() == DAMAGES.keys()
    text = PATH.read_text()
    named = set(re.findall(r"<baseName><simpleValue>(\w+)</simpleValue>", text))
    assert named <= {mark.name for mark in MARKS} | set(QUANTITIES)
    sets = set(re.findall(r"<propertySet><simpleValue>(\w+)</simpleValue>", text))
    assert sets == {"AsBuilt_Progress", "AsBuilt_Quantities"}
