"""The bill: what counts, how it is rounded, and that periods add up whatever happens."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest
from hypothesis import given, settings

from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.money import cents, certified_quantity
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import Bill, bills
from asbuilt_bim.progress.valuation.inputs import (
    Observation,
    Override,
    RateChange,
    Terms,
    ValuationInputs,
)
from asbuilt_bim.progress.valuation.notes import CODES, OF_MONEY
from asbuilt_bim.report.wording.notes import note_words
from benchmarks.valuation.made import FIRST, UNSEEN, Seen, cost_line, made_report
from benchmarks.valuation.sequences import LINES, NONE, PERIODS, WHOLE, check_sequence, signed

HALF = Seen(lower=0.5, best=0.6, upper=0.9)


def only(report: ProgressReport) -> Bill:
    (bill,) = bills(report)
    return bill


def test_certified_is_the_sum_of_the_elements_and_its_amount_is_the_printed_quantity_times_the_rate() -> None:
    line = cost_line("1", 0, 10.0, 33.33, ["a", "b", "c"])
    bill = only(made_report({"a": WHOLE, "b": HALF, "c": UNSEEN}, [line], FIRST, ValuationInputs()))
    (made,) = bill.lines
    assert made.quantity == 5.0 and made.amount == cents(5.0 * 33.33) == bill.cumulative.work
    third = replace(line, elements=("a", "b", "c", "d"), planned_quantity=10.001)
    (made,) = only(made_report({"a": WHOLE, "d": HALF}, [third], FIRST, ValuationInputs())).lines
    assert made.quantity == 3.75 and made.amount == cents(3.75 * 33.33)


def test_pieces_are_whole_and_only_one_seen_complete_counts_not_one_complete_as_far_as_seen() -> None:
    keys = [f"c{n}" for n in range(8)]
    nearly = Seen(lower=0.82, best=0.9, upper=0.95)
    seen = dict.fromkeys(keys, nearly) | {"c0": WHOLE, "c1": Seen(lower=0.6, best=1.0, upper=1.0)}
    (made,) = only(made_report(seen, [cost_line("1", 3, 8.0, 180.0, keys)], FIRST, ValuationInputs())).lines
    assert (made.quantity, made.amount) == (1.0, 180.0)
    assert made.line.as_built_lower == 1.0 and made.line.as_built_best == 7.0


def test_of_pieces_that_are_taken_off_those_that_may_be_built_count_whole() -> None:
    off = replace(cost_line("1", 3, 2.0, 10.0, ["a", "b"]), rate=-10.0)
    maybe = Seen(lower=0.0, best=0.1, upper=0.2)
    (made,) = only(made_report({"a": maybe, "b": NONE}, [off], FIRST, ValuationInputs())).lines
    assert (made.quantity, made.amount) == (1.0, -10.0)


@pytest.mark.parametrize(
    ("parts", "planned", "quantity"),
    [(2.0015, 5.0, 2.002), (2.00149, 5.0, 2.001), (4.9999999999, 5.0, 5.0), (12.34559, 12.3456, 12.3456),
     (0.00123456, 0.5, 0.001235), (-2.0015, -5.0, -2.002), (0.0, 5.0, 0.0)],
)  # fmt: skip
def test_a_quantity_is_rounded_once_and_never_above_the_contract(parts: float, planned: float, quantity: float) -> None:
    assert certified_quantity(parts, planned, pieces=False) == quantity


def test_an_override_goes_before_what_was_observed_and_that_before_photos_only_where_the_project_says_so() -> None:
    line, seen = cost_line("1", 0, 10.0, 1.0, ["a"]), {"a": HALF}
    look = [Observation(element="a", day=FIRST + timedelta(days=1), share=0.8, by="B", why="")]
    day = FIRST + timedelta(days=2)

    def quantity(inputs: ValuationInputs) -> float:
        report = made_report(seen, [line], day, inputs, look)
        aged = replace(report, elements=tuple(replace(one, last_seen=FIRST) for one in report.elements))
        return only(aged).lines[0].quantity

    override = Override(line=line.global_id, element="a", share=0.3, reason="r", by="B", day=FIRST)
    assert quantity(ValuationInputs()) == 5.0
    assert quantity(ValuationInputs(count_observations=True)) == 8.0
    assert quantity(ValuationInputs(count_observations=True, overrides=(override,))) == 3.0


def test_photos_of_that_day_that_show_less_than_a_person_saw_keep_their_certain_share_and_it_is_named() -> None:
    look = [Observation(element="a", day=FIRST, share=1.0, by="B", why="")]
    report = made_report(
        {"a": HALF}, [cost_line("1", 0, 10.0, 1.0, ["a"])], FIRST, ValuationInputs(count_observations=True), look
    )
    assert only(report).lines[0].quantity == 5.0
    assert [note.code for note in report.notes] == [Reason.OBSERVATION_CONTRADICTS]
    shown = made_report({"a": HALF}, [], FIRST, ValuationInputs(), look)
    assert {note.code for note in shown.notes} == {Reason.OBSERVATION_CONTRADICTS, Reason.OBSERVATION_SHOWN}


def test_what_is_not_measured_of_a_line_is_not_certified_until_a_person_says_so() -> None:
    line = cost_line("1", 0, 12.0, 1.0, ["a"], others=2)
    assert only(made_report({"a": WHOLE}, [line], FIRST, ValuationInputs())).lines[0].quantity == 4.0
    rest = Override(line=line.global_id, element="", share=0.5, reason="r", by="B", day=FIRST)
    assert only(made_report({"a": WHOLE}, [line], FIRST, ValuationInputs(overrides=(rest,)))).lines[0].quantity == 8.0


def test_a_wall_that_was_torn_down_takes_its_amount_back_and_that_is_named() -> None:
    line = cost_line("1", 0, 10.0, 7.0, ["a", "b"])
    before = signed(made_report({"a": WHOLE, "b": HALF}, [line], FIRST, ValuationInputs()))
    report = made_report({"a": NONE, "b": HALF}, [line], FIRST + timedelta(days=14), before)
    (made,) = only(report).lines
    assert (made.previous, made.period, made.amount, made.falls) == (52.5, -35.0, 17.5, True)
    (note,) = report.notes
    assert note.code is Reason.CERTIFIED_FALLS and (note.values["was"], note.values["now"]) == (52.5, 17.5)


def test_a_certified_line_that_is_gone_from_the_costs_stays_in_the_bill_at_nothing() -> None:
    one, two = cost_line("1", 0, 10.0, 7.0, ["a"]), cost_line("2", 1, 5.0, 2.0, ["a"])
    before = signed(made_report({"a": WHOLE}, [one, two], FIRST, ValuationInputs()))
    report = made_report({"a": WHOLE}, [two], FIRST + timedelta(days=1), before)
    bill = only(report)
    assert [(line.line.identification, line.period, line.amount) for line in bill.lines] == [
        ("2", 0.0, 10.0), ("1", -70.0, 0.0),
    ]  # fmt: skip
    assert bill.cumulative.work == 10.0 and bill.period.work == -70.0
    assert [note.code for note in report.notes] == [Reason.CERTIFIED_LINE_GONE]


def test_a_line_is_known_again_by_its_item_where_its_key_is_another() -> None:
    line = cost_line("1", 0, 10.0, 7.0, ["a"])
    before = signed(made_report({"a": HALF}, [line], FIRST, ValuationInputs()))
    again = replace(line, global_id="0CostItemOfTheIfcFile1")
    (made,) = only(made_report({"a": WHOLE}, [again], FIRST, before)).lines
    assert (made.previous, made.period) == (35.0, 35.0)


def test_retention_is_of_all_and_tax_of_what_is_added_now() -> None:
    line = cost_line("1", 0, 10.0, 100.0, ["a"])
    start = ValuationInputs(terms=Terms(retention=0.05, tax=0.19))
    before = signed(made_report({"a": HALF}, [line], FIRST, start))
    later = replace(before, terms=Terms(retention=0.0, tax=0.07))
    bill = only(made_report({"a": WHOLE}, [line], FIRST, later))
    assert (bill.previous.retention, bill.previous.tax) == (25.0, cents(475.0 * 0.19))
    assert (bill.cumulative.retention, bill.period.retention) == (0.0, -25.0)
    assert bill.period.tax == cents(525.0 * 0.07)
    assert bill.cumulative.tax == cents(bill.previous.tax + bill.period.tax)
    assert bill.period.payable == 525.0 + 36.75


def test_another_retention_or_tax_than_was_signed_is_told_with_what_it_keeps_back_until_it_is_signed() -> None:
    line = cost_line("1", 0, 10.0, 100.0, ["a"])
    start = ValuationInputs(terms=Terms(retention=0.05, tax=0.19))
    before = signed(made_report({"a": HALF}, [line], FIRST, start))
    assert made_report({"a": WHOLE}, [line], FIRST, before).notes == ()
    report = made_report({"a": HALF}, [line], FIRST, replace(before, terms=Terms(retention=0.1, tax=0.2)))
    assert [(note.code, note_words(note)) for note in report.notes] == [
        (Reason.RETENTION_CHANGED, "retention 5 % -> 10 %: 25.00 EUR more is kept back of what was earned before"),
        (Reason.TAX_CHANGED, "tax 19 % -> 20 %: it is on what this valuation adds. The tax on what was certified "
         "before stays as it was"),
    ]  # fmt: skip
    assert only(report).period.retention == 25.0 and {note.code for note in report.notes} <= OF_MONEY & CODES
    assert made_report({"a": HALF}, [line], FIRST, signed(report)).notes == ()
    of_before = replace(before, signed_terms=None, terms=Terms(retention=0.025, tax=0.19))
    (released,) = made_report({"a": HALF}, [line], FIRST, of_before).notes
    assert note_words(released).startswith("retention 5 % -> 2.5 %: 12.50 EUR less is kept back, so it is paid out now")


def test_overrides_without_a_reason_and_those_whose_element_is_gone_are_named() -> None:
    line = cost_line("1", 0, 10.0, 7.0, ["a"])
    given = (
        Override(line=line.global_id, element="a", share=0.3, reason="", by="B", day=FIRST),
        Override(line=line.global_id, element="gone", share=0.3, reason="r", by="B", day=FIRST),
    )
    rates = (RateChange(line=line.global_id, rate=8.0, why=""),)
    report = made_report({"a": HALF}, [line], FIRST, ValuationInputs(overrides=given, rates=rates))
    assert [note.code for note in report.notes] == [
        Reason.RATE_CHANGED, Reason.OVERRIDE_UNSIGNED, Reason.OVERRIDE_UNUSED,
    ]  # fmt: skip


def test_an_override_of_a_piece_that_is_no_whole_one_is_told_with_what_it_counts_as() -> None:
    line = cost_line("1", 3, 2.0, 10.0, ["a", "b"])
    given = ValuationInputs(overrides=tuple(
        Override(line=line.global_id, element=key, share=share, reason="r", by="B", day=FIRST)
        for key, share in (("a", 0.9), ("b", 1.0))
    ))  # fmt: skip
    seen = {"a": HALF, "b": HALF}
    report = made_report(seen, [line], FIRST, given)
    (note,) = report.notes
    assert note.code is Reason.OVERRIDE_NOT_WHOLE and only(report).lines[0].quantity == 1.0
    assert "the override of Wall a is 90 %, and counts as 0 %: a piece counts whole or not at all" in note_words(note)
    taken_off = made_report(seen, [replace(line, rate=-10.0)], FIRST, given)
    assert "is 90 %, and counts as 100 %" in note_words(taken_off.notes[0])
    assert made_report(seen, [cost_line("1", 0, 2.0, 10.0, ["a", "b"])], FIRST, given).notes == (), "by volume"


@settings(max_examples=200, deadline=None)
@given(LINES, PERIODS)
def test_periods_add_up_nothing_exceeds_the_contract_and_nobody_certifies_what_nobody_saw(
    drawn: list[tuple[int, float, float, list[str], int]], periods: list[tuple[object, ...]]
) -> None:
    check_sequence(drawn, periods)


def test_what_a_person_saw_after_the_visit_is_told_with_who_and_when_it_counts() -> None:
    look = [Observation(element="a", day=FIRST + timedelta(days=1), share=1.0, by="Mia", why="")]
    line, counts = cost_line("1", 0, 10.0, 1.0, ["a"]), ValuationInputs(count_observations=True)
    report = made_report({"a": HALF}, [line], FIRST, counts, look)
    assert only(report).lines[0].quantity == 5.0
    (note,) = report.notes
    words = note_words(note)
    assert note.code is Reason.OBSERVATION_LATER
    assert (
        f"count yet: Mia, Wall a on {look[0].day.isoformat()}. It counts from the first visit of that day or later on"
        in words
    )
    that_day = made_report({"a": HALF}, [line], look[0].day, counts, look)
    assert Reason.OBSERVATION_LATER not in {one.code for one in that_day.notes}
    assert made_report({"a": HALF}, [line], FIRST, ValuationInputs(), look).notes == (), "it wouldn't count anyway"
