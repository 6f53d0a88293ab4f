"""The page's cost lines: numbers that a person can check with a pocket calculator."""

from __future__ import annotations

import re
from dataclasses import replace

from asbuilt_bim.progress.money import cents, total
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.report.cost_rows import worths
from asbuilt_bim.report.page.write import page_html
from tests.report.sample_report import sample_report


def printed(row: str, label: str) -> float:
    (text,) = re.findall(rf'data-label="{label}">([^<]*)<', row)
    (digits,) = re.findall(r"-?\d[\d.\u202f\u2009]*", text)
    return float(re.sub(r"[\u202f\u2009]", "", digits))


def test_each_amount_is_the_printed_quantity_by_the_printed_rate() -> None:
    report = sample_report()
    done, rate = 12.998, 310.1234
    exact = dict(planned_quantity=16.6125, rate=rate, as_built_lower=done, earned_lower=cents(done * rate))
    lines = [line if line.measure == "count" else replace(line, **exact) for line in report.cost_lines]
    page = page_html(replace(report, cost_lines=tuple(lines), valuation=None), {})
    rows = [row for row in re.findall(r"<tr>.*?</tr>", page, re.DOTALL) if 'data-label="Earned certain"' in row]
    rows = [row for row in rows if 'data-label="Rate"' in row]
    assert len(rows) == len(lines) > 1
    for row in rows:
        assert cents(printed(row, "Planned") * printed(row, "Rate")) == printed(row, "Value")
        assert cents(printed(row, "As built certain") * printed(row, "Rate")) == printed(row, "Earned certain")


def test_pieces_are_whole_numbers() -> None:
    page = page_html(sample_report(), {})
    count = next(line for line in sample_report().cost_lines if line.measure == "count")
    assert f'data-label="Planned">{count.planned_quantity:.0f} ' in page


def test_what_a_lines_elements_are_worth_when_finished_adds_up_to_the_contract() -> None:
    report = sample_report()
    uneven = tuple(replace(line, rate=line.rate + 0.0049) for line in report.cost_lines)
    lines = [line for bill in bills(replace(report, cost_lines=uneven)) for line in bill.lines]
    assert any(total(cents(row.quantity * line.rate) for row in line.rows) != line.contract for line in lines)
    for line in lines:
        assert total(worths(line)) == line.contract
    gone = replace(lines[0], contract=0.0)
    assert worths(gone) == [cents(row.quantity * gone.rate) for row in gone.rows]
