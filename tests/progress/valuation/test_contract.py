"""A contract is held to the design: what the design loses stays unpaid, and a quantity far off it is named."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import openpyxl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asbuilt_bim.bim.model import CostLine
from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.valuation.bill import LOST, Bill, bills
from asbuilt_bim.progress.valuation.inputs import Override, RateChange, ValuationInputs
from asbuilt_bim.progress.valuation.notes import with_valuation
from asbuilt_bim.report.cost_rows import cost_groups
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.workbook.read import read_last_workbook
from asbuilt_bim.report.workbook.write import write_workbook
from benchmarks.valuation.made import FIRST, Seen, cost_line, made_report
from benchmarks.valuation.sequences import NONE, WHOLE, signed

LINE = cost_line("1.1", 0, 16.0, 245.0, ["a", "b", "c", "d"])
PART = Seen(lower=0.57, best=0.6, upper=0.7)


def report_of(
    seen: dict[str, Seen], line: CostLine = LINE, inputs: ValuationInputs | None = None, each: float = 4.0
) -> ProgressReport:
    """Value a line whose elements, of those seen, have `each` of its unit in the design."""
    there = replace(line, elements=tuple(key for key in line.elements if key in seen))
    made = made_report(seen, [there], FIRST + timedelta(days=14), ValuationInputs())
    lines = tuple(replace(one, design_quantity=each * len(there.elements)) for one in made.cost_lines)
    return with_valuation(replace(made, cost_lines=lines), inputs or ValuationInputs())


def only(report: ProgressReport) -> Bill:
    (bill,) = bills(report)
    return bill


def codes(report: ProgressReport) -> list[Reason]:
    return [note.code for note in report.notes]


ALL = {"a": WHOLE, "b": WHOLE, "c": NONE, "d": PART}


def test_a_wall_that_the_design_loses_raises_nothing_its_part_stays_unpaid_in_a_row_of_its_own_and_is_named() -> None:
    before = report_of(ALL)
    after = report_of({key: one for key, one in ALL.items() if key != "c"}, inputs=signed(before))
    (line,) = only(after).lines
    assert only(before).cumulative.work == only(after).cumulative.work > 0.0 == only(after).period.payable
    (row,) = [row for row in line.rows if row.element is None]
    assert (row.global_id, row.quantity, row.share) == (LOST, pytest.approx(4.0), 0.0)
    assert line.line.earned_lower == line.amount
    assert line.line.best_quantity_shown == pytest.approx(0.75 * 16.0 * (1.0 + 1.0 + 0.6) / 3.0)
    (note,) = after.notes
    words = note_words(note)
    assert note.code is Reason.DESIGN_LOST_WORK and "4 m3 of its contract, 980.00 EUR" in words.replace("\u202f", "")
    assert "what is no longer in the design (Wall c)" in words


def test_what_the_costs_alone_no_longer_cover_is_not_said_to_have_left_the_design(tmp_path: Path) -> None:
    before = signed(report_of(ALL))
    fewer = replace(LINE, elements=("a", "b", "d"))
    after = report_of(ALL, fewer, before)
    (words,) = [note_words(note) for note in after.notes]
    assert "stood for what is no longer covered by this cost line (Wall c). It stays unpaid" in words
    write_workbook(after, tmp_path / "q.xlsx")
    labels = [row[2].value for row in openpyxl.load_workbook(tmp_path / "q.xlsx")["Cost by element"].iter_rows()]
    assert "(no longer covered by this cost line)" in labels and "(no longer in the design)" not in labels
    both = report_of({key: one for key, one in ALL.items() if key != "b"}, fewer, before)
    (words,) = [note_words(note) for note in both.notes if note.code is Reason.DESIGN_LOST_WORK]
    assert "no longer in the design, or not covered by this cost line (Wall b, Wall c)" in words
    assert only(after).period.work == 0.0


def test_a_wall_built_in_part_that_goes_takes_its_own_amount_and_the_others_keep_theirs() -> None:
    before = report_of(ALL)
    after = report_of({key: one for key, one in ALL.items() if key != "d"}, inputs=signed(before))
    assert only(after).lines[0].quantity == 8.0 and only(after).period.work == pytest.approx(-0.57 * 4.0 * 245.0)
    assert codes(after) == [Reason.DESIGN_LOST_WORK, Reason.CERTIFIED_FALLS]


def test_walls_that_become_smaller_are_not_paid_more_for_it() -> None:
    before = report_of(ALL)
    after = report_of(ALL, inputs=signed(before), each=3.0)
    assert only(after).lines[0].quantity == pytest.approx(0.75 * only(before).lines[0].quantity)
    assert Reason.DESIGN_LOST_WORK in codes(after)


def test_what_the_design_lost_stays_unpaid_in_all_later_valuations_and_when_outputs_are_made_again() -> None:
    fewer = {key: one for key, one in ALL.items() if key != "c"}
    second = report_of(fewer, inputs=signed(report_of(ALL)))
    third = report_of(fewer, inputs=signed(second))
    assert only(third).period.work == 0.0 and codes(third) == [Reason.DESIGN_LOST_WORK]
    again = with_valuation(third, third.valuation)
    assert (again.cost_lines, again.notes) == (third.cost_lines, third.notes)
    back = report_of(ALL, inputs=signed(third))
    assert only(back).period.work == 0.0 and codes(back) == []


def test_where_the_contract_becomes_less_by_what_the_design_loses_nothing_is_lost() -> None:
    less = replace(LINE, planned_quantity=12.0)
    after = report_of({key: one for key, one in ALL.items() if key != "c"}, less, signed(report_of(ALL)))
    assert after.cost_lines[0].lost == 0.0 and only(after).period.work == 0.0


def designed(
    seen: dict[str, Seen], line: CostLine, inputs: ValuationInputs | None, each: float | dict[str, float] = 4.0
) -> ProgressReport:
    """Value a line whose elements have `each` of its unit in the design."""
    made = made_report(seen, [replace(line, elements=tuple(seen))], FIRST + timedelta(days=14), ValuationInputs())
    design = each if isinstance(each, dict) else dict.fromkeys(seen, each)
    total = sum(design.values())
    parts = {key: one / total / (1.0 + line.others) for key, one in design.items()}
    lines = tuple(replace(one, designs=design, design_quantity=total, parts=parts) for one in made.cost_lines)
    return with_valuation(replace(made, cost_lines=lines), inputs or ValuationInputs())


DESIGNS = st.dictionaries(st.sampled_from("abcdef"), st.integers(1, 900).map(lambda n: n / 100), min_size=1)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(DESIGNS, st.integers(200, 4000).map(lambda n: n / 100)), min_size=2, max_size=4))
def test_whatever_a_design_gains_or_loses_nobodys_part_changes_but_by_its_own_design_or_the_contract(
    periods: list[tuple[dict[str, float], float]],
) -> None:
    inputs: ValuationInputs | None = None
    before: tuple[dict[str, float], dict[str, float], float] | None = None
    for design, contract in periods:
        line = replace(LINE, planned_quantity=contract)
        report = designed(dict.fromkeys(design, WHOLE), line, inputs, design)
        had = {row.global_id: row.quantity for row in only(report).lines[0].rows if row.element}
        assert sum(had.values()) <= contract * (1.0 + 1e-9) and only(report).cumulative.work <= contract * 245.0 + 0.01
        if before is not None:
            was, designed_then, then = before
            most = max(was[key] / designed_then[key] for key in was) * max(contract / then, 1.0)
            assert all(had[key] <= most * design[key] + 0.0011 for key in had)
            for key in was.keys() & had.keys():
                if design[key] >= designed_then[key]:
                    assert had[key] >= was[key] * min(contract / then, 1.0) - 0.0011
        again = with_valuation(report, report.valuation)
        assert again.cost_lines == report.cost_lines and again.notes == report.notes
        inputs, before = signed(report), (had, design, contract)


def added(line: CostLine = LINE, inputs: ValuationInputs | None = None) -> ProgressReport:
    """Value the line when the design has a fifth wall, "e", that isn't begun; all that was there is as before."""
    return designed({**ALL, "e": NONE}, line, inputs)


def test_a_wall_that_the_design_gains_takes_nothing_from_what_was_certified_of_the_others_and_is_named() -> None:
    before = report_of(ALL)
    after = added(inputs=signed(before))
    (line,) = only(after).lines
    assert only(after).period.work == 0.0 and only(after).cumulative.work == only(before).cumulative.work > 0.0
    assert {row.global_id: row.quantity for row in line.rows} == pytest.approx(dict.fromkeys("abcd", 4.0) | {"e": 0.0})
    (note,) = after.notes
    words = note_words(note).replace("\u202f", "")
    assert note.code is Reason.DESIGN_ADDED_WORK
    assert "the design has 4 m3, 980.00 EUR, that its contract quantity has no room for (Wall e" in words
    again = with_valuation(after, after.valuation)
    assert (again.cost_lines, again.notes) == (after.cost_lines, after.notes)
    third = added(inputs=signed(after))
    assert only(third).period.work == 0.0 and codes(third) == [Reason.DESIGN_ADDED_WORK]


def test_quantities_that_were_read_rounded_lower_nothing_when_the_design_gains_a_wall() -> None:
    odd = {"a": 4.0004, "b": 3.9996, "c": 1.23449, "d": 6.76551}
    before = designed(ALL, LINE, None, odd)
    rounded = signed(before)
    read = {key: round(one, 3) for key, one in rounded.paid[0].quantities.items()}
    rounded = replace(rounded, paid=(replace(rounded.paid[0], quantities=read),))
    after = designed({**ALL, "e": NONE}, LINE, rounded, {**odd, "e": 4.0})
    assert only(after).period.work == 0.0 and codes(after) == [Reason.DESIGN_ADDED_WORK]


def test_what_a_raised_contract_holds_of_a_new_wall_is_its_part_and_the_rest_is_named() -> None:
    before = signed(report_of(ALL))
    part = added(replace(LINE, planned_quantity=18.0), before)
    assert {row.global_id: row.quantity for row in only(part).lines[0].rows} == pytest.approx(
        dict.fromkeys("abcd", 4.0) | {"e": 2.0}
    )
    assert "the design has 2 m3, 490.00 EUR" in note_words(part.notes[0])
    again = with_valuation(part, part.valuation)
    assert (again.cost_lines, again.notes) == (part.cost_lines, part.notes)
    whole = added(replace(LINE, planned_quantity=20.0), before)
    assert only(whole).period.work == 0.0 and Reason.DESIGN_ADDED_WORK not in codes(whole)
    later = added(replace(LINE, planned_quantity=20.0), signed(whole))
    assert only(later).period.work == 0.0 and codes(later) == []


def test_four_columns_that_were_certified_stay_four_pieces_when_a_fifth_is_designed() -> None:
    pieces, seen = cost_line("2.1", 3, 4.0, 42.0, list("abcd")), dict.fromkeys("abcd", WHOLE)
    before = designed(seen, pieces, None, each=1.0)
    after = designed({**seen, "e": NONE}, pieces, signed(before), each=1.0)
    assert only(before).lines[0].quantity == only(after).lines[0].quantity == 4.0
    assert codes(after) == [Reason.DESIGN_ADDED_WORK]


def test_a_wall_in_the_place_of_another_takes_over_its_part_of_the_contract() -> None:
    before = signed(report_of(ALL))
    swapped = {key: one for key, one in ALL.items() if key != "c"} | {"e": NONE}
    after = report_of(swapped, replace(LINE, elements=("a", "b", "d", "e")), before)
    assert only(after).period.work == 0.0 and codes(after) == []


def test_a_person_may_certify_what_the_design_lost_on_its_row() -> None:
    fewer = {key: one for key, one in ALL.items() if key != "c"}
    said = Override(line=LINE.global_id, element=LOST, share=0.5, reason="stands", by="B", day=FIRST)
    after = report_of(fewer, inputs=replace(signed(report_of(ALL)), overrides=(said,)))
    assert only(after).period.work == 2.0 * 245.0 and Reason.OVERRIDE_UNUSED not in codes(after)


def test_a_result_of_before_the_design_was_kept_is_held_to_what_its_elements_had() -> None:
    known = signed(report_of(ALL))
    old = replace(known, paid=tuple(replace(one, per_design=0.0) for one in known.paid))
    after = report_of({key: one for key, one in ALL.items() if key != "c"}, inputs=old)
    assert only(after).period.work == 0.0 and codes(after) == [Reason.DESIGN_LOST_WORK]


def test_without_a_signed_valuation_the_contract_is_shared_out_among_what_there_is() -> None:
    assert report_of({"a": WHOLE, "b": WHOLE}, each=8.0).cost_lines[0].lost == 0.0


@pytest.mark.parametrize("contract", [160.0, 8.0])
def test_a_contract_quantity_far_off_the_designs_is_named_with_both(contract: float) -> None:
    report = report_of(ALL, replace(LINE, planned_quantity=contract))
    (note,) = report.notes
    assert note.code is Reason.CONTRACT_NOT_DESIGN
    assert f"contract {contract:g} m3, design about 16 m3" in note_words(note)


def test_waste_and_what_a_line_pays_for_besides_are_no_reason_to_warn() -> None:
    assert codes(report_of(ALL, replace(LINE, planned_quantity=17.5))) == []
    assert codes(report_of(ALL, replace(LINE, planned_quantity=160.0, others=3))) == []
    assert codes(report_of(ALL, replace(cost_line("1", 4, 1.0, 9.0, list("abcd"))))) == []  # of no unit that a wall has


def test_what_was_certified_in_another_unit_is_of_another_line_and_keeps_a_row_of_its_own() -> None:
    pieces = cost_line("1.3", 3, 4.0, 180.0, ["a", "b"])
    before = signed(report_of({"a": WHOLE, "b": NONE}, pieces, each=2.0))
    volume = replace(cost_line("1.3", 0, 8.0, 265.0, ["a", "b"]), name="Columns, concrete")
    after = report_of({"a": WHOLE, "b": NONE}, volume, before)
    new, gone = only(after).lines
    assert (new.previous, new.previous_quantity, new.line.unit) == (0.0, 0.0, "m3")
    assert gone.gone and (gone.previous_quantity, gone.line.unit, gone.amount) == (2.0, "pcs", 0.0)
    words = [note_words(note) for note in after.notes if note.code is Reason.CERTIFIED_LINE_GONE]
    assert "stands for other work now: Columns, concrete (m3)" in words[0]


def test_a_unit_spelt_another_way_is_of_the_same_line() -> None:
    before = report_of(ALL)
    bill = only(report_of(ALL, replace(LINE, unit="m³"), signed(before)))
    assert [line.gone for line in bill.lines] == [False]
    assert bill.period.work == 0.0 < bill.cumulative.work


def test_another_tables_line_of_the_same_number_is_the_same_only_with_the_same_text() -> None:
    before = signed(report_of(ALL))
    same = replace(LINE, global_id="costs:other")
    assert [line.gone for line in only(report_of(ALL, same, before)).lines] == [False]
    assert [line.gone for line in only(report_of(ALL, replace(same, name="Slabs"), before)).lines] == [False, True]


COLUMNS = replace(cost_line("1.1", 0, 4.0, 310.0, ["a", "b"]), name="Columns")
WALLS = replace(cost_line("1.2", 0, 8.0, 265.0, ["c", "d"]), name="Walls")
"""Two lines of one unit, whose numbers a person may exchange in the table."""


def exchanged() -> tuple[ProgressReport, ValuationInputs]:
    """Exchange the numbers of columns and walls after signing, the walls at a person's rate; and what was signed."""
    seen = {"a": WHOLE, "b": NONE, "c": WHOLE, "d": PART}
    change = RateChange(line=WALLS.global_id, rate=300.0, why="agreed, B")
    known = signed(made_report(seen, [COLUMNS, WALLS], FIRST, ValuationInputs(rates=(change,))))
    lines = [replace(WALLS, global_id="costs:1.1", identification="1.1"),
             replace(COLUMNS, global_id="costs:1.2", identification="1.2")]  # fmt: skip
    return made_report(seen, lines, FIRST + timedelta(days=14), known), known


def test_numbers_exchanged_in_a_table_keep_what_was_certified_in_rows_of_its_own_and_no_rate_goes_over() -> None:
    report, known = exchanged()
    bill = only(report)
    assert [(line.line.name, line.gone, line.previous, line.rate) for line in bill.lines] == [
        ("Walls", False, 0.0, 265.0),
        ("Columns", False, 0.0, 310.0),
        ("Columns", True, 620.0, 310.0),
        ("Walls", True, known.paid[1].amount, 300.0),
    ]
    assert bill.previous.work == known.before[0].work and len({line.line.global_id for line in bill.lines}) == 4
    told = [note_words(note) for note in report.notes]
    assert any("Its number stands for other work now: Walls (m3)" in words for words in told)
    assert any("rate 300.00 of costs:1.2 has nothing to stand for any more (agreed, B)" in words for words in told)
    (group,) = cost_groups(report)
    assert group.earned_lower == bill.cumulative.work and not group.certified  # nothing but what photos say


def test_exchanged_numbers_lose_nothing_through_a_workbook_that_nobody_signed_and_come_back(tmp_path: Path) -> None:
    report, known = exchanged()
    write_workbook(report, tmp_path / "q.xlsx")
    inputs = read_last_workbook(tmp_path / "q.xlsx").inputs
    again = made_report({"a": WHOLE, "b": NONE, "c": WHOLE, "d": PART}, [COLUMNS, WALLS], FIRST, inputs)
    assert only(again).previous.work == known.before[0].work
    assert [(line.line.name, line.gone, line.previous) for line in only(again).lines] == [
        ("Columns", False, 620.0),
        ("Walls", False, known.paid[1].amount),
    ]


def test_a_text_that_is_put_right_is_of_the_same_line_and_keeps_its_rate() -> None:
    seen = {"a": WHOLE, "b": NONE, "c": WHOLE, "d": PART}
    change = RateChange(line=WALLS.global_id, rate=300.0, why="agreed, B")
    known = signed(made_report(seen, [COLUMNS, WALLS], FIRST, ValuationInputs(rates=(change,))))
    right = replace(WALLS, name="Walls, C30/37")
    _, walls = only(made_report(seen, [COLUMNS, right], FIRST, known)).lines
    assert (walls.gone, walls.period, walls.rate) == (False, 0.0, 300.0)
    other = replace(WALLS, name="Stairs", elements=("a",))
    bill = only(made_report(seen, [COLUMNS, other], FIRST, known))
    assert [(line.line.name, line.gone) for line in bill.lines] == [
        ("Columns", False),
        ("Stairs", False),
        ("Walls", True),
    ]


def test_a_line_that_is_otherwise_than_when_it_was_signed_is_named_with_what_was() -> None:
    braces = replace(LINE, name="Walls {x}")
    other = replace(LINE, name="Walls, C35/45", rate=300.0, planned_quantity=17.0)
    after = report_of(ALL, other, signed(report_of(ALL, braces)))
    (words,) = [note_words(note) for note in after.notes if note.code is Reason.CERTIFIED_LINE_CHANGED]
    assert "text was 'Walls {x}', rate 245.00, now 300.00, contract quantity 16, now 17 m3" in words
