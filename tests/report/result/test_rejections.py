"""Rejections in result files: with their codes, and of results that were written before there were any."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.result.document import read_result, result_document, write_result
from asbuilt_bim.report.result.rejections import rejection_from_plain, rejection_to_plain
from asbuilt_bim.report.tables import lost_stations, of_whole_visit
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.vision.masks.segment import InstanceSource
from tests.report.sample_report import sample_report

OLD = Path(__file__).parent / "result-1.3.json.gz"
"""The sample's result, written by the last version without codes."""


@pytest.fixture
def old() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(gzip.decompress(OLD.read_bytes()))
    return document


def read(document: dict[str, Any], folder: Path) -> ProgressReport:
    path = folder / "old.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return read_result(path)


def test_rejections_of_a_result_without_codes_are_unstated_and_read_as_they_were_written(
    old: dict[str, Any], tmp_path: Path
) -> None:
    report = read(old, tmp_path)
    for key, found in (("rejections", report.rejections), ("unmatched", report.unmatched)):
        assert len(found) == len(old[key]) > 5
        for was, rejection in zip(old[key], found, strict=True):
            assert rejection.code is Reason.UNSTATED and rejection.subject.kind is SubjectKind.FACE
            words = words_of(rejection)
            assert {name: getattr(words, name) for name in was} == was


def test_a_result_without_codes_is_reported_and_written_again(old: dict[str, Any], tmp_path: Path) -> None:
    old["rejections"] += [
        {"what": "station Z9", "reason": "target: no red disc is in view", "value": "", "limit": "", "remedy": "place"},
        {
            "what": "station G1, marker 17",
            "reason": "contradicts the other markers",
            "value": "",
            "limit": "",
            "remedy": "",
        },
        {"what": "survey", "reason": "lies beside the design: by +3.10 m in z", "value": "", "limit": "", "remedy": ""},
        {"what": "rig, stations G1 to U4", "reason": "it has moved a little", "value": "", "limit": "", "remedy": ""},
    ]
    report = read(old, tmp_path)
    assert [row.name for row in lost_stations(report)] == ["Z9"]
    assert [words_of(one).what for one in report.faults] == ["survey"]
    assert [words_of(one).what for one in report.rejections if of_whole_visit(one)] == [
        "survey",
        "rig, stations G1 to U4",
    ]
    page = page_html(report, {})
    for text in (
        "target: no red disc is in view",
        "station G1, marker 17: contradicts",
        "+3.10 m in z",
        "too uncertain",
    ):
        assert text in page
    write_result(report, tmp_path / "again.json")
    assert read_result(tmp_path / "again.json").rejections == report.rejections


def test_a_code_of_a_newer_version_keeps_its_english() -> None:
    plain = rejection_to_plain(sample_report().rejections[0]) | {"code": "struck by lightning"}
    rejection = rejection_from_plain(plain)
    assert rejection.code is Reason.UNSTATED and rejection.subject.at_station == "B2"
    assert str(words_of(rejection)) == str(words_of(sample_report().rejections[0]))


@pytest.mark.parametrize("values", [{}, {"found": 0}, {"off_sigmas": "many", "limit_sigmas": ["a"]}])
def test_a_code_without_the_values_of_its_sentence_keeps_its_english(
    values: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()  # elsewhere no test may make a rejection that has no words
    plain = rejection_to_plain(sample_report().rejections[2]) | {"values": values}
    assert rejection_from_plain(plain).code is Reason.UNSTATED
    assert str(words_of(rejection_from_plain(plain))) == str(words_of(sample_report().rejections[2]))


def test_a_rejection_carries_code_subject_and_values_beside_its_english() -> None:
    plain = result_document(sample_report())["rejections"][2]
    assert plain["code"] == "marker contradicts the others"
    assert plain["subject"] == {"kind": "marker", "name": "17", "station": "A1"}
    assert plain["values"] == {"off_sigmas": 14.2, "limit_sigmas": 3.0}
    assert (plain["what"], plain["value"], plain["limit"]) == ("station A1, marker 17", "14 sigma", "3 sigma")


def test_values_of_every_kind_are_read_as_they_were_written() -> None:
    values = {
        "name": "ß",
        "found": 3,
        "share": 0.25,
        "known": True,
        "names": ("a", "b"),
        "ratios": (1.5, 2.0),
        "none": (),
    }
    rejection = Rejection(
        code=Reason.STATION_MEMORY, subject=Subject(kind=SubjectKind.STATION, name="A1"), values=values
    )
    again = rejection_from_plain(json.loads(json.dumps(rejection_to_plain(rejection))))
    assert again == rejection
    assert [type(value) for value in again.values.values()] == [type(value) for value in values.values()]


@pytest.mark.parametrize(
    ("text", "source", "segmenter"),
    [
        ("geometric", InstanceSource.GEOMETRY, ""),
        ("geometry alone", InstanceSource.GEOMETRY_ALONE, ""),
        ("geometry and concrete", InstanceSource.BOTH, "concrete"),
        ("geometric and X", InstanceSource.BOTH, "X"),
        ("concrete", InstanceSource.NETWORK, "concrete"),
    ],
)
def test_who_found_a_face_is_read_from_results_that_said_it_in_words(
    old: dict[str, Any], tmp_path: Path, text: str, source: InstanceSource, segmenter: str
) -> None:
    for station in old["stations"]:
        for face in station["faces"]:
            face["source"] = text
    report = read(old, tmp_path)
    assert {(face.source, face.segmenter) for station in report.stations for face in station.faces} == {
        (source, segmenter)
    }
    write_result(report, tmp_path / "again.json")
    again = read_result(tmp_path / "again.json")
    assert {(face.source, face.segmenter) for one in again.stations for face in one.faces} == {(source, segmenter)}


def test_equal_rejections_of_a_visit_are_named_once() -> None:
    one, two = (replace(sample_report().rejections[0], values={"found": 0, "needed": 2}) for _ in range(2))
    assert list(dict.fromkeys([one, two, replace(one, values={"found": 1, "needed": 2})])) == [
        one,
        replace(one, values={"found": 1, "needed": 2}),
    ]
