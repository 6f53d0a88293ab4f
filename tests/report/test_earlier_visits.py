"""What is wrong with an earlier visit stands on pages and in the workbook, with its reasons, as this one's does."""

from __future__ import annotations

import html
import io
import re
from dataclasses import replace
from datetime import date

import openpyxl
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about, noted
from asbuilt_bim.errors import Rejection, rejected
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.context import page_context, with_panels
from asbuilt_bim.report.page.environment import environment
from asbuilt_bim.report.page.interactive import interactive_from
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.tables import faults_before
from asbuilt_bim.report.workbook.write import workbook_bytes
from tests.report.sample_report import sample_report

FIRST = date(2026, 3, 2)
FAULT = rejected(
    Reason.PHOTOS_OF_OTHER_DAY,
    about(SubjectKind.VISIT, FIRST.isoformat()),
    stations=("U3",),
    days=("2026-03-16",),
    count=7,
    clock_wrong=False,
)
LOST = rejected(
    Reason.STATION_OF_OTHER_DAY, about(SubjectKind.STATION, "U3"), day=FIRST.isoformat(), taken="2026-03-16"
)
WRONG = "An earlier visit is known to be wrong: clear this before anybody is paid"


def first_visit(*rejections: Rejection) -> ProgressReport:
    return replace(sample_report(), visit_date=FIRST, earlier_visits=(), rejections=rejections)


def last_visit() -> ProgressReport:
    not_used = noted(Reason.STATIONS_NOT_USED, about(SubjectKind.VISIT, FIRST.isoformat()), stations=("U3",))
    return replace(sample_report(), rejections=(), notes=(not_used,))


def text_of(page: str) -> str:
    return html.unescape(re.sub("<[^>]+>", " ", page[page.index("<main>") : page.index("At a glance")]))


def sheet_text(data: bytes, sheet: str) -> str:
    cells = openpyxl.load_workbook(io.BytesIO(data), data_only=True)[sheet].iter_rows()
    return "\n".join(str(cell.value) for row in cells for cell in row if cell.value is not None)


@pytest.fixture(scope="module")
def told() -> dict[str, str]:
    report, earlier = last_visit(), (first_visit(FAULT, LOST),)
    context, templates = page_context(report, {}, earlier, {}), environment()
    data = workbook_bytes(report, earlier)
    return {
        "page": text_of(page_html(report, {}, earlier)),
        "interactive": text_of(interactive_from(with_panels(context, templates), templates)),
        "Summary": sheet_text(data, "Summary"),
        "Valuation": sheet_text(data, "Valuation"),
    }


@pytest.mark.parametrize("where", ["page", "interactive", "Summary", "Valuation"])
def test_what_is_known_to_be_wrong_with_an_earlier_visit_is_told(told: dict[str, str], where: str) -> None:
    assert WRONG in told[where]
    assert "Visit of 2026-03-02: photos' days: the photos of 1 of 7 stations are of another day" in told[where]


@pytest.mark.parametrize("where", ["page", "interactive", "Summary"])
def test_a_station_left_out_of_an_earlier_visit_stands_there_with_its_reason(told: dict[str, str], where: str) -> None:
    assert "U3 of the visit of 2026-03-02: rejected" in told[where]
    assert "its photos are of 2026-03-16, and not of the visit's day, 2026-03-02" in told[where]


def test_a_station_that_is_told_with_its_reason_is_not_told_again_without(told: dict[str, str]) -> None:
    assert "could not be used" not in page_html(last_visit(), {}, (first_visit(FAULT, LOST),))
    assert "could not be used" in page_html(last_visit(), {}), "its visit's result may be gone"


def test_an_earlier_visit_that_is_sound_or_wrong_just_as_this_one_says_nothing_of_its_own() -> None:
    report = last_visit()
    sound = replace(first_visit(), stations=report.stations[:1])
    assert WRONG not in page_html(report, {}, (sound,))
    assert faults_before((first_visit(FAULT),), replace(report, rejections=(FAULT,))) == ()
