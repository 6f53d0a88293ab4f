"""Visits that contradict each other in their order: which of them may be wrong, and that those decide nothing."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import rejected
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.geometry import polygon
from asbuilt_bim.geometry.plane import PlaneFrame
from asbuilt_bim.match.assign import match_faces
from asbuilt_bim.match.options import MatchOptions
from asbuilt_bim.progress.completion.summary import summarise
from asbuilt_bim.progress.history import EMPTY_HISTORY
from asbuilt_bim.progress.options import ProgressOptions
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.progress.states.classify import classify_surface
from asbuilt_bim.progress.visits.order import Contradiction, contradictions, likeliest_wrong, refusals
from asbuilt_bim.project.options import Options
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import measured, placement, station
from tests.progress.states.test_undone import AROUND, COLUMNS, DESIGN, POSE

DAYS = [date(2026, 3, 2 + n) for n in range(5)]


def between(*pairs: tuple[int, int]) -> list[Contradiction]:
    """Contradictions of visits by their numbers, the earlier first."""
    return [Contradiction(earlier=DAYS[a], later=DAYS[b], elements=("C1",)) for a, b in pairs]


def report(built: list[int], day: date) -> ProgressReport:
    """A first visit's report of the row of columns where those are built."""
    faces = []
    for n in built:
        front = DESIGN.elements[n].faces[0].frame
        assert isinstance(front, PlaneFrame)
        faces.append(measured(f"A1/{n}", POSE, front, polygon.box(0.0, 0.0, 0.5, 2.8), "column"))
    seen = placement(station("A1", POSE, [*(COLUMNS[n] for n in built), *AROUND], faces))
    matched = match_faces(seen, DESIGN, MatchOptions())
    surfaces = classify_surface(matched, DESIGN, EMPTY_HISTORY, ProgressOptions())
    return summarise(surfaces, matched, DESIGN, EMPTY_HISTORY, day)


def undoing(day: date, *gone: int) -> ProgressReport:
    """A report of a visit that was refused, since those columns look open."""
    subject = about(SubjectKind.VISIT, day.isoformat())
    ids = tuple(DESIGN.elements[n].global_id for n in gone)
    fault = rejected(Reason.VISIT_UNDOES, subject, elements=ids, global_ids=ids, risen=0)
    return replace(report([], day), rejections=(fault,))


def test_of_two_visits_that_contradict_each_other_neither_is_known_to_be_right() -> None:
    assert likeliest_wrong(between((0, 1))) == {DAYS[0], DAYS[1]}


def test_one_visit_that_contradicts_two_that_agree_is_wrong_by_itself() -> None:
    assert likeliest_wrong(between((1, 3), (2, 3))) == {DAYS[3]}
    assert likeliest_wrong(between((0, 1), (0, 2))) == {DAYS[0]}


def test_a_visit_whose_photos_say_their_day_is_not_taken_for_wrong_where_another_may_be() -> None:
    assert likeliest_wrong(between((0, 1)), sure=[DAYS[0]]) == {DAYS[1]}
    assert likeliest_wrong(between((0, 1)), sure=[DAYS[0], DAYS[1]]) == {DAYS[0], DAYS[1]}


def test_three_visits_in_reverse_order_are_all_in_doubt() -> None:
    assert likeliest_wrong(between((0, 1), (0, 2), (1, 2))) == set(DAYS[:3])


def test_where_nothing_contradicts_no_visit_is_wrong() -> None:
    assert likeliest_wrong([]) == frozenset()


def test_the_visits_that_saw_built_what_a_later_one_sees_open_contradict_it_and_others_do_not() -> None:
    saw, did_not = report([0, 1, 2], DAYS[0]), report([4], DAYS[1])
    (found,) = contradictions([saw, did_not, undoing(DAYS[2], 0, 1, 2)])
    assert (found.earlier, found.later) == (DAYS[0], DAYS[2])
    assert found.elements == ("C0", "C1", "C2")


def test_a_visit_that_may_be_wrong_decides_nothing_and_says_so_first() -> None:
    told = refusals(between((0, 1)), {DAYS[0], DAYS[1]})
    (fault,) = told[DAYS[0]]
    barred = monitor((), (), (), DESIGN, EMPTY_HISTORY, DAYS[0], Options(), barred=told[DAYS[0]])
    assert barred.faults[0] == fault and barred.nothing_seen
    assert {element.state for element in barred.elements} == {"unknown"}
    assert all(e.notes[0].values["cause"] == Reason.VISITS_CONTRADICT for e in barred.elements)
    assert "it and the visit of 2026-03-03 contradict each other" in str(words_of(fault))
