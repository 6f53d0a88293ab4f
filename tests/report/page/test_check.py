"""The page of a check: names out of files are text, and each grade has its words."""

from __future__ import annotations

from datetime import date

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import rejected
from asbuilt_bim.measure.station import RejectedStation
from asbuilt_bim.progress.visits.checked import CheckedVisit, checked_station
from asbuilt_bim.report.page.check import MADE_BY, check_page
from asbuilt_bim.report.wording.of_page.check_words import verdict_words

EVIL = "<script>alert(1)</script>"


def refused(name: str) -> CheckedVisit:
    reason = rejected(Reason.TARGET_ABSENT, about(SubjectKind.TARGET, station=name))
    outcome = RejectedStation(station=name, rejections=(reason,))
    return CheckedVisit(day=date(2026, 3, 2), stations=(checked_station(outcome, (reason,), None, b"", None),))


def test_a_stations_name_is_text_whatever_it_holds() -> None:
    page = check_page(refused(EVIL), EVIL)
    assert b"<script" not in page and b"&lt;script&gt;" in page
    assert MADE_BY in page[:2048]


def test_what_comes_after_a_failed_step_was_not_looked_at() -> None:
    grades = {one.aspect: one.grade for one in refused("A1").stations[0].aspects}
    assert grades["disc"] == "not" and grades["tags"] == grades["place"] == "unchecked"


def test_the_verdict_says_what_to_take_again() -> None:
    assert "Not one station" in verdict_words(refused("A1"))
