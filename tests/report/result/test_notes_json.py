"""Notes in a result: codes beside the English; results without codes read as they were written."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from asbuilt_bim.codes import Note, Reason, SubjectKind, about
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.csv import csv_text
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.result.document import read_result, result_document, write_result
from asbuilt_bim.report.tables import element_rows
from asbuilt_bim.report.wording.notes import note_words
from tests.notes import codes
from tests.report.sample_report import sample_report

LOST = Note(
    code=Reason.STATIONS_NOT_USED, subject=about(SubjectKind.VISIT, "2026-03-02"), values={"stations": ("A1", "A2")}
)
GONE = Note(code=Reason.GONE, subject=about(SubjectKind.ELEMENT, "id"), values={"area_m2": 0.1 + 0.2})
KNOCKED = Note(
    code=Reason.PAST_DESIGN, subject=about(SubjectKind.FACE, "A1/2", "A1"), values={"area_m2": 2.7182818284590455}
)


def report() -> ProgressReport:
    made = sample_report()
    first, face = made.elements[0], made.faces[0]
    element = replace(first, notes=(GONE, KNOCKED), doubts=(GONE,))
    noted = replace(face, surface=replace(face.surface, notes=(KNOCKED,), doubts=(KNOCKED,)))
    return replace(
        made, notes=(*made.notes, LOST), elements=(element, *made.elements[1:]), faces=(noted, *made.faces[1:])
    )


def read_again(tmp_path: Path, change: Callable[[Any], None]) -> ProgressReport:
    """Return the report as it is read from a file that was changed."""
    write_result(report(), tmp_path / "result.json")
    document = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    change(document)
    (tmp_path / "result.json").write_text(json.dumps(document), encoding="utf-8")
    return read_result(tmp_path / "result.json")


def without_codes(part: Any) -> None:
    """Take the codes out of a document, as those of older programs are."""
    if isinstance(part, dict):
        part.pop("note_codes", None)
        part.pop("doubt_codes", None)
    for inner in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
        without_codes(inner)


def test_notes_come_back_as_they_were_with_their_english_beside_them(tmp_path: Path) -> None:
    before, after = report(), read_again(tmp_path, lambda document: None)
    assert after.notes == before.notes
    assert after.elements[0].notes == (GONE, KNOCKED) and after.elements[0].doubts == (GONE,)
    assert after.faces[0].surface.notes == after.faces[0].surface.doubts == (KNOCKED,)
    document = result_document(before)
    assert document["notes"][-1] == note_words(LOST)
    assert document["note_codes"][-1] == {
        "code": "stations not used",
        "subject": {"kind": "visit", "name": "2026-03-02", "station": ""},
        "values": {"stations": ["A1", "A2"]},
    }


def test_a_result_of_before_there_were_codes_reads_as_unstated_and_prints_the_same(tmp_path: Path) -> None:
    before = read_again(tmp_path, lambda document: None)
    old = read_again(tmp_path, without_codes)
    assert set(codes((*old.notes, *old.elements[0].notes, *old.elements[0].doubts))) == {Reason.UNSTATED}
    assert page_html(old, {}) == page_html(before, {})
    assert csv_text(old) == csv_text(before) and element_rows(old) == element_rows(before)
    assert result_document(old)["notes"] == result_document(before)["notes"]


def test_a_code_that_only_a_newer_program_knows_reads_as_its_text(tmp_path: Path) -> None:
    def newer(document: Any) -> None:
        document["minor"] += 1
        document["note_codes"][-1]["code"] = "told by the moon"
        document["elements"][0]["note_codes"][0]["values"] = {}

    after = read_again(tmp_path, newer)
    assert codes(after.notes)[-1] == Reason.UNSTATED and note_words(after.notes[-1]) == note_words(LOST)
    assert codes(after.elements[0].notes) == [Reason.UNSTATED, Reason.PAST_DESIGN]
    assert [note_words(note) for note in after.elements[0].notes] == [note_words(GONE), note_words(KNOCKED)]
