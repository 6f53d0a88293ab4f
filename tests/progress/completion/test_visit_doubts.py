"""What a visit's elements say together: the wrong storey, the wrong day, photos of several days."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime

from asbuilt_bim.codes import Note, Reason, SubjectKind, about, noted
from asbuilt_bim.progress.completion.visit_doubts import FEWEST, visit_doubts
from asbuilt_bim.progress.report import Completion, ElementProgress, ProgressReport
from asbuilt_bim.report.wording.notes import note_words
from tests.report.sample_report import sample_report

HALF, NOTHING = (Completion(best=x, lower=x, upper=x, coverage=1.0) for x in (0.5, 0.0))


def elements(count: int, completion: Completion, notes: tuple[Note, ...] = ()) -> tuple[ElementProgress, ...]:
    usual = sample_report().elements[0]
    return tuple(
        replace(usual, global_id=f"{n:022d}", name=f"Column {n}", completion=completion, notes=notes)
        for n in range(count)
    )


def report_of(built: tuple[ElementProgress, ...], begin: datetime) -> ProgressReport:
    task = sample_report().tasks[0]
    progress = replace(task.progress, elements=tuple(one.global_id for one in built))
    of_all = replace(task, schedule_start=begin, schedule_finish=None, progress=progress)
    return replace(sample_report(), visit_date=date(2026, 3, 2), elements=built, tasks=(of_all,))


def test_what_stands_before_its_tasks_begin_asks_for_storey_and_day() -> None:
    """Storeys that are alike, and a survey one storey off: ten elements of the floor above were "complete"."""
    (note,) = visit_doubts(report_of(elements(5, HALF), datetime(2026, 4, 1, 8)))
    assert note.code is Reason.BUILT_EARLY and note.values["count"] == 5
    words = note_words(note)
    assert "5 elements are built though the schedule begins them after this visit" in words
    assert "'Column 0', 'Column 1', 'Column 2' and 2 more; from 2026-04-01 on" in words


def test_work_that_has_begun_or_hardly_any_or_nothing_built_is_no_doubt() -> None:
    begun, later = datetime(2026, 3, 2, 8), datetime(2026, 4, 1, 8)
    assert not visit_doubts(report_of(elements(5, HALF), begun))
    assert not visit_doubts(report_of(elements(FEWEST - 1, HALF), later))
    assert not visit_doubts(report_of(elements(5, NOTHING), later))


def test_an_element_that_one_of_its_tasks_has_begun_is_not_early() -> None:
    report = report_of(elements(5, HALF), datetime(2026, 4, 1, 8))
    assert not visit_doubts(
        replace(report, tasks=(*report.tasks, replace(report.tasks[0], schedule_start=datetime(2026, 2, 2))))
    )


def test_photos_that_disagree_about_several_elements_may_be_of_several_days() -> None:
    apart = noted(
        Reason.PHOTOS_DISAGREE, about(SubjectKind.ELEMENT, "x"), kind="wall", element="x", cells=2, stations=("G1",),
        low_m=0.0, high_m=1.0,
    )  # fmt: skip
    begun = datetime(2026, 3, 2)
    (note,) = visit_doubts(report_of(elements(FEWEST, HALF, (apart,)), begun))
    assert note.code is Reason.PHOTOS_OF_SEVERAL_DAYS and note.values["count"] == FEWEST
    assert not visit_doubts(report_of(elements(FEWEST - 1, HALF, (apart,)), begun))
    unseen = tuple(replace(one, stations=()) for one in elements(FEWEST, HALF, (apart,)))  # an earlier visit's note
    assert not visit_doubts(report_of(unseen, begun))
