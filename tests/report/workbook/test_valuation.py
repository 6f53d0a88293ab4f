"""The workbook is a valuation: live formulas whose values are ours, names and tables, pages that print."""

from __future__ import annotations

import html
import io
import re
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import openpyxl
import pytest

from asbuilt_bim.progress.report import Completion, ProgressReport
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import Observation, Override, RateChange, Terms, ValuationInputs, Variation
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.report.by_persons import by_persons
from asbuilt_bim.report.cost_rows import possible_of, possible_share
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.tables import still_in_doubt
from asbuilt_bim.report.wording.of_page.alike import doubts_alike
from asbuilt_bim.report.wording.values import number
from asbuilt_bim.report.workbook.layout import sum_name
from asbuilt_bim.report.workbook.write import workbook_bytes
from tests.report.sample_report import global_id, sample_report

TERMS = Terms(retention=0.05, tax=0.19)
VARIATION = Variation(
    number="V1", text="more", order="letter", unit="m3", quantity=3.5, rate=100.01, share=0.5, by="Ann"
)


def valued(**inputs: object) -> ProgressReport:
    return with_valuation(sample_report(), ValuationInputs(terms=TERMS, **inputs))  # type: ignore[arg-type]


def book(report: ProgressReport, *, values: bool = False) -> openpyxl.Workbook:
    return openpyxl.load_workbook(io.BytesIO(workbook_bytes(report)), data_only=values)


def rows(made: openpyxl.Workbook, sheet: str) -> list[dict[str, object]]:
    heads = [cell.value for cell in made[sheet][4]]
    found = [dict(zip(heads, row, strict=True)) for row in made[sheet].iter_rows(min_row=5, values_only=True)]
    return [row for row in found if isinstance(row.get("No."), int)]


def test_every_amount_of_the_bill_is_a_live_formula_with_the_value_that_we_work_out() -> None:
    report = valued()
    formulas, values = rows(book(report), "Bill"), rows(book(report, values=True), "Bill")
    lines = [line for bill in bills(report) for line in bill.lines]
    assert len(lines) == len(values) == 4
    for line, formula, value in zip(lines, formulas, values, strict=True):
        for heading in ("Contract amount", "This period amount", "Certified amount", "Remaining amount"):
            assert str(formula[heading]).startswith("=ROUND(")
        assert str(formula["Sum of elements"]).startswith("=SUMIF('Cost by element'")
        assert (value["Certified quantity"], value["Certified amount"]) == (line.quantity, line.amount)
        assert value["Contract amount"] == line.line.planned_value


def test_the_elements_feed_the_bill_whatever_way_they_are_sorted() -> None:
    report = valued()
    parts = rows(book(report, values=True), "Cost by element")
    for line in (line for bill in bills(report) for line in bill.lines):
        own = [row for row in parts if row["No."] == line.number]
        assert sum(float(str(row["Quantity"])) for row in own) == pytest.approx(line.line.planned_quantity)
        certified = sum(float(str(row["Quantity"])) * float(str(row["Counts"])) for row in own)
        assert certified == pytest.approx(line.quantity, abs=0.0006)


def test_the_bill_without_persons_is_what_the_page_says_was_earned() -> None:
    report = valued()
    for line in (line for bill in bills(report) for line in bill.lines):
        assert (line.quantity, line.amount) == (line.line.as_built_lower, line.line.earned_lower)


def test_pieces_are_shown_as_whole_numbers() -> None:
    (anchors,) = [row for row in rows(book(valued(), values=True), "Bill") if row["Unit"] == "pcs"]
    assert anchors["Certified quantity"] == 1.0  # of five columns one is complete


def test_each_currency_is_a_bill_with_its_own_sums() -> None:
    report = valued()
    made = book(report, values=True)
    totals = {row[2]: row for row in made["Bill"].iter_rows(min_row=5, values_only=True) if str(row[2])[:5] == "Total"}
    assert {name[-3:] for name in totals} == {"EUR", "CHF"}
    for bill in bills(report):
        row = next(row for name, row in totals.items() if name.endswith(bill.currency))
        assert row[12] == bill.cumulative.work


def test_what_a_person_set_is_in_a_colour_of_its_own() -> None:
    line = sample_report().cost_lines[0]
    override = Override(
        line=line.global_id, element=line.elements[0], share=0.4, reason="tape", by="Ann", day=date(2026, 3, 17)
    )
    report = valued(overrides=(override,), variations=(VARIATION,))
    parts = book(report)["Cost by element"]
    heads = {cell.value: cell.column for cell in parts[4]}
    row = next(row for row in parts.iter_rows(min_row=5) if row[heads["Override"] - 1].value == 0.4)
    assert row[heads["Reason"] - 1].value == "tape"
    yellow = {row[heads[name] - 1].fill.start_color.rgb for name in ("Override", "Reason", "By", "Date")}
    assert yellow == {"FFFFF3CD"} and row[0].fill.start_color.rgb != "FFFFF3CD"
    variations = book(report, values=True)["Variations"]
    assert [cell.value for cell in variations[5]][7:12] == [350.04, 0.5, 0, 175.02, 175.02]


def test_a_variation_below_the_tables_rows_counts_and_gets_the_tables_formulas() -> None:
    made = book(valued(variations=(VARIATION,)))
    sheet, place = made.defined_names["variations_cumulative_1"].attr_text.split("!")
    formula = made[sheet.strip("'")][place.replace("$", "")].value
    assert formula == "=ROUND(SUMIF(Variations!$A:$A,1,Variations!$L:$L),2)"
    given = {one.name: one.calculatedColumnFormula for one in made["Variations"].tables["Variations"].tableColumns}
    own = {name: one.attr_text for name, one in given.items() if one}
    assert own.keys() == {"Bill", "Amount", "This period amount", "Certified amount"} and own["Bill"] == "1"
    heads = {str(cell.value): cell.column_letter for cell in made["Variations"][4]}
    for name, text in own.items():
        here = re.sub(r"Variations\[\[#This Row\],\[(.+?)\]\]", lambda found: f"{heads[found[1]]}5", text)
        assert name == "Bill" or made["Variations"][f"{heads[name]}5"].value == f"={here}"


def test_sums_are_named_cells_and_tables_are_named() -> None:
    report = valued()
    made, values = book(report), book(report, values=True)
    sheet, place = made.defined_names["net_this_period_1"].attr_text.split("!")
    assert values[sheet.strip("'")][place.replace("$", "")].value == bills(report)[0].period.net
    assert {"retention_rate", "tax_rate", "signed_by", "signed_on", "payable_cumulative_2"} <= set(made.defined_names)
    tables = [name for sheet in made for name in sheet.tables]
    assert tables == ["Bill", "CostByElement", "Variations", "Elements"]
    said = (Path(__file__).parents[3] / "docs" / "valuation.md").read_text(encoding="utf-8")
    assert f"Each table has a name: `{'`, `'.join(tables)}`; with its first row also `Certificates`" in said


def test_every_sheet_prints_one_page_wide_in_columns_that_can_be_read() -> None:
    made = book(valued(variations=(VARIATION,)))
    for sheet in made:
        assert sheet.page_setup.paperSize == 9 and sheet.page_setup.fitToHeight == 0
        if sheet.title in ("Summary", "Notes", "Stations", "Tasks", "Late"):
            continue
        area = re.search(r"\$A\$1:\$([A-Z]+)\$\d+", sheet.print_area or "")
        assert area, sheet.title
        last = openpyxl.utils.column_index_from_string(area[1])
        widths = [sheet.column_dimensions[openpyxl.utils.get_column_letter(n + 1)].width for n in range(last)]
        assert sum(widths) <= 220, sheet.title  # 7 points and more on A4


def test_without_cost_lines_each_sheet_says_why_and_what_to_do() -> None:
    made = book(replace(sample_report(), cost_lines=()))
    for name in ("Valuation", "Bill", "Cost by element"):
        text = " ".join(str(cell.value) for row in made[name].iter_rows() for cell in row if cell.value)
        assert "no cost items" in text and "asbuilt-bim template" in text and "costs: costs.csv" in text


def test_observations_stand_beside_what_photos_say() -> None:
    seen = Observation(element=global_id(1), day=date(2026, 3, 17), share=0.8, by="Ann", why="tape")
    later = replace(seen, day=date(2026, 4, 1))
    report = replace(sample_report(), observations=(seen, later), visit_date=date(2026, 3, 17))
    shown = book(with_valuation(report, ValuationInputs()), values=True)["Observations"]
    assert [row[10].value for row in shown.iter_rows(min_row=5, max_row=6)] == [
        "shown only",
        "not yet: after this visit",
    ]
    counted = book(with_valuation(report, ValuationInputs(count_observations=True)), values=True)["Observations"]
    assert counted["K5"].value == "80 %"
    element = next(one for one in report.elements if one.global_id == global_id(1))
    assert counted["G5"].value == pytest.approx(element.completion.lower)


def test_what_a_person_saw_stands_as_it_was_said_and_what_counts_of_it_beside_it() -> None:
    base = sample_report()
    element = max(base.elements, key=lambda one: one.completion.lower)
    assert element.last_seen is not None and element.completion.lower > 0.375
    seen = Observation(element=element.global_id, day=date(2026, 1, 1), share=0.375, by="Ann", why="tape")
    report = with_valuation(replace(base, observations=(seen,)), ValuationInputs(count_observations=True))
    sheet = book(report, values=True)["Cost by element"]
    at = {cell.value: index for index, cell in enumerate(sheet[4])}
    row = next(row for row in sheet.iter_rows(min_row=5) if row[at["GlobalId"]].value == element.global_id)
    assert row[at["Seen by a person"]].value == 0.375
    assert row[at["Beside photos"]].value == pytest.approx(element.completion.lower)


def test_photos_that_disagreed_are_told_until_a_later_visit_shows_the_element_again() -> None:
    first = sample_report()
    torn = next(one for one in first.elements if one.cells_conflict > 0.0 and one.stations)
    blind = tuple(replace(one, stations=(), cells_conflict=0.0, notes=()) for one in first.elements)
    last = replace(first, visit_date=first.visit_date + timedelta(days=14), elements=blind)
    (told,) = [one for one in still_in_doubt(last, (first,)) if one.global_id == torn.global_id]
    assert told.cells_conflict > 0.0 and first.visit_date.isoformat() in told.stations[0]
    shown = replace(last, elements=tuple(replace(one, stations=("B1",)) for one in blind))
    assert not any(one.cells_conflict for one in still_in_doubt(shown, (first,)))


def test_no_text_of_a_table_or_a_person_becomes_a_formula() -> None:
    line = sample_report().cost_lines[0]
    evil = "=cmd|' /C calc'!A0"
    override = Override(line=line.global_id, element=line.elements[0], share=0.4, reason=evil, by=evil, day=None)
    report = valued(overrides=(override,), variations=(replace(VARIATION, text=evil, order=evil),))
    for sheet in book(report):
        for row in sheet.iter_rows():
            assert all(cell.data_type != "f" for cell in row if cell.value == evil)


def test_the_amounts_of_the_elements_add_up_to_the_bill_to_the_cent() -> None:
    base = sample_report()
    odd = [replace(line, planned_quantity=line.planned_quantity * 1.003333, rate=1037.77) for line in base.cost_lines]
    report = with_valuation(replace(base, cost_lines=tuple(odd)), ValuationInputs(terms=TERMS))
    made = book(report, values=True)
    parts, lines = rows(made, "Cost by element"), rows(made, "Bill")
    apart = 0
    for line in lines:
        own = [row for row in parts if row["No."] == line["No."]]
        assert round(sum(float(str(row["Amount"])) for row in own), 2) == line["Certified amount"]
        apart += round(sum(float(str(row["Before the line"])) for row in own), 2) != line["Certified amount"]
    assert apart, "nothing was rounded: the case proves nothing"
    amounts = [str(row["Amount"]) for row in rows(book(report), "Cost by element")]
    assert sum("SUMIF(" in formula for formula in amounts) == len(lines)  # one row of each line takes the rest


def test_no_best_amount_stands_where_less_than_half_was_seen() -> None:
    base = sample_report()
    first, *rest = base.cost_lines
    seen_little = replace(first.completion, best=1.0, coverage=0.3)
    little = replace(
        first, completion=seen_little, as_built_best=first.planned_quantity, earned_best=first.planned_value
    )
    half = {"as_built_best": 1.0, "earned_best": 1.0}
    known = [replace(line, completion=replace(line.completion, best=0.5, coverage=0.8), **half) for line in rest]
    report = with_valuation(replace(base, cost_lines=(little, *known)), ValuationInputs(terms=TERMS))
    made = book(report, values=True)
    (row,) = [row for row in rows(made, "Bill") if row["Key"] == first.global_id]
    assert (row["Best quantity"], row["Best amount"]) == ("unknown", "unknown")
    heads = [str(cell.value) for cells in made["Valuation"].iter_rows() for cell in cells if cell.value]
    own = [line for line in report.cost_lines if line.currency == first.currency]
    assert f"Best (1 of {len(own)} lines unknown)" in heads
    bill = next(one for one in bills(report) if one.currency == first.currency)
    assert bill.best is None, "a sum without a line is no estimate of all, and may lie under what is certain"


def before_you_sign(report: ProgressReport) -> str:
    texts = [str(cell.value) for cell in book(report, values=True)["Valuation"]["A"]]
    return "\n".join(texts[texts.index("Before you sign") : texts.index("How it is worked out")])


def test_what_the_page_asks_to_look_at_stands_where_one_signs_if_it_is_paid() -> None:
    report = valued()
    torn = [element for element in report.elements if element.cells_conflict]
    (page,) = doubts_alike(torn)
    assert f"Look before you pay: {page.line}." in before_you_sign(report)
    lines = [replace(line, elements=(), parts={}) for line in report.cost_lines]
    assert "Look before you pay" not in before_you_sign(replace(report, cost_lines=tuple(lines)))


def test_the_sheet_says_that_it_is_the_first_and_which_terms_are_not_set() -> None:
    def text(report: ProgressReport) -> list[str]:
        return [str(c.value) for row in book(report, values=True)["Valuation"].iter_rows() for c in row if c.value]

    none = text(with_valuation(sample_report(), ValuationInputs()))
    assert none.count("not set") == 2 and any("everything since the start" in one for one in none)
    assert "not set" not in text(valued())


def test_what_looks_like_a_sum_error_is_said_where_it_stands() -> None:
    report = valued()
    made = book(report, values=True)
    assert "share of the contract quantity" in str(made["Cost by element"]["A2"].value)
    page = page_html(report, {})
    assert "takes the cents of the line's rounding" in html.unescape(page)
    for row in rows(made, "Cost by element"):
        if row["GlobalId"]:
            assert f"{number(float(str(row['Amount'])))} of it certain" in page


def test_the_sheet_to_sign_says_that_one_side_is_enough() -> None:
    text = " ".join(str(cell.value) for cell in book(valued())["Valuation"]["A"])
    assert "One side is enough" in text and "formwork too" in text and "never what nobody saw" not in text


def observed(**inputs: object) -> ProgressReport:
    """Return the sample with two walls of which persons saw more than photos make certain."""
    report = sample_report()
    looked = [
        Observation(element=one.global_id, day=report.visit_date, share=one.completion.upper, by=by, why="")
        for one, by in ((report.elements[3], "Mia"), (report.elements[4], "Ben"))
    ]
    with_them = replace(report, observations=tuple(looked))
    return with_valuation(with_them, ValuationInputs(terms=TERMS, count_observations=True, **inputs))  # type: ignore[arg-type]


def test_what_persons_saw_is_told_where_one_signs_and_at_money_due_with_its_sum() -> None:
    report = observed()
    page = page_html(report, {})
    due = html.unescape(re.sub("<[^>]+>", "", page[page.index("Money due") : page.index("<nav")]))
    changed = [bill for bill in bills(report) if by_persons(bill).is_theirs]
    assert [bill.currency for bill in changed] == ["EUR"], "of the other bill persons saw nothing"
    for bill in changed:
        photos = sum(line.line.earned_lower for line in bill.lines)
        rests = f"{number(bill.cumulative.work - photos)} on what"
        for told in (before_you_sign(report), due):
            assert "No person" not in told and f"{number(photos)} {bill.currency} rest on photos" in told
            assert rests in told and "Mia saw (W-01 east)" in told
    assert due.count("Certified in all") == due.count("Certain in all") == 1
    assert "rest on photos" not in before_you_sign(valued()), "where photos alone count there is nothing to tell"


def test_the_pages_cards_and_cost_lines_are_the_bill_to_the_cent_where_persons_count() -> None:
    line = sample_report().cost_lines[0]
    override = Override(
        line=line.global_id, element=line.elements[0], share=0.4, reason="tape", by="Ann", day=date(2026, 3, 17)
    )
    report = observed(overrides=(override,))
    page = html.unescape(page_html(report, {}))
    costs = page[page.index('id="cost"') :]
    for bill in bills(report):
        assert f'data-label="Certified">{number(bill.cumulative.work)}<' in costs
        for one in bill.lines:
            assert f'data-label="Certified">{number(one.amount)}<' in costs
            for row, (_, amount) in zip(one.rows, one.amounts(), strict=True):
                by = "the override of Ann" if row.override else ""
                by = f"what {row.observed.observation.by} saw" if row.rests_on_a_person and row.observed else by
                counts = f"certified, by {by}" if by else "certain"
                assert row.element is None or f"{number(amount)} of it {counts}" in page
    assert 'data-label="Certified"' not in page_html(valued(), {})


def test_what_persons_changed_adds_up_to_the_certified_work() -> None:
    line = sample_report().cost_lines[0]
    override = Override(line=line.global_id, element=line.elements[0], share=0.4, reason="", by="", day=None)
    change = RateChange(line=line.global_id, rate=2.0 * line.rate, why="")
    made = bills(observed(overrides=(override,), rates=(change,)))
    for bill in made:
        parts = by_persons(bill)
        assert parts.photos + parts.seen + parts.overridden + parts.rates == pytest.approx(bill.cumulative.work)
    assert any(by_persons(bill).overridden for bill in made) and any(by_persons(bill).rates for bill in made)


def test_the_bill_says_what_may_be_earned_at_most() -> None:
    report = valued()
    made = rows(book(report, values=True), "Bill")
    every = [(line, bill.complete_from) for bill in bills(report) for line in bill.lines]
    for (line, whole_from), row in zip(every, made, strict=True):
        most = possible_of(line, whole_from)
        assert row["Possible amount"] == most and line.amount <= most <= line.contract
    assert any(line.amount < possible_of(line, whole_from) < line.contract for line, whole_from in every)


def test_what_may_be_earned_follows_a_rate_that_is_overwritten() -> None:
    made = book(valued())
    for row in rows(made, "Bill")[: len(valued().cost_lines)]:
        assert re.fullmatch(r"=ROUND\(-?[\d.e+-]+\*F\d+,2\)", str(row["Possible amount"]))
    assert made["Bill"]["F4"].value == "Rate"


def test_where_one_signs_it_is_said_as_soon_as_a_sum_is_another_than_when_the_workbook_was_made() -> None:
    report = valued()
    sheet, values = book(report)["Valuation"], book(report, values=True)["Valuation"]
    said = [cell for row in sheet.iter_rows() for cell in row if "somebody changed" in str(cell.value)]
    assert len(said) == len(bills(report))
    for bill, cell in zip(bills(report), said, strict=True):
        work = f"ROUND({sum_name('work', 'cumulative', bill.number)}-({bill.cumulative.work!r}),2)<>0"
        assert work in str(cell.value) and f"Bill {bill.number}: " in str(cell.value)
        assert not values[cell.coordinate].value
        (text,) = re.findall(r'"(Bill [^"]*)"', str(cell.value))
        assert len(text) <= 255  # longer ones no spreadsheet takes in a formula


def test_a_piece_may_be_whole_from_the_share_that_the_project_says() -> None:
    half = Completion(best=0.5, lower=0.4, upper=0.93, coverage=1.0)
    element = replace(sample_report().elements[0], state="part", completion=half)
    assert possible_share(element, 0.9, pieces=True, takes_off=False) == 1.0
    assert possible_share(element, 0.98, pieces=True, takes_off=False) == 0.0
    assert {bill.complete_from for bill in bills(replace(valued(), complete_from=0.9))} == {0.9}
