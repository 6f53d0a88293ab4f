from __future__ import annotations

import datetime
import json

import pytest

from asbuilt_bim.report.result.document import result_document
from asbuilt_bim.storage.schemas import all_faults, first_fault
from tests.report.sample_report import sample_report


@pytest.fixture(scope="module")
def document() -> dict[str, object]:
    found: dict[str, object] = json.loads(json.dumps(result_document(sample_report())))
    return found


def test_a_key_that_a_newer_program_wrote_passes_where_newer_ones_may(document: dict[str, object]) -> None:
    assert "of_tomorrow" in first_fault("result-1", document | {"of_tomorrow": 1})
    assert first_fault("result-1", document | {"of_tomorrow": 1}, newer=True) == ""


def test_half_a_character_in_a_name_is_no_fault_and_hides_none(document: dict[str, object]) -> None:
    assert first_fault("result-1", document | {"project_name": "B\ud800ro"}) == ""
    assert first_fault("result-1", document | {"project_name": "B\ud800ro", "elements": 1}).startswith("elements: ")


@pytest.mark.parametrize("strange", [{1: 2}, {"left": datetime.date(2026, 3, 2)}, {"left": b"x"}])
def test_what_yaml_holds_and_json_does_not_is_a_fault_in_words(strange: dict[object, object]) -> None:
    assert any("required property" in fault for fault in all_faults("rig-1", strange))


def test_what_is_nested_too_deep_is_a_fault_in_words() -> None:
    deep = json.loads("[" * 900 + "]" * 900)
    assert first_fault("result-1", deep) == "the whole document: Recursion limit reached"
    assert all_faults("rig-1", deep) == ["the whole document: Recursion limit reached"]


def test_of_a_million_faults_the_first_is_told() -> None:
    assert first_fault("result-1", {"elements": [{}] * 1_000_000}).startswith("the whole document: ")
