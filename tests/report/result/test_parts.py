"""A result is written in lines, and its sums or one storey are read without parsing the rest."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.errors import ResultError
from asbuilt_bim.report.result import lines as lines_module
from asbuilt_bim.report.result.document import read_result, result_document, write_result
from asbuilt_bim.report.result.lines import all_of, from_lines, to_lines
from asbuilt_bim.report.result.parts import ResultSummary, read_elements, read_summary
from tests.report.result.test_document import same
from tests.report.sample_report import sample_report

HARD: dict[str, Any] = {
    "name": 'ends with a comma,\nand has "lines"\r\u2028, {and} [brackets]',
    "empty": [], "nothing": None, "texts": ["{", "]"], "mixed": [{"a": 1}, 2], "faces": [{"b": "],\n"}, {"b": "}"}],
    "elements": [{"global_id": "x:y", "n": [{"c": 1}]}], "object": {"faces": [{"d": 1}]},
}  # fmt: skip


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_result(sample_report(), tmp_path / "result.json")
    return tmp_path / "result.json"


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Take note of each text that is parsed of a result in lines."""
    texts: list[str] = []
    parse = lines_module.parse_json

    def noting(text: str | bytes) -> Any:
        texts.append(str(text))
        return parse(text)

    monkeypatch.setattr(lines_module, "parse_json", noting)
    yield texts


def test_lines_are_one_json_document_with_the_long_lists_last() -> None:
    text = "".join(to_lines(HARD))
    assert json.loads(text) == HARD and list(json.loads(text))[-2:] == ["elements", "faces"]
    assert from_lines(text.removesuffix("\n").split("\n"), dict.fromkeys(HARD, all_of)) == HARD


def test_a_result_holds_the_same_values_as_before_it_was_written_in_lines(path: Path) -> None:
    assert json.loads(path.read_text(encoding="utf-8")) == result_document(sample_report())


def test_the_sums_are_those_of_the_whole_and_nothing_of_an_element_is_parsed(path: Path, parsed: list[str]) -> None:
    report, summary = read_result(path), read_summary(path)
    assert all(same(getattr(report, one.name), getattr(summary, one.name)) for one in fields(ResultSummary))
    assert not any('"exposed_uv_m"' in text or '"cells_built"' in text or '"left_digest"' in text for text in parsed)


def test_one_storey_is_read_alone(path: Path, parsed: list[str]) -> None:
    report = read_result(path)
    storey = next(one for one in report.storeys if one.elements)
    expected = tuple(one for one in report.elements if one.global_id in storey.elements)
    assert 0 < len(expected) < len(report.elements)
    assert same(read_elements(path, storey.key), expected)
    assert sum('"cells_built"' in text for text in parsed) == len(expected)


def test_an_element_whose_id_cannot_be_told_from_its_text_is_not_lost(tmp_path: Path) -> None:
    report, odd = sample_report(), 'a:"b",\u00e9'
    storey = next(one for one in report.storeys if one.elements)
    first = storey.elements[0]
    report = replace(
        report,
        storeys=tuple(
            replace(one, elements=tuple(odd if key == first else key for key in one.elements)) for one in report.storeys
        ),
        elements=tuple(replace(one, global_id=odd) if one.global_id == first else one for one in report.elements),
        faces=tuple(one for one in report.faces if one.element != first),
    )
    write_result(report, tmp_path / "result.json")
    assert odd in {one.global_id for one in read_elements(tmp_path / "result.json", storey.key)}


def test_a_result_of_before_in_one_line_is_read_too(path: Path) -> None:
    storey = next(one for one in read_result(path).storeys if one.elements)
    in_lines = read_summary(path), read_elements(path, storey.key)
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8")
    assert same((read_summary(path), read_elements(path, storey.key)), in_lines)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('"version":1', '"version":2', "result version 2"),
        ('"format":"asbuilt-bim/result"', '"format":"other"', "not a result"),
        ('"whole":{', '"whole":{,', "damaged: line"),
        ('"project_name":', '"name_of_project":', "damaged"),
        ('"storeys":[', '"storeys":[\nx', "damaged: line"),
    ],
)
def test_what_is_damaged_or_another_file_is_named(path: Path, old: str, new: str, named: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ResultError, match=named):
        read_summary(path)


def test_a_state_that_nobody_knows_is_named_with_those_that_there_are(path: Path) -> None:
    storey = read_summary(path).storeys[0].key
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r'"state":"[a-z ]+"', '"state":"hovering"', text), encoding="utf-8")
    with pytest.raises(ResultError, match=r"hovering is none of complete, part, .*elements\[0\]\.state"):
        read_elements(path, storey)


def test_a_storey_that_is_not_there_is_named(path: Path, tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="holds no storey 'cellar'"):
        read_elements(path, "cellar")
    with pytest.raises(ResultError, match=r"absent\.json: can't be read"):
        read_summary(tmp_path / "absent.json")
