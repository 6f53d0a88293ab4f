"""A design that another export gave new GlobalIds: its elements are known by where they stand, and by nothing less."""

from __future__ import annotations

from dataclasses import replace

import pytest

from asbuilt_bim.bim.model import BimElement
from asbuilt_bim.codes import Reason
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.globalid_remap import inputs_again, remapped_ids, with_new_ids
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.revision import design_changes, remap_notes
from asbuilt_bim.progress.surface import unseen
from asbuilt_bim.progress.valuation.inputs import Override, RateChange, ValuationInputs
from tests.match.small_site import box, element, model, round_column
from tests.progress.test_money_and_dates import LATER, NOTHING, report
from tests.report.sample_report import sample_report

FULL, HALF, UNSEEN = box(0, 0, 0, 0.5, 0.5, 3.0), box(3, 0, 0, 0.5, 0.5, 3.0), box(6, 0, 0, 4.0, 0.25, 3.0)


def again(*elements: BimElement) -> ProgressReport:
    """A later visit that sees nothing of a design, with the first visit's result behind it."""
    design, past = model(elements), report()
    history = remember(EMPTY_HISTORY, with_new_ids(past, remapped_ids(past, design)))
    surfaces = [
        history.earlier(one.global_id, f, ProgressOptions()) or unseen(f) for one in elements for f in one.faces
    ]
    return summarise(surfaces, NOTHING, design, history, LATER)


def test_what_was_seen_under_the_old_ids_counts_under_the_new_ones() -> None:
    old = again(element("A", "column", FULL), element("B", "column", HALF), element("C", "wall", UNSEEN))
    new = again(element("x", "column", FULL), element("y", "column", HALF), element("z", "wall", UNSEEN))
    assert [e.state for e in new.elements] == [e.state for e in old.elements]
    assert new.whole.completion == old.whole.completion
    assert new.elements[0].complete_on == old.elements[0].complete_on is not None
    assert new.elements[1].best_when_seen == old.elements[1].best_when_seen == pytest.approx(0.5, abs=0.02)


def test_an_element_that_moved_is_of_another_kind_or_kept_its_id_is_nobody_elses() -> None:
    past = report()
    kept, moved = element("A", "column", FULL), element("y", "column", box(3.01, 0, 0, 0.5, 0.5, 3.0))
    other = element("z", "column", UNSEEN)
    assert remapped_ids(past, model([kept, moved, other])) == {}
    assert with_new_ids(past, {}) is past


def test_of_two_solids_in_one_place_neither_is_taken_for_the_old_one() -> None:
    first, second = element("x", "column", FULL), element("y", "column", FULL)
    assert remapped_ids(report(), model([first, second, element("z", "wall", UNSEEN)])) == {"C": "z"}


def test_a_round_column_is_known_wherever_its_seam_is() -> None:
    was, now = round_column("R", 1.0, 2.0, 0.2, 3.0), round_column("S", 1.0, 2.0, 0.2, 3.0)
    wider = round_column("T", 1.0, 2.0, 0.21, 3.0)
    past = summarise([unseen(face) for face in was.faces], NOTHING, model([was]), EMPTY_HISTORY, LATER)
    assert remapped_ids(past, model([now])) == {"R": "S"} and remapped_ids(past, model([wider])) == {}


def test_new_ids_are_no_revision_and_are_told_once() -> None:
    ids = {"A": "x", "B": "y", "C": "z"}
    renamed = with_new_ids(report(), ids)
    design = model([element("x", "column", FULL), element("y", "column", HALF), element("z", "wall", UNSEEN)])
    after = again(*design.elements)
    changes = design_changes(renamed, after)
    assert not (changes.gone or changes.new or changes.reshaped or changes.moved)
    (note,) = remap_notes(renamed, ids)
    assert note.code == Reason.DESIGN_NEW_IDS and note.values["count"] == 3
    assert remap_notes(report(), {}) == ()


def test_a_surveyors_override_and_rate_count_under_the_new_ids() -> None:
    before = sample_report()
    line = before.cost_lines[0]
    after = replace(before, cost_lines=(replace(line, global_id="new line"), *before.cost_lines[1:]))
    given = Override(line=line.global_id, element="A", share=0.4, reason="plumb", by="Ann", day=LATER)
    gone = replace(given, line="no such line", element="Q")
    inputs = ValuationInputs(overrides=(given, gone), rates=(RateChange(line=line.global_id, rate=9.0, why="Ann"),))
    again_ = inputs_again(inputs, before, after, {"A": "x"})
    assert [(one.line, one.element) for one in again_.overrides] == [("new line", "x"), ("no such line", "Q")]
    assert again_.rates[0].line == "new line"
    assert inputs_again(inputs, before, before, {}) == inputs
