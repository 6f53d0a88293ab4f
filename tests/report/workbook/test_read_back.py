"""The last workbook is read back: what a surveyor wrote is carried on, what was certified is never guessed."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import openpyxl
import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import WorkbookError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import Override, RateChange, Terms, ValuationInputs, Variation
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.report.workbook.read import read_last_workbook
from asbuilt_bim.report.workbook.write import write_workbook
from benchmarks.valuation.sequences import signed
from tests.report.sample_report import sample_report
from tests.report.workbook.saved import at, typed

DAY = date(2026, 3, 20)
LINE = sample_report().cost_lines[0]
INPUTS = ValuationInputs(
    terms=Terms(retention=0.05, tax=0.19),
    overrides=(Override(line=LINE.global_id, element=LINE.elements[0], share=0.4, reason="r", by="B", day=DAY),),
    rates=(RateChange(line=sample_report().cost_lines[1].global_id, rate=77.77, why="agreed, B"),),
    variations=(Variation(number="V1", text="t", order="o", unit="m3", quantity=3.5, rate=100.01, share=0.5, by="B"),),
)
SIGNED = {("", "signed_by"): "Ann", ("", "signed_on"): DAY}


@pytest.fixture
def workbook(tmp_path: Path) -> Path:
    return written(with_valuation(sample_report(), INPUTS), tmp_path / "q.xlsx")


def written(report: ProgressReport, path: Path) -> Path:
    write_workbook(report, path)
    return path


def refusal(path: Path) -> str:
    with pytest.raises(WorkbookError) as caught:
        read_last_workbook(path)
    return str(caught.value)


def test_what_persons_wrote_comes_back_as_it_was(workbook: Path) -> None:
    last = read_last_workbook(workbook)
    assert last.notes == () and replace(last.inputs, before=()) == INPUTS
    assert [(one.bill, one.work, one.tax) for one in last.inputs.before] == [(1, 0.0, 0.0), (2, 0.0, 0.0)]


def test_a_signed_workbook_is_what_came_before_the_next_valuation(workbook: Path) -> None:
    last = read_last_workbook(typed(workbook, SIGNED)).inputs
    by_hand = signed(with_valuation(sample_report(), INPUTS))
    assert (last.paid, last.before, last.paid_variations) == (by_hand.paid, by_hand.before, by_hand.paid_variations)
    (one,) = last.certificates
    assert (one.number, one.signed_by, one.signed_on, one.visit) == (1, "Ann", DAY, sample_report().visit_date)
    assert last.number == 2


def test_a_day_of_signing_before_the_visit_or_the_last_valuation_is_mistyped_and_refused(
    workbook: Path, tmp_path: Path
) -> None:
    visit = sample_report().visit_date
    early = typed(workbook, {**SIGNED, ("", "signed_on"): visit - timedelta(days=1)})
    assert f"before its visit ({visit.isoformat()}); correct the day on 'Valuation'" in refusal(early)
    first = read_last_workbook(typed(workbook, SIGNED)).inputs
    again = written(with_valuation(sample_report(), first), tmp_path / "second.xlsx")
    earlier = typed(again, {**SIGNED, ("", "signed_on"): DAY - timedelta(days=1)})
    assert "before valuation 1 was signed (2026-03-20)" in refusal(earlier)


def test_what_was_certified_goes_through_a_workbook_that_nobody_signed(workbook: Path, tmp_path: Path) -> None:
    first = read_last_workbook(typed(workbook, SIGNED)).inputs
    again = read_last_workbook(written(with_valuation(sample_report(), first), tmp_path / "two.xlsx")).inputs
    assert replace(again, signed_terms=first.terms) == first  # a run takes these from its result
    third = read_last_workbook(typed(tmp_path / "two.xlsx", SIGNED)).inputs
    assert [one.number for one in third.certificates] == [1, 2]
    report = with_valuation(sample_report(), third)
    assert all(bill.period.work == 0.0 == bill.period.tax for bill in bills(report))


def test_a_lines_override_and_rate_are_read_from_the_cells_that_a_surveyor_typed(workbook: Path) -> None:
    typed(workbook, {
        at(workbook, "Cost by element", "Override", 3): 0.25, at(workbook, "Cost by element", "By", 3): "Cy",
        at(workbook, "Bill", "Rate", 3): 1.25, ("", "retention_rate"): 0.1,
    })  # fmt: skip
    last = read_last_workbook(workbook).inputs
    assert [one.share for one in last.overrides] == [0.25, 0.4] and last.overrides[0].by == "Cy"
    assert [one.rate for one in last.rates] == [77.77, 1.25] and last.terms.retention == 0.1


def test_an_override_that_is_emptied_and_a_rate_put_back_are_gone(workbook: Path) -> None:
    place = next(row for row in range(20) if _cell(workbook, "Cost by element", "Override", row) == 0.4)
    typed(workbook, {
        at(workbook, "Cost by element", "Override", place): None, at(workbook, "Bill", "Rate", 2): 62.5,
    })  # fmt: skip
    last = read_last_workbook(workbook).inputs
    assert last.overrides == () and last.rates == ()


def _cell(path: Path, sheet: str, heading: str, row: int) -> object:
    return openpyxl.load_workbook(path, data_only=True)[sheet][at(path, sheet, heading, row)[1]].value


@pytest.mark.parametrize(
    ("sheet", "heading", "value", "code"),
    [
        ("Cost by element", "Override", "half", Reason.OVERRIDE_UNREADABLE),
        ("Cost by element", "Override", 1.5, Reason.OVERRIDE_UNREADABLE),
        ("Bill", "Rate", "a lot", Reason.RATE_UNREADABLE),
        ("Variations", "Quantity", "some", Reason.VARIATION_UNREADABLE),
        ("Variations", "Done", 1.2, Reason.VARIATION_UNREADABLE),
        ("Variations", "Done", "50 %", Reason.VARIATION_UNREADABLE),
        ("Variations", "Bill", "2", Reason.VARIATION_UNREADABLE),
    ],
)
def test_what_cannot_be_read_of_a_persons_cells_is_named_and_counts_for_nothing(
    workbook: Path, sheet: str, heading: str, value: str | float, code: Reason
) -> None:
    if (sheet, heading) == ("Bill", "Rate"):
        with pytest.raises(WorkbookError, match=r"'Rate' is the text 'a lot' and no number\. Give the cell a number"):
            read_last_workbook(typed(workbook, {at(workbook, sheet, heading, 0): value}))
        return
    last = read_last_workbook(typed(workbook, {at(workbook, sheet, heading, 0): value}))
    assert [note.code for note in last.notes] == [code]
    assert all(one.share == 0.0 for one in last.inputs.variations if code is Reason.VARIATION_UNREADABLE)


def test_days_may_be_typed_as_german_text(workbook: Path) -> None:
    by_day = read_last_workbook(typed(workbook, SIGNED)).inputs
    german = f"{DAY:%d.%m.%Y}"
    typed(workbook, {("", "signed_on"): german, at(workbook, "Cost by element", "Date", 3): "02.03.2026",
                     at(workbook, "Cost by element", "Override", 3): 0.25})  # fmt: skip
    by_text = read_last_workbook(workbook).inputs
    assert by_text.certificates[-1].signed_on == by_day.certificates[-1].signed_on == DAY
    assert by_text.overrides[0].day == date(2026, 3, 2)


Change = Callable[[Path], dict[tuple[str, str], str | float | date | None]]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda p: {("", "signed_by"): "Ann"}, "the date of who certified it is missing"),
        (lambda p: {("", "signed_on"): DAY}, "the name of who certified it is missing"),
        (lambda p: {**SIGNED, ("", "signed_on"): "soon"}, "no day"),
        (lambda p: {("", "tax_rate"): None}, "tax rate on 'Valuation' is empty, and no percentage from 0 % to 100 %"),
        (lambda p: {("", "tax_rate"): 19.0}, "tax rate on 'Valuation' is 1900 %, and no percentage from 0 % to 100 %"),
        (lambda p: {("", "tax_rate"): "19 %"}, "tax rate on 'Valuation' is the text '19 %', and no percentage"),
        (lambda p: {("", "asbuilt_bim_valuation"): 2}, "another version"),
        (lambda p: {**SIGNED, at(p, "Bill", "Certified amount", 0): 1e6}, "isn't"),
        (lambda p: {**SIGNED, at(p, "Bill", "Certified quantity", 0): None}, "has no value, and none is guessed"),
        (lambda p: {**SIGNED, at(p, "Cost by element", "Override", 5): 0.91}, "its override is 91.0%"),
        (lambda p: {**SIGNED, at(p, "Cost by element", "Counts", 5): 0.0123}, "its rows of 'Cost by element' come to"),
        (lambda p: {**SIGNED, at(p, "Variations", "Done", 0): 1.0}, "variation V1 isn't"),
        (lambda p: {**SIGNED, ("", "work_cumulative_1"): 1.0}, "'Valuation' says"),
        (lambda p: {at(p, "Bill", "Key", -1): "key"}, "lacks its headings"),
        (lambda p: {("Bill", "B4"): "Text"}, "two columns of one heading"),
        (lambda p: {at(p, "Bill", "Previous amount", 0): 5.0}, "its lines 5.00"),
    ],
)
def test_a_workbook_whose_certificate_would_have_to_be_guessed_is_refused(
    workbook: Path, change: Change, reason: str
) -> None:
    with pytest.raises(WorkbookError, match=reason):
        read_last_workbook(typed(workbook, change(workbook)))


def test_a_certified_row_that_was_taken_out_is_refused_with_the_remedy(workbook: Path, tmp_path: Path) -> None:
    first = read_last_workbook(typed(workbook, SIGNED)).inputs
    path = written(with_valuation(sample_report(), first), tmp_path / "two.xlsx")
    before = {("", f"variations_previous_{1}"): 0.0}
    rows = {at(path, "Variations", heading, 0): None for heading in ("No.", "Text", "Previous amount")}
    assert "put back the rows" in refusal(typed(path, {**rows, **before}))


def below(path: Path, table: int, values: dict[str, str | float]) -> Path:
    """Write a row right below the variations, as a person does, whose table has so many rows."""
    cells = {at(path, "Variations", heading, table): value for heading, value in values.items()}
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    sheet = f"xl/worksheets/sheet{openpyxl.load_workbook(path).sheetnames.index('Variations') + 1}.xml"
    row = "".join(f'<c r="{place}"/>' for place in sorted(place for _, place in cells))
    files[sheet] = re.sub(rb"<dimension [^>]*/>", b"", files[sheet])  # of the rows before
    files[sheet] = files[sheet].replace(b"</sheetData>", f'<row r="{5 + table}">{row}</row></sheetData>'.encode())
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return typed(path, cells)


MORE: dict[str, str | float] = {
    "No.": "V13", "Text": "more", "Unit": "m", "Quantity": 9.0, "Rate": 111.0, "Done": 1.0,
}  # fmt: skip


def test_a_signed_variation_below_the_table_is_told_how_it_gets_its_formulas_and_its_bill(workbook: Path) -> None:
    rows = openpyxl.load_workbook(workbook)["Variations"].max_row - 4
    plain, without_bill, whole = (workbook.with_name(f"{name}.xlsx") for name in ("plain", "bill", "whole"))
    for path, more in ((plain, {}), (without_bill, {"Certified amount": 999.0}),
                       (whole, {"Certified amount": 999.0, "Bill": 1})):  # fmt: skip
        path.write_bytes(workbook.read_bytes())
        below(path, rows, {**MORE, **more})
    assert "V13" in refusal(typed(plain, SIGNED)) and "copy a row of the table over it" in refusal(plain)
    assert "'Bill' has no value" in refusal(typed(without_bill, SIGNED)) and "write the number" in refusal(without_bill)
    sums = {("", "variations_cumulative_1"): 1174.02}
    assert read_last_workbook(typed(whole, {**SIGNED, **sums})).inputs.paid_variations["V13"] == 999.0


def test_an_unsigned_variation_typed_below_the_table_is_carried_on(workbook: Path) -> None:
    rows = openpyxl.load_workbook(workbook)["Variations"].max_row - 4
    last = read_last_workbook(below(workbook, rows, MORE)).inputs.variations[-1]
    assert (last.number, last.quantity, last.rate, last.share, last.bill) == ("V13", 9.0, 111.0, 1.0, 1)


def test_a_workbook_that_a_program_saved_without_calculating_is_refused(workbook: Path) -> None:
    book = openpyxl.load_workbook(workbook)
    book.save(workbook)
    assert "has no value" in refusal(workbook) and "Ctrl+Shift+F9" in refusal(workbook)


def test_a_damaged_workbook_is_to_be_put_back_from_its_signed_copy_or_from_the_runs(workbook: Path) -> None:
    workbook.write_text("no workbook", encoding="utf-8")
    assert "signed copy" in refusal(workbook) and "runs/" in refusal(workbook) and "CSV" not in refusal(workbook)


def test_a_workbook_without_a_bill_holds_nothing(tmp_path: Path) -> None:
    path = written(replace(sample_report(), cost_lines=()), tmp_path / "q.xlsx")
    assert read_last_workbook(path).inputs == ValuationInputs()


def test_previous_amounts_typed_before_the_first_certificate_count(tmp_path: Path) -> None:
    path = written(with_valuation(sample_report(), ValuationInputs()), tmp_path / "q.xlsx")
    typed(path, {
        at(path, "Bill", "Previous quantity", 0): 1.0, at(path, "Bill", "Previous amount", 0): 185.0,
        ("", "work_previous_1"): 185.0, ("", "retention_previous_1"): 9.25, ("", "tax_previous_1"): 30.0,
    })  # fmt: skip
    report = with_valuation(sample_report(), read_last_workbook(path).inputs)
    bill = bills(report)[0]
    assert (bill.previous.work, bill.previous.retention, bill.previous.tax) == (185.0, 9.25, 30.0)
    assert bill.lines[0].previous == 185.0
