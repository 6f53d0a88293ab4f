"""Warnings that say the same become one line with a count and the list of what it concerns."""

from __future__ import annotations

from dataclasses import replace

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.errors import Rejection
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.wording.of_page.alike import MOST_NAMED, days_alike, doubts_alike, notes_alike, rejections_alike
from tests.report.sample_report import sample_report


def marker(number: int, off: float = 14.2) -> Rejection:
    subject = about(SubjectKind.MARKER, str(number), "A1")
    values = {"off_sigmas": off, "limit_sigmas": 3.0}
    return Rejection(code=Reason.MARKER_CONTRADICTS, subject=subject, values=values)


def unusable(number: int, error: str = "its body is open") -> Note:
    subject = about(SubjectKind.ELEMENT, f"id{number}")
    return noted(Reason.ELEMENT_UNUSABLE, subject, ifc_class="IfcWall", element=f"W: {number}", error=error)


def test_thirty_markers_with_one_fault_are_one_line_that_counts_them() -> None:
    (one,) = rejections_alike(marker(number) for number in range(30))
    assert one.line.startswith("30 times: ") and one.line.count("marker") >= MOST_NAMED
    assert one.line.endswith("and 24 more") and "\n" not in one.line
    assert len(one.concerns) == 30 and "14 sigma" in one.concerns[0]


def test_a_single_warning_stays_a_sentence_and_different_ones_stay_apart() -> None:
    (one,) = rejections_alike([marker(17)])
    assert one.concerns == () and one.line.startswith("station A1, marker 17: contradicts")
    assert len(notes_alike([unusable(1), unusable(2, "it is empty")])) == 2


def test_elements_with_one_fault_are_one_line_whatever_their_names() -> None:
    (one,) = notes_alike([unusable(1), unusable(2), unusable(2)])
    assert one.line.startswith("2 times: can't be used: its body is open: IfcWall W: 1 (id1)")


def test_a_note_that_every_visit_has_is_one_line_with_their_days() -> None:
    lines = days_alike([("2026-03-02", "turned"), ("2026-03-16", "turned"), ("2026-03-16", "other")])
    assert lines == ("visits 2026-03-02, 2026-03-16: turned", "visit 2026-03-16: other")


def test_the_page_lists_what_a_warning_concerns_once() -> None:
    report = sample_report()
    torn = tuple(replace(element, cells_conflict=1.0) for element in report.elements)
    assert len(doubts_alike(torn)[0].concerns) == len(torn)
    page = page_html(replace(report, elements=torn, rejections=tuple(map(marker, range(30)))), {})
    notice = page[page.index("Please look at") :].partition("</section>")[0]
    for element in torn:
        assert f'href="#e-{element.global_id}"' in notice
        assert all(f">picture {name}</a>" in notice for name in element.stations)
    assert notice.count("<li>") == 3 and "<strong>30</strong> times" in notice and "marker 29" in notice
